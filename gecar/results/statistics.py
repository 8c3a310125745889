"""How the runs of two cells differ, as the field reports it: medians with intervals, rank tests, an effect size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from gecar.evolution.scores import UNSOLVED
from gecar.results.cells import Cell

Floats = npt.NDArray[np.float64]


class Contrast(NamedTuple):
    """One cell against another.

    Attributes
    ----------
    p
        Two-sided probability of ranks this far apart if the two were alike: of runs with the same seeds, which begin
        alike, by Wilcoxon's signed ranks (1945; a tie counts half for either), of others by Mann and Whitney's (1947).
    paired
        Whether it was the former.
    a12
        Vargha and Delaney's effect size (2000): how often a run of the one is faster than one of the other, 0..1; equal
        times count half. They call 0.56 small, 0.64 medium, 0.71 large.
    """

    p: float
    a12: float
    paired: bool


def contrast(cell: Cell, other: Cell) -> Contrast:
    """Compare times to GOAL; a run that did not get there is slower than any that did.

    Parameters
    ----------
    cell, other
        Each with at least one run.
    """
    ours, theirs = (np.minimum(c.times_s, UNSOLVED) for c in (cell, other))
    test = stats.mannwhitneyu(ours, theirs, alternative="two-sided")
    a12 = 1.0 - float(test.statistic) / (len(ours) * len(theirs))
    paired = [record["seed"] for record in cell.records] == [record["seed"] for record in other.records]
    if not paired:
        return Contrast(float(test.pvalue), a12, paired=False)
    p = stats.wilcoxon(ours, theirs, zero_method="zsplit").pvalue if (ours != theirs).any() else 1.0
    return Contrast(float(p), a12, paired=True)


def holm(p: Sequence[float]) -> Floats:
    """Return p-values corrected for their number (Holm 1979), shape (tests,).

    SciPy has no such function, and statsmodels, which has, would bring pandas along; a test holds both equal.
    """
    order = np.argsort(p)
    stepped = np.asarray(p, float)[order] * np.arange(len(p), 0, -1)
    corrected = np.empty(len(p))
    corrected[order] = np.minimum(np.maximum.accumulate(stepped), 1.0)
    return corrected


def evaluations_to(cell: Cell, time_s: float) -> Floats:
    """Return how many evaluations each run spent until its best was at most a time [s]; inf if it never was (runs,)."""
    spent = np.full(len(cell.records), np.inf)
    for k, record in enumerate(cell.records):
        reached = np.flatnonzero(np.array(record["history"]["best"]) <= time_s)
        if reached.size:
            spent[k] = record["history"]["evaluations"][reached[0]]
    return spent
