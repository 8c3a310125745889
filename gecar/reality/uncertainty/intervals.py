"""Intervals: what other recordings, other noise, and the simulation's own faults would have made of a parameter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.gain_offset import gain_intervals
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import cost, weights
from gecar.reality.uncertainty.mcmc import walked_quantiles
from gecar.reality.verdict import Interval

Array = npt.NDArray[np.float64]

NORMAL_95 = 1.96
FLAT = 2.0  # coordinates: a deviation so large comes from slopes that say nothing
RISE = 12.0  # of cost: rise that ends a walk along a flat parameter


def deviations(estimator: Estimator, model: Model) -> Array:
    """Return standard deviations of a model's coordinates, shape (k,).

    The larger of two: a sandwich over half-second spans, which holds whatever the noise's colour, and the jackknife
    over recordings, which also feels what no noise model knows.
    """
    slopes, errors = estimator.own_sensitivities(model), model.errors
    w = weights(errors)
    normal = slopes.T @ (w[:, None] * slopes)
    inverse = np.linalg.pinv(normal + 1e-9 * np.diag(np.diag(normal)), hermitian=True)
    scores = np.stack([np.bincount(estimator.blocks.spans, s * w * errors) for s in slopes.T], axis=1)
    sandwich = inverse @ (scores.T @ scores) @ inverse
    leaps = []
    for k in np.unique(estimator.blocks.folds):
        rows = estimator.blocks.folds == k
        part = slopes[rows].T @ (w[rows, None] * slopes[rows])
        leaps.append(
            np.linalg.pinv(normal - part, hermitian=True) @ (slopes[rows].T @ (w[rows] * errors[rows]))
        )
    folds = len(leaps)
    jack = (folds - 1) / folds * np.sum((np.array(leaps) - np.mean(leaps, axis=0)) ** 2, axis=0)
    out: Array = np.sqrt(np.maximum(np.diag(sandwich), jack))
    return out


def intervals(estimator: Estimator, model: Model) -> dict[str, dict[str, Interval]]:
    """Return 95 % intervals of every parameter of a model, by effect and label."""
    if not model.effects:
        return {}
    out: dict[str, dict[str, Interval]] = {}
    low, high = model.parameters.bounds
    spans = gain_intervals(estimator, model)
    for k, (left, right) in walked_quantiles(estimator, model).items():
        spans[k] = (max(float(model.z[k]) - left, 0.0), max(right - float(model.z[k]), 0.0))
    for k, (c, sd) in enumerate(zip(model.parameters.coordinates, deviations(estimator, model), strict=True)):
        z = float(model.z[k])
        step = c.parameter.model_error_steps if c.parameter.worthwhile > 0.0 else 0.0
        size = c.parameter.model_error * abs(z) + step
        if k in spans:
            down, up = spans[k]
        elif sd > FLAT:
            down, up = (
                _walked(estimator, model, k, side, abs(end - z))
                for side, end in ((-1.0, low[k]), (1.0, high[k]))
            )
        else:
            down = up = NORMAL_95 * sd
        reach = NORMAL_95 * 0.5 * size
        edges = np.clip((z - np.hypot(down, reach), z + np.hypot(up, reach)), low[k], high[k])
        ends = sorted(c.value(float(end)) for end in edges)
        out.setdefault(c.effect.id, {})[c.parameter.label] = Interval(
            c.value(z), ends[0], ends[1], c.parameter.unit
        )
    return out


def _walked(estimator: Estimator, model: Model, k: int, side: float, most: float) -> float:
    """Return how far one coordinate can go before the cost notices; the others stay."""
    residual = estimator.residual(model.parameters, model.tolerated)
    gone, pace = 0.0, 0.25
    while gone < most and pace < 64.0:
        moved = model.z.copy()
        moved[k] += side * min(gone + pace, most)
        if cost(residual(moved)) > model.cost + RISE:
            return gone + pace
        gone, pace = gone + pace, 1.5 * pace
    return most
