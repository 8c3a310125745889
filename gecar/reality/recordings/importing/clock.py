"""The offset between two clocks, from motion: what the encoders say against what the camera saw.

A camera measures neither speed nor yaw rate; their means over a window it does. So both sides are compared as
the chord the axle centre moved through and the angle it turned by within a window: quantities that do not
change with the camera's origin, axes or (up to a factor, which is fitted) unit, so that these need not be
known yet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import correlate

from gecar.errors import InputError
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.importing.track import Track, turning, windows

# Measured on 96 recordings of a 3D simulation (camera at 33 Hz, 1 mm and 0.3 deg): windows from 0.1 to 0.4 s
# do equally well.
_WINDOW_S = 0.2
_GRID_S = 0.02
_REACH_S = 0.06
_LEAST_OVERLAP_S = 2.0
_BLOCKS = 12
_LEAST_AGREEMENT = 0.8
_CREEP_S = 0.0015  # tyres creep on a grippy floor: the camera reads as late by as much (the same recordings)
_BEND_S = 0.4  # long enough that the bend of a path stands out of a camera's noise


@dataclass(frozen=True)
class ClockOffset:
    """What aligning two clocks found.

    Attributes
    ----------
    offset_s
        Add this to the camera's times to have the brick's [s].
    deviation_s
        Its standard deviation, from residuals, drift and creep [s]; NaN if too little is shared to say.
    correlation
        Between the two motions at that offset, -1 to 1.
    runner_up
        The highest correlation at an offset over a second away.
    drift_s
        Offset in the last third less the offset in the first [s].
    """

    offset_s: float
    deviation_s: float
    correlation: float
    runner_up: float
    drift_s: float


@dataclass(frozen=True)
class Likeness:
    """How a camera's units and axes compare with the encoders', as far as their motions agree.

    Attributes
    ----------
    scale
        The camera's unit of length [m]; NaN if the robot hardly moved, or its wheels slipped.
    heading_factor
        Radians per unit of the camera's heading, negative if it counts clockwise; NaN without headings, or
        if the robot hardly turned, or its wheels slipped.
    mirrored
        Whether the camera's axes are a mirror image (y down); ``None`` if the path bends too little to say.
    """

    scale: float
    heading_factor: float
    mirrored: bool | None


def estimate_offset(brick: Track, camera: Track) -> ClockOffset:
    """Find what to add to a camera's times to have the brick's.

    The offset is searched over every overlap of two seconds and half the shorter track, by correlation; then
    refined below the sample by a robust fit (Geman and McClure's loss: windows in which wheels slip count
    little). What is left of slip and backlash reads as a late camera.

    Raises
    ------
    InputError
        If the tracks are too short, or one of them never moves.
    """
    coarse, correlation, runner_up = _coarse_offset(brick, camera)
    offset, deviation = _fine_offset(brick, camera, coarse)
    third = len(camera.t_s) // 3
    ends = [_fine_offset(brick, camera.part(part), offset)[0] for part in (slice(third), slice(-third, None))]
    drift = ends[1] - ends[0]
    deviation = float(np.sqrt(deviation**2 + (drift / 2.0) ** 2 + _CREEP_S**2))
    return ClockOffset(offset, deviation, correlation, runner_up, drift)


def compare(brick: Track, camera: Track, offset: float) -> Likeness:
    """Compare a camera's units and axes with the encoders', at a known offset [s]."""
    at = _shared_times(brick, camera, offset)
    if len(at) < 2 * _BLOCKS:
        return Likeness(float("nan"), float("nan"), None)
    told, seen = windows(brick, at + offset, _WINDOW_S), windows(camera, at, _WINDOW_S)
    scale = _factor(told[0], seen[0], 0.002)
    heading_factor = _factor(told[1], seen[1], 0.02) if len(seen) > 1 else float("nan")
    return Likeness(scale, heading_factor, _mirrored(brick, camera, offset) if np.isfinite(scale) else None)


def _factor(told: Series, seen: Series, least: float) -> float:
    """Return the factor from what a camera saw to what the encoders told; NaN if they do not agree on it."""
    if np.std(told) < least or np.std(seen) == 0.0 or abs(np.corrcoef(told, seen)[0, 1]) < _LEAST_AGREEMENT:
        return float("nan")
    return 1.0 / _fit(told, seen)[0]


def _coarse_offset(brick: Track, camera: Track) -> tuple[float, float, float]:
    """Return the best offset on the grid [s], the correlation there, and the best over a second away."""
    at_b, at_c = _grid(brick), _grid(camera)
    told, seen = windows(brick, at_b, _WINDOW_S), windows(camera, at_c, _WINDOW_S)
    scores = [_correlations(a, b) for a, b in zip(told, seen, strict=False)]
    scores[1:] = [np.abs(turn) for turn in scores[1:]]  # headings may count clockwise
    score = np.mean(scores, axis=0)
    if not np.isfinite(score).any():
        raise InputError("the encoders or the camera show no motion, so that their clocks cannot be aligned")
    score = np.nan_to_num(score, nan=-1.0)
    lags = (np.arange(len(score)) - (len(at_c) - 1)) * _GRID_S
    best = int(score.argmax())
    elsewhere = score[np.abs(lags - lags[best]) > 1.0]
    return float(lags[best] + at_b[0] - at_c[0]), float(score[best]), float(elsewhere.max(initial=-1.0))


def _grid(track: Track) -> Series:
    """Return evenly spaced times whose window lies within the track [s]."""
    first, last = track.t_s[0] + _WINDOW_S / 2, track.t_s[-1] - _WINDOW_S / 2
    if last - first < _LEAST_OVERLAP_S:
        raise InputError(
            f"{last - first + _WINDOW_S:.1f} s of motion are too short to align clocks by: 2.2 s at least"
        )
    return np.arange(first, last, _GRID_S)


def _correlations(a: Series, b: Series) -> Series:
    """Return Pearson's correlation at every lag, shape (len(a) + len(b) - 1,); NaN where too few meet."""
    a, b = a - a.mean(), b - b.mean()
    ones_a, ones_b = np.ones_like(a), np.ones_like(b)
    n = np.round(_products(ones_a, ones_b))
    sum_a, sum_b = _products(a, ones_b), _products(ones_a, b)
    var_a = n * _products(a * a, ones_b) - sum_a**2
    var_b = n * _products(ones_a, b * b) - sum_b**2
    least = max(_LEAST_OVERLAP_S / _GRID_S, min(len(a), len(b)) / 2)
    # A stretch in which one side all but stands still says nothing.
    enough = (n >= least) & (var_a > 1e-3 * n**2 * np.var(a)) & (var_b > 1e-3 * n**2 * np.var(b))
    with np.errstate(all="ignore"):
        r: Series = (n * _products(a, b) - sum_a * sum_b) / np.sqrt(var_a * var_b)
    r[~enough] = np.nan
    return r


