"""Approximate Bayesian computation: which draws of a prior drive as the paper says.

Rejection first: draws of the prior until enough arrive at all, which also says how rare that is. Then the tolerance
on the arrival time shrinks step by step: draws within the next tolerance are resampled, and each is moved by a
Metropolis chain that leaves the posterior at that tolerance as it is (Del Moral, Doucet and Jasra, Statistics and
Computing 22, 2012). All priors are uniform in the unit cube, so a move is accepted where it stays in the cube and
its drive within the tolerance, and no draw needs a weight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Misfit = Callable[[Floats], float]
"""Distance of a point of the unit cube, shape (d,), from what was observed; inf where it is impossible."""

MOVES = 30
SCALES = (1.0, 0.3, 0.1)  # of the optimal step 2.38 / sqrt(d): one of them fits, whatever the shape


@dataclass(frozen=True)
class Posterior:
    """Draws within a tolerance.

    Attributes
    ----------
    cube
        Points of the unit cube, shape (n, d).
    misfit
        Of each, shape (n,).
    accepted
        Share of the moves accepted at the last tolerance.
    drives
        Drives spent on the moves.
    """

    cube: Floats
    misfit: Floats
    accepted: float
    drives: int


def shrink(
    cube: Floats, misfit: Floats, tolerances: list[float], of: Misfit, rng: np.random.Generator
) -> Posterior:
    """Narrow draws to ever smaller tolerances.

    Parameters
    ----------
    cube, misfit
        Draws of the prior that are possible at all, shape (n, d), and their misfits, shape (n,).
    tolerances
        From wide to narrow.
    of
        The misfit.
    rng
        Source of randomness.

    Raises
    ------
    ValueError
        If no draw lies within the next tolerance.
    """
    n, drives, share = len(cube), 0, 1.0
    for tolerance in tolerances:
        inside = np.flatnonzero(misfit <= tolerance)
        if not len(inside):
            raise ValueError(f"no draw within {tolerance:g}; take more draws, or a wider tolerance first")
        # One copy of each before any second: fewer repeats than drawing with replacement.
        chosen = rng.permutation(np.resize(rng.permutation(inside), n))
        spread = np.cov(cube[inside].T) if len(inside) > 3 * cube.shape[1] else np.cov(cube.T)
        cube, misfit, share = _move(cube[chosen], misfit[chosen], spread, tolerance, of, rng)
        drives += n * MOVES
    return Posterior(cube, misfit, share, drives)


def _move(
    cube: Floats, misfit: Floats, spread: Floats, tolerance: float, of: Misfit, rng: np.random.Generator
) -> tuple[Floats, Floats, float]:
    """Move each draw by a Metropolis chain; return draws, misfits and the share of moves accepted."""
    cube, misfit, accepted = cube.copy(), misfit.copy(), 0
    n, d = cube.shape
    root = np.linalg.cholesky(spread + 1e-9 * np.eye(d)) * 2.38 / np.sqrt(d)
    for k in range(n):
        for move in range(MOVES):
            proposed = cube[k] + SCALES[move % len(SCALES)] * (root @ rng.standard_normal(d))
            if (proposed < 0.0).any() or (proposed > 1.0).any():
                continue
            found = of(proposed)
            if found <= tolerance:
                cube[k], misfit[k] = proposed, found
                accepted += 1
    return cube, misfit, accepted / (n * MOVES)
