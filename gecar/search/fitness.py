"""Scores: the fitness of eq. 1, what selection may know beside it, and what a drive was like."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.errors import expected

UNSOLVED = 1e4
"""Fitness of what does not reach GOAL through all checkpoints in time, eq. 1."""
INVALID = -1
"""Outcome of a genome that maps to no program; the others are `gecar.world.rollout.Outcome`."""

Scores = npt.NDArray[np.void]
Floats = npt.NDArray[np.float64]


def score_type(n_arrivals: int = 0, n_times: int = 0) -> np.dtype[np.void]:
    """Return the dtype of scores.

    Parameters
    ----------
    n_arrivals
        How many tiles' arrival times to keep; 0 unless selection wants them.
    n_times
        How many drives under drawn conditions to keep the times of.

    Returns
    -------
    numpy.dtype
        ``fitness_s``: eq. 1 [s]. ``merit_s``: what selection goes by; eq. 1, or its quantile under drawn conditions
        (`gecar.search.chance`). ``share``: how far along the course it came, 0..1, for selection only.
        ``outcome``, ``checkpoints``, ``time_s``, ``steps``: of the nominal drive; steps of all. ``arrival_s``: when
        each tile of the course's sequence was reached [s], nan where it was not. ``drawn_s``: times to GOAL under drawn
        conditions [s], inf where it was missed, nan where nothing was driven.
    """
    return np.dtype(
        [
            ("fitness_s", "<f8"),
            ("merit_s", "<f8"),
            ("share", "<f8"),
            ("outcome", "<i1"),
            ("checkpoints", "<i4"),
            ("time_s", "<f8"),
            ("steps", "<i8"),
            ("arrival_s", "<f8", (n_arrivals,)),
            ("drawn_s", "<f4", (n_times,)),
        ]
    )


def invalid_scores(n: int, n_arrivals: int = 0, n_times: int = 0) -> Scores:
    """Return the scores of n genomes that map to no program."""
    scores = np.zeros(n, score_type(n_arrivals, n_times))
    scores["fitness_s"] = scores["merit_s"] = UNSOLVED
    scores["share"] = -1.0
    scores["outcome"] = INVALID
    scores["arrival_s"] = scores["drawn_s"] = np.nan
    return scores


def as_scores(results: Any, n: int, n_arrivals: int, n_times: int = 0) -> Scores:
    """Check what an evaluation returned.

    Parameters
    ----------
    results
        Scores (n,), or only their fitness [s] as numbers.
    n
        How many were asked for.
    n_arrivals, n_times
        As in `score_type`.

    Raises
    ------
    InputError
        If there are more or fewer, or one has no fitness.
    """
    wanted = score_type(n_arrivals, n_times)
    given = np.asarray(results)
    if given.dtype != wanted:
        given = _from_fitness(given, wanted)
    if given.shape != (n,):
        raise expected(
            "tell", f"scores of shape {given.shape}", f"one score for each of the {n} programs asked for"
        )
    if np.isnan(given["fitness_s"]).any():
        raise expected("tell", "a fitness that is not a number", "seconds, or 10000 for a program that fails")
    return given


def _from_fitness(given: npt.NDArray[Any], wanted: np.dtype[np.void]) -> Scores:
    """Make scores of fitness alone; the course was then passed or not."""
    if given.dtype.kind not in "iuf" or wanted["arrival_s"].shape[0]:
        raise expected("tell", f"results of dtype {given.dtype}", f"numbers, or scores of dtype {wanted}")
    scores = np.zeros(given.shape, wanted)
    scores["fitness_s"] = scores["merit_s"] = given
    scores["share"] = given < UNSOLVED
    scores["drawn_s"] = np.nan
    return scores


def merit(scores: Scores, checkpoint_credit: bool) -> Floats:
    """Return what tournaments and elites go by; lower is better.

    Parameters
    ----------
    scores
        The population's.
    checkpoint_credit
        Whether the cliff of eq. 1 slopes: unsolved individuals then lie between 10^4 and 10^4 + 2, those that
        came farther below the others. Fitness as reported stays eq. 1.
    """
    merits: Floats = scores["merit_s"]
    if not checkpoint_credit:
        return merits
    return np.where(merits < UNSOLVED, merits, UNSOLVED + 1.0 - scores["share"])
