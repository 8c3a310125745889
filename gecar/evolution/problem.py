"""Problems: what is evolved. A problem reads programs from derivations and ranks scores.

A phenotype and a fitness define one: `gecar.evolution.fitness`. A problem whose scores have more fields is a subclass
of `Problem`, such as that of the robot in `gecar.search.programs`.
"""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.scores import FIELDS, INVALID, Floats, Scores
from gecar.language.mapping import Derivation

P = TypeVar("P")


def seed_of(content: bytes, seed: int) -> int:
    """Return a seed for some content: its own, and always the same within runs of one seed."""
    return int.from_bytes(hashlib.blake2b(content, digest_size=8, key=seed.to_bytes(8)).digest())


class Problem(ABC, Generic[P]):
    """A problem; subclasses implement `read` and `meaning`."""

    @property
    def score_type(self) -> np.dtype[np.void]:
        """Dtype of scores; it includes the fields of `gecar.evolution.scores.FIELDS`."""
        return np.dtype(list(FIELDS))

    @property
    def failure(self) -> float:
        """Merit of a program that fails; every success has a lower one."""
        return math.inf

    @property
    def partial_credit(self) -> bool:
        """Whether selection prefers failures with a greater share."""
        return False

    @property
    def rescored(self) -> bool:
        """Whether `wants_more` may hold: a program that occurs again is then scored again, and the best may change."""
        return False

    @property
    def n_cases(self) -> int:
        """Number of cases that `cases` returns, for ``lexicase``; 0 without any."""
        return 0

    @abstractmethod
    def read(self, derivation: Derivation) -> P | None:
        """Return the program of a derivation; None if it has none."""

    @abstractmethod
    def meaning(self, program: P, derivation: Derivation) -> bytes:
        """Return bytes that are equal for programs that do the same: they share their scores."""

    def seed(self, program: P, digest: bytes, seed: int) -> int:  # noqa: ARG002
        """Return the seed of a program's noise: its own, and the same whenever a run with this seed meets it.

        Parameters
        ----------
        program
            The program.
        digest
            A hash of its `meaning`.
        seed
            The run's.
        """
        return seed_of(digest, seed)

    def solved(self, score: np.void) -> bool:  # noqa: ARG002
        """Whether a program is so good that the evolution ends."""
        return False

    def failed(self, n: int) -> Scores:
        """Return the scores of n genomes that map to no program."""
        scores = np.zeros(n, self.score_type)
        scores["merit"], scores["share"], scores["outcome"] = self.failure, -1.0, INVALID
        return scores

    def from_merits(self, merits: npt.NDArray[Any]) -> Scores:
        """Make scores of plain numbers, lower is better, `failure` for failure."""
        scores = np.zeros(merits.shape, self.score_type)
        scores["merit"] = merits
        scores["share"] = merits < self.failure
        return scores

    def check(self, results: Any, n: int) -> Scores:
        """Check what an evaluation returned.

        Parameters
        ----------
        results
            Scores (n,), or only their merits as numbers.
        n
            How many were asked for.

        Raises
        ------
        InputError
            If there are more or fewer, or one has no merit.
        """
        given = np.asarray(results)
        if given.dtype != self.score_type:
            if given.dtype.kind not in "iuf" or self.n_cases:
                found = f"results of dtype {given.dtype}"
                raise expected("tell", found, f"numbers, or scores of dtype {self.score_type}")
            given = self.from_merits(given)
        if given.shape != (n,):
            raise expected(
                "tell", f"scores of shape {given.shape}", f"one score for each of the {n} programs asked for"
            )
        if np.isnan(given["merit"]).any():
            raise expected(
                "tell", "a score that is not a number", f"numbers, {self.failure:g} for a program that fails"
            )
        return given

    def cases(self, scores: Scores) -> Floats:
        """Return what lexicase selection compares, lower is better (population, cases)."""
        return np.zeros((len(scores), 0))

    def wants_more(self, score: np.void) -> bool:  # noqa: ARG002
        """Whether a program met again is to be scored again."""
        return False

    def add(self, known: np.void, told: np.void) -> None:
        """Add to what is known of a program what its next scoring told; ``known`` is changed in place."""
