"""Discover: from a case's recordings to a verdict on what the simulation lacks.

verdict = discover(read_case("recordings/monday"))
verdict.effects, verdict.robot
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.language.grammar import Grammar
from gecar.language.program import Program
from gecar.reality.advise.next_recording import suggest
from gecar.reality.advise.notes import (
    ALONG_ENCODERS,
    WITHOUT,
    note_on_astray,
    note_on_kind,
    note_on_moments,
    note_on_place,
    notes_on_findings,
    notes_on_recordings,
)
from gecar.reality.evidence import Evidence
from gecar.reality.fitting.gain_offset import with_gain_from_even_floor
from gecar.reality.fitting.model import Model, Step
from gecar.reality.invent.beside import lessened
from gecar.reality.invent.corrected_replay import with_formulas
from gecar.reality.invent.formula import Formula, describe
from gecar.reality.invent.invention import OF_THE_CAMERA, OF_THE_MOUNT, invent, of_both_motors
from gecar.reality.invent.sentences import elsewhere
from gecar.reality.locate.hotspot import ABOUT_M, middle, strongest_place, with_spot
from gecar.reality.locate.mismatch_map import MismatchMap
from gecar.reality.locate.moments import Acting, kind_of_driving, moments
from gecar.reality.locate.path_check import path_in_doubt
from gecar.reality.materiality import DEFAULT, Material, Size, combined
from gecar.reality.noise.sensor_noise import Noise, estimate_noise
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.prove.confirmation import (
    Confirmation,
    confirmed,
    dropped,
    explained_and_confirmed,
    standing_out,
    steady,
    with_better_readings,
)
from gecar.reality.prove.holdout import Contender, gaps, judge
from gecar.reality.prove.whiteness import whiteness
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.recordings.split import Split, hold_out, with_enough
from gecar.reality.replay.log_faults import without_log_faults
from gecar.reality.residuals.compilation import compiled_replays
from gecar.reality.residuals.of_case import INSTRUMENTS, Physics, Residuals, motion_residuals
from gecar.reality.residuals.parting import logs_apart
from gecar.reality.residuals.threads import Threads
from gecar.reality.selection.acceptance import size_of, worsens
from gecar.reality.selection.alternatives import alternatives, late_as_well
from gecar.reality.selection.observability import observable
from gecar.reality.selection.problem import Problem, problem_of
from gecar.reality.selection.stepwise import (
    Explanation,
    explain,
    left_before,
    left_by,
    left_share_of_each,
    likeliest,
    resumed,
)
from gecar.reality.selection.thresholds import HOTSPOT, NEGLIGIBLE, PRICE, SIGNIFICANCE
from gecar.reality.uncertainty.intervals import hulls, intervals, weakest_absent
from gecar.reality.uncertainty.limits import limits
from gecar.reality.uncertainty.valleys import along_valleys, valleys
from gecar.reality.verdict import (
    Found,
    Interval,
    Invented,
    Judgement,
    Limit,
    Minor,
    Misfit,
    Residual,
    Verdict,
)
from gecar.world.course.course import load_course
from gecar.world.effects import BY_ID, CATALOGUE, Effect
from gecar.world.robot import Robot, load_robot
from gecar.world.rollout import Outcome, World, simulate
from gecar.world.terms import Term

Spans = Mapping[str, Mapping[str, Interval]]

MEMORY_S = 1.0  # over which replays are drawn back to the measurement
ENOUGH_ELSEWHERE = 0.5  # share of the residuals away from a place that must be left
FOR_A_LAW = 0.25  # of the material size must be left; what stood in for oval wheels left 0.4
# Laws in the place of effects must leave so much less, or explain so much more, than laws beside them; and laws where
# nothing material is left must leave so much less than there was.
INSTEAD = 0.7
# Times the misfit of readings along the camera's own path that a law's path must leave for the law to be refused: laws
# for a table that shakes leave far more, and right ones less.
READS_WORSE = 1.2
# Times its misfit under the known robot that an instrument may have under what was found without it: an instrument's
# own errors make up for less than half of what an effect does.
UNDONE = 4.0
REPAIRS = 3  # of logs, at most: by the known robot first, then by the one found
# Times the material size, and what recordings fitted on leave, that one set aside must leave to be told of by itself.
ASTRAY = 3.0
OF_NO_MATTER = 0.2  # of the material size: a new repair that moves whole drives by less changes nothing


@dataclass(frozen=True)
class _Context:
    """What all stages share: the robot as it is known, what may be found, and how."""

    robot: Robot
    catalogue: tuple[Effect, ...]
    split: Split
    seed: int
    tell: Callable[[str], None]
    with_formula: bool
    material: Material
    program: Program | None
    language: Grammar | None
    invents: bool
    about: str

    def arrival_apart_s(self, one: Robot, other: Robot) -> float | None:
        """Return how much later or earlier one robot arrives with the program than another [s]; None: unknown."""
        course = self.split.fitted[0].setup.course
        if self.program is None or course == "none":
            return None
        floor = load_course(course)
        drives = [simulate(World(robot, floor), self.program.opcodes) for robot in (one, other)]
        arrived = all(drive.outcome is Outcome.GOAL for drive in drives)
        return abs(drives[0].time_s - drives[1].time_s) if arrived else None


def discover(
    case: Case,
    holdout: Sequence[str] = (),
    robot: Robot | None = None,
    seed: int = 0,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    with_formula: bool = False,
    catalogue: Sequence[Effect] = CATALOGUE,
    material: Material = DEFAULT,
    program: Program | None = None,
    language: Grammar | None = None,
    invents: bool = False,
    about: str = "",
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
    material
        From what size on something is material.
    program
        Whose time of arrival tells sizes, too.
    language
        The language of laws that are written where nothing in the catalogue explains what is left; default: none are.
    invents
        Whether laws are written in any case.
    about
        An effect that the next recording shall show; default: what helps most.

    Raises
    ------
    InputError
        If a name is unknown, or a robot or course file is wrong.
    """
    known = robot if robot is not None else load_robot(case.recordings[0].setup.robot)
    context = _Context(
        known,
        tuple(catalogue),
        with_enough(hold_out(case, holdout)),
        seed,
        tell,
        with_formula,
        material,
        program,
        language,
        invents,
        about,
    )
    with compiled_replays(language is not None, tell), Threads(workers) as threads:
        return _discover(case.name, context, threads)