def _products(a: Series, b: Series) -> Series:
    """Return the sum of products at every lag: entry k pairs a[j + k - (len(b) - 1)] with b[j]."""
    products: Series = correlate(a, b, mode="full", method="fft")
    return products


def _shared_times(brick: Track, camera: Track, offset: float) -> Series:
    """Return the camera's times whose window lies within both tracks at any offset within reach."""
    margin = _WINDOW_S / 2 + _REACH_S
    first = max(brick.t_s[0] - offset, camera.t_s[0]) + margin
    last = min(brick.t_s[-1] - offset, camera.t_s[-1]) - margin
    return camera.t_s[(camera.t_s > first) & (camera.t_s < last)]


def _fit(told: Series, seen: Series) -> tuple[float, Series]:
    """Return the factor from one side to the other, robustly, and the residuals it leaves."""
    weight = np.ones_like(told)
    for _ in range(7):
        factor = float(np.sum(weight * told * seen)) / (float(np.sum(weight * told * told)) + 1e-300)
        residual = seen - factor * told
        weight = 1.0 / (1.0 + (residual / (3.0 * _spread(residual))) ** 2) ** 2
    return factor, residual


def _spread(residual: Series) -> float:
    """Return the residuals' standard deviation, from their median."""
    return float(1.4826 * np.median(np.abs(residual)) + 1e-12)


def _fine_offset(brick: Track, camera: Track, coarse: float) -> tuple[float, float]:
    """Return the offset near a coarse one, and its standard deviation [s].

    Where the tracks share too little, the coarse one comes back, with NaN.
    """
    at = _shared_times(brick, camera, coarse)
    if len(at) < 2 * _BLOCKS:
        return coarse, float("nan")
    seen = windows(camera, at, _WINDOW_S)

    def residuals(offset: float) -> Series:
        told = windows(brick, at + offset, _WINDOW_S)
        return np.array([_fit(told[k], channel)[1] for k, channel in enumerate(seen)])

    tried = coarse + np.linspace(-_REACH_S, _REACH_S, 31)
    limit = 3.0 * np.array([[_spread(r) for r in residuals(offset)] for offset in tried]).min(axis=0)[:, None]

    def loss(offset: float) -> float:
        squared = np.square(residuals(offset) / limit)
        return float(np.sum(squared / (1.0 + squared)))

    start = tried[int(np.argmin([loss(offset) for offset in tried]))]
    bounds = (start - _REACH_S / 15, start + _REACH_S / 15)
    offset = float(minimize_scalar(loss, bounds=bounds, method="bounded", options={"xatol": 1e-5}).x)
    return offset, _deviation(lambda o: residuals(o) / limit, offset)


def _deviation(misfits: Callable[[float], Series], offset: float) -> float:
    """Return the offset's standard deviation [s]: the sandwich estimator, over blocks of time.

    Neighbouring windows overlap and slip lasts, so that single residuals are far from independent; sums over
    blocks nearly are.
    """
    step = 0.004
    misfit = misfits(offset)
    slope = (misfits(offset + step) - misfits(offset - step)) / (2.0 * step)
    weight = 1.0 / (1.0 + misfit**2) ** 2
    scores = [np.sum(block) for block in np.array_split(weight * misfit * slope, _BLOCKS, axis=1)]
    return float(np.sqrt(np.sum(np.square(scores))) / np.sum(weight * slope**2))


def _mirrored(brick: Track, camera: Track, offset: float) -> bool | None:
    """Say whether the camera's path bends the other way."""
    at = _shared_times(brick, camera, offset)
    at = at[(at > at[0] + _BEND_S) & (at < at[-1] - _BEND_S)]
    if not len(at):
        return None
    told, seen = turning(brick, at + offset, _BEND_S), turning(camera, at, _BEND_S)
    agreement = float(np.mean(np.sign(told * seen)[np.abs(told) >= np.quantile(np.abs(told), 0.75)]))
    return agreement < 0 if abs(agreement) > 0.4 else None
