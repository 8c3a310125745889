"""The robot language's interpreter: flat opcodes, run whenever the robot no longer waits."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel, subroutine
from gecar.language.opcodes import (
    ADD,
    COMPARE,
    CONSTANT,
    DRIVE,
    EQUAL,
    HOLD,
    JUMP,
    LOOP,
    MAX_DUTY_PCT,
    MAX_VALUE,
    MOTOR_UNTIL,
    MULTIPLY,
    N_REGISTERS,
    ONE,
    PREVIOUS,
    READING,
    REGISTER,
    REMEMBER,
    RESET_TIMER,
    SET,
    STACK,
    SUBTRACT,
    TEST,
)
from gecar.random_streams import LARGEST_NORMAL, normal, skip_normal
from gecar.world.kernel.sensing import RING, delayed, glance, lag_keep, lagged, reported
from gecar.world.kernel.terms import colour_error

# Where the program stands. `due_ms` is the schedule the program asks for; steps round it, but never add up errors.
# Of programs with memory: the last row of a loop that turned, and the schedule then; whether memory changed since the
# program last waited for taking no time; when the timer began [ms]; registers, what sensors reported before, the stack.
CONTROL = np.dtype(
    [(field, np.int64) for field in ("row", "until", "due_step", "step", "line", "tile")]
    + [(field, np.float64) for field in ("due_ms", "left_duty", "right_duty")]
    + [("turned_ms", np.float64)]
    + [(field, np.int64) for field in ("turned", "changed", "timer_ms")]
    + [("registers", np.int64, (N_REGISTERS,)), ("previous", np.int64, (3,)), ("stack", np.int64, (STACK,))]
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
def held(value: int) -> int:
    """Return a number within the range of calculation."""
    return min(max(value, -MAX_VALUE), MAX_VALUE)


@kernel
def arithmetic(op: int, left: int, right: int) -> int:
    """Return what an operation gives [thousandths], from two numbers within the range of calculation."""
    if op == ADD:
        return held(left + right)
    if op == SUBTRACT:
        return held(left - right)
    if op == MULTIPLY:
        return held(left * right // ONE)
    if right == 0:
        return held(left * MAX_VALUE)
    return held(left * ONE // right)


@kernel
def _elapsed(k: Any, dt: float) -> int:
    """Return the whole milliseconds since the timer began."""
    return math.floor(1000.0 * dt * k.step + 1e-6) - k.timer_ms


@kernel
def _keep(numbers: npt.NDArray[np.int64], which: int, number: int, k: Any) -> None:
    """Put a number into memory."""
    if numbers[which] != number:
        numbers[which] = number
        k.changed = 1


@subroutine
def calculate(  # noqa: C901, PLR0912
    program: npt.NDArray[np.int32], row: int, k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> int:
    """Run rows from one on, as long as they only calculate; return the row after them.

    What a DRIVE takes is then at the beginning of the stack.
    """
    stack, top = k.stack, 0
    seen, level = -1, 0.0
    while row < program.shape[0]:
        op, a = program[row, 0], program[row, 1]
        if op < CONSTANT or op > REMEMBER:
            break
        row += 1
        if op in (READING, REMEMBER):
            if a != seen:  # a sensor asked twice in one moment only draws its noise twice
                seen, level = a, reflection(a, k.step, s, p, dt, floor, eyes)
            noise = eyes.noise_pct * normal(eyes) if eyes.noise_pct > 0.0 else 0.0
            reading = int(reported(level, noise, p)) * ONE
            if op == READING:
                stack[top] = reading
                top += 1
            else:
                _keep(k.previous, a, reading, k)
        elif ADD <= op <= COMPARE:
            right = int(program[row - 1, 3])
            if a == 0:
                top -= 1
                right = stack[top]
            if op < COMPARE:
                stack[top - 1] = arithmetic(op, stack[top - 1], right)
            else:
                top -= 1
                if not holds(stack[top], program[row - 1, 2], right):
                    row = program[row - 1, 4]
        elif op == SET:
            top -= 1
            _keep(k.registers, a, stack[top], k)
        elif op == RESET_TIMER:
            k.timer_ms += _elapsed(k, dt)
        else:
            stack[top] = _pushed(op, a, program[row - 1, 3], k, dt)
            top += 1
    return row


@kernel
def _pushed(op: int, a: int, c: int, k: Any, dt: float) -> int:
    """Return what a CONSTANT, PREVIOUS, TIMER or REGISTER pushes."""
    if op == CONSTANT:
        return c
    if op == REGISTER:
        return k.registers[a]
    if op == PREVIOUS:
        return k.previous[a]
    k.changed = 1  # soon it will have
    return held(_elapsed(k, dt) * ONE)


@kernel
def _until_holds(
    program: npt.NDArray[np.int32], k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Whether what the motors turn until holds now: the test of a MOTOR_UNTIL, or the rows after a DRIVE."""
    row = k.until
    if program[row - 1, 0] == MOTOR_UNTIL:
        return test_row(program, row, k, s, p, dt, floor, eyes)
    end = program[row - 1, 4]
    while row < end and program[row, 0] != HOLD:
        if program[row, 0] == TEST:
            row = row + 1 if test_row(program, row, k, s, p, dt, floor, eyes) else program[row, 4]
        elif program[row, 0] == JUMP:
            row = program[row, 4]
        else:
            row = calculate(program, row, k, s, p, dt, floor, eyes)
    return row >= end