def _discover(name: str, context: _Context, threads: Threads) -> Verdict:
    """Return the verdict, stage by stage."""
    context.tell(f"fitting on {', '.join(r.name for r in context.split.fitted)}")
    noise = estimate_noise(context.split.fitted, context.robot.physics, MEMORY_S)
    split, problem, held, seen = _with_logs_repaired(context, noise, threads)
    motion = _explain_motion(context, problem, held, seen)
    explained = motion.explained
    fitted = _along_paths(explained.problem.residuals.everywhere(), explained, explained.taken.physics)
    # Where a drive began is told once, or robots would be judged on other readings each.
    held = _with_nuisances(held, explained, explained.taken.physics)
    sensing = _explain_sensor(context, explained, fitted, held)
    context.tell("alternatives, location")
    return _verdict(name, context, split, (motion, sensing) if sensing else (motion,), fitted, held)


def _verdict(
    name: str,
    context: _Context,
    split: Split,
    stages: Sequence[_Stage],
    fitted: Residuals,
    held: Residuals,
) -> Verdict:
    """Return the verdict on what the stages found, the motion's first, judged on the recordings set aside.

    ``split`` has the repaired recordings; ``fitted`` and ``held`` are their residuals along the path that was found.
    """
    known, motion = context.robot, stages[0].explained
    found = known.with_effects({e: v for stage in stages for e, v in stage.explained.taken.values.items()})
    found = found.with_terms([*known.term, *(term for stage in stages for term in stage.laws)])
    before, after = (
        Contender(robot, _with_nuisances(held, motion, robot.physics)) for robot in (known, found)
    )
    effects, rivals = _findings(context, stages)
    held_of_each = (after.held, after.held.of_sensor())
    astray = [_astray(*each) for each in zip(stages, held_of_each, strict=False)]
    left = _what_is_left(context, stages, fitted, after, [size for each in astray for size in each.values()])
    invented = tuple(law for stage in stages for law in stage.invented)
    small = [_minor(context, stage, step) for stage in stages for step in stage.explained.minor]
    word = _word(bool(effects), bool(invented), left.material)
    unseen = [step.effect for s in stages for step in s.explained.steps if step.effect in s.unseen]
    nothing = not (effects or invented)
    shows = nothing or len(unseen) < len(effects) or any(law.shows for law in invented)
    where = _located(context, stages, fitted, after.held, found)
    seen_from = _limits(context, stages)
    return Verdict(
        case=name,
        verdict=word,
        effects=effects,
        minor=tuple(each for each in small if context.material.times(each.size) > NEGLIGIBLE),
        invented=invented,
        located=where.places(np.random.default_rng(context.seed)) if word != "nothing" else (),
        judgement=Judgement(tuple(r.name for r in split.held), split.by_time, judge(before, after), shows),
        residual=left,
        next_recording=suggest(
            found,
            effects,
            rivals,
            fitted.recordings[0],
            left.material,
            invented,
            seen_from,
            context.about,
        ),
        robot=found.model_copy(update={"name": f"{known.name}-{name}"}),
        limits=seen_from,
        fitted_on=tuple(r.name for r in split.fitted),
        notes=(
            *notes_on_findings(
                split,
                found,
                [step for stage in stages for step in stage.candidates],
                unseen,
                invented,
                stages[0].left_out or stages[0].acts,
                _alike(motion),
            ),
            *notes_on_recordings(split, context.split, fitted, motion.problem.clocks_fitted, where.doubted),
            *(note_on_astray(name, size) for each in astray for name, size in each.items()),
        ),
        evidence=Evidence(
            motion,
            stages[1].explained if len(stages) > 1 else None,
            where,
            fitted,
            after.held,
            before.held,
            known,
        ),
    )


