"""Discover: from a case's recordings to a verdict on what the simulation lacks.

verdict = discover(read_case("recordings/monday"))
print(verdict)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.advise.next_recording import suggest
from gecar.reality.advise.notes import remarks
from gecar.reality.evidence import Evidence
from gecar.reality.fitting.clock_offsets import fitted_offsets
from gecar.reality.fitting.gain_offset import levelled
from gecar.reality.invent.corrected_replay import with_formulas
from gecar.reality.invent.formula import Formula, describe
from gecar.reality.locate.mismatch_map import Map
from gecar.reality.locate.path_check import path_in_doubt
from gecar.reality.noise.sensor_noise import Noise, estimate_noise
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.prove.holdout import Misfit, Split, judge, split
from gecar.reality.prove.whiteness import whiteness
from gecar.reality.recordings.known_robot import known_robot
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.residuals.of_case import Comparison
from gecar.reality.residuals.of_recording import Strip
from gecar.reality.selection.alternatives import alternatives
from gecar.reality.selection.selection import Selection
from gecar.reality.selection.stepwise import Explanation, explain
from gecar.reality.selection.thresholds import SIGHT, SIGHT_ON_A_DOUBTFUL_PATH
from gecar.reality.selection.visible import visible, visible_to_sight
from gecar.reality.uncertainty.intervals import intervals
from gecar.reality.verdict import Found, Judgement, Residual, Verdict
from gecar.world.course import Course, load_course
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]

MEMORY_S = 1.0
POSES = (4, 5, 6)  # channels of the pose


@dataclass
class _Workshop:
    """What all stages of one discovery share."""

    robot: Robot
    split: Split
    noise: Noise
    strips: list[Strip]
    held: list[Strip]
    pool: ThreadPoolExecutor
    tell: Callable[[str], None]
    seed: int


def discover(
    case: Case,
    holdout: Sequence[str] = (),
    robot: Robot | None = None,
    seed: int = 0,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    with_formula: bool = False,
) -> Verdict:
    """Find which physics a simulation lacks, fit it, and prove it on recordings set aside.

    Parameters
    ----------
    case
        Recordings of one robot.
    holdout
        Names of the recordings to set aside; default: every fourth, or the last part of the only one.
    robot
        The robot as it is known; default: what the recordings name.
    seed
        Of every draw of chance.
    workers
        Threads; default: all cores.
    tell
        Called with a line of progress.
    with_formula
        Whether to add a formula for what nothing explains to the replays, and to judge what that gains.

    Raises
    ------
    InputError
        If a name is unknown, or a robot or course file is wrong.
    """
    shop = _open(case, holdout, robot, seed, workers, tell)
    tell(f"fitting on {', '.join(r.name for r in shop.split.fitted)}")
    motion, moved, colour = _move(shop)
    sight, seen = _look(shop, moved, colour)
    found_robot = shop.robot.with_effects({**moved.taken.values, **(seen.taken.values if seen else {})})
    tell("intervals, alternatives, whereabouts")
    judgement = _judge(shop, motion, found_robot, colour)
    found, rivals = _found(shop, motion, moved, found_robot)
    if sight and seen:
        more, others = _found(shop, sight, seen, found_robot)
        found, rivals = found + more, rivals + others
    unexplained = moved.unexplained or bool(seen and seen.unexplained)
    doubted = bool(seen and seen.unexplained) and path_in_doubt(shop.strips, found_robot.physics)
    where = _map(shop, found_robot, motion, moved, seen, doubted)
    word = _word(bool(found), unexplained)
    return Verdict(
        case=case.name,
        verdict=word,
        effects=found,
        located=where.places(np.random.default_rng(seed)) if word != "nothing" else (),
        judgement=judgement,
        residual=_left(shop, motion, moved, found_robot, unexplained, with_formula),
        next_recording=suggest(found_robot, found, rivals, shop.split.fitted[0], shop.noise, unexplained),
        robot=found_robot.model_copy(update={"name": f"{shop.robot.name}-{case.name}"}),
        fitted_on=tuple(r.name for r in shop.split.fitted),
        notes=remarks(shop.split, shop.strips, motion, doubted),
        evidence=Evidence(
            motion, moved, sight, seen, where, tuple(shop.strips), tuple(shop.held), shop.robot
        ),
    )


def _word(named: bool, unexplained: bool) -> str:
    if named:
        return "missing_and_unexplained" if unexplained else "missing"
    return "unexplained" if unexplained else "nothing"


def _open(
    case: Case,
    holdout: Sequence[str],
    robot: Robot | None,
    seed: int,
    workers: int | None,
    tell: Callable[[str], None],
) -> _Workshop:
    parts = split(case, holdout)
    known = robot if robot is not None else known_robot(case.recordings[0])
    noise = estimate_noise(parts.fitted, known.physics, MEMORY_S)
    courses: dict[str, Course | None] = {}

    def strip(recording: Recording) -> Strip:
        name = recording.setup.course
        if name not in courses:
            needed = recording.setup.rig == "floor" and name != "none"
            courses[name] = load_course(name) if needed else None
        return Strip(recording, noise, MEMORY_S, courses[name])

    pool = ThreadPoolExecutor(workers or os.cpu_count() or 1)
    return _Workshop(
        known,
        parts,
        noise,
        [strip(r) for r in parts.fitted],
        [strip(r) for r in parts.held],
        pool,
        tell,
        seed,
    )


def _move(shop: _Workshop) -> tuple[Selection, Explanation, Array]:
    """Explain how the robot moved; with it, by how much slow noise exceeds white noise in the pose, shape (3,)."""
    comparison = Comparison(shop.strips, False, shop.pool)
    selection = Selection(
        comparison, shop.robot, visible(shop.strips), shop.split.fitted, shop.seed, shop.tell
    )
    moved = explain(selection)
    left = selection.rid_of_subtle(moved.taken).fit.errors
    return selection, moved, selection.blocks.colour(left)[list(POSES)]


def _look(shop: _Workshop, moved: Explanation, colour: Array) -> tuple[Selection | None, Explanation | None]:
    """Explain what the colour sensor saw along the measured path."""
    mover = moved.taken.freedom.physics(moved.taken.fit.z)
    list(shop.pool.map(lambda strip: strip.locate(mover), shop.strips))
    comparison = Comparison(shop.strips, True, shop.pool)
    if not comparison.strips:
        return None, None
    comparison.set_path(mover, colour)
    known = shop.robot.with_effects(
        moved.taken.values
    )  # a late camera, a skewed clock shift what is seen, too
    selection = Selection(
        comparison,
        known,
        visible_to_sight(comparison.strips),
        shop.split.fitted,
        shop.seed,
        shop.tell,
        SIGHT_ON_A_DOUBTFUL_PATH if moved.unexplained else SIGHT,
    )
    seen = explain(selection)
    return selection, replace(seen, taken=levelled(selection, seen.taken))


def _judge(shop: _Workshop, motion: Selection, found: Robot, colour: Array) -> Judgement:
    if motion.clocked:
        _set_clocks(shop, found)
    list(shop.pool.map(lambda strip: strip.locate(found.physics), shop.held))
    sight = Comparison(shop.held, True, shop.pool)
    sight.set_path(found.physics, colour)
    channels = judge(shop.split.held, shop.held, shop.noise, shop.robot, found)
    return Judgement(tuple(r.name for r in shop.split.held), shop.split.by_time, channels)


def _left(
    shop: _Workshop,
    motion: Selection,
    moved: Explanation,
    found: Robot,
    unexplained: bool,
    with_formula: bool,
) -> Residual:
    """Return what is left: whether it is white, and formulas for what nothing explains."""
    white, p = whiteness(motion, moved.taken)
    physics = moved.taken.freedom.physics(moved.taken.fit.z)
    formulas = describe(shop.strips, physics) if moved.unexplained else ()
    gained = _described(shop, found, formulas) if with_formula and formulas else None
    return Residual(white and not unexplained, p, "; ".join(map(str, formulas)) or None, gained)


def _described(shop: _Workshop, found: Robot, formulas: Sequence[Formula]) -> dict[str, Misfit]:
    """Judge what formulas added to the robot found gain on the recordings set aside."""
    change = with_formulas(formulas)
    misfits = judge(shop.split.held, shop.held, shop.noise, found, found, change)
    return {column: m for column, m in misfits.items() if m.before != m.after}


def _set_clocks(shop: _Workshop, found: Robot) -> None:
    """Take the camera clocks out of the recordings set aside, too: a nuisance, as a start pose is."""
    held = Comparison(shop.held, False, shop.pool)
    held.set_offsets(fitted_offsets(held, lambda: held.errors(found.physics))[0])


def _found(
    shop: _Workshop, selection: Selection, explained: Explanation, robot: Robot
) -> tuple[tuple[Found, ...], tuple[Robot, ...]]:
    """Return what was found, and robots with an alternative in its place."""
    taken = explained.taken
    if not taken.effects:
        return (), ()
    spans = intervals(selection, taken)
    held = Comparison(shop.held, selection.comparison.sight, shop.pool)
    with_all = cost(held.errors(robot.physics)) if held.strips else 0.0
    out, rivals = [], []
    for step in explained.steps:
        rest = {k: v for k, v in robot.effects.items() if k != step.effect}
        without = robot.model_copy(update={"effects": rest})
        gain = cost(held.errors(without.physics)) - with_all if held.strips else float("nan")
        others = alternatives(selection, explained, step)
        rivals += [without.with_effects(model.values) for model in others.values()]
        out.append(Found(step.effect, tuple(others), spans[step.effect], gain, step.null_95, step.p))
    return tuple(out), tuple(rivals)


def _map(
    shop: _Workshop,
    found: Robot,
    motion: Selection,
    moved: Explanation,
    seen: Explanation | None,
    doubted: bool,
) -> Map:
    explained = (not moved.unexplained, not (seen and seen.unexplained))
    mover = moved.taken.freedom.physics(moved.taken.fit.z)
    nothing = motion.nothing.fit.errors
    return Map(
        shop.strips,
        nothing,
        motion.cells,
        shop.robot.physics,
        mover,
        found.physics,
        explained,
        doubted,
        moved.spot,
    )
