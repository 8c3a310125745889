"""Scores of drives: the fitness of eq. 1, what selection may know beside it, and what a drive was like."""

from __future__ import annotations

import numpy as np


def score_type(n_arrivals: int = 0, n_times: int = 0, n_costs: int = 0) -> np.dtype[np.void]:
    """Return the dtype of scores.

    Parameters
    ----------
    n_arrivals
        How many tiles' arrival times to keep; 0 unless selection wants them.
    n_times
        How many drives under drawn conditions to keep the times of.
    n_costs
        How many costs to keep: 2, or 0 unless there are several goals.

    Returns
    -------
    numpy.dtype
        ``fitness_s``: eq. 1 [s]. ``merit``: what selection goes by; eq. 1, or its quantile under drawn conditions
        (`gecar.search.chance`). ``share``: how far along the course it came, 0..1, for selection only.
        ``outcome``, ``checkpoints``, ``time_s``, ``steps``: of the nominal drive; steps of all. ``arrival_s``: when
        each tile of the course's sequence was reached [s], nan where it was not. ``fastest_s``, ``slowest_s``: the
        least and the most time to GOAL of the nominal robot at the steps it was driven at so far [s]; ``slowest_s`` is
        inf where it missed GOAL at one. ``drawn_s``: times to GOAL under drawn conditions [s], inf where it was missed,
        nan where nothing was driven. ``costs``: electrical energy of the nominal drive [J], and length [instructions].
    """
    return np.dtype(
        [
            ("fitness_s", "<f8"),
            ("merit", "<f8"),
            ("share", "<f8"),
            ("outcome", "<i1"),
            ("checkpoints", "<i4"),
            ("time_s", "<f8"),
            ("steps", "<i8"),
            ("arrival_s", "<f8", (n_arrivals,)),
            ("fastest_s", "<f8"),
            ("slowest_s", "<f8"),
            ("drawn_s", "<f4", (n_times,)),
            ("costs", "<f8", (n_costs,)),
        ]
    )