def _with_logs_repaired(
    context: _Context, noise: Noise, threads: Threads
) -> tuple[Split, Problem, Residuals, Confirmation]:
    """Repair the logs and explain the motion by effects; repeat it if the robot found repairs the logs differently.

    When a command changed in a gap of a log is told by how a robot moves; the known robot tells it so that what it
    lacks is made up for in part, and one found in part may do so again: the likeliest of all repairs is taken. Returns
    the repaired recordings, the problem, held-out residuals, and what was seen.
    """
    split = _without_log_faults(context.split, context.robot.physics, noise, threads)
    fitted, held = _residuals(split, noise, threads)
    before: Confirmation | None = None
    repaired: list[tuple[Split, Problem, Residuals, Confirmation]] = []
    for number in range(REPAIRS):
        problem = _problem(context, context.robot, fitted, held)
        seen = (before and _once_more(problem, held, before)) or explained_and_confirmed(problem, held)
        repaired.append((split, problem, held, seen))
        physics = seen.explained.problem.with_small_changes(seen.explained.taken)
        again = _without_log_faults(context.split, physics, noise, threads)
        told = _residuals(again, noise, threads)
        apart = logs_apart(fitted, told[0], physics).or_more(logs_apart(held, told[1], physics))
        if number == REPAIRS - 1 or context.material.times(apart) < OF_NO_MATTER:
            break
        context.tell("once more, with gaps of the logs as the robot that was found tells them")
        split, (fitted, held), before = again, told, seen
    explained = [each.explained for *_, each in repaired]
    return repaired[likeliest([(each.problem, each.taken) for each in explained])]


def _once_more(problem: Problem, held: Residuals, before: Confirmation) -> Confirmation | None:
    """Explain newly repaired logs by the effects found before; None where these change, or leave what is material."""
    found = before.explained
    camera = found.problem.clocks_fitted or found.problem.mark_fitted
    if not found.steps or found.unexplained or before.candidates or camera:
        return None
    again = confirmed(resumed(problem, found, found.tried), held)
    alike = _named(again.explained) == _named(found)
    return again if alike and not (again.candidates or again.explained.unexplained) else None


def _residuals(split: Split, noise: Noise, threads: Threads) -> tuple[Residuals, Residuals]:
    """Return the residuals of motion of the recordings fitted on, and of those set aside."""
    fitted, held = (motion_residuals(runs, noise, MEMORY_S, threads) for runs in (split.fitted, split.held))
    return fitted, held


def _without_log_faults(split: Split, physics: Physics, noise: Noise, threads: Threads) -> Split:
    """Return the recordings with missing rows and jittering times of their logs repaired, by a robot's physics."""

    def repaired(run: Recording) -> Recording:
        return without_log_faults(run, physics, noise.sd, noise.walk, MEMORY_S)

    fitted, held = (tuple(threads.map(repaired, runs)) for runs in (split.fitted, split.held))
    return replace(split, fitted=fitted, held=held)


@dataclass(frozen=True)
class _Stage(Confirmation):
    """What was explained and confirmed, and laws written on top of it.

    Attributes
    ----------
    spans
        95 % intervals of the effects' parameters, by effect and label.
    held
        The recordings set aside that were to confirm them.
    laws, invented
        The laws, and what the verdict says of them.
    left_out
        What is said of an instrument, a place, a kind of driving or moments that nothing explains, so that they were
        left out.
    acts
        What is said of a kind of driving in which something acts where nothing explains the rest, either.
    """

    spans: Spans
    held: Residuals
    laws: tuple[Term, ...] = ()
    invented: tuple[Invented, ...] = ()
    left_out: str = ""
    acts: str = ""


def _explain_motion(context: _Context, problem: Problem, held: Residuals, seen: Confirmation) -> _Stage:
    """Explain how the robot moved: by the effects that were seen, by effects and laws, or by laws alone.

    Clocks of the camera that were fitted before the laws were known have taken up a part of these: then all begins
    anew. What is left may be at one place on the floor, or in one kind of driving, or else one instrument may be wrong,
    or something acts now and then.
    """
    effects = _with_intervals(context, seen, held)
    motion = _written(context, effects)
    renewed = motion.explained.problem.with_clocks_beside(motion.explained.taken) if motion.laws else None
    if renewed is not None:
        context.tell("once more with the camera's clocks as they are beside laws")
        anew = explained_and_confirmed(problem.filmed_as(renewed), held)
        motion = min(motion, _written(context, _with_intervals(context, anew, held)), key=_left)
    if context.language is not None and _reads_worse(motion):
        context.tell(
            "the colour sensor read its lines where the camera says: once more without laws of the camera"
        )
        motion = _written(replace(context, language=elsewhere(context.language, OF_THE_CAMERA)), effects)
    if motion.laws:
        return _explained_in_other_driving(context, effects, motion, problem.residuals, held)
    found = replace(motion, explained=with_spot(motion.explained))
    if not found.explained.unexplained:
        return found
    away = _explained_elsewhere(context, found.explained, found.candidates, problem.residuals, held)
    if away or not motion.explained.unexplained:
        return away or found
    found = _explained_at_other_times(context, found, kind_of_driving, problem.residuals, held)
    if found.left_out:
        return found
    without = (_explained_without(context, each, found, problem.residuals, held) for each in INSTRUMENTS)
    in_part = next(filter(None, without), None)
    found = in_part or _explained_at_other_times(context, found, moments, problem.residuals, held)
    if found.left_out or not found.explained.unexplained:
        return found
    return _explained_along_encoders(context, found, problem.residuals, held) or found


