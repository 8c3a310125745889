"""What a colour sensor's readings leave wherever the path lies, within what is known of it.

A camera, its lens and its mount tell a path to a few millimetres, an error that lasts; poses' noise adds one that lasts
for tenths of a second. Beside a line a millimetre is 12 % of a reading, so that from reading to reading such errors
could explain anything. As they last, they cannot: the path is moved, span by span, to where readings fit best.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.sensor_noise import PATH_CAUTION
from gecar.reality.residuals.nuisances import in_blocks
from gecar.reality.residuals.of_recording import RecordingResiduals

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

SPAN = 6  # blocks of a path's quick errors: 1.8 s
ROUNDS = 4
ROUGH = 0.5  # share of the quick errors that changes from row to row; it covers what is not linear, too


class _Fit(NamedTuple):
    """Readings along a path: whitened errors, shape (spans, rows), their slopes (spans, rows, 3), noise [%]."""

    errors: Array
    slopes: Array
    own_sd: Array


def beyond_any_path(run: RecordingResiduals, physics: Physics, path_sd: Array) -> Array:
    """Return the squared errors of readings that no shift of the path explains, less their noise, shape (rows,) [%^2].

    Errors are those of the most likely shifts of all spans, by Gauss-Newton: whitened, in units of a reading's own
    noise. What was not measured, or is not compared, is nan.

    Parameters
    ----------
    run
        The recording, with its path.
    physics
        The model, shape (1,).
    path_sd
        Standard deviations of an error of the path that lasts [m, m, rad], shape (3,).
    """
    path = run.nuisances.path
    assert path is not None
    rows = len(path.poses)
    of_row = np.arange(rows) // (SPAN * path.block)
    count = int(of_row[-1]) + 1
    best, least = np.zeros((count, 3)), np.full(count, np.inf)
    step, fit = np.zeros((count, 3)), None
    for _ in range(ROUNDS):
        tried = best + step
        now = _fit(run, physics, tried[of_row] * path_sd, path_sd)
        cost = np.sum(now.errors**2, axis=1) + np.sum(tried**2, axis=1)
        better = cost < least
        fit = now if fit is None else _Fit(*(_chosen(better, *pair) for pair in zip(now, fit, strict=True)))
        best, least = np.where(better[:, None], tried, best), np.minimum(cost, least)
        turned = fit.slopes.transpose(0, 2, 1)
        asked = (turned @ fit.errors[:, :, None])[:, :, 0] - best
        whole = np.linalg.solve(turned @ fit.slopes + np.eye(3), asked[:, :, None])[:, :, 0]
        step = np.where(better[:, None], whole, 0.5 * step)
    assert fit is not None
    return ((fit.errors**2 - 1.0) * fit.own_sd**2).ravel()[:rows]


def _fit(run: RecordingResiduals, physics: Physics, shifts: Array, path_sd: Array) -> _Fit:
    """Return how readings fit along a path that is moved row by row [m, m, rad], shape (rows, 3)."""
    path = run.nuisances.path
    assert path is not None
    moved = run.with_nuisances(replace(run.nuisances, path=replace(path, poses=path.poses + shifts)))
    quick_sd = np.maximum(run.noise.path_sd, run.smoothed_sd(path.inflation) / PATH_CAUTION)
    moved = moved.with_uncertain_path(physics, quick_sd, ROUGH)
    there = moved.nuisances.path
    assert there is not None
    errors = run.recording.reflection_pct - moved.readings(physics)
    longer = there.slopes * (path_sd / quick_sd)
    whitened = there.whitened(np.vstack([errors, longer.T]))
    own_sd = np.where(np.isnan(whitened[0]), np.nan, there.own_sd)
    spans = in_blocks(np.column_stack([np.nan_to_num(whitened.T), own_sd]), SPAN * path.block)
    return _Fit(spans[:, :, 0], spans[:, :, 1:4], spans[:, :, 4])


def _chosen(which: npt.NDArray[np.bool_], one: Array, other: Array) -> Array:
    """Return the first of two arrays where a span asks for it, else the second."""
    return np.where(which.reshape(-1, *[1] * (one.ndim - 1)), one, other)
