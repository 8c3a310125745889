"""Scores of programs already known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.evolution.phenotypes import DIGEST_BYTES
from gecar.evolution.scores import Scores

CAPACITY = 16_384
"""More than a run of Table 4 has evaluations; beyond it the oldest is forgotten, so that long runs stay small."""


class ScoreCache:
    """Scores by the digest of the program, the latest `CAPACITY` of them.

    Parameters
    ----------
    score_type
        Dtype of scores.
    """

    def __init__(self, score_type: np.dtype[np.void]) -> None:
        self._scores = np.zeros(CAPACITY, score_type)
        self._digests: list[bytes] = []
        self._rows: dict[bytes, int] = {}
        self._next = 0

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, digest: bytes) -> bool:
        return digest in self._rows

    def look_up(self, digests: Sequence[bytes]) -> Scores:
        """Return the scores of programs that are known (digests,)."""
        return self._scores[[self._rows[digest] for digest in digests]]

    def add(self, digests: Sequence[bytes], scores: Scores) -> None:
        """Keep the scores of programs; of those known already, the new ones."""
        self._scores[[self._row(digest) for digest in digests]] = scores

    def _row(self, digest: bytes) -> int:
        """Return the row of a program's score, a new one or the oldest's if it has none."""
        if digest in self._rows:
            return self._rows[digest]
        row = self._next
        if len(self._digests) < CAPACITY:
            self._digests.append(digest)
        else:
            del self._rows[self._digests[row]]
            self._digests[row] = digest
        self._rows[digest] = row
        self._next = (row + 1) % CAPACITY
        return row

    def dump(self) -> tuple[npt.NDArray[np.uint8], Scores]:
        """Return digests (n, 16) and scores (n,), the oldest first."""
        order = np.roll(np.arange(len(self._digests)), -self._next if len(self._digests) == CAPACITY else 0)
        raw = np.frombuffer(b"".join(self._digests), np.uint8).reshape(-1, DIGEST_BYTES)
        return raw[order], self._scores[order]