def _written(context: _Context, effects: _Stage) -> _Stage:
    """Add laws to what effects explain of the motion, if whole drives set aside come out no worse with them.

    A law may mend what effects do that were refused: beside these it helps, and beside nothing it does not.
    """
    found = _with_laws(context, _with_law_of_both_motors(context, effects))
    if not found.laws or not effects.held.recordings:
        return found
    was, now = gaps(*(_set_aside(stage.explained, effects.held) for stage in (effects, found)))
    return found if now <= was else effects


def _set_aside(explained: Explanation, held: Residuals) -> Contender:
    """Return the robot of an explanation beside the recordings set aside."""
    taken = explained.taken
    return Contender(taken.robot, explained.problem.with_its_camera(held, taken.physics))


def _reads_worse(motion: _Stage) -> bool:
    """Whether laws of what the camera sees put the colour sensor where it would have read something else.

    It read the lines from where the robot was: if the camera's own path says that, the camera is right.
    """
    explained = motion.explained
    robot = explained.taken.robot
    others = [term for term in robot.term if term.port not in OF_THE_CAMERA]
    if len(others) == len(robot.term):
        return False
    costs = []
    for physics in (robot.physics, robot.with_terms(others).physics):
        along = _along_paths(explained.problem.residuals.everywhere(), explained, physics).of_sensor()
        costs.append(cost(along.errors(physics)) if along.recordings else 0.0)
    return costs[0] > READS_WORSE * costs[1] + PRICE


def _explained_in_other_driving(
    context: _Context, effects: _Stage, written: _Stage, fitted: Residuals, held: Residuals
) -> _Stage:
    """Leave out one kind of driving instead of keeping laws that leave much, if effects explain all other driving."""
    if not written.explained.unexplained:
        return written
    found = _explained_at_other_times(context, effects, kind_of_driving, fitted, held)
    return found if found.left_out else written


def _explained_elsewhere(
    context: _Context, before: Explanation, candidates: Sequence[Step], fitted: Residuals, held: Residuals
) -> _Stage | None:
    """Explain motion away from a place on the floor where something unknown acts; None if there is none, or that fails.

    What acts there would else give effects another size in recordings that pass it. Such an effect, a candidate, may
    hide the place while it is not part of the model.
    """
    problem, taken = before.problem, before.taken
    beside = [step for step in candidates if step.effect not in taken.effects]
    fit = problem.estimator.fit
    models = [taken, *(fit((*taken.effects, step.effect), step.model.values) for step in beside)]
    scored = [(*strongest_place(problem.under(model), model), model) for model in models]
    score, spot, model = max(scored, key=lambda each: each[0])
    if score < HOTSPOT:
        return None
    place = middle(problem.under(model), model, spot)
    context.tell(f"something acts at one place: once more away from x {place[0]:.2f} m, y {place[1]:.2f} m")
    alone, held = (residuals.away_from(place, ABOUT_M) for residuals in (fitted, held))
    if not held.recordings or len(alone.index.t_s) < ENOUGH_ELSEWHERE * len(fitted.index.t_s):
        return None
    motion = _explained_in_part(context, alone, held, fitted)
    if motion is None:
        return None
    taken = motion.explained.taken
    found = problem.estimator.at(taken, taken.z)
    spot = strongest_place(problem.under(found), found)[1]  # beside what is known now
    return replace(motion, explained=replace(motion.explained, spot=spot), left_out=note_on_place(spot))


def _explained_at_other_times(
    context: _Context,
    found: _Stage,
    told: Callable[[Problem, Model, Residuals], Acting | None],
    fitted: Residuals,
    held: Residuals,
) -> _Stage:
    """Explain motion without the times at which something unknown acts, which ``told`` finds.

    The stage stays as it is if there are hardly any, or so many that too little is left, or if no effect explains the
    rest.
    """
    problem, taken = found.explained.problem, found.explained.taken
    if problem.on_bench:
        return found
    acting = told(problem, taken, problem.with_its_camera(held, taken.physics))
    if acting is None:
        return found
    alone, others = fitted.except_at(acting.fitted), held.except_at(acting.held)
    share = len(alone.index.t_s) / max(len(fitted.index.t_s), 1)
    if not ENOUGH_ELSEWHERE <= share < 1.0 - NEGLIGIBLE:
        return found
    context.tell(f"something acts {acting.kind or 'at some moments'}: once more without what happened then")
    # What is left of it elsewhere may be taken for a place: the robot is where it is when it happens.
    anywhere = tuple(effect for effect in context.catalogue if not effect.at_a_place)
    motion = _explained_in_part(replace(context, catalogue=anywhere), alone, others, fitted)
    if not acting.kind:
        return replace(motion, left_out=note_on_moments(alone)) if motion else found
    if motion is None:
        return replace(found, acts=note_on_kind(acting.kind, acting.left, False))
    return replace(motion, left_out=note_on_kind(acting.kind, acting.left, True))


