"""Invent the missing law: where no effect of the catalogue explains what is left, a law of its own is written.

    library = Library(problem, model)                      # sensitivities of residuals to laws
    laws    = search(library, grammar, ports)              # all single laws, then Grammatical Evolution
    proved  = left out recordings ask for the best of them, more than chance would give any of them,
              and recordings set aside come out better with it

Then the same again, on top of it, for what is still left. The law becomes a part of the robot (`gecar.world.terms`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.language.grammar import Grammar
from gecar.reality.fitting.model import Step
from gecar.reality.invent.beside import held_up, pruned, taken_back, with_effects, without_absent
from gecar.reality.invent.proof import Proof, largest_gains, simplified
from gecar.reality.invent.search import Law, Library, fit, search
from gecar.reality.invent.sentences import key, linear, looking_at, single_laws
from gecar.reality.invent.states import Physics, ranges, states
from gecar.reality.invent.written import Written, added, half_widths_of_constants, with_constants_of
from gecar.reality.materiality import Size
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.prove.holdout import Contender, gaps
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.parting import PATH_KNOWN
from gecar.reality.selection.homogeneity import flickers
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import LEAST_SHOWN, share_asked_for, spread_of_size
from gecar.reality.selection.stepwise import Explanation, left_before
from gecar.reality.selection.thresholds import CLOSE, DRIFTING, PRICE
from gecar.reality.verdict import Invented
from gecar.world.ports import AT_A_POINT, AT_X, AT_Y, N_TERMS, PORTS
from gecar.world.terms import Term

Array = npt.NDArray[np.float64]

MOST_LAWS = 3
TRIED = 5  # of the best laws, until one is proved
HELPS = 0.85  # of the gap of whole drives set aside without a law, in units of noise: with it they must part by less
# A law is refused that leaves so many material sizes and this share of the error, and whose size spreads so over
# recordings. Seeds 2801 to 3604: laws for radios that drop out leave 10 to 22, half of the error, and spread by 0.18 to
# 0.24; right ones that leave as much spread by 0.01 to 0.13.
MUCH, MOST, UNEVEN = 4.0, 0.4, 0.16
MOSTLY = 0.9  # of all rows lie below where a law moves the sensor most
# About a robot's length: the point that a force comes from is known to so much, or to as near as the robot came.
POINT_KNOWN_M = 0.25
OF_THE_MOUNT = ("sensor_ahead", "sensor_aside")  # ports of laws that need a path that is known
OF_THE_CAMERA = tuple(port.id for port in PORTS if port.sensor == "camera")
OF_PLACE = frozenset(("x", "y", "heading", "distance"))  # variables that only a known place has
OF_FLOOR = OF_PLACE | {"ahead", "aside", "turn_rate", "load", "slip"}  # and that a motor on a bench has not
OF_BOTH_MOTORS = frozenset(("other_command",))  # of laws that act while both are driven
OF_PAIR = OF_BOTH_MOTORS | {"side", "other_angle", "other_speed"}  # and that one motor alone has not
FROM_A_POINT = "force_toward"  # the port of forces toward a point or away from it
ABOUT_A_POINT = "pose_turn"  # the port of a camera's frame that turns about a point
ON_FLOOR = frozenset(("force_x", "force_y", *AT_A_POINT))  # ports that have the floor's axes


class _Proven(NamedTuple):
    """A law that holds.

    Attributes
    ----------
    first
        The explanation without any law.
    written
        All laws, with this one.
    law
        The law.
    told
        What the verdict says of it, but for its constants.
    """

    first: Explanation
    written: Written
    law: Law
    told: list[Invented]


def invent(
    explained: Explanation,
    held: Residuals,
    grammar: Grammar,
    seed: int = 0,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    refused: Sequence[Step] = (),
) -> Written:
    """Write laws for what an explanation leaves, one after the other, as long as each proves itself.

    After each, effects are chosen anew beside the laws: a listed cause goes before a further law.

    Parameters
    ----------
    explained
        Of the recordings fitted on.
    held
        Residuals of the same kind, of the recordings set aside.
    grammar
        The language of laws.
    seed
        Random seed.
    tell
        Called with a line of progress.
    refused
        Effects that were taken and are no findings: they may be beside a law, and a law may only hold beside them.
    """
    ports, problem, first = _ports(explained.problem), explained.problem, _as_whitened(explained)
    nothing = written = Written(first, (), ())
    for number in range(MOST_LAWS):
        here = written.explained
        if len(here.problem.estimator.robot.term) == N_TERMS:
            break
        library = Library(here.problem, here.taken)
        found = search(library, grammar, ports, seed + number, tell, _unknown(problem))
        nulls = largest_gains(library, seed) if found else np.zeros(0)
        holds = _first_that_holds(written, first, library, found, held, nulls)
        missing = [step for step in refused if step.effect not in first.taken.effects]
        if holds is None and found and missing and not (written.terms or problem.on_bench):
            tell(f"laws beside {', '.join(step.effect for step in missing)}")
            holds = _first_beside(missing, first, found, held, nulls)
        if holds is None:
            break
        first, more, law, told = holds
        written = replace(more, invented=(*written.invented, *told))
        tell(f"a law: {', '.join(f'{term.port} = {term.law}' for term in law.terms)}")
        # In mm of an EV3's wheel little of another motor is material: on a bench a law must prove itself, and no more.
        if problem.on_bench:
            continue
        written = with_effects(written, first, held)
        first = replace(first, steps=written.explained.steps)
        if not written.explained.unexplained:
            break
    if written is nothing:
        return written
    written = without_absent(written, first, seed)
    return replace(written, invented=with_constants_of(written, first))


def of_both_motors(explained: Explanation, grammar: Grammar) -> tuple[Grammar, list[Step]] | None:
    """Return the laws that use the other motor's command, as a language, and the effects that the best one replaces.

    None if no such law explains more than effects did. But for the battery's load no effect of the catalogue is of both
    motors together: what is, imitates a flat battery, a clock or friction. Laws of how the other wheel turns wait for
    what is left: axles that rub would stand in for oval wheels.
    """
    language = None if explained.problem.on_bench else looking_at(grammar, OF_BOTH_MOTORS)
    if language is None:
        return None
    first = _as_whitened(explained)
    library = Library(first.problem, first.taken)
    best = max(single_laws(language), key=library.gain)
    if library.gain(best) < PRICE:
        return None
    law = fit(library, library.started(best))
    beside = pruned(added(Written(first, (), ()), first, library, law), first).explained.taken.effects
    return language, [step for step in explained.steps if step.effect not in beside]


def _as_whitened(explained: Explanation) -> Explanation:
    """Return an explanation with its model's residuals whitened under its own problem."""
    return replace(explained, taken=explained.problem.estimator.at(explained.taken, explained.taken.z))


