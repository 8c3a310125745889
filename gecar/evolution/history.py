"""The record of a run, generation by generation, and how fast it goes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, get_type_hints

import numpy as np

from gecar.evolution.scores import INVALID, UNSOLVED, Scores
from gecar.language.mapping import Mapped


class Generation(NamedTuple):
    """What a generation came to.

    Attributes
    ----------
    generation
        0 is the first population.
    best, mean
        Merit over the population, lower is better, see `gecar.evolution.scores.FIELDS`; a program that fails has the
        problem's `failure`, inf unless it says otherwise. Of robot programs it is fitness of eq. 1 [s], 10^4 for
        failure, or with drawn conditions the median time to GOAL of what arrives often enough.
    valid, distinct
        Shares of the population that map to a program, and of different programs in it.
    evaluations
        Individuals scored since the run began, the first population included.
    wall_s
        Time since the run began, interruptions apart [s].
    solved
        Share of the population that does not fail.
    mean_solved
        Their mean merit; nan where there is none.
    simulated
        Programs scored since the run began: evaluations that no earlier one answered.
    steps
        What scoring cost since the run began; of robot programs, simulation steps.
    size, depth
        Mean over the population of the choices a derivation takes, and of its tree's depth in nonterminals; nan without
        any derivation.
    entropy
        Shannon entropy of the population's programs [bits]: 0 where all are the same, log2 of the population where all
        differ.
    """

    generation: int
    best: float
    mean: float
    valid: float
    distinct: float
    evaluations: int
    wall_s: float
    solved: float
    mean_solved: float
    simulated: int
    steps: int
    size: float = math.nan
    depth: float = math.nan
    entropy: float = math.nan


HISTORY = np.dtype(
    [(name, "<i8" if kind is int else "<f8") for name, kind in get_type_hints(Generation).items()]
)
"""A generation's dtype in checkpoints."""


@dataclass(frozen=True)
class Totals:
    """What has been spent so far."""

    evaluations: int = 0
    simulated: int = 0
    steps: int = 0


def summary(
    generation: int,
    scores: Scores,
    programs: Sequence[bytes],
    mapped: Mapped,
    totals: Totals,
    wall_s: float,
    failure: float = UNSOLVED,
) -> Generation:
    """Sum up a generation.

    Parameters
    ----------
    generation
        Its number.
    scores
        The population's.
    programs
        Digests of its programs, those that are the same alike.
    mapped
        Its derivations.
    totals
        Spent so far.
    wall_s
        Time since the run began [s].
    failure
        Merit of a program that fails.
    """
    fitness = scores["merit"]
    solved = fitness < failure
    return Generation(
        generation=generation,
        best=float(fitness.min()),
        mean=float(fitness.mean()),
        valid=float(np.mean(scores["outcome"] != INVALID)),
        distinct=len(set(programs)) / len(scores),
        evaluations=totals.evaluations,
        wall_s=wall_s,
        solved=float(solved.mean()),
        mean_solved=float(fitness[solved].mean()) if solved.any() else float("nan"),
        simulated=totals.simulated,
        steps=totals.steps,
        size=float(mapped.used[mapped.valid].mean()) if mapped.valid.any() else math.nan,
        depth=float(mapped.depths[mapped.valid].mean()) if mapped.valid.any() else math.nan,
        entropy=_entropy(programs),
    )


def _entropy(programs: Sequence[bytes]) -> float:
    """Return the entropy of a distribution of programs [bits]; nan for none."""
    shares = np.array([*Counter(programs).values()]) / max(len(programs), 1)
    return float(-(shares * np.log2(shares)).sum()) + 0.0 if programs else math.nan


WITHOUT_SUCCESS = 4
"""How much longer a population without success may take to improve. Of 40 on the paper's course 39 had their first
success within 36 generations, the other one never."""


class Patience:
    """Decides when a population is stagnant: after a number of generations without a better program.

    Parameters
    ----------
    generations
        That number, once a program has succeeded; `WITHOUT_SUCCESS` times as many before. 0: no limit.
    failure
        Merit of a program that fails.
    """

    def __init__(self, generations: int, failure: float = UNSOLVED) -> None:
        self._limit, self._failure = generations, failure
        self._best, self._idle = failure, 0
        self.restarts = 0

    @property
    def at_its_end(self) -> bool:
        """Whether the population is stagnant, and is to be replaced."""
        limit = self._limit if self._best < self._failure else WITHOUT_SUCCESS * self._limit
        return 0 < limit <= self._idle

    def see(self, best: float) -> None:
        """Add the best merit of a generation; after a restart, of the new population."""
        if self.at_its_end:
            self._best, self._idle = self._failure, 0
            self.restarts += 1
        if best < self._best:
            self._best, self._idle = best, 0
        else:
            self._idle += 1


@dataclass(frozen=True)
class Pace:
    """How fast a run goes.

    Attributes
    ----------
    evaluations_per_s
        Individuals scored per second in the latest generations.
    left_s
        Time to the last generation at that rate [s].
    """

    evaluations_per_s: float
    left_s: float


_LATELY = 10


def pace(history: Sequence[Generation], generations: int) -> Pace:
    """Judge the pace by the latest generations.

    Parameters
    ----------
    history
        All so far, at least one.
    generations
        The number of the last.
    """
    last = history[-1]
    first = history[-1 - _LATELY] if len(history) > _LATELY else Generation(-1, *[0] * 10)
    seconds = max(last.wall_s - first.wall_s, 1e-9)
    each_s = seconds / (last.generation - first.generation)
    return Pace((last.evaluations - first.evaluations) / seconds, each_s * (generations - last.generation))
