"""Scores: what an evolution knows of a program's worth; problems add fields of their own."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

UNSOLVED = 1e4
"""Merit of a robot program that fails (eq. 1 of the paper); what succeeds is below."""
INVALID = -1
"""Outcome of a genome that maps to no program."""
FIELDS = (("merit", "<f8"), ("share", "<f8"), ("outcome", "<i1"), ("steps", "<i8"))
"""``merit``: what selection goes by, lower is better. ``share``: how near a failure came to success, 0..1, higher is
better; among equal merits it decides, too. ``outcome``: `INVALID`, or the problem's own code. ``steps``: what scoring
cost, in the problem's own unit."""

Scores = npt.NDArray[np.void]
Floats = npt.NDArray[np.float64]


def merits(scores: Scores, partial_credit: bool, failure: float = UNSOLVED) -> Floats:
    """Return what tournaments and elites go by; lower is better.

    Parameters
    ----------
    scores
        The population's (population,).
    partial_credit
        Whether the cliff at failure slopes: failures then lie between it and 2 above, those with a greater share below
        the others.
    failure
        Merit of a program that fails.
    """
    plain: Floats = scores["merit"]
    return np.where(plain < failure, plain, failure + 1.0 - scores["share"]) if partial_credit else plain
