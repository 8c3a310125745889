"""Fitness as a chance: the time a program takes to GOAL where it arrives under nearly all conditions it may meet.

Eq. 1 is the time of one drive, in a simulation whose step, start and robot are known to the last digit. A search finds
programs that owe their time to those digits and leave the course elsewhere: the reality gap of Jakobi (1997), and what
Koos, Mouret and Doncieux (IEEE T-EC 17(1), 2013) call transferability. Here a program is driven under conditions drawn
anew in every generation (`gecar.world.perturbation`). What counts is a chance-constrained quantile of eq. 1: the median
time to GOAL if the required share of all its drives so far arrives, and 10^4 if not. The nominal robot is driven at
other steps, too: its longest time counts where that exceeds the median, and more where times differ between steps.
Programs met again in later generations are driven again, so that luck does not last.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.evolution.scores import UNSOLVED
from gecar.parallel.executors import usable_cores
from gecar.search.courses import paces, spread
from gecar.world.kernel.conditions import Conditions, select
from gecar.world.rollout import Fleet, World, goal_times

ROUNDS = 8
"""Sets of drawn conditions after which a program is not driven again."""
FIRST_DRAWS = 3
"""Drawn conditions a program meets before the rest: one that misses GOAL too often drives no further (racing)."""
MARGIN = 1.05
"""How far behind the best so far, in time to GOAL, a program is let go after the first draws."""
STEPS_S = (0.004, 0.002, 0.001, 0.0005, 0.00025)
"""Steps a result is checked at [s]."""
CHOICE_STEPS_S = (
    0.0042, 0.0041, 0.0039, 0.0038, 0.0036, 0.0034, 0.0032, 0.003, 0.0028, 0.0026, 0.0024, 0.0022,
    0.0018, 0.0016, 0.0014, 0.0012, 0.0011, 0.0009, 0.0008, 0.0007, 0.0006, 0.0004, 0.0003,
)  # fmt: skip
"""Steps the programs that a result is chosen from are driven at [s]."""
AS_GOOD = 1.01
"""How much slower a shorter program may be to be chosen before the best: lexicographic parsimony in buckets (Luke and
Panait, GECCO 2002)."""
STEADY = 1.015
"""How much longer the slowest of the nominal robot's drives at other steps may take than the fastest."""
PRICE = 5.0
"""By how many per cent merit is worse for each per cent beyond that."""

Floats = npt.NDArray[np.float64]


def n_times(draws: int) -> int:
    """Return how many times under drawn conditions scores hold, where each generation adds ``draws`` - 1."""
    return ROUNDS * (draws - 1)


def pool(score: np.void, share: float) -> None:
    """Set a score's merit and share from the drives it holds.

    Parameters
    ----------
    score
        A row of dtype `gecar.search.fitness.score_type`; ``fitness_s`` and ``drawn_s`` are set, and ``share`` is how
        far the nominal drive came where it missed GOAL.
    share
        Required share of arrivals.
    """
    if score["fitness_s"] >= UNSOLVED:
        score["merit"], score["share"] = UNSOLVED, 0.5 * score["share"]
        return
    drawn = score["drawn_s"]
    times = np.concatenate([[score["fitness_s"]], drawn[~np.isnan(drawn)]])
    arrived = np.isfinite(times)
    enough = arrived.mean() >= share and score["slowest_s"] < np.inf
    score["merit"] = UNSOLVED
    if enough:
        score["merit"] = max(np.median(times[arrived]), score["slowest_s"]) * _unsteady(score)
    score["share"] = 1.0 if enough else 0.5 + 0.5 * arrived.sum() / max(len(drawn) / ROUNDS + 1, len(times))


def _unsteady(score: np.void) -> float:
    """Return the factor by which a program's merit is worse because its time depends on the simulation's step."""
    return 1.0 + PRICE * max(score["slowest_s"] / score["fastest_s"] - STEADY, 0.0)


def add_drives(score: np.void, more: np.void, share: float) -> None:
    """Add the drives of a program met again to those it had; a full score stays as it is."""
    old, new = score["drawn_s"], more["drawn_s"]
    free = np.flatnonzero(np.isnan(old))
    fresh = new[~np.isnan(new)][: len(free)]
    old[free[: len(fresh)]] = fresh
    score["steps"] = more["steps"]
    score["slowest_s"] = max(score["slowest_s"], more["slowest_s"])
    score["fastest_s"] = min(score["fastest_s"], more["fastest_s"])
    pool(score, share)


def wants_more(score: np.void) -> bool:
    """Whether a program met again is to be driven again: it has arrived often enough so far, and has room."""
    return bool(score["merit"] < UNSOLVED and np.isnan(score["drawn_s"]).any())


class Arrivals(NamedTuple):
    """How a program fares under drawn conditions: times to GOAL [s], inf where it missed GOAL, shape (draws,)."""

    times_s: Floats

    @property
    def share(self) -> float:
        """Share of drives at GOAL."""
        return float(np.isfinite(self.times_s).mean())

    def quantile_s(self, q: float) -> float | None:
        """Return a quantile of the times of those at GOAL [s]; None where none arrived."""
        arrived = self.times_s[np.isfinite(self.times_s)]
        return float(np.quantile(arrived, q)) if len(arrived) else None