def _explained_in_part(
    context: _Context, part: Residuals, held: Residuals, fitted: Residuals
) -> _Stage | None:
    """Explain a part of what was measured, and leave the rest unexplained; None if effects leave much of the part.

    Each effect must have one size in all recordings, or it may belong to the rest; but where wheels turn as the
    encoders say, what turned them shows in nothing. It need not explain the rest, but a cause does not make it worse.
    """
    problem = _problem(context, context.robot, part, held)
    explained = explain(problem, once_more=True)
    if explained.unexplained or not explained.steps:
        return None
    seen = confirmed(explained, held, in_part=True)
    motion = _with_intervals(context, seen if part.follow_encoders else steady(seen), held)
    found, whole = motion.explained, problem.sizes.of(fitted)
    if not found.steps or found.unexplained or worsens(problem, problem.known, found.taken, whole):
        return None
    return replace(motion, explained=replace(found, left=whole.left(found.taken.physics), unexplained=True))


def _explained_without(
    context: _Context, instrument: str, before: _Stage, fitted: Residuals, held: Residuals
) -> _Stage | None:
    """Explain motion without the encoders, or without the poses, where nothing explains those; None if that fails.

    One of them that errs in a way of its own would otherwise hide what the other shows, as it counts in every sample.
    What was found may explain both: beside all that two causes do, either alone may make whole drives worse. Names
    given ``before`` are only lost if whole paths come out no worse without encoders, or encoders better without poses.
    """
    measured = {name for run in fitted.recordings for name in run.recording.measured}
    alone, beside = (residuals.without(instrument) for residuals in (fitted, held))
    if measured.isdisjoint(INSTRUMENTS[instrument]) or not alone.recordings:
        return None
    context.tell(f"much is unexplained: once more without the {instrument}")
    motion = _explained_in_part(context, alone, beside, fitted)
    if motion is None or _is_undone(instrument, context.robot, motion.explained, fitted):
        return None
    both = resumed(_problem(context, context.robot, fitted, held), motion.explained)
    seen = _with_intervals(context, confirmed(both, held), held)
    if not (seen.explained.unexplained or seen.candidates):
        return seen
    if _named(before.explained) - _named(motion.explained) and _is_worse_without(
        instrument, before.explained, motion.explained
    ):
        return None
    return replace(motion, left_out=WITHOUT[instrument])


def _explained_along_encoders(
    context: _Context, before: _Stage, fitted: Residuals, held: Residuals
) -> _Stage | None:
    """Explain the poses in replays whose wheels turn as the encoders say; None if that fails.

    Names given ``before`` are not lost.
    """
    alone, beside = (residuals.along_encoders() for residuals in (fitted, held))
    if not alone.recordings:
        return None
    context.tell("much is unexplained: once more with wheels that turn as the encoders say")
    motion = _explained_in_part(context, alone, beside, fitted)
    if motion is None or not _named(before.explained) <= _named(motion.explained):
        return None
    return replace(motion, left_out=ALONG_ENCODERS)


def _named(explained: Explanation) -> set[str]:
    return {step.effect for step in explained.steps}


def _is_undone(instrument: str, known: Robot, without: Explanation, fitted: Residuals) -> bool:
    """Whether an instrument agrees with the robot as it is known, and not with what was found without it.

    An instrument that errs does not err by just what an effect does to the robot.
    """
    (other,) = INSTRUMENTS.keys() - {instrument}
    seen = fitted.without(other)
    before, after = (cost(seen.errors(physics)) for physics in (known.physics, without.taken.physics))
    return after > UNDONE * before + PRICE


def _is_worse_without(instrument: str, before: Explanation, without: Explanation) -> bool:
    """Whether whole paths come out worse without encoders, or the encoders no better without poses."""
    if instrument == "encoders":
        times = without.problem.material.times
        return times(without.left) > times(before.left)
    was, now = (without.problem.cost_of(each.taken.physics) for each in (before, without))
    return was - now < PRICE


def _problem(context: _Context, robot: Robot, fitted: Residuals, held: Residuals) -> Problem:
    """Return the selection problem of residuals, with the effects of the catalogue that they can show."""
    catalogue = observable(context.catalogue, fitted)
    return problem_of(fitted, robot, catalogue, context.material, context.seed, context.tell, held)


