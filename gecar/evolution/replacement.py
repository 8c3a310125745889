"""Replacement: who lives on when the children have their scores.

Without any, children take their parents' place (generational). Otherwise parents and children compete for the places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gecar.evolution.selection import Population

Int32s = npt.NDArray[np.int32]


class Replacement(Protocol):
    """Chooses who lives on."""

    def __call__(self, population: Population, n: int) -> Int32s:
        """Return the places of n survivors (n,) among parents and children."""


@dataclass(frozen=True)
class ReplaceWorst:
    """The worst make room: with one or two children at a time, a steady state (Whitley, ICGA 1989)."""

    def __call__(self, population: Population, n: int) -> Int32s:
        """Return the n best by merit, parents before children that are as good (n,)."""
        return np.sort(np.argsort(population.merits, kind="stable")[:n]).astype(np.int32)