def _ports(problem: Problem) -> list[str]:
    """Return the ports whose laws can show in a problem's residuals."""
    runs = problem.residuals.recordings
    measured = [np.flatnonzero(~np.isnan(run.replayer.measured).all(axis=0)).tolist() for run in runs]
    sensors = {"colour"} if problem.residuals.sensor else {""}
    if not problem.residuals.sensor:
        sensors |= {"camera"} if any(run.replayer.has_poses for run in runs) else set()
        sensors |= {"encoders"} if any(0 in seen or 1 in seen for seen in measured) else set()
        sensors |= {"gyro"} if any(3 in seen for seen in measured) else set()
    there = [port for port in PORTS if port.sensor in sensors and (port.on_bench or not problem.on_bench)]
    return [port.id for port in there if _placed(problem) or port.id not in ON_FLOOR]


def _unknown(problem: Problem) -> frozenset[str]:
    """Return the variables that say nothing in a problem's recordings, or the same as others."""
    if not problem.on_bench:
        return frozenset() if _placed(problem) else OF_PLACE
    measured = {name for run in problem.recordings for name in run.measured}
    both = {"left_angle_rad", "right_angle_rad"} <= measured
    return OF_FLOOR if both else OF_FLOOR | OF_PAIR


def _placed(problem: Problem) -> bool:
    """Whether it is known where the robot stood: if not, no recording's axes are another's."""
    runs = problem.residuals.recordings
    return any(run.replayer.has_poses or run.nuisances.start is not None for run in runs)


def _first_that_holds(
    written: Written,
    first: Explanation,
    library: Library,
    found: Sequence[Law],
    held: Residuals,
    nulls: Array,
) -> _Proven | None:
    """Add the best law that is proved and that the held-out recordings confirm; None if there is none.

    A further law that they do not show is none: it may make up for what the form of those before it leaves.
    """
    for law, proof in _proved(library, found, nulls):
        more = pruned(added(written, first, library, law), first)
        if _leaves_more(more.explained, written.explained):
            continue
        if _spread(library, law) >= UNEVEN and _leaves_much(more.explained):
            continue
        gain = _gain_set_aside(written.explained, more.explained, held)
        unseen = gain == 0.0 and held.recordings
        if gain is not None and not (unseen and written.terms):
            told = _told(library, law, _indistinguishable(law, found), proof, gain)
            return _Proven(first, more, law, told)
    return None