def _explain_sensor(
    context: _Context, motion: Explanation, fitted: Residuals, held: Residuals
) -> _Stage | None:
    """Explain what the colour sensor read along the measured path; None where it read nothing."""
    residuals = fitted.of_sensor()
    if not residuals.recordings:
        return None
    # A late camera and a skewed clock shift what is read, too.
    known = motion.taken.robot
    beside = held.of_sensor()
    problem = _problem(context, known, residuals, beside)
    problem = replace(problem, sizes=replace(problem.sizes, off=motion.left))
    seen = _readings_explained(problem, beside)
    # A camera that errs by what matters over a metre moves the line among its poses, too: the line lies elsewhere only
    # if that explains nearly all, and is the same in all recordings.
    if motion.unexplained or context.material.times(motion.left) > 1.0:
        language = context.language and elsewhere(context.language, OF_THE_MOUNT)
        context, stands = replace(context, language=language), standing_out(seen)
        if _of_place(seen) != _of_place(stands):
            anywhere = tuple(effect for effect in problem.catalogue if "pose" not in BY_ID[effect].needs)
            seen = _readings_explained(problem.of_effects(anywhere), beside)
            stands = standing_out(seen)
        seen = stands if motion.unexplained else seen
    return _with_laws(context, _with_intervals(context, seen, beside, motion.unexplained))


def _readings_explained(problem: Problem, held: Residuals) -> Confirmation:
    """Explain sensor readings by effects that the readings set aside confirm, and that do not make those worse."""
    seen = explained_and_confirmed(problem, held)
    taken = with_gain_from_even_floor(seen.explained.problem.estimator, seen.explained.taken)
    return with_better_readings(replace(seen, explained=replace(seen.explained, taken=taken)), held)


def _of_place(seen: Confirmation) -> set[str]:
    """Return which of the effects that were seen need a known path."""
    return {step.effect for step in seen.explained.steps if "pose" in BY_ID[step.effect].needs}


def _with_law_of_both_motors(context: _Context, stage: _Stage) -> _Stage:
    """Add a law that uses the other motor's command, or put it in the place of effects, where it explains more.

    What no effect is like may leave less than is material beside one that imitates it.
    """
    if context.language is None or not stage.explained.steps:
        return stage
    found = of_both_motors(stage.explained, context.language)
    if found is None:
        return stage
    language, imitations = found
    bare = _without(stage.explained, imitations)
    instead = _with_laws_on(context, language, replace(stage, spans={}), bare)
    gains = [_gain(bare, each) for each in (stage, instead)]
    return instead if _is_material(instead, stage) and gains[1] - gains[0] >= PRICE else stage


def _with_laws(context: _Context, stage: _Stage) -> _Stage:
    """Add laws that explain what a stage's effects do not, where laws are wanted.

    They are wanted where what is left is material, and where it stands far out of what changes of the robot's constants
    could be; there they must be material themselves. Effects may imitate what no list holds: if what is left beside
    laws still asks for laws, they are written in the place of the effects that they lessen, too (of all if there are no
    laws), and taken if they leave far less, or no more and explain far more. Effects that are all named again beside
    them stood in for nothing.
    """
    if context.language is None or not (context.invents or _is_left(stage)):
        return stage
    beside = _with_laws_on(context, context.language, stage, stage.explained)
    of_any_size = context.invents or stage.explained.unexplained
    if not of_any_size and not (_is_material(beside, stage) and _left(beside) < INSTEAD * _left(stage)):
        beside = stage
    if not _is_left(beside):
        return beside
    named = stage.explained.steps
    laws = beside.laws[len(stage.laws) :]
    doubtful = lessened(beside.explained, laws, stage.explained) if laws else named
    if not doubtful:
        return beside
    context.tell(f"laws in the place of {', '.join(step.effect for step in doubtful)}")
    bare = _without(stage.explained, doubtful)
    alone = _with_laws_on(context, context.language, replace(stage, spans={}), bare)
    again = {step.effect for step in doubtful} <= set(alone.explained.taken.effects)
    if again or not (of_any_size or _is_material(alone, stage)):
        return beside
    gains = [_gain(bare, each) for each in (beside, alone)]
    far_less = _left(alone) < INSTEAD * _left(beside)
    far_more = max(_left(alone), 1.0) <= max(_left(beside), 1.0) and gains[0] < INSTEAD * gains[1]
    return alone if far_less or far_more else beside


def _without(explained: Explanation, steps: Sequence[Step]) -> Explanation:
    """Return an explanation without some of its effects."""
    for step in steps:
        explained = dropped(explained, step)
    return explained


def _is_left(stage: _Stage) -> bool:
    """Whether a law is worth looking for: what is left is material, or no change of constants could explain it.

    In the second case effects may have stood in for most of a law, but not for all but a quarter of a material size,
    nor for all but what their own laws are off by.
    """
    explained = stage.explained
    if explained.unexplained or not explained.problem.is_beyond_constants:
        return explained.unexplained
    share = _left(stage) / max(left_before(explained.problem), 1.0)
    allowed = left_share_of_each(explained.problem, explained.taken, explained.steps)
    return _left(stage) >= FOR_A_LAW and share > allowed


