"""What the colour sensor would have read along a path the robot was measured to take.

Along the measured path, not the simulated one: then only the sensor and the course can explain a difference.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.world.kernel.sensing import Surface, spot_reflection
from gecar.world.kernel.terms import colour_error, sensor_shift

Array = npt.NDArray[np.float64]

LAG_STEP_S = 0.01  # in which a robot moves by less than a spot's radius; rows of a slow log are farther apart


@compiled
def _along(t: Array, path: Array, at: float, k: int, pose: Array) -> int:
    """Interpolate a path at a time, holding its ends; return the row it was found at, to search on from."""
    last = t.shape[0] - 1
    while k < last - 1 and t[k + 1] < at:
        k += 1
    while k > 0 and t[k] > at:
        k -= 1
    share = min(max((at - t[k]) / (t[k + 1] - t[k]), 0.0), 1.0)
    for i in range(3):
        pose[i] = (1.0 - share) * path[k, i] + share * path[k + 1, i]
    return k


@compiled
def _clipped_mean(level: float, sd: float) -> float:
    """Return the mean of a reading with normal noise after it is clipped to 0..100.

    Readings at the ends can only err inwards; without this, white at 100 % fakes a sensor gain below 1.
    """
    total = level
    for bound, side in ((0.0, -1.0), (100.0, 1.0)):
        z = side * (level - bound) / sd
        if z > -6.0:
            upper = 0.5 * math.erfc(-z / math.sqrt(2.0))
            total -= side * sd * (z * upper + math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi))
    return total


@compiled
def _seen(
    time: float,
    t: Array,
    path: Array,
    late: float,
    floor: Surface,
    p: Any,
    shift: Array,
    k: int,
    pose: Array,
) -> tuple[int, float]:
    """Return the path's row at a time of the sensor's clock, and what the sensor saw then [%].

    Arguments are those of `readings_along`; the search begins at row ``k``, and ``pose`` is overwritten.
    """
    k = _along(t, path, time + late - p.sensor_delay, k, pose)
    heading = pose[2] + shift[2]
    cos, sin = math.cos(heading), math.sin(heading)
    x, y = pose[0] + shift[0], pose[1] + shift[1]
    front = left = 0.0
    if p.n_terms > 0.0:
        per_s = 1.0 / (t[k + 1] - t[k])
        vx, vy = per_s * (path[k + 1, 0] - path[k, 0]), per_s * (path[k + 1, 1] - path[k, 1])
        turn_rate = per_s * (path[k + 1, 2] - path[k, 2])
        front, left = sensor_shift(
            time, x, y, heading, vx * cos + vy * sin, vy * cos - vx * sin, turn_rate, p
        )
    return k, spot_reflection(floor, x, y, cos, sin, front, left, p)


@compiled
def readings_along(
    t: Array,
    path: Array,
    late: float,
    noise: float,
    floor: Surface,
    physics: npt.NDArray[Any],
    shift: Array,
) -> Array:
    """Return the reflection predicted at every row [%], shape (rows,).

    Parameters
    ----------
    t, path
        Times [s], shape (rows,), and poses of the axle's centre [m, m, rad], shape (rows, 3).
    late
        How much later than the sensor's clock the path's is [s].
    noise
        Standard deviation of a reading [%].
    floor
        From `gecar.world.kernel.sensing.surface`.
    physics
        Record of dtype `PHYSICS`, shape (1,).
    shift
        Moves the whole path [m, m, rad], shape (3,): to see how much a pose's error matters.
    """
    p = physics[0]
    readings = np.empty(t.shape[0])
    pose, k = np.zeros(3), 0
    before = now = 0.0
    for i in range(t.shape[0]):
        if i == 0 or p.sensor_lag <= 0.0:
            k, now = _seen(t[i], t, path, late, floor, p, shift, k, pose)
            before = now
        else:
            elapsed = t[i] - t[i - 1]
            pieces = max(math.ceil(elapsed / LAG_STEP_S - 1e-6), 1)
            piece = elapsed / pieces
            keep = math.exp(-piece / p.sensor_lag)
            for j in range(pieces):
                at = t[i] - (pieces - 1 - j) * piece
                k, seen = _seen(at, t, path, late, floor, p, shift, k, pose)
                # From piece to piece what is seen runs straight: a first-order lag's exact answer to a ramp.
                slope = (seen - before) / piece
                now = seen - slope * p.sensor_lag + (now - before + slope * p.sensor_lag) * keep
                before = seen
        level = p.sensor_gain * now + p.sensor_offset
        if p.n_terms > 0.0:
            x, y, heading = pose[0] + shift[0], pose[1] + shift[1], pose[2] + shift[2]
            level += colour_error(t[i], x, y, heading, level, p)
        readings[i] = _clipped_mean(level, noise)
    return readings
