"""Calculation of programs with memory: rows that work on a stack, in whole thousandths."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel, subroutine
from gecar.language.opcodes import (
    ADD,
    COMPARE,
    CONSTANT,
    MAX_VALUE,
    MULTIPLY,
    ONE,
    PREVIOUS,
    READING,
    REGISTER,
    REMEMBER,
    RESET_TIMER,
    SET,
    SUBTRACT,
)
from gecar.random_streams import normal
from gecar.world.kernel.eyes import Floor, reflection
from gecar.world.kernel.sensing import reported


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
    while row < program.shape[0]:
        op, a = program[row, 0], program[row, 1]
        if op < CONSTANT or op > REMEMBER:
            break
        row += 1
        if op in (READING, REMEMBER):
            level = reflection(a, k.step, s, p, dt, floor, eyes)
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
