"""Evaluation: programs in, scores out, in whatever process or on whatever machine it is wanted."""

from __future__ import annotations

import hashlib
import math
import pickle
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.search.fitness import UNSOLVED, Scores, score_type
from gecar.world.rollout import Drive, Driver, Outcome, World

Opcodes = npt.NDArray[np.int32]
Evaluator = Callable[[Sequence[Opcodes], Sequence[int], float], Scores]
"""What scores programs: opcodes, a seed of the noise for each, and the best fitness so far [s]; programs far behind
that may be scored roughly. It must pickle, and always give a program the same score with the same seed and the same
fitness to beat, whichever other programs stand beside it."""


@dataclass(frozen=True)
class DriveEvaluator:
    """Scores a program by one drive over a course, eq. 1.

    Attributes
    ----------
    world
        Robot and course.
    keep_arrivals
        Whether scores hold the arrival times at all checkpoints.
    """

    world: World
    keep_arrivals: bool = False

    def __call__(
        self,
        programs: Sequence[Opcodes],
        seeds: Sequence[int],
        to_beat_s: float = math.inf,  # noqa: ARG002  one drive is never broken off
    ) -> Scores:
        """Return a score for each program, dtype `score_type`."""
        scores = np.zeros(len(programs), score_type(self.n_arrivals))
        for i, (opcodes, seed) in enumerate(zip(programs, seeds, strict=True)):
            drive = self._driver.simulate(opcodes, seed)
            solved = drive.outcome == Outcome.GOAL
            fitness = drive.time_s if solved else UNSOLVED
            arrival = drive.arrival_s if self.keep_arrivals else ()
            scores[i] = (
                fitness, self._share(drive), drive.outcome, drive.checkpoints, drive.time_s, drive.steps, arrival,
            )  # fmt: skip
        return scores

    @property
    def n_arrivals(self) -> int:
        """How many arrival times a score holds."""
        return len(self.world.course.sequence) if self.keep_arrivals else 0

    @cached_property
    def _driver(self) -> Driver:
        return Driver(self.world)

    def _share(self, drive: Drive) -> float:
        """How far along the course a drive came: tiles in order, and among equals who was there sooner, 0..1."""
        passed = int(np.count_nonzero(~np.isnan(drive.arrival_s)))
        if passed == 0:
            return 0.0
        sooner = 1.0 - float(drive.arrival_s[passed - 1]) / self.world.time_limit_s
        return (passed - 1 + max(sooner, 0.0)) / len(drive.arrival_s)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle without what can be made again: a course without its raster is 2 kB instead of 3 MB."""
        bare = replace(self.world, course=replace(self.world.course))
        return DriveEvaluator, (bare, self.keep_arrivals)


class Recipe(NamedTuple):
    """An evaluator as it travels to workers, and the name it is known by there."""

    name: str
    pickled: bytes


def recipe(evaluator: Evaluator) -> Recipe:
    """Pack an evaluator; this only ever goes to workers of the same run, never to a file."""
    pickled = pickle.dumps(evaluator)
    return Recipe(hashlib.sha256(pickled).hexdigest(), pickled)


_unpacked = threading.local()
_MOST_UNPACKED = 4


def unpack(packed: Recipe) -> Evaluator:
    """Return the evaluator; each thread of each worker unpacks it once (an evaluator is not for several threads)."""
    known: dict[str, Evaluator] = _unpacked.__dict__
    if packed.name not in known:
        while len(known) >= _MOST_UNPACKED:
            del known[next(iter(known))]
        known[packed.name] = pickle.loads(packed.pickled)  # noqa: S301  packed by this run itself
    return known[packed.name]


class Scored(NamedTuple):
    """What a batch gives back: scores, and how long they took [s]."""

    scores: Scores
    seconds: float


class Batch(NamedTuple):
    """Programs to score together, as an `Evaluator` takes them."""

    programs: Sequence[Opcodes]
    seeds: Sequence[int]
    to_beat_s: float = math.inf


def score_batch(packed: Recipe, batch: Batch) -> Scored:
    """Score a batch; this is what executors run."""
    began = time.perf_counter()
    scores = unpack(packed)(*batch)
    return Scored(scores, time.perf_counter() - began)