def arrivals(
    world: World,
    programs: Sequence[npt.NDArray[np.int32]],
    draws: int,
    seed: int | tuple[int, ...],
    others: Sequence[World] = (),
) -> list[Arrivals]:
    """Drive programs under the same fresh conditions.

    Parameters
    ----------
    world
        What the simulation assumes.
    programs
        Opcodes.
    draws
        How many conditions.
    seed
        Where they come from.
    others
        Further courses that the conditions are spread over; see `gecar.search.courses`.
    """
    worlds = world, *others
    under, course = spread(worlds, draws, seed)
    times = np.empty((len(programs), draws))
    for here, (each, pace) in enumerate(zip(worlds, paces(worlds), strict=True)):
        rows = np.flatnonzero(course == here)
        times[:, rows] = pace * times_to_goal(each, programs, select(under, rows.tolist()), rows + 1)
    return [Arrivals(row) for row in times]


def times_to_goal(
    world: World, programs: Sequence[npt.NDArray[np.int32]], under: Conditions, streams: npt.ArrayLike
) -> Floats:
    """Drive every program under all conditions; return times to GOAL [s], inf where it is missed.

    Parameters
    ----------
    world
        Robot and course.
    programs
        Opcodes.
    under
        n conditions.
    streams
        Seed of the noise under each, shape (n,), or one for all.

    Returns
    -------
    numpy.ndarray
        Shape (programs, n).
    """
    shape = len(programs), len(under)
    pairs = np.stack(np.divmod(np.arange(len(programs) * len(under)), len(under)), axis=1)
    seeds = np.broadcast_to(streams, shape).ravel()

    def driven(part: npt.NDArray[np.intp]) -> npt.NDArray[np.void]:
        return Fleet(world).drive(programs, under, pairs[part], seeds[part])[0]

    # Kernels let other threads run; pymunk, in Python, does not.
    threads = 1 if world.uses_pymunk else usable_cores()
    with ThreadPoolExecutor(threads) as pool:
        summary = np.concatenate(list(pool.map(driven, np.array_split(np.arange(len(pairs)), threads))))
    return goal_times(summary).reshape(shape)


def drives_at_steps(
    world: World, programs: Sequence[npt.NDArray[np.int32]], steps_s: Sequence[float], seed: int = 0
) -> Floats:
    """Return the nominal robot's times to GOAL at other steps [s], inf where it misses it, shape (programs, steps)."""
    return times_to_goal(world, programs, world.at_steps(steps_s), seed)


def times_at_steps(world: World, opcodes: npt.NDArray[np.int32], seed: int = 0) -> dict[str, float | None]:
    """Return a program's time to GOAL on the nominal robot at each of `STEPS_S` [s]; None where it misses GOAL."""
    (times,) = drives_at_steps(world, [opcodes], STEPS_S, seed)
    return {
        f"{step:g}": float(time) if np.isfinite(time) else None
        for step, time in zip(STEPS_S, times, strict=True)
    }


def merit_of(times: Arrivals, share: float) -> float:
    """Return the median time of what arrives often enough, else 10^4 and how much is missing, for comparisons."""
    median = times.quantile_s(0.5)
    return median if median is not None and times.share >= share else UNSOLVED + 1.0 - times.share


def chosen(
    world: World,
    programs: Sequence[npt.NDArray[np.int32]],
    share: float,
    seed: int,
    others: Sequence[World] = (),
) -> int:
    """Return which of a search's best programs is best on fresh draws: all on 64, the better quarter on 448 more.

    What looks best in a search is partly lucky; these draws are none of the search's, and the result is measured on
    others again. Programs whose nominal drive takes as long at other steps (`CHOICE_STEPS_S`, none of `STEPS_S` but the
    world's own) come before those that owe their time to one step; of those as good, the shortest is taken.
    """
    at_steps = drives_at_steps(world, programs, (world.step_s, *CHOICE_STEPS_S))
    slowest = at_steps.max(axis=1)
    unsteady = slowest > STEADY * at_steps.min(axis=1)
    first = arrivals(world, programs, 64, (seed, _CHOICE, 0), others)
    order = np.lexsort((np.maximum([merit_of(times, share) for times in first], slowest), unsteady))
    left = order[: max(1, (len(order) + 3) // 4)].tolist()
    second = arrivals(world, [programs[k] for k in left], 448, (seed, _CHOICE, 1), others)
    both = [
        Arrivals(np.concatenate([first[k].times_s, more.times_s]))
        for k, more in zip(left, second, strict=True)
    ]
    merits, last = np.maximum([merit_of(times, share) for times in both], slowest[left]), unsteady[left]
    best = np.lexsort((merits, last))[0]
    as_good = np.flatnonzero((merits <= AS_GOOD * merits[best]) & (last == last[best]))
    return int(left[min(as_good, key=lambda k: (len(programs[left[k]]), merits[k]))])


_CHOICE, REPORT = 1_000_003, 1_000_033
"""Streams of draws beside those of the generations: for the choice at the end, and for what is reported."""
REPORTED_DRAWS = 200
