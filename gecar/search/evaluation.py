"""Evaluation: programs in, scores out, in whatever process or on whatever machine it is wanted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.evolution.scores import UNSOLVED, Scores
from gecar.parallel.pickled import Pickled, unpickled
from gecar.search.chance import FIRST_DRAWS, MARGIN, n_times, pool
from gecar.search.courses import paces, spread
from gecar.search.fitness import score_type
from gecar.world.kernel.conditions import Conditions, impatient
from gecar.world.perturbation import drawn_steps_s
from gecar.world.rollout import Driver, Fleet, Outcome, World, goal_times

Opcodes = npt.NDArray[np.int32]
Evaluator = Callable[[Sequence[Opcodes], Sequence[int], float, int], Scores]
"""What scores programs: opcodes, a seed of the noise for each, the best merit so far [s] (programs far behind that may
be scored roughly), and the generation, whose conditions are drawn for it. It must pickle, and always give a program the
same score with the same seed, merit to beat and generation, whichever other programs stand beside it."""


@dataclass(frozen=True)
class DriveEvaluator:
    """Scores programs by driving them: once, eq. 1; and under drawn conditions, if there are to be any.

    A drive that reaches no further tile of the course's sequence for a third of the time limit is given up: it would
    miss GOAL in nearly every case, and most of the time of a search's failures is spent so.

    Racing: what misses GOAL in the nominal drive ends there. The others meet `FIRST_DRAWS` drawn conditions; what still
    may arrive often enough, and is not `MARGIN` behind the best, meets the rest. So a bad program costs one drive.

    Attributes
    ----------
    world
        Robot and course.
    keep_arrivals
        Whether scores hold the arrival times at all checkpoints.
    draws
        Drives a program is judged by, the nominal one included.
    required_share
        Share of arrivals it needs.
    seed
        Where the conditions come from.
    others
        The same robot on further courses: drawn conditions are spread over all (`gecar.search.courses`).
    goals
        What programs are compared by, if by several (`gecar.search.goals`): then slow programs race on.
    """

    world: World
    keep_arrivals: bool = False
    draws: int = 1
    required_share: float = 0.95
    seed: int = 0
    others: tuple[World, ...] = ()
    goals: tuple[str, ...] = ()

    def __call__(
        self,
        programs: Sequence[Opcodes],
        seeds: Sequence[int],
        to_beat_s: float = math.inf,
        generation: int = 0,
    ) -> Scores:
        """Return a score for each program, dtype `score_type`."""
        scores = self._nominal(programs, seeds)
        if self.draws > 1:
            self._race(scores, programs, seeds, math.inf if self.goals else to_beat_s, generation)
            for score in scores:
                pool(score, self.required_share)
        if self.goals:
            self._count_costs(scores, programs, seeds)
        return scores

    @property
    def n_arrivals(self) -> int:
        """How many arrival times a score holds."""
        return len(self.world.course.sequence) if self.keep_arrivals else 0

    def _nominal(self, programs: Sequence[Opcodes], seeds: Sequence[int]) -> Scores:
        kind = score_type(self.n_arrivals, n_times(self.draws), 2 if self.goals else 0)
        scores = np.zeros(len(programs), kind)
        pairs = np.stack([np.arange(len(programs)), np.zeros(len(programs))], axis=1)
        summary, arrival = self._fleet_on(0).drive(programs, self._world_says, pairs, seeds)
        for field in ("outcome", "checkpoints", "time_s", "steps"):
            scores[field] = summary[field]
        solved = summary["outcome"] == Outcome.GOAL
        scores["fitness_s"] = scores["merit"] = np.where(solved, summary["time_s"], UNSOLVED)
        scores["share"] = self._shares(arrival)
        scores["arrival_s"] = arrival[:, : self.n_arrivals]
        scores["slowest_s"] = scores["fastest_s"] = scores["fitness_s"]
        scores["drawn_s"] = np.nan
        return scores

    def _race(
        self,
        scores: Scores,
        programs: Sequence[Opcodes],
        seeds: Sequence[int],
        to_beat_s: float,
        generation: int,
    ) -> None:
        """Drive what may still be good under the generation's conditions, in two stages."""
        drawn, course = spread(self._worlds, self.draws - 1, (self.seed, generation))
        under = impatient(drawn)
        first = min(FIRST_DRAWS, self.draws - 1)
        allowed = math.floor((1.0 - self.required_share) * self.draws + 1e-9)
        for begin, end in ((0, first), (first, self.draws - 1)):
            times = scores["drawn_s"][:, :begin]
            missed = np.isinf(times).sum(axis=1)
            so_far = np.median(np.column_stack([scores["fitness_s"], times]), axis=1)
            behind = so_far > MARGIN * to_beat_s
            left = np.flatnonzero(
                (scores["fitness_s"] < UNSOLVED) & (missed <= allowed) & ~(behind & (begin > 0))
            )
            if len(left) == 0:
                return
            if end == begin:
                break
            k, row = _pairs(left, np.arange(begin, end))
            drive_number = generation * self.draws + row + 1
            streams = np.array(seeds, np.uint64)[k] + drive_number.astype(np.uint64) * _NEXT_STREAM
            for here in np.unique(course[row]):
                mine = course[row] == here
                times = self._driven(scores, programs, k[mine], under, row[mine], streams[mine], here)
                scores["drawn_s"][k[mine], row[mine]] = times * self._paces[here]
        missed = np.isinf(scores["drawn_s"]).sum(axis=1)
        self._at_other_steps(scores, left[missed[left] <= allowed], programs, seeds, generation)

    def _at_other_steps(
        self,
        scores: Scores,
        left: npt.NDArray[np.intp],
        programs: Sequence[Opcodes],
        seeds: Sequence[int],
        generation: int,
    ) -> None:
        """Drive the nominal robot at the generation's steps by what came through the race."""
        under = impatient(self.world.at_steps(drawn_steps_s((self.seed, generation))))
        k, row = _pairs(left, np.arange(len(under)))
        times = self._driven(scores, programs, k, under, row, np.array(seeds, np.uint64)[k])
        np.maximum.at(scores["slowest_s"], k, times)
        np.minimum.at(scores["fastest_s"], k, times)

    def _driven(
        self,
        scores: Scores,
        programs: Sequence[Opcodes],
        k: npt.NDArray[np.intp],
        under: Conditions,
        row: npt.NDArray[np.intp],
        streams: npt.NDArray[np.uint64],
        course: int = 0,
    ) -> npt.NDArray[np.float64]:
        """Drive programs ``k`` under conditions ``row``; return times to GOAL [s]; the scores count the steps."""
        summary, _ = self._fleet_on(course).drive(programs, under, np.stack([k, row], axis=1), streams)
        np.add.at(scores["steps"], k, summary["steps"])
        return goal_times(summary)

    def _count_costs(self, scores: Scores, programs: Sequence[Opcodes], seeds: Sequence[int]) -> None:
        """Set energy and length; the energy by driving once more, where it is a goal and the program does not fail."""
        for score, opcodes, seed in zip(scores, programs, seeds, strict=True):
            driven = "energy" in self.goals and score["merit"] < UNSOLVED
            energy_j = self._driver.simulate(opcodes, seed).energy_j if driven else np.nan
            score["costs"] = energy_j, len(opcodes)

    @cached_property
    def _driver(self) -> Driver:
        return Driver(self.world)

    def _shares(self, arrival: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """How far along the course drives came: tiles in order, and among equals who was there sooner, 0..1."""
        reached = ~np.isnan(arrival)
        passed = reached.sum(axis=1)
        latest = np.where(reached, arrival, 0.0).max(axis=1, initial=0.0)
        sooner = np.maximum(1.0 - latest / self.world.time_limit_s, 0.0)
        shares: npt.NDArray[np.float64] = np.where(passed > 0, (passed - 1 + sooner) / arrival.shape[1], 0.0)
        return shares

    @cached_property
    def _worlds(self) -> tuple[World, ...]:
        return self.world, *self.others

    @cached_property
    def _paces(self) -> npt.NDArray[np.float64]:
        return paces(self._worlds)

    @cached_property
    def _fleets(self) -> dict[int, Fleet]:
        return {}

    def _fleet_on(self, course: int) -> Fleet:
        """Return a course's arrays, made when it is first driven on."""
        if course not in self._fleets:
            self._fleets[course] = Fleet(self._worlds[course])
        return self._fleets[course]

    @cached_property
    def _world_says(self) -> Conditions:
        return impatient(self.world.nominal)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle without what can be made again: a course without its raster is 2 kB instead of 3 MB."""
        bare, *others = (replace(world, course=replace(world.course)) for world in self._worlds)
        return DriveEvaluator, (
            bare, self.keep_arrivals, self.draws, self.required_share, self.seed, tuple(others), self.goals,
        )  # fmt: skip


def _pairs(
    k: npt.NDArray[np.intp], row: npt.NDArray[np.intp]
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return every program with every condition, shapes (n,)."""
    return np.repeat(k, len(row)), np.tile(row, len(k))


_NEXT_STREAM = np.uint64(0x9E3779B97F4A7C15)


class Scored(NamedTuple):
    """What a batch gives back: scores, and how long they took [s]."""

    scores: Scores
    seconds: float


class Batch(NamedTuple):
    """Programs to score together, as an `Evaluator` takes them."""

    programs: Sequence[Opcodes]
    seeds: Sequence[int]
    to_beat_s: float = math.inf
    generation: int = 0


def score_batch(packed: Pickled, batch: Batch) -> Scored:
    """Score a batch; this is what executors run."""
    began = time.perf_counter()
    evaluator: Evaluator = unpickled(packed)
    scores = evaluator(*batch)
    return Scored(scores, time.perf_counter() - began)
