"""A fitness of one's own: any number that a Python function makes of a drive."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gecar.errors import expected
from gecar.evolution.scores import UNSOLVED, Scores
from gecar.search.chance import n_times, pool
from gecar.search.evaluation import Opcodes
from gecar.search.fitness import score_type
from gecar.world.kernel.conditions import select
from gecar.world.perturbation import drawn_conditions
from gecar.world.rollout import Drive, Driver, World

Fitness = Callable[[Drive], float]
"""What a drive is worth: 0 or more, less is better; 10,000 or more, or nan: it failed. The drive holds its trace."""


@dataclass(frozen=True)
class FitnessEvaluator:
    """Scores programs by a function of their drives, one drive at a time; otherwise as `DriveEvaluator`.

    A program that fails in the nominal drive is not driven under drawn conditions.

    Attributes
    ----------
    world
        Robot and course.
    fitness
        What a drive is worth.
    draws, required_share, seed, keep_arrivals
        As in `gecar.search.evaluation.DriveEvaluator`; a drive that fails counts as one that does not arrive.
    """

    world: World
    fitness: Fitness
    draws: int = 1
    required_share: float = 0.95
    seed: int = 0
    keep_arrivals: bool = False

    @property
    def n_arrivals(self) -> int:
        """How many arrival times a score holds."""
        return len(self.world.course.sequence) if self.keep_arrivals else 0

    def __call__(
        self,
        programs: Sequence[Opcodes],
        seeds: Sequence[int],
        to_beat_s: float = math.inf,  # noqa: ARG002  values of one's own may not be raced
        generation: int = 0,
    ) -> Scores:
        """Return a score for each program, dtype `score_type`; times in it are values of the fitness."""
        scores = np.zeros(len(programs), score_type(self.n_arrivals, n_times(self.draws)))
        scores["drawn_s"] = np.nan
        nominal = Driver(self.world)
        drawn = self._drawn(generation)
        for score, opcodes, seed in zip(scores, programs, seeds, strict=True):
            self._score(score, nominal.simulate(opcodes, seed, trace=True))
            score["slowest_s"] = score["fastest_s"] = score["fitness_s"]
            if score["fitness_s"] < UNSOLVED:
                for row, driver in enumerate(drawn):
                    number = generation * self.draws + row + 1
                    drive = driver.simulate(opcodes, seed + number, trace=True)
                    value = self._value(drive)
                    score["drawn_s"][row] = value if value < UNSOLVED else np.inf
                    score["steps"] += drive.steps
            if drawn:
                pool(score, self.required_share)
        return scores

    def _drawn(self, generation: int) -> list[Driver]:
        """Return the generation's conditions, ready to drive under."""
        if self.draws == 1:
            return []
        under = drawn_conditions(self.world, self.draws - 1, (self.seed, generation))
        return [Driver(self.world, select(under, [row])) for row in range(len(under))]

    def _score(self, score: np.void, drive: Drive) -> None:
        reached = int(np.count_nonzero(~np.isnan(drive.arrival_s)))
        score["fitness_s"] = score["merit"] = self._value(drive)
        score["outcome"], score["checkpoints"] = drive.outcome, drive.checkpoints
        score["time_s"], score["steps"] = drive.time_s, drive.steps
        score["arrival_s"] = drive.arrival_s[: self.n_arrivals]
        score["share"] = reached / len(drive.arrival_s)

    def _value(self, drive: Drive) -> float:
        value = float(self.fitness(drive))
        if value < 0.0:
            raise expected("fitness", f"{value:g}", "0 or more; less is better")
        return min(value, UNSOLVED) if not math.isnan(value) else UNSOLVED
