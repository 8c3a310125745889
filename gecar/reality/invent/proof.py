"""Whether a law is real: left-out recordings ask for it, more than any law of the whole search gains by chance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.invent.search import Law, Library
from gecar.reality.optimisation.least_squares import costs, jacobian, weights

Array = npt.NDArray[np.float64]

DRAWS = 500
RIDGE = 1e-6


def left_out_gains(library: Library, law: Law) -> Array:
    """Return what a law gains on each fold with its constants fitted to the others (one Newton step back), (folds,).

    The model without it is as it was fitted to all.
    """
    blocks = library.problem.estimator.blocks
    residual, z, errors = (
        library.problem.estimator.residual(law.parameters),
        law.minimum.z,
        law.minimum.errors,
    )
    slopes, w = sensitivities(library, law), weights(errors)
    normal = slopes.T @ (w[:, None] * slopes)
    folds, fitted = np.unique(blocks.folds), []
    for k in folds:
        rows = blocks.folds == k
        rest = normal - slopes[rows].T @ (w[rows, None] * slopes[rows])
        pull = slopes[rows].T @ (w[rows] * errors[rows])
        ridge = RIDGE * np.diag(np.maximum(np.diag(normal), 1e-9))
        fitted.append(np.clip(z + np.linalg.solve(rest + ridge, pull), *law.parameters.bounds))
    before = np.bincount(blocks.folds, costs(library.model.errors))
    if len(folds) < 2:
        return np.array([law.gain])
    after: Array = np.array(
        [
            float(np.sum(costs(e[blocks.folds == k])))
            for k, e in zip(folds, residual(np.array(fitted)), strict=True)
        ]
    )
    out: Array = before[folds] - after
    return out


def sensitivities(library: Library, law: Law) -> Array:
    """Return the derivatives of residuals by a fitted law's parameters, shape (n, k)."""
    free, at = law.parameters, law.minimum
    return jacobian(library.problem.estimator.residual(free), at.z, at.errors, free.probes, free.bounds[1])


def largest_gains(library: Library, seed: int) -> Array:
    """Return the largest gain of any law the search tried, where spans of half a second have random signs, (draws,).

    As `gecar.reality.selection.null_distribution` does for the catalogue: the search is part of the null.
    """
    scores = np.stack(list(library.scores.values()))
    signs = np.random.default_rng((seed, len(scores))).choice(
        np.array([-1.0, 1.0], np.float32), (DRAWS, scores.shape[1])
    )
    best = np.zeros(DRAWS, np.float32)
    for first in range(0, len(scores), 512):
        best = np.maximum(best, np.max(np.abs(signs @ scores[first : first + 512].T), axis=1))
    return 0.5 * best.astype(float) ** 2
