"""Intervals: what other recordings, other noise, and the simulation's own faults would have made of a parameter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.gain_offset import level_spans
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import cost, weights
from gecar.reality.selection.selection import Selection
from gecar.reality.uncertainty.mcmc import wandered
from gecar.reality.verdict import Interval

Array = npt.NDArray[np.float64]

NORMAL_95 = 1.96
SYSTEMATIC = 0.02  # of an effect's size: against the 3D engine, fitted parameters come back within so much
SYSTEMATIC_STEP = 0.15  # of the smallest size worth a name
# Gears that give add to their play: 0.3 to 0.8 degrees there.
MORE_SYSTEMATIC = {"backlash": 0.12, "dead_band": 0.05}
MORE_STEP = {"backlash": 0.6}
FLAT = 2.0  # coordinates: a deviation so large comes from slopes that say nothing
NOTICED = 12.0  # of cost: what walking along a flat parameter must not raise it by


def deviations(selection: Selection, model: Model) -> Array:
    """Return standard deviations of a model's coordinates, shape (k,).

    The larger of two: a sandwich over half-second spans, which holds whatever the noise's colour, and the jackknife
    over recordings, which also feels what no noise model knows.
    """
    slopes, errors = selection.slopes(model), model.fit.errors
    w = weights(errors)
    normal = slopes.T @ (w[:, None] * slopes)
    inverse = np.linalg.pinv(normal + 1e-9 * np.diag(np.diag(normal)), hermitian=True)
    scores = np.stack([np.bincount(selection.blocks.spans, s * w * errors) for s in slopes.T], axis=1)
    sandwich = inverse @ (scores.T @ scores) @ inverse
    leaps = []
    for k in np.unique(selection.blocks.folds):
        rows = selection.blocks.folds == k
        part = slopes[rows].T @ (w[rows, None] * slopes[rows])
        leaps.append(
            np.linalg.pinv(normal - part, hermitian=True) @ (slopes[rows].T @ (w[rows] * errors[rows]))
        )
    folds = len(leaps)
    jack = (folds - 1) / folds * np.sum((np.array(leaps) - np.mean(leaps, axis=0)) ** 2, axis=0)
    out: Array = np.sqrt(np.maximum(np.diag(sandwich), jack))
    return out


def intervals(selection: Selection, model: Model) -> dict[str, dict[str, Interval]]:
    """Return 95 % intervals of every parameter of a model, by effect and label."""
    if not model.effects:
        return {}
    out: dict[str, dict[str, Interval]] = {}
    low, high = model.freedom.bounds
    spans = level_spans(selection, model)
    for k, (left, right) in wandered(selection, model).items():
        spans[k] = (max(float(model.fit.z[k]) - left, 0.0), max(right - float(model.fit.z[k]), 0.0))
    for k, (c, sd) in enumerate(zip(model.freedom.coordinates, deviations(selection, model), strict=True)):
        z = float(model.fit.z[k])
        step = MORE_STEP.get(c.parameter.field, SYSTEMATIC_STEP) if c.parameter.worthwhile > 0.0 else 0.0
        size = MORE_SYSTEMATIC.get(c.parameter.field, SYSTEMATIC) * abs(z) + step
        if k in spans:
            down, up = spans[k]
        elif sd > FLAT:
            down, up = (
                _walked(selection, model, k, side, abs(end - z))
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


def _walked(selection: Selection, model: Model, k: int, side: float, most: float) -> float:
    """Return how far one coordinate can go before the cost notices; the others stay."""
    residual = selection.residual(model.freedom, model.shift)
    gone, pace = 0.0, 0.25
    while gone < most and pace < 64.0:
        moved = model.fit.z.copy()
        moved[k] += side * min(gone + pace, most)
        if cost(residual(moved)) > model.cost + NOTICED:
            return gone + pace
        gone, pace = gone + pace, 1.5 * pace
    return most
