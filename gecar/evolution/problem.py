"""Problems: what is evolved. An evolution asks its problem what a derivation means and how scores compare."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.scores import FIELDS, INVALID, UNSOLVED, Floats, Scores
from gecar.language.mapping import Mapped

P = TypeVar("P")


def seed_of(content: bytes, seed: int) -> int:
    """Return a seed for some content: its own, and always the same within runs of one seed."""
    return int.from_bytes(hashlib.blake2b(content, digest_size=8, key=seed.to_bytes(8)).digest())


class Problem(ABC, Generic[P]):
    """What an evolution must know of its programs; `read` and `meaning` are for subclasses to say."""

    @property
    def score_type(self) -> np.dtype[np.void]:
        """Dtype of scores, with the fields of `gecar.evolution.scores.FIELDS` among its own."""
        return np.dtype(list(FIELDS))

    @property
    def partial_credit(self) -> bool:
        """Whether selection prefers failures with a greater share."""
        return False

    @property
    def rescored(self) -> bool:
        """Whether `wants_more` may hold: a program met again is then scored again, and the best may change."""
        return False

    @property
    def n_cases(self) -> int:
        """How many cases `cases` tells apart, for ``lexicase``; 0 where there are none."""
        return 0

    @abstractmethod
    def read(self, mapped: Mapped, i: int) -> P | None:
        """Return genome i's program; None where its derivation is none."""

    @abstractmethod
    def meaning(self, program: P) -> bytes:
        """Return bytes that are equal for programs that do the same: they share their scores."""

    def seed(self, program: P, seed: int) -> int:
        """Return the seed of a program's noise: its own, and the same whenever a run with this seed meets it."""
        return seed_of(self.meaning(program), seed)

    def failed(self, n: int) -> Scores:
        """Return the scores of n genomes that map to no program."""
        scores = np.zeros(n, self.score_type)
        scores["merit"], scores["share"], scores["outcome"] = UNSOLVED, -1.0, INVALID
        return scores

    def from_merits(self, merits: npt.NDArray[Any]) -> Scores:
        """Make scores of plain numbers, lower is better, `UNSOLVED` for failure."""
        scores = np.zeros(merits.shape, self.score_type)
        scores["merit"] = merits
        scores["share"] = merits < UNSOLVED
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
            raise expected("tell", "a score that is not a number", "numbers, 10000 for a program that fails")
        return given

    def cases(self, scores: Scores) -> Floats:  # noqa: ARG002
        """Return what lexicase selection compares, lower is better (population, cases)."""
        raise expected("cases", "a problem without them", "tournament selection")

    def wants_more(self, score: np.void) -> bool:  # noqa: ARG002
        """Whether a program met again is to be scored again."""
        return False

    def add(self, known: np.void, told: np.void) -> None:
        """Add to what is known of a program what its next scoring told; ``known`` is changed in place."""


class TextProblem(Problem[str]):
    """The words of any grammar, scored by plain numbers."""

    def read(self, mapped: Mapped, i: int) -> str | None:
        """Return genome i's text; None where its derivation does not finish."""
        return mapped.text(i) if mapped.valid[i] else None

    def meaning(self, program: str) -> bytes:
        """Return the text as bytes."""
        return program.encode()
