"""A problem defined by a phenotype and a fitness.

Fitness(error)                                        one number, lower is better
Fitness(eaten, maximise=True, target=89)              one number, higher is better; 89 ends the run
Fitness(errors, scores=20, overall=np.mean)           an error for each of 20 cases, for lexicase; their mean ranks
Fitness(error_and_size, scores=2)                     two objectives; the first ranks
Fitness(walk, draws=8)                                a random fitness: walk(program, rng), up to eight draws
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.problem import P, Problem
from gecar.evolution.scores import FIELDS, Floats, Scores
from gecar.evolution.state import Best, Candidate
from gecar.language.mapping import Derivation

SCORED = 1
"""Outcome of a program that has its scores."""


@dataclass(frozen=True)
class Fitness(Generic[P]):
    """The fitness of a program.

    Attributes
    ----------
    function
        Takes the program and returns its score, or several; nan or inf if it fails. None: the caller of `tell` supplies
        scores.
    scores
        Number of scores it returns.
    maximise
        Whether higher is better; for all scores, or for each.
    overall
        Computes one number, lower is better, from the scores (scores,); maximised scores are negated before. It ranks
        individuals in tournaments, as elites and as the best. None: the first score.
    target
        First score of a program that is good enough to end the run; with ``overall``, its value.
    draws
        1; or, for a random fitness, how often a program is scored at most: once in each generation in which it occurs.
        The mean counts. ``function`` then also takes a `numpy.random.Generator`.
    """

    function: Callable[..., Any] | None = None
    scores: int = 1
    maximise: bool | tuple[bool, ...] = False
    overall: Callable[[Floats], float] | None = None
    target: float | None = None
    draws: int = 1

    def __post_init__(self) -> None:
        if self.scores < 1 or self.draws < 1:
            raise expected("fitness", f"scores = {self.scores}, draws = {self.draws}", "at least 1 of each")
        if not isinstance(self.maximise, bool) and len(self.maximise) != self.scores:
            raise expected(
                "fitness", f"maximise for {len(self.maximise)} scores", f"one for each of {self.scores}"
            )

    @cached_property
    def signs(self) -> Floats:
        """1 for each score of which lower is better, else -1 (scores,)."""
        return np.where(np.broadcast_to(self.maximise, self.scores), -1.0, 1.0)

    def of(self, candidate: Candidate[P]) -> Any:
        """Return what the function says of a candidate."""
        if self.function is None:
            raise expected("fitness", "none", "a function; otherwise ask and tell")
        if self.draws == 1:
            return self.function(candidate.program)
        rng = np.random.default_rng((candidate.seed, candidate.generation))
        return self.function(candidate.program, rng)

    def merit(self, values: Floats) -> float:
        """Return what ranks, lower is better; inf where a score is not finite."""
        if not all(map(math.isfinite, values.tolist())):
            return math.inf
        turned = self.signs * values
        return float(turned[0] if self.overall is None else self.overall(turned))


@dataclass(frozen=True)
class FitnessProblem(Problem[P]):
    """Programs of any kind, scored by a function.

    Attributes
    ----------
    phenotype
        What a derivation means; None where it is no program. Derivations of equal text share a score.
    fitness
        How good a program is.
    """

    phenotype: Callable[[Derivation], P | None]
    fitness: Fitness[P]

    @property
    def score_type(self) -> np.dtype[np.void]:
        """``values``: as the function returns them, the mean over ``draws``."""
        return np.dtype([*FIELDS, ("values", "<f8", (self.fitness.scores,)), ("draws", "<i4")])

    @property
    def rescored(self) -> bool:
        """Whether chance has a part."""
        return self.fitness.draws > 1

    @property
    def n_cases(self) -> int:
        """How many scores there are, if several."""
        return self.fitness.scores if self.fitness.scores > 1 else 0

    def read(self, derivation: Derivation) -> P | None:
        """Return the program that was derived; None where the derivation is none."""
        return self.phenotype(derivation)

    def meaning(self, program: P, derivation: Derivation) -> bytes:  # noqa: ARG002
        """Return the text as bytes."""
        return derivation.text.encode()

    def seed(self, program: P, digest: bytes, seed: int) -> int:
        """Return the seed of a program's noise; 0 if its score does not depend on chance."""
        chance = self.fitness.function is None or self.rescored
        return super().seed(program, digest, seed) if chance else 0

    def solved(self, score: np.void) -> bool:
        """Whether a program reaches the target, in all its draws."""
        fitness = self.fitness
        if fitness.target is None or score["draws"] < fitness.draws:
            return False
        target = fitness.target if fitness.overall is not None else fitness.signs[0] * fitness.target
        return bool(score["merit"] <= target)

    def failed(self, n: int) -> Scores:
        """Return the scores of n genomes without a program."""
        scores = super().failed(n)
        scores["values"] = np.nan
        return scores

    def check(self, results: Any, n: int) -> Scores:
        """Check what the fitness returned, or what was told.

        Raises
        ------
        InputError
            If it is not a number for each score of each of the n programs.
        """
        if isinstance(results, np.ndarray) and results.dtype == self.score_type:
            return super().check(results, n)
        wanted = f"{self.fitness.scores} a program" if self.n_cases else "one a program"
        try:
            values = np.asarray(results, float)
        except (TypeError, ValueError):
            raise expected("fitness", f"scores such as {_first(results)}", f"numbers, {wanted}") from None
        if n == 0 == values.size:
            return self.from_values(values.reshape(0, self.fitness.scores))
        if values.shape not in {(n, self.fitness.scores), *([] if self.n_cases else [(n,)])}:
            found = f"scores of shape {values.shape} for {n} programs"
            raise expected("fitness", found, f"numbers, {wanted}")
        return self.from_values(values.reshape(n, self.fitness.scores))

    def from_values(self, values: Floats) -> Scores:
        """Make scores of what the function returned (programs, scores)."""
        scores = np.zeros(len(values), self.score_type)
        scores["values"], scores["draws"], scores["outcome"], scores["steps"] = values, 1, SCORED, 1
        if self.fitness.overall is None:
            whole = np.isfinite(values).all(axis=1)
            scores["merit"] = np.where(whole, self.fitness.signs[0] * values[:, 0], math.inf)
        else:
            scores["merit"] = [self.fitness.merit(row) for row in values]
        scores["share"] = np.isfinite(scores["merit"])
        return scores

    def cases(self, scores: Scores) -> Floats:
        """Return the scores, lower is better, inf where one fails (population, scores)."""
        if not self.n_cases:
            return super().cases(scores)
        turned = self.fitness.signs * scores["values"]
        return np.where(np.isfinite(scores["merit"])[:, None], turned, np.inf)

    def wants_more(self, score: np.void) -> bool:
        """Whether a program met again is to be scored again."""
        return bool(np.isfinite(score["merit"]) and score["draws"] < self.fitness.draws)

    def add(self, known: np.void, told: np.void) -> None:
        """Take the mean of a program's draws; one that fails in a draw fails."""
        n = known["draws"] + told["draws"]
        known["values"] = (known["draws"] * known["values"] + told["draws"] * told["values"]) / n
        known["draws"], known["steps"] = n, told["steps"]
        known["merit"] = self.fitness.merit(known["values"])
        known["share"] = np.isfinite(known["merit"])

    def score(
        self,
        candidates: Sequence[Candidate[P]],
        map: Callable[..., Iterable[Any]] = map,  # noqa: A002
    ) -> Scores:
        """Return the scores of candidates."""
        return self.check(list(map(self.fitness.of, candidates)), len(candidates))

    def afresh(
        self,
        programs: Sequence[Best[P]],
        seed: int,
        first: int,
        map: Callable[..., Iterable[Any]] = map,  # noqa: A002
    ) -> npt.NDArray[np.float64]:
        """Score programs anew, all under the same draws; return what ranks them, lower is better (programs,).

        Parameters
        ----------
        programs
            Which.
        seed
            The run's.
        first
            Number of the first draw; the run used those below.
        map
            As in `gecar.evolution.ask_tell.Evolution.run`.
        """
        draws = range(first, first + self.fitness.draws)
        asked = [Candidate(one.program, seed, generation=draw) for one in programs for draw in draws]
        values = self.score(asked, map)["values"].reshape(len(programs), len(draws), -1)  # type: ignore[arg-type]
        return np.array([self.fitness.merit(mean) for mean in values.mean(axis=1)])


def _first(results: Any) -> str:
    return repr(next(iter(results), results))[:60] if isinstance(results, Iterable) else repr(results)[:60]
