"""Fitness over several robots: a program must bring all of them to GOAL, not only the nominal one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from gecar.search.evaluation import DriveEvaluator, Opcodes
from gecar.search.fitness import UNSOLVED, Scores, score_type
from gecar.world.perturbation import perturbed
from gecar.world.rollout import World

Summary = Literal["mean", "worst"]

LEAST_DRIVES = 3
"""Robots a program drives before it may be given up: one or two say little of ten."""
MARGIN = 1.05
"""How far behind the best so far, in time to GOAL, it is given up: programs that close may still be the better ones."""


@dataclass(frozen=True)
class RobustEvaluator:
    """Scores a program by the nominal robot and ``robots`` perturbed ones.

    Racing: the robots drive one after the other, and the first that misses GOAL ends it with eq. 1's 10^4. A program
    that has fallen `MARGIN` behind the best so far after `LEAST_DRIVES` robots drives no further either: its fitness
    is the mean or the worst of those it drove. So the best is always driven on all robots, and 10 robots cost about
    twice what one does (`benchmarks/robustness.py`).

    Attributes
    ----------
    world
        Nominal robot and course.
    robots
        How many perturbed ones.
    summary
        Fitness is the mean or the worst time to GOAL of all.
    seed
        Where the perturbed ones come from.
    """

    world: World
    robots: int
    summary: Summary = "mean"
    seed: int = 0
    keep_arrivals: bool = False

    def __call__(
        self, programs: Sequence[Opcodes], seeds: Sequence[int], to_beat_s: float = math.inf
    ) -> Scores:
        """Return a score for each program, dtype `score_type`; arrivals and outcome are those of the last drive."""
        scores = np.zeros(len(programs), score_type(self.n_arrivals))
        for i, (opcodes, seed) in enumerate(zip(programs, seeds, strict=True)):
            scores[i] = self._race(opcodes, seed, to_beat_s)
        return scores

    @property
    def n_arrivals(self) -> int:
        """How many arrival times a score holds."""
        return self._drivers[0].n_arrivals

    def _race(self, opcodes: Opcodes, seed: int, to_beat_s: float) -> np.void:
        times: list[float] = []
        steps = 0
        for driver in self._drivers:
            score = driver([opcodes], [seed])[0]
            steps += int(score["steps"])
            if score["fitness_s"] >= UNSOLVED:
                # Further is better: robots at GOAL, then how far the next one came.
                score["share"] = (len(times) + score["share"]) / len(self._drivers)
                break
            times.append(float(score["fitness_s"]))
            score["fitness_s"] = np.mean(times) if self.summary == "mean" else max(times)
            if len(times) >= LEAST_DRIVES and score["fitness_s"] > MARGIN * to_beat_s:
                break
        score["steps"] = steps
        return score

    @cached_property
    def _drivers(self) -> tuple[DriveEvaluator, ...]:
        worlds = (self.world, *perturbed(self.world, self.robots, self.seed))
        return tuple(DriveEvaluator(world, self.keep_arrivals) for world in worlds)

    def __reduce__(self) -> tuple[type[RobustEvaluator], tuple[object, ...]]:
        """Pickle what it is made of, as `DriveEvaluator` does."""
        bare = DriveEvaluator(self.world).__reduce__()[1][0]
        return RobustEvaluator, (bare, self.robots, self.summary, self.seed, self.keep_arrivals)
