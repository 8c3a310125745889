"""The colour sensors' readings: where the sensors sit, what they see, what lags and is late, and noise."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel
from gecar.random_streams import normal
from gecar.world.kernel.sensing import RING, delayed, glance, lag_keep, lagged, reported
from gecar.world.kernel.terms import colour_error, sensor_shift


class Floor(NamedTuple):
    """What kernels know of a course.

    Attributes
    ----------
    averaged
        Brightness averaged over the sensor's spot, shape (rows, columns), 255 bare and 0 line, row 0 at the bottom.
    pitch
        Size of a raster cell [m].
    per_tile
        Tiles in a metre [1/m].
    columns, rows
        Tiles across and up.
    drivable
        Whether a tile belongs to the course, shape (rows * columns,).
    sequence
        Tiles in driving order, checkpoints first and GOAL last, shape (k,).
    """

    averaged: npt.NDArray[np.float32]
    pitch: float
    per_tile: float
    columns: int
    rows: int
    drivable: npt.NDArray[np.bool_]
    sequence: npt.NDArray[np.int32]


# Memory of the colour sensors: lagged reflections [%] of the last steps, for centre, left and right sensor; which of
# them the program reads; when each was last asked and what it saw then [%]; deviations of a reading [%] and a command;
# time of a statement [ms]; the random stream.
EYES = np.dtype(
    [
        ("rings", np.float64, (3 * RING,)),
        ("used", np.int8, (3,)),
        ("asked", np.int64, (3,)),
        ("level", np.float64, (3,)),
        ("noise_pct", np.float64),
        ("motor_noise", np.float64),
        ("statement_ms", np.float64),
        ("stream", np.uint64),
    ]
)


@kernel
def _side(sensor: int, p: Any) -> float:
    """Return how far to the left of the middle one a sensor sits [m]."""
    if sensor == 1:
        return p.side_sensor_left
    return -p.side_sensor_left if sensor == 2 else 0.0


@kernel
def see(sensor: int, s: Any, p: Any, floor: Floor) -> float:
    """Return what a colour sensor sees now [%]."""
    front, left = 0.0, _side(sensor, p)
    if p.n_terms > 0.0:
        ahead, aside = s.vx * s.cos + s.vy * s.sin, s.vy * s.cos - s.vx * s.sin - s.yaw_rate * p.com_ahead
        x, y = s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin
        moved = sensor_shift(s.t, x, y, s.heading, ahead, aside, s.yaw_rate, p)
        front, left = moved[0], left + moved[1]
    return glance(floor.averaged, floor.pitch, s, front, left, p)


@kernel
def look(n: int, s: Any, p: Any, dt: float, floor: Floor, eyes: Any) -> None:
    """Feed the sensors' memory at step ``n``; only sensors with lag or delay need one."""
    keep = lag_keep(dt, p.sensor_lag)
    for sensor in range(3):
        if eyes.used[sensor] != 0:
            now = see(sensor, s, p, floor)
            ring = sensor * RING
            if n == 0:
                for k in range(RING):
                    eyes.rings[ring + k] = now
            before = eyes.rings[ring + ((n - 1) & (RING - 1))]
            eyes.rings[ring + (n & (RING - 1))] = lagged(before, now, keep)


@kernel
def reflection(sensor: int, n: int, s: Any, p: Any, dt: float, floor: Floor, eyes: Any) -> float:
    """Return the reflection [%] that a sensor reports on at step ``n``: lagged and late, without noise.

    A sensor asked several times in one step looks once.
    """
    if eyes.asked[sensor] == n:
        return eyes.level[sensor]
    if p.sensor_lag == 0.0 and p.sensor_delay == 0.0:
        level = see(sensor, s, p, floor)
    else:
        level = delayed(eyes.rings, sensor * RING, n, p.sensor_delay / dt)
    if p.n_terms > 0.0:  # what they add, they add to the reading
        x, y = s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin
        level += (
            colour_error(s.t, x, y, s.heading, p.sensor_gain * level + p.sensor_offset, p) / p.sensor_gain
        )
    eyes.asked[sensor], eyes.level[sensor] = n, level
    return level


@kernel
def read_sensor(sensor: int, n: int, s: Any, p: Any, dt: float, floor: Floor, eyes: Any) -> float:
    """Return the whole percent a sensor reports at step ``n``."""
    level = reflection(sensor, n, s, p, dt, floor, eyes)
    noise = eyes.noise_pct * normal(eyes) if eyes.noise_pct > 0.0 else 0.0
    return reported(level, noise, p)