def _is_material(stage: _Stage, before: _Stage) -> bool:
    """Whether a law added since the stage before moves the robot, or changes a reading, by a material amount."""
    material = stage.explained.problem.material
    return any(material.times(law.size) >= 1.0 for law in stage.invented[len(before.invented) :])


def _gain(bare: Explanation, stage: _Stage) -> float:
    """Return what a stage's robot gains in log-likelihood over a bare explanation's, beside what that leaves."""
    before, after = (bare.problem.cost_of(e.taken.physics) for e in (bare, stage.explained))
    return before - after


def _with_laws_on(context: _Context, language: Grammar, stage: _Stage, explained: Explanation) -> _Stage:
    """Return a stage with this explanation in place of its own, and laws added to it."""
    refused = {step.effect: step for step in stage.candidates}  # each once, as it was taken last
    written = invent(explained, stage.held, language, context.seed, context.tell, [*refused.values()])
    named = _named(written.explained)
    if not written.terms and named == _named(explained):
        return replace(stage, explained=written.explained)
    laws, told = (*stage.laws, *written.terms), (*stage.invented, *written.invented)
    stage = replace(stage, explained=written.explained, laws=laws, invented=told)
    candidates = tuple(step for step in stage.candidates if step.effect not in named)
    return replace(stage, candidates=candidates, spans=_spans(context, written.explained))


def _left(stage: _Stage) -> float:
    """Return the size of what a stage leaves unexplained, as a multiple of the smallest material size."""
    return stage.explained.problem.material.times(stage.explained.left)


def _with_nuisances(held: Residuals, motion: Explanation, physics: npt.NDArray[Any]) -> Residuals:
    """Return the recordings set aside with the nuisances of those fitted on, fitted anew under a robot's physics."""
    return _along_paths(motion.problem.with_its_camera(held, physics), motion, physics)


def _along_paths(residuals: Residuals, motion: Explanation, physics: npt.NDArray[Any]) -> Residuals:
    """Return recordings with the path their colour sensor took, as a robot's physics gives it."""
    return residuals.localised(physics).with_paths(physics, motion.problem.slow_noise(motion.taken))


def _with_intervals(
    context: _Context, confirmation: Confirmation, held: Residuals, doubtful: bool = False
) -> _Stage:
    """Return the intervals of what was confirmed; an effect that may as well be absent becomes a candidate.

    Readings along a path that nothing explains are ``doubtful``.
    """
    explained, candidates = confirmation.explained, confirmation.candidates
    context.tell("intervals")
    while True:
        spans = intervals(explained.problem.estimator, explained.taken, context.seed)
        on_bench = explained.problem.on_bench
        weakest = weakest_absent(explained.taken, explained.steps, spans, doubtful, on_bench)
        if weakest is None:
            break
        explained, candidates = dropped(explained, weakest), (*candidates, weakest)
    return _Stage(explained, candidates, confirmation.unseen, _spans(context, explained, spans), held)


def _spans(context: _Context, explained: Explanation, named: Spans | None = None) -> Spans:
    """Return the intervals of an explanation's effects, small ones too; on a bench along the valleys they lie in.

    Small ones are not claimed, but they may be there: intervals hold for robots with and without them.
    ``named`` are those of its named effects without them, if they are known without valleys.
    """
    problem, taken = explained.problem, explained.taken
    spans = named if named is not None else intervals(problem.estimator, taken, context.seed)
    if explained.minor:
        beside = intervals(problem.estimator, explained.whole, context.seed)
        spans = {effect: hulls(of, spans.get(effect, of)) for effect, of in beside.items()}
    return along_valleys(problem, taken, spans) if explained.steps and problem.on_bench else spans


def _findings(context: _Context, stages: Sequence[_Stage]) -> tuple[tuple[Found, ...], tuple[Robot, ...]]:
    """Return what was found, and robots with an alternative in its place."""
    known = context.robot
    found, rivals = list[Found](), list[Robot]()
    for stage in stages:
        beside = {
            effect: values
            for other in stages
            if other is not stage
            for effect, values in other.explained.taken.values.items()
        }
        for step in stage.explained.steps:
            others = alternatives(stage.explained, step)
            rivals += [known.with_effects({**beside, **model.values}) for model in others.values()]
            late = late_as_well(stages[0].explained.problem, step)
            rivals += [known.with_effects({**beside, **late})] if late else []
            gain, null = step.holdout_gain, step.null_95
            size = _sized(context, stage.explained.problem, stage.explained.taken, step)
            found.append(
                Found(step.effect, (*others, *late), stage.spans[step.effect], gain, null, step.p, size)
            )
    return tuple(found), tuple(rivals)


def _minor(context: _Context, stage: _Stage, step: Step) -> Minor:
    size = _sized(context, stage.explained.problem, stage.explained.whole, step)
    return Minor(step.effect, stage.spans[step.effect], size)


