"""The colour sensor: the floor's raster averaged over a spot, then lag, delay, gain, noise and whole percent."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled

# Most steps a delay may span: 0.25 s at the smallest step of 0.25 ms, in a ring whose size is a power of two.
RING = 1024


def _disc_points() -> npt.NDArray[np.float64]:
    """Return points that stand for equal areas of the unit disc, shape (30, 2): ahead and left.

    Three rings of 4, 10 and 16 at each ring's mean square radius: the mean and the second moments are a disc's own.
    """
    rings = ((4, 2.0), (10, 9.0), (16, 22.0))
    points = [
        (math.sqrt(area / 30.0) * math.cos(angle), math.sqrt(area / 30.0) * math.sin(angle))
        for count, area in rings
        for angle in (2.0 * math.pi * (k + 0.5) / count for k in range(count))
    ]
    return np.array(points)


_DISC = _disc_points()


@compiled
def floor_brightness(raster: npt.NDArray[np.uint8], pitch: float, x: float, y: float) -> float:
    """Return the floor's brightness at a point [m], 0 (line) to 255, bilinear; bare floor outside the field."""
    column = x / pitch - 0.5
    row = y / pitch - 0.5
    j = math.floor(column)
    i = math.floor(row)
    if j < 0 or i < 0 or j >= raster.shape[1] - 1 or i >= raster.shape[0] - 1:
        return 255.0
    right = column - j
    up = row - i
    j = int(j)
    i = int(i)
    below = (1.0 - right) * raster[i, j] + right * raster[i, j + 1]
    above = (1.0 - right) * raster[i + 1, j] + right * raster[i + 1, j + 1]
    return (1.0 - up) * below + up * above  # type: ignore[no-any-return]


@compiled
def spot_reflection(
    raster: npt.NDArray[np.uint8], pitch: float, x: float, y: float, cos: float, sin: float, left: float, p: Any
) -> float:
    """Return what the sensor sees [%], before lag, delay and noise.

    Parameters
    ----------
    raster, pitch
        Floor, shape (rows, columns), 255 bare and 0 line, row 0 at the bottom; size of a cell [m].
    x, y, cos, sin
        The axle's centre [m] and the heading.
    left
        How far this sensor sits to the left of its nominal place [m].
    p
        Record of dtype `PHYSICS`.
    """
    ahead = p.sensor_ahead
    aside = p.sensor_left + left
    # Bilinear cells blur like a disc of their own, of variance pitch^2/4 an axis: the spot gives that much up.
    radius = 0.5 * math.sqrt(max(p.spot_diameter * p.spot_diameter - 4.0 * pitch * pitch, 0.0))
    # The course may lie displaced: look where the floor under the spot is drawn.
    turn_cos = math.cos(p.line_angle)
    turn_sin = math.sin(p.line_angle)
    total = 0.0
    for k in range(_DISC.shape[0]):
        u = ahead + radius * _DISC[k, 0]
        w = aside + radius * _DISC[k, 1]
        px = x + u * cos - w * sin - p.line_dx
        py = y + u * sin + w * cos - p.line_dy
        total += floor_brightness(raster, pitch, px * turn_cos + py * turn_sin, py * turn_cos - px * turn_sin)
    share = total / (255.0 * _DISC.shape[0])
    return p.black + (p.white - p.black) * share  # type: ignore[no-any-return]


@compiled
def reported(reflection: float, noise: float, p: Any) -> float:
    """Return the whole percent the sensor reports for a reflection [%] with noise [%] added."""
    level = p.sensor_gain * reflection + p.sensor_offset + noise
    return min(max(math.floor(level + 0.5), 0.0), 100.0)


@compiled
def lagged(last: float, now: float, keep: float) -> float:
    """Return a first-order lag's output; ``keep`` = exp(-step / time constant), 0 without lag."""
    return keep * last + (1.0 - keep) * now


@compiled
def lag_keep(dt: float, time_constant: float) -> float:
    """Return the share of its old value a lag keeps over a step; 0 without lag."""
    return math.exp(-dt / time_constant) if time_constant > 0.0 else 0.0


@compiled
def delayed(ring: npt.NDArray[np.float64], newest: int, steps: float) -> float:
    """Return a ring's value ``steps`` (any real number) before the newest, linear between entries."""
    whole = math.floor(steps)
    part = steps - whole
    last = newest - int(whole)
    return (1.0 - part) * ring[last & (RING - 1)] + part * ring[(last - 1) & (RING - 1)]  # type: ignore[no-any-return]
