"""Proof of a step: what it gains on left-out recordings, against what no cause gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Fits
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import costs, weights

Array = npt.NDArray[np.float64]

NULLS = 500
SLOPELESS = frozenset({"slippery_patch"})  # no Newton step tells what it would be without a recording
ALONE = 0.9  # of a step's gain in one recording
LEFT = 0.02  # of the structure: what a whole explanation leaves
TOLD = 0.02  # of what all recordings tell of a parameter


def judged(fits: Fits, catalogue: Sequence[str], step: Step) -> Step:
    """Judge a step by leaving out recordings, and against the null."""
    new, folds = step.model, fits.blocks.folds
    saved = np.bincount(folds, costs(step.base.fit.errors) - costs(new.fit.errors))
    # What one recording alone shows can not be left out. Wholly explained it counts: an imitation leaves something.
    alone = saved.max() > ALONE * step.gain and step.after < LEFT * step.before
    if alone or len(np.unique(folds)) < 2:
        gains = np.array([step.gain])
    elif step.effect in SLOPELESS:
        gains = np.where(saved.sum() - saved > TOLD * saved.sum(), saved, np.minimum(saved, 0.0))
    else:
        gains = _gains(fits, step.base, new)
    nulls = null(fits, catalogue, new)
    p = float((1 + np.sum(nulls >= gains.sum())) / (1 + len(nulls)))
    return replace(step, left_out=gains, null_95=float(np.quantile(nulls, 0.95)), p=p)


def _gains(fits: Fits, base: Model, new: Model) -> Array:
    """Return what a model gains on each fold when that is left out, shape (folds,).

    The model below is asked to predict, too: what it fitted to the left-out recording would flatter it. But leaving
    out may cost it no more than it costs the new one; else a base that falls apart would let everything pass.
    """
    folds = fits.blocks.folds
    before, after = _left_out(fits, base), _left_out(fits, new)
    lost = np.maximum(after - np.bincount(folds, costs(new.fit.errors)), 0.0)
    out: Array = np.minimum(before, np.bincount(folds, costs(base.fit.errors)) + lost) - after
    return out


def _left_out(fits: Fits, model: Model) -> Array:
    """Return each fold's cost under parameters fitted without it (one Newton step back), shape (folds,)."""
    slopes, errors, z = fits.slopes(model), model.fit.errors, model.fit.z
    if not len(z):
        return np.bincount(fits.blocks.folds, costs(errors)).astype(float)
    w = weights(errors)
    out = np.zeros(int(fits.blocks.folds.max()) + 1)
    normal = slopes.T @ (w[:, None] * slopes)
    for k in np.unique(fits.blocks.folds):
        rows = fits.blocks.folds == k
        rest = normal - slopes[rows].T @ (w[rows, None] * slopes[rows])
        pull = slopes[rows].T @ (w[rows] * errors[rows])
        # What this recording alone tells is not known without it: it stays neutral.
        known = np.flatnonzero(np.diag(rest) > TOLD * np.diag(normal))
        without = np.zeros(len(z))
        block = rest[np.ix_(known, known)]
        ridge = 1e-6 * np.diag(np.maximum(np.diag(block), 1e-9))
        without[known] = z[known] + np.linalg.solve(block + ridge, pull[known])
        without = np.clip(without, *model.freedom.bounds)
        out[k] = float(np.sum(costs(fits.residual(model.freedom, model.shift)(without)[rows])))
    return out


def null(fits: Fits, catalogue: Sequence[str], model: Model) -> Array:
    """Return the largest gain any effect reaches where there is no cause, for many draws, shape (NULLS,)."""
    errors = model.fit.errors
    w = np.sqrt(weights(errors))
    spans = int(fits.blocks.spans.max()) + 1
    signs = fits.rng.choice((-1.0, 1.0), (NULLS, spans))
    best = np.zeros(NULLS)
    for effect in catalogue:
        if effect in model.effects:
            continue
        g = fits.beside(model, fits.felt(model, effect) * w[:, None])
        if g.shape[1]:
            q = np.linalg.qr(g)[0] * (w * errors)[:, None]
            score = np.stack([np.bincount(fits.blocks.spans, column, spans) for column in q.T], axis=1)
            best = np.maximum(best, 0.5 * np.sum((signs @ score) ** 2, axis=1))
    return best