def _proved(library: Library, found: Sequence[Law], nulls: Array) -> Iterator[tuple[Law, Proof]]:
    """Yield those of the best few laws that cross-validation confirms, with their proofs."""
    tried = set[str]()
    for each in (law for law in found if law.worth >= PRICE):
        law, gains = simplified(library, each)
        if key(law.terms) in tried:
            continue
        tried.add(key(law.terms))
        proof = Proof(gains, nulls)
        if law.worth >= PRICE and proof.holds and _has_one_size(library, law) and _is_known(library, law):
            yield law, proof
        if len(tried) == TRIED:
            return


def _has_one_size(library: Library, law: Law) -> bool:
    """Whether a law has one size in all recordings and, if it changes readings, from moment to moment."""
    if _spread(library, law) >= DRIFTING:
        return False
    if any(term.port != "colour_reading" for term in law.terms):
        return True
    physics = law.parameters.physics(law.minimum.z)
    return not flickers(library.problem.residuals, library.model.physics, physics)


def _leaves_much(explained: Explanation) -> bool:
    """Whether much of a large error is left beside a law, as beside one that only describes the mean of noise."""
    problem = explained.problem
    left = problem.material.times(explained.left)
    return not problem.on_bench and left >= MUCH and left >= MOST * left_before(problem)


def _leaves_more(after: Explanation, before: Explanation) -> bool:
    """Whether a law takes whole drives farther from what was measured: it fits short windows of them only."""
    material = after.problem.material
    return not after.problem.on_bench and material.times(after.left) > material.times(before.left)


def _is_known(library: Library, law: Law) -> bool:
    """Whether the places a law speaks of are known: the sensor's, the point that pulls, or that a frame turns about."""
    return _beyond_path(library, law) and _from_a_point(library, law) and _turns(library, law)


def _turns(library: Library, law: Law) -> bool:
    """Whether it is known that the camera's frame turns about a point; true of laws at other ports.

    A frame that turns about a point far off drifts: how fast it turns is known no better than where that point is.
    """
    factors = [
        (k, c)
        for k, c in enumerate(law.parameters.constants)
        if law.terms[c.term].port == ABOUT_A_POINT and c.name in linear(law.terms[c.term])
    ]
    if not factors:
        return True
    half, z = _half_widths(library, law), law.minimum.z[law.parameters.model.size :]
    return any(abs(float(c.at(z[k]))) > c.step * half[k] for k, c in factors)


def _half_widths(library: Library, law: Law) -> Array:
    """Return half the 95 % intervals of a law's constants, in coordinates, shape (constants,)."""
    minimum = law.minimum
    return half_widths_of_constants(library.problem, law.parameters, minimum.z, minimum.errors)


def _from_a_point(library: Library, law: Law) -> bool:
    """Whether it is known from which point a law's force comes; true of laws without such a point.

    It must be known to `POINT_KNOWN_M`, or to as near as the robot came: what is felt near a point alone would explain
    whatever happened once, wherever that was.
    """
    toward = [number for number, term in enumerate(law.terms) if term.port == FROM_A_POINT]
    if not toward:
        return True
    constants, minimum = law.parameters.constants, law.minimum
    at = [k for k, c in enumerate(constants) if c.term in toward and c.slot in (AT_X, AT_Y)]
    half = _half_widths(library, law)
    runs, physics = library.problem.residuals.recordings, law.parameters.physics(minimum.z)
    tables = [states(run, physics, law.terms[number]) for number in toward for run in runs]
    nearest = min(float(table["distance"].min()) for table in tables)
    return all(constants[k].step * half[k] < max(POINT_KNOWN_M, nearest) for k in at)


def _beyond_path(library: Library, law: Law) -> bool:
    """Whether laws that move the colour sensor move it by more than its path is known to; true of all others.

    Where they move it most: a late sensor sits elsewhere in turns alone.
    """
    physics = law.parameters.physics(law.minimum.z)
    moved = [
        _along(term, library.problem.residuals, physics) for term in law.terms if term.port in OF_THE_MOUNT
    ]
    return not moved or float(np.quantile(np.hypot.reduce(moved), MOSTLY)) >= PATH_KNOWN[0]