def _sized(context: _Context, problem: Problem, model: Model, step: Step) -> Size:
    """Return what an effect of a model does to the robot, and to when it arrives."""
    values = model.values
    known, whole = context.robot, context.robot.with_effects(values)
    rest = known.with_effects({effect: v for effect, v in values.items() if effect != step.effect})
    size = size_of(problem, model, step)
    return replace(size, arrival_s=context.arrival_apart_s(whole, rest))


def _limits(context: _Context, stages: Sequence[_Stage]) -> dict[str, Limit | None]:
    """Return, of every effect that was not found, the smallest size that these recordings would have shown."""
    seen = {
        effect: limit
        for stage in stages
        for effect, limit in limits(stage.explained.problem, stage.explained.taken, stage.held).items()
    }
    found = {step.effect for stage in stages for step in stage.explained.steps}
    return {effect.id: seen.get(effect.id) for effect in context.catalogue if effect.id not in found}


def _located(
    context: _Context, stages: Sequence[_Stage], fitted: Residuals, held: Residuals, found: Robot
) -> MismatchMap:
    """Return where simulation and reality part, in recordings set aside as well, as nothing is fitted to them here.

    Only those fitted on are shown where the end of the only recording is set aside, where an instrument was left out,
    and where all that counts is at one place, which was found in them.
    """
    motion, runs = stages[0].explained, fitted.recordings
    if not (context.split.by_time or stages[0].left_out or motion.spot):
        runs += held.recordings
    shown = replace(fitted, recordings=runs)
    sensor_unexplained = any(stage.explained.unexplained for stage in stages[1:])
    return MismatchMap(
        shown.recordings,
        shown.errors(context.robot.physics),
        shown.index,
        context.robot.physics,
        motion.taken.physics,
        found.physics,
        (not motion.unexplained, not sensor_unexplained),
        sensor_unexplained and path_in_doubt(shown.recordings, found.physics),
        motion.spot,
    )


def _astray(stage: _Stage, held: Residuals) -> dict[str, Size]:
    """Return the remaining errors, by name, of held-out recordings that are off by far more than recordings fitted on.

    One of those may be off as much, which alone says nothing. Beside an effect at a place a held-out one may just have
    missed that place, slightly off its path.
    """
    explained, problem = stage.explained, stage.explained.problem
    at_a_place = any(BY_ID[step.effect].at_a_place for step in explained.steps)
    if explained.unexplained or at_a_place or problem.on_bench or problem.is_only_one:
        return {}
    left = {
        run.recording.name: left_by(
            replace(problem, sizes=replace(problem.sizes, runs=(run,))), explained.taken
        )
        for run in held.recordings
    }
    most = ASTRAY * max(_left(stage), 1.0)
    return {name: size for name, size in left.items() if problem.material.times(size) > most}


def _what_is_left(
    context: _Context,
    stages: Sequence[_Stage],
    fitted: Residuals,
    found: Contender,
    astray: Sequence[Size],
) -> Residual:
    """Return the size of the remaining error, whether it is white noise, and formulas for what nothing explains.

    ``astray`` are the errors of held-out recordings that show something else (`_astray`).
    """
    parts = [stage.explained for stage in stages]
    # Of motion and readings, the smaller p-value counts, times their number (Bonferroni).
    p = min(1.0, len(parts) * min(whiteness(each.problem, each.taken, context.seed)[1] for each in parts))
    motion, described = parts[0], tuple[Formula, ...]()
    if motion.unexplained:
        described = describe(fitted.recordings, motion.taken.physics, context.seed)
    gained = _with_formulas(found, described) if context.with_formula and described else None
    material = bool(astray) or any(each.unexplained for each in parts)
    white = p > SIGNIFICANCE and not material
    apart = (
        context.robot.with_effects(v)
        for v in (motion.taken.values, motion.problem.small_changes(motion.taken))
    )
    left = combined([*(each.left for each in parts), *astray])
    size = replace(left, arrival_s=context.arrival_apart_s(*apart))
    return Residual(white, p, size, material, "; ".join(map(str, described)) or None, gained)


def _with_formulas(found: Contender, formulas: Sequence[Formula]) -> dict[str, Misfit]:
    """Judge what formulas added to the robot found gain on the recordings set aside."""
    misfits = judge(found, replace(found, correction=with_formulas(formulas)))
    return {column: m for column, m in misfits.items() if m.before != m.after}


def _alike(motion: Explanation) -> tuple[tuple[str, ...], ...]:
    """Return sets of a motor's constants that a bench hardly tells apart."""
    return valleys(motion.problem, motion.taken) if motion.problem.on_bench else ()


def _word(named: bool, invented: bool, unexplained: bool) -> str:
    if invented:
        return "missing_and_invented" if named else "invented"
    if named:
        return "missing_and_unexplained" if unexplained else "missing"
    return "unexplained" if unexplained else "nothing"
