"""Discover: from a case's recordings to a verdict on what the simulation lacks.

verdict = discover(read_case("recordings/monday"))
print(verdict)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.advise.next_recording import suggest
from gecar.reality.advise.notes import notes_on
from gecar.reality.evidence import Evidence
from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.fitting.gain_offset import with_gain_from_even_floor
from gecar.reality.invent.corrected_replay import with_formulas
from gecar.reality.invent.formula import Formula, describe
from gecar.reality.locate.hotspot import hotspot
from gecar.reality.locate.mismatch_map import MismatchMap
from gecar.reality.locate.path_check import path_in_doubt
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.prove.held_out import Confirmation, confirmed, dropped
from gecar.reality.prove.holdout import Contender, judge
from gecar.reality.prove.whiteness import whiteness
from gecar.reality.recordings.known_robot import known_robot
from gecar.reality.recordings.recording import Case
from gecar.reality.recordings.split import Split, hold_out
from gecar.reality.replay.channels import POSE
from gecar.reality.residuals.of_case import Residuals, motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.reality.selection.alternatives import alternatives
from gecar.reality.selection.observability import observable
from gecar.reality.selection.problem import problem_of
from gecar.reality.selection.stepwise import Explanation, explain
from gecar.reality.selection.thresholds import MOTION, SENSOR, SENSOR_ON_A_DOUBTFUL_PATH, SIGNIFICANCE
from gecar.reality.uncertainty.intervals import contains_neutral, intervals
from gecar.reality.verdict import Found, Interval, Judgement, Misfit, Residual, Verdict
from gecar.world.effects import CATALOGUE, Effect
from gecar.world.robot import Robot

MEMORY_S = 1.0  # over which replays are drawn back to the measurement


@dataclass(frozen=True)
class _Context:
    """What all stages share: the robot as it is known, what may be found, and how."""

    robot: Robot
    catalogue: tuple[Effect, ...]
    split: Split
    seed: int
    tell: Callable[[str], None]
    with_formula: bool


def discover(
    case: Case,
    holdout: Sequence[str] = (),
    robot: Robot | None = None,
    seed: int = 0,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    with_formula: bool = False,
    catalogue: Sequence[Effect] = CATALOGUE,
) -> Verdict:
    """Find which physics a simulation lacks, fit it, and judge it on recordings set aside.

    Parameters
    ----------
    case
        Recordings of one robot.
    holdout
        Names of the recordings to set aside; default: every fourth, or the last part of the only one.
    robot
        The robot as it is known; default: what the recordings name.
    seed
        Random seed.
    workers
        Threads; default: one a core.
    tell
        Called with a line of progress.
    with_formula
        Whether to add a formula for what nothing explains to the replays, and to judge what that gains.
    catalogue
        The effects that may be found.

    Raises
    ------
    InputError
        If a name is unknown, or a robot or course file is wrong.
    """
    known = robot if robot is not None else known_robot(case.recordings[0])
    context = _Context(known, tuple(catalogue), hold_out(case, holdout), seed, tell, with_formula)
    with Threads(workers) as threads:
        return _discover(case.name, context, threads)


def _discover(name: str, context: _Context, threads: Threads) -> Verdict:
    """Return the verdict, stage by stage."""
    split, tell = context.split, context.tell
    tell(f"fitting on {', '.join(r.name for r in split.fitted)}")
    noise = estimate_noise(split.fitted, context.robot.physics, MEMORY_S)
    aside = motion_residuals(split.held, noise, MEMORY_S, threads)
    residuals = motion_residuals(split.fitted, noise, MEMORY_S, threads)
    moved = _sized(context, confirmed(_explain_motion(context, residuals), aside))
    motion = moved.explained
    fitted = _along_paths(motion.problem.residuals, motion, motion.taken.physics)
    held = _along_paths(_on_their_clocks(aside, motion, motion.taken.physics), motion, motion.taken.physics)
    seen = _explain_sensor(context, motion, fitted.of_sensor(), held.of_sensor())
    sensing = seen.explained if seen else None
    tell("alternatives, location")
    found = context.robot.with_effects({**motion.taken.values, **(sensing.taken.values if sensing else {})})
    before, after = (
        Contender(robot, _along_paths(_on_their_clocks(aside, motion, robot.physics), motion, robot.physics))
        for robot in (context.robot, found)
    )
    effects, rivals = _findings(context.robot, [each for each in (moved, seen) if each])
    where = _located(context, motion, sensing, fitted, found)
    unexplained = motion.unexplained or bool(sensing and sensing.unexplained)
    word = _word(bool(effects), unexplained)
    return Verdict(
        case=name,
        verdict=word,
        effects=effects,
        located=where.places(np.random.default_rng(context.seed)) if word != "nothing" else (),
        judgement=Judgement(tuple(r.name for r in split.held), split.by_time, judge(before, after)),
        residual=_what_is_left(context, motion, sensing, fitted, after, unexplained),
        next_recording=suggest(found, effects, rivals, split.fitted[0], noise, unexplained),
        robot=found.model_copy(update={"name": f"{context.robot.name}-{name}"}),
        fitted_on=tuple(r.name for r in split.fitted),
        notes=notes_on(
            split,
            fitted,
            motion.problem.clocks_fitted,
            where.doubted,
            [step.effect for each in (moved, seen) if each for step in each.candidates],
        ),
        evidence=Evidence(motion, sensing, where, fitted, after.held, context.robot),
    )


def _explain_motion(context: _Context, residuals: Residuals) -> Explanation:
    """Explain how the robot moved; what is left at one place of the floor counts where nothing else is."""
    catalogue = observable(context.catalogue, residuals)
    motion = explain(problem_of(residuals, context.robot, catalogue, MOTION, context.seed, context.tell))
    if motion.unexplained or motion.steps:
        return motion
    spot = hotspot(motion.problem, motion.left)
    return replace(motion, unexplained=spot is not None, spot=spot)


def _on_their_clocks(held: Residuals, motion: Explanation, physics: npt.NDArray[Any]) -> Residuals:
    """Return the recordings set aside with their camera clocks fitted, if those of the others were."""
    return with_fitted_clocks(held, physics)[0] if motion.problem.clocks_fitted else held


def _along_paths(residuals: Residuals, motion: Explanation, physics: npt.NDArray[Any]) -> Residuals:
    """Return recordings with the path their colour sensor took, as a model of the robot gives it."""
    inflation = motion.problem.estimator.blocks.inflation(motion.left.errors)[list(POSE)]
    return residuals.localised(physics).with_paths(physics, inflation)


def _explain_sensor(
    context: _Context, motion: Explanation, residuals: Residuals, held: Residuals
) -> _Sized | None:
    """Explain what the colour sensor read along the measured path; None where it read nothing."""
    if not residuals.recordings:
        return None
    # A late camera and a skewed clock shift what is read, too.
    known = context.robot.with_effects(motion.taken.values)
    limits = SENSOR_ON_A_DOUBTFUL_PATH if motion.unexplained else SENSOR
    catalogue = observable(context.catalogue, residuals)
    sensing = explain(problem_of(residuals, known, catalogue, limits, context.seed, context.tell))
    seen = confirmed(sensing, held)
    taken = with_gain_from_even_floor(seen.explained.problem.estimator, seen.explained.taken)
    return _sized(context, replace(seen, explained=replace(seen.explained, taken=taken)))


@dataclass(frozen=True)
class _Sized(Confirmation):
    """What was confirmed, with the 95 % intervals of its parameters by effect and label."""

    spans: Mapping[str, Mapping[str, Interval]]


def _sized(context: _Context, confirmation: Confirmation) -> _Sized:
    """Return the intervals of what was confirmed; an effect that may as well be absent becomes a candidate."""
    explained, candidates = confirmation.explained, confirmation.candidates
    context.tell("intervals")
    while True:
        spans = intervals(explained.problem.estimator, explained.taken, context.seed)
        absent = [s for s in explained.steps if contains_neutral(explained.taken, s.effect, spans)]
        if not absent:
            return _Sized(explained, candidates, spans)
        weakest = min(absent, key=lambda step: step.gain)
        explained, candidates = dropped(explained, weakest), (*candidates, weakest)


def _findings(known: Robot, explanations: Sequence[_Sized]) -> tuple[tuple[Found, ...], tuple[Robot, ...]]:
    """Return what was found, and robots with an alternative in its place."""
    found, rivals = list[Found](), list[Robot]()
    for sized in explanations:
        beside = {
            effect: values
            for other in explanations
            if other is not sized
            for effect, values in other.explained.taken.values.items()
        }
        for step in sized.explained.steps:
            others = alternatives(sized.explained, step)
            rivals += [known.with_effects({**beside, **model.values}) for model in others.values()]
            gain, null = step.holdout_gain, step.null_95
            found.append(Found(step.effect, tuple(others), sized.spans[step.effect], gain, null, step.p))
    return tuple(found), tuple(rivals)


def _located(
    context: _Context,
    motion: Explanation,
    sensing: Explanation | None,
    fitted: Residuals,
    found: Robot,
) -> MismatchMap:
    """Return where simulation and reality part."""
    sensor_unexplained = bool(sensing and sensing.unexplained)
    return MismatchMap(
        fitted.recordings,
        motion.problem.known.errors,
        motion.problem.residuals.index,
        context.robot.physics,
        motion.taken.physics,
        found.physics,
        (not motion.unexplained, not sensor_unexplained),
        sensor_unexplained and path_in_doubt(fitted.recordings, found.physics),
        motion.spot,
    )


def _what_is_left(
    context: _Context,
    motion: Explanation,
    sensing: Explanation | None,
    fitted: Residuals,
    found: Contender,
    unexplained: bool,
) -> Residual:
    """Return whether what is left is white, and formulas for what nothing explains."""
    parts = [each for each in (motion, sensing) if each]
    # Of motion and readings, the less likely p-value counts, times two (Bonferroni).
    p = min(1.0, len(parts) * min(whiteness(each.problem, each.taken, context.seed)[1] for each in parts))
    described: tuple[Formula, ...] = ()
    if motion.unexplained:
        described = describe(fitted.recordings, motion.taken.physics, context.seed)
    gained = _with_formulas(found, described) if context.with_formula and described else None
    words = "; ".join(map(str, described)) or None
    return Residual(p > SIGNIFICANCE and not unexplained, p, words, gained)


def _with_formulas(found: Contender, formulas: Sequence[Formula]) -> dict[str, Misfit]:
    """Judge what formulas added to the robot found gain on the recordings set aside."""
    misfits = judge(found, replace(found, correction=with_formulas(formulas)))
    return {column: m for column, m in misfits.items() if m.before != m.after}


def _word(named: bool, unexplained: bool) -> str:
    if named:
        return "missing_and_unexplained" if unexplained else "missing"
    return "unexplained" if unexplained else "nothing"
