"""The robot language's interpreter: flat opcodes, run whenever the robot no longer waits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel
from gecar.language.opcodes import (
    CONSTANT,
    DRIVE,
    EQUAL,
    HOLD,
    JUMP,
    LOOP,
    MAX_DUTY_PCT,
    MOTOR_UNTIL,
    N_REGISTERS,
    ONE,
    REMEMBER,
    STACK,
    TEST,
)
from gecar.random_streams import normal, normal_bound, normal_quantile, uniform
from gecar.world.kernel.calculation import calculate, holds
from gecar.world.kernel.eyes import Floor, reflection
from gecar.world.kernel.sensing import reported

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


@kernel
def test_row(
    program: npt.NDArray[np.int32], row: int, k: Any, s: Any, p: Any, dt: float, floor: Floor, eyes: Any
) -> bool:
    """Whether the test in a row holds now, as a reading compares; noise is worked out only where it may matter."""
    comparison, threshold = program[row, 2], program[row, 3]
    level = reflection(program[row, 1], k.step, s, p, dt, floor, eyes)
    answer = holds(ONE * reported(level, 0.0, p), comparison, threshold)
    if eyes.noise_pct == 0.0:
        return answer
    u = uniform(eyes)
    most = eyes.noise_pct * normal_bound(u)
    if comparison < EQUAL and answer == holds(ONE * reported(level, most, p), comparison, threshold):
        return answer
    return holds(ONE * reported(level, eyes.noise_pct * normal_quantile(u), p), comparison, threshold)


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
    row, rows = k.row, program.shape[0]  # kept in registers: polling is most of a drive's time
    surely_now_ms = 1000.0 * dt * (k.step - 0.001)
    passes = 1 if row == 0 else 0
    while passes < 2:
        if row >= rows:
            row = 0
            passes += 1
            continue
        op = program[row, 0]
        if op == TEST:
            row = row + 1 if test_row(program, row, k, s, p, dt, floor, eyes) else program[row, 4]
        elif op == JUMP:
            row = program[row, 4]
        elif op == LOOP:
            k.row = row
            again = _turns_in_no_time(program, k)
            row = k.row
            if again:
                break
        elif CONSTANT <= op <= REMEMBER:
            row = calculate(program, row, k, s, p, dt, floor, eyes)
        else:
            k.row = row
            takes_time = _command(program, k, eyes)
            row = k.row
            if takes_time:
                passes = 0
                if k.due_ms > surely_now_ms and _waits(k, dt):
                    return True
    k.row = row
    k.due_step = k.step + 1
    k.due_ms = 1000.0 * dt * k.due_step
    if passes < 2:
        k.turned_ms = k.due_ms
    stuck = _stands_for_ever(k, s, eyes)
    k.changed = 0
    return not stuck


@kernel
def _waits(k: Any, dt: float) -> bool:
    """Set the step the program waits for; return whether that is yet to come."""
    k.due_step = first_step_after(k.due_ms, dt)
    return k.due_step > k.step


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