def _along(term: Term, residuals: Residuals, physics: Physics) -> Array:
    """Return a law's value at every row of all recordings, at a port that has no sides, shape (rows,)."""
    tables = [states(run, physics, term) for run in residuals.recordings]
    return np.concatenate([np.broadcast_to(term.value(t), t["time"].shape)[:, 0] for t in tables])


def _spread(library: Library, law: Law) -> float:
    """Return the relative spread over recordings of a law's size: a cause has one size, what imitates one has many."""
    return spread_of_size(library.problem.estimator.blocks.folds, library.model.errors, law.minimum.errors)


def _first_beside(
    refused: Sequence[Step], explained: Explanation, found: Sequence[Law], held: Residuals, nulls: Array
) -> _Proven | None:
    """Return the first law that holds beside refused effects, if those that are still needed then hold, too.

    Each effect is taken back alone, then all: one may have stood in for the law. What explains most is tried first. The
    laws are those found without them; what the residuals then left is more, and so is what chance gives a law.
    """
    tried = []
    for some in (*([step] for step in refused), *([refused] if len(refused) > 1 else ())):
        first = taken_back(explained, some)
        library = Library(first.problem, first.taken)
        laws = sorted((fit(library, law.terms) for law in found), key=lambda law: -law.worth)
        physics = laws[0].parameters.physics(laws[0].minimum.z)
        cost_of_all = explained.problem.cost_of(physics)
        tried.append((cost_of_all + PRICE * len(some), first, library, laws))
    for _, first, library, laws in sorted(tried, key=lambda each: each[0]):
        holds = _first_that_holds(Written(first, (), ()), first, library, laws, held, nulls)
        both = held_up(holds.written.explained, held) if holds else None
        if holds and both:
            return holds._replace(written=replace(holds.written, explained=both))
    return None


def _gain_set_aside(before: Explanation, after: Explanation, held: Residuals) -> float | None:
    """Return what a law gains on recordings set aside; None where they do not ask for it, or part as far with it.

    They must ask for it beside no other change of the robot, or beside those small ones that either asks for: far from
    what was fitted these may do more harm than good. Whole drives, open loop, are judged as the verdict is; they must
    come out much better, unless all of the law is asked for: then something else may send them farther astray.
    Recordings that do not show the law say nothing of it, a gain of 0: those fitted on, left out, have confirmed it.
    """
    if not held.recordings:
        return 0.0
    filmed = [(e, e.problem.with_its_camera(held, e.taken.physics)) for e in (before, after)]
    plain = [seen.errors(e.taken.physics) for e, seen in filmed]
    if np.sum((plain[0] - plain[1]) ** 2) < LEAST_SHOWN:
        return 0.0
    beside = [seen.errors(e.problem.with_small_changes(e.taken)) for e, seen in filmed]
    shares = [(share_asked_for(held.index, *errors), errors) for errors in (plain, beside)]
    share, (without, having) = max(shares, key=lambda each: each[0].margin)
    gain = cost(without) - cost(having)
    if gain <= 0.0 or share.margin <= 0.0:
        return None
    was, now = gaps(*(Contender(e.taken.robot, seen) for e, seen in filmed))
    return gain if now < (1.0 if share.is_whole else HELPS) * was else None


def _indistinguishable(law: Law, found: Sequence[Law]) -> list[Law]:
    """Return the best law at each other port that gains nearly as much: these recordings can not tell them apart."""
    out: dict[str, Law] = {}
    for other in found:
        close = law.gain - other.gain <= max(min(CLOSE * law.gain, PRICE), 0.02 * law.gain)
        if other.terms[0].port != law.terms[0].port and close:
            out.setdefault(other.terms[0].port, other)
    return list(out.values())


def _told(
    library: Library, law: Law, others: Sequence[Law], proof: Proof, held_gain: float
) -> list[Invented]:
    """Return what the verdict says of each term of a law, but for its constants, its size and its words."""
    problem, physics = library.problem, law.parameters.physics(law.minimum.z)
    return [
        Invented(
            term=term,
            alternatives=tuple(each for other in others for each in other.terms),
            parameters={},
            looks_like="",
            holdout_gain=held_gain,
            left_out_gain=proof.gain,
            null_95=proof.null_95,
            p=proof.p,
            spread=_spread(library, law),
            range=ranges(term, problem.residuals.recordings, physics),
            size=Size(),
        )
        for term in law.terms
    ]