@kernel
def _goes_on(
    program: npt.NDArray[np.int32], k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Whether the wait is over: by time, or by what the motors turn until."""
    if k.until < 0:
        return k.step >= k.due_step
    if k.step < k.due_step and not _until_holds(program, k, s, p, dt, floor, eyes):
        return False
    k.due_ms = min(k.due_ms, 1000.0 * dt * k.step)
    k.until = -1
    return True


@kernel
def first_step_after(due_ms: float, dt: float) -> int:
    """Return the first step at or after a time [ms]."""
    return math.ceil(due_ms / (1000.0 * dt) - 1e-6)


@kernel
def run_program(  # noqa: C901
    program: npt.NDArray[np.int32], k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Run statements until the robot waits again; one step, if a pass or a loop's turn takes no time.

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
        elif CONSTANT <= program[k.row, 0] <= REMEMBER:
            k.row = calculate(program, k.row, k, s, p, dt, floor, eyes)
        elif program[k.row, 0] == LOOP:
            if _turns_in_no_time(program, k):
                break
        elif _command(program, k, eyes):
            passes = 0
            k.due_step = first_step_after(k.due_ms, dt)
            if k.due_step > k.step:
                return True
    k.due_step = k.step + 1
    k.due_ms = 1000.0 * dt * k.due_step
    if passes < 2:
        k.turned_ms = k.due_ms
    stuck = _stands_for_ever(k, s, eyes)
    k.changed = 0
    return not stuck


@kernel
def _turns_in_no_time(program: npt.NDArray[np.int32], k: Any) -> bool:
    """Go back to the loop's first row; return whether this loop, or one around it, has turned since time passed.

    The ends of loops stand in the order in which loops can turn one after the other: those within before those around.
    """
    row, k.row = k.row, program[k.row, 4]
    again = row <= k.turned and k.due_ms == k.turned_ms
    k.turned, k.turned_ms = row, k.due_ms
    return again


@kernel
def _stands_for_ever(k: Any, s: Any, eyes: Any) -> bool:
    """Whether a robot whose program takes no time stands without command and noise, so that nothing changes."""
    still = s.vx == 0.0 and s.vy == 0.0 and s.yaw_rate == 0.0 and s.left_speed == 0.0 and s.right_speed == 0.0
    quiet = k.left_duty == 0.0 and k.right_duty == 0.0 and eyes.noise_pct == 0.0
    return still and quiet and k.changed == 0


@kernel
def _share(duty: int) -> float:
    """Return a duty [thousandths of a percent] as a share, rounded to a whole percent and within bounds."""
    return min(max((duty + ONE // 2) // ONE, -MAX_DUTY_PCT), MAX_DUTY_PCT) / 100.0


@kernel
def _command(program: npt.NDArray[np.int32], k: Any, eyes: Any) -> bool:
    """Run the MOTOR, MOTOR_UNTIL or DRIVE the program stands at; return whether it takes time."""
    row = k.row
    k.line = program[row, 5]
    if program[row, 0] == DRIVE:
        until = program[row, 2] != 0
        k.row = program[row, 4] if until else row + 1
        k.left_duty, k.right_duty = _share(k.stack[0]), _share(k.stack[1])
    else:
        until = program[row, 0] == MOTOR_UNTIL
        k.row = row + 2 if until else row + 1
        k.left_duty, k.right_duty = program[row, 1] / 100.0, program[row, 2] / 100.0
    if eyes.motor_noise > 0.0:
        k.left_duty *= 1.0 + eyes.motor_noise * normal(eyes)
        k.right_duty *= 1.0 + eyes.motor_noise * normal(eyes)
    time = program[row, 3] + eyes.statement_ms
    k.due_ms += time
    takes_time = time > 0.0
    if until and takes_time:
        k.until = row + 1
    return takes_time
