"""The robot language's interpreter: flat opcodes, run whenever the robot no longer waits."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel
from gecar.language.opcodes import EQUAL, JUMP, MOTOR_UNTIL, TEST
from gecar.random_streams import LARGEST_NORMAL, normal, skip_normal
from gecar.world.kernel.sensing import RING, delayed, glance, lag_keep, lagged, reported
from gecar.world.kernel.terms import colour_error

# Where the program stands. `due_ms` is the schedule the program asks for; steps round it, but never add up errors.
CONTROL = np.dtype(
    [(field, np.int64) for field in ("row", "until", "due_step", "step", "line", "tile")]
    + [(field, np.float64) for field in ("due_ms", "left_duty", "right_duty")]
)


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
# them the program reads; deviations of a reading [%] and a command; time of a statement [ms]; the random stream.
EYES = np.dtype(
    [
        ("rings", np.float64, (3 * RING,)),
        ("used", np.int8, (3,)),
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
    return glance(floor.averaged, floor.pitch, s, _side(sensor, p), p)


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
    """Return the reflection [%] that a sensor reports on at step ``n``: lagged and late, without noise."""
    if p.sensor_lag == 0.0 and p.sensor_delay == 0.0:
        level = see(sensor, s, p, floor)
    else:
        level = delayed(eyes.rings, sensor * RING, n, p.sensor_delay / dt)
    if p.n_terms > 0.0:  # what they add, they add to the reading
        x, y = s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin
        level += (
            colour_error(s.t, x, y, s.heading, p.sensor_gain * level + p.sensor_offset, p) / p.sensor_gain
        )
    return level


@kernel
def read_sensor(sensor: int, n: int, s: Any, p: Any, dt: float, floor: Floor, eyes: Any) -> float:
    """Return the whole percent a sensor reports at step ``n``."""
    level = reflection(sensor, n, s, p, dt, floor, eyes)
    noise = eyes.noise_pct * normal(eyes) if eyes.noise_pct > 0.0 else 0.0
    return reported(level, noise, p)


@kernel
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


@kernel
def test_row(
    program: npt.NDArray[np.int32], row: int, k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Whether the test in a row holds now; as a reading compares, but noise that cannot matter is only skipped."""
    comparison, threshold = program[row, 2], program[row, 3] / 1000.0
    level = reflection(program[row, 1], k.step, s, p, dt, floor, eyes)
    most = LARGEST_NORMAL * eyes.noise_pct
    answer = holds(reported(level, most, p), comparison, threshold)
    if eyes.noise_pct == 0.0:
        return answer
    if comparison < EQUAL and answer == holds(reported(level, -most, p), comparison, threshold):
        skip_normal(eyes)
        return answer
    return holds(reported(level, eyes.noise_pct * normal(eyes), p), comparison, threshold)


@kernel
def _goes_on(
    program: npt.NDArray[np.int32], k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Whether the wait is over: by time, or by the test of a MOTOR_UNTIL."""
    if k.until < 0:
        return k.step >= k.due_step
    if k.step < k.due_step and not test_row(program, k.until, k, s, p, dt, floor, eyes):
        return False
    k.due_ms = min(k.due_ms, 1000.0 * dt * k.step)
    k.until = -1
    return True


@kernel
def first_step_after(due_ms: float, dt: float) -> int:
    """Return the first step at or after a time [ms]."""
    return math.ceil(due_ms / (1000.0 * dt) - 1e-6)


@kernel
def run_program(
    program: npt.NDArray[np.int32], k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Run statements until the robot waits again; a pass that takes no time waits for the next step.

    Returns
    -------
    bool
        False if the program is stuck: a whole pass takes no time, the robot stands, and nothing it reads can change.
    """
    if not _goes_on(program, k, s, p, dt, floor, eyes):
        return True
    passes = 1 if k.row == 0 else 0
    while passes < 2:
        if k.row >= program.shape[0]:
            k.row = 0
            passes += 1
        elif program[k.row, 0] == TEST:
            target = program[k.row, 4]
            k.row = k.row + 1 if test_row(program, k.row, k, s, p, dt, floor, eyes) else target
        elif program[k.row, 0] == JUMP:
            k.row = program[k.row, 4]
        elif _command(program, k, eyes):
            passes = 0
            k.due_step = first_step_after(k.due_ms, dt)
            if k.due_step > k.step:
                return True
    k.due_step = k.step + 1
    k.due_ms = 1000.0 * dt * k.due_step
    return not _stands_for_ever(k, s, eyes)


@kernel
def _stands_for_ever(k: Any, s: Any, eyes: Any) -> bool:
    """Whether a robot whose program takes no time stands without command and noise, so that nothing changes."""
    still = s.vx == 0.0 and s.vy == 0.0 and s.yaw_rate == 0.0 and s.left_speed == 0.0 and s.right_speed == 0.0
    return still and k.left_duty == 0.0 and k.right_duty == 0.0 and eyes.noise_pct == 0.0


@kernel
def _command(program: npt.NDArray[np.int32], k: Any, eyes: Any) -> bool:
    """Run the MOTOR or MOTOR_UNTIL the program stands at; return whether it takes time."""
    row = k.row
    until = program[row, 0] == MOTOR_UNTIL
    k.row = row + 2 if until else row + 1
    k.line = program[row, 5]
    k.left_duty = program[row, 1] / 100.0
    k.right_duty = program[row, 2] / 100.0
    if eyes.motor_noise > 0.0:
        k.left_duty *= 1.0 + eyes.motor_noise * normal(eyes)
        k.right_duty *= 1.0 + eyes.motor_noise * normal(eyes)
    time = program[row, 3] + eyes.statement_ms
    k.due_ms += time
    takes_time = time > 0.0
    if until and takes_time:
        k.until = row + 1
    return takes_time
