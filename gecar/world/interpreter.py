"""The robot language's interpreter: flat opcodes, run whenever the robot no longer waits."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.language.opcodes import JUMP, MOTOR_UNTIL, TEST
from gecar.world.randomness import normal
from gecar.world.sensing import RING, delayed, lag_keep, lagged, reported, spot_reflection

# Where the program stands. `due_ms` is the schedule the program asks for; steps round it, but never add up errors.
CONTROL = np.dtype(
    [("row", np.int64), ("until", np.int64), ("due_step", np.int64), ("step", np.int64), ("line", np.int64)]
    + [(field, np.float64) for field in ("due_ms", "left_duty", "right_duty")]
)


class Floor(NamedTuple):
    """What kernels know of a course.

    Attributes
    ----------
    raster
        Brightness, shape (rows, columns), 255 bare and 0 line, row 0 at the bottom.
    pitch, tile
        Size of a raster cell and of a tile [m].
    columns, rows
        Tiles across and up.
    drivable
        Whether a tile belongs to the course, shape (rows * columns,).
    sequence
        Tiles in driving order, checkpoints first and GOAL last, shape (k,).
    """

    raster: npt.NDArray[np.uint8]
    pitch: float
    tile: float
    columns: int
    rows: int
    drivable: npt.NDArray[np.bool_]
    sequence: npt.NDArray[np.int32]


class Eyes(NamedTuple):
    """Memory of the colour sensors, for lag and delay.

    Attributes
    ----------
    rings
        Lagged reflections [%] of the last steps, shape (3, RING); rows are centre, left and right sensor.
    used
        Whether the program reads a sensor, shape (3,).
    noise_pct
        Standard deviation of a reading [%].
    stream
        Random stream, shape (1,).
    """

    rings: npt.NDArray[np.float64]
    used: npt.NDArray[np.bool_]
    noise_pct: float
    stream: npt.NDArray[np.uint64]


@compiled
def _side(sensor: int, p: Any) -> float:
    """Return how far to the left of the middle one a sensor sits [m]."""
    if sensor == 1:
        return p.side_sensor_left  # type: ignore[no-any-return]
    return -p.side_sensor_left if sensor == 2 else 0.0


@compiled
def see(sensor: int, s: Any, p: Any, floor: Floor) -> float:
    """Return what a colour sensor sees now [%]."""
    x = s.x - p.com_ahead * s.cos
    y = s.y - p.com_ahead * s.sin
    return spot_reflection(floor.raster, floor.pitch, x, y, s.cos, s.sin, _side(sensor, p), p)


@compiled
def look(n: int, s: Any, p: Any, dt: float, floor: Floor, eyes: Eyes) -> None:
    """Feed the sensors' memory at step ``n``; does nothing for a sensor that answers at once."""
    if p.sensor_lag == 0.0 and p.sensor_delay == 0.0:
        return
    keep = lag_keep(dt, p.sensor_lag)
    for sensor in range(3):
        if eyes.used[sensor]:
            now = see(sensor, s, p, floor)
            ring = eyes.rings[sensor]
            if n == 0:
                ring[:] = now
            ring[n & (RING - 1)] = lagged(ring[(n - 1) & (RING - 1)], now, keep)


@compiled
def read_sensor(sensor: int, n: int, s: Any, p: Any, dt: float, floor: Floor, eyes: Eyes) -> float:
    """Return the whole percent a sensor reports at step ``n``."""
    if p.sensor_lag == 0.0 and p.sensor_delay == 0.0:
        level = see(sensor, s, p, floor)
    else:
        level = delayed(eyes.rings[sensor], n, p.sensor_delay / dt)
    noise = eyes.noise_pct * normal(eyes.stream) if eyes.noise_pct > 0.0 else 0.0
    return reported(level, noise, p)


@compiled
def holds(reading: float, comparison: int, threshold: float) -> bool:
    """Whether a reading compares with a threshold as asked (codes as in `gecar.language.opcodes`)."""
    if comparison == 0:
        return reading > threshold
    if comparison == 1:
        return reading < threshold
    if comparison == 2:
        return reading >= threshold
    if comparison == 3:
        return reading <= threshold
    return (reading == threshold) == (comparison == 4)


@compiled
def test_row(
    program: npt.NDArray[np.int32], row: int, k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Eyes
) -> bool:
    """Whether the test in a row holds now."""
    reading = read_sensor(program[row, 1], k.step, s, p, dt, floor, eyes)
    return holds(reading, program[row, 2], program[row, 3] / 1000.0)  # type: ignore[no-any-return]


@compiled
def run_program(
    program: npt.NDArray[np.int32], k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Eyes, motor_noise: float
) -> bool:
    """Run statements until the robot waits again.

    Returns
    -------
    bool
        False if a whole pass takes no time: the program is stuck.
    """
    if k.until >= 0:
        if k.step < k.due_step and not test_row(program, k.until, k, s, p, dt, floor, eyes):
            return True
        k.due_ms = min(k.due_ms, 1000.0 * dt * k.step)
        k.until = -1
    elif k.step < k.due_step:
        return True
    passes = 0
    while True:
        if k.row >= program.shape[0]:
            k.row = 0
            passes += 1
            if passes == 2 or program.shape[0] == 0:
                return False
        row = k.row
        opcode = program[row, 0]
        if opcode == TEST:
            k.row = row + 1 if test_row(program, row, k, s, p, dt, floor, eyes) else program[row, 4]
        elif opcode == JUMP:
            k.row = program[row, 4]
        else:
            k.line = program[row, 5]
            _command(program, row, k, eyes, motor_noise)
            k.row = row + 1
            if opcode == MOTOR_UNTIL:
                k.row = row + 2
                if program[row, 3] > 0:
                    k.until = row + 1
            if program[row, 3] > 0:
                passes = 0
                k.due_ms += program[row, 3]
                k.due_step = int(math.ceil(k.due_ms / (1000.0 * dt) - 1e-6))
                if k.due_step > k.step:
                    return True


@compiled
def _command(program: npt.NDArray[np.int32], row: int, k: Any, eyes: Eyes, motor_noise: float) -> None:
    k.left_duty = program[row, 1] / 100.0
    k.right_duty = program[row, 2] / 100.0
    if motor_noise > 0.0:
        k.left_duty *= 1.0 + motor_noise * normal(eyes.stream)
        k.right_duty *= 1.0 + motor_noise * normal(eyes.stream)
