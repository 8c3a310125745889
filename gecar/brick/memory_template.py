"""The part of main.py that programs with memory need: calculation, timer, loops. See `gecar.language.opcodes`."""

from __future__ import annotations

import numpy as np

from gecar.brick.python_source import KEPT, READERS
from gecar.language import opcodes
from gecar.language.program import Program
from gecar.language.values import Sensor

CALCULATION = f'''# The program calculates in whole thousandths, as gecar's simulation does: equal to the last digit.
MAX_VALUE = {opcodes.MAX_VALUE}


def held(value):
    return max(-MAX_VALUE, min(MAX_VALUE, value))


def add(left, right):
    return held(left + right)


def subtract(left, right):
    return held(left - right)


def multiply(left, right):
    return held(left * right // {opcodes.ONE})


def divide(left, right):
    return held(left * {opcodes.ONE} // right if right else left * MAX_VALUE)


def duty(value):
    """Return a duty in whole percent."""
    return max(-{opcodes.MAX_DUTY_PCT}, min({opcodes.MAX_DUTY_PCT}, (value + {opcodes.ONE // 2}) // {opcodes.ONE}))


'''

TIMER = f"""timer_ms = 0  # when the timer began


def timer():
    return held((clock.time() - timer_ms) * {opcodes.ONE})


def reset_timer():
    global timer_ms
    timer_ms = clock.time()


"""

LOOPS = '''turned = -1  # the last loop that turned, and the schedule then
turned_ms = -1


def turn(number):
    """End a turn of a loop; one in which no time has passed waits a millisecond, as a pass does."""
    global turned, turned_ms, due_ms
    if number <= turned and due_ms == turned_ms:
        due_ms += 1
        drive_until_due(None)
    turned = number
    turned_ms = due_ms


'''


def memory_text(program: Program) -> str:
    """Return what a program needs of this; nothing for one of Table 3's language."""
    ops = set(program.opcodes[:, opcodes.OP].tolist())
    variables = [
        *_registers(program, opcodes.SET, opcodes.REGISTER),
        *(KEPT[s] for s in _remembered(program)),
    ]
    return (
        (CALCULATION if max(ops) > opcodes.JUMP else "")
        + (TIMER if ops & {opcodes.TIMER, opcodes.RESET_TIMER} else "")
        + (LOOPS if opcodes.LOOP in ops else "")
        + "".join(f"{variable} = 0\n" for variable in variables)
        + ("\n\n" if variables else "")
    )


def registers_set(program: Program) -> list[str]:
    """Return the registers that a program sets."""
    return _registers(program, opcodes.SET)


def keeping_text(program: Program) -> str:
    """Return the lines that keep what sensors read when a motor statement begins."""
    sensors = _remembered(program)
    if not sensors:
        return ""
    declared = ", ".join(KEPT[sensor] for sensor in sensors)
    return f"    global {declared}\n" + "".join(f"    {KEPT[s]} = {READERS[s]}()\n" for s in sensors)


def _registers(program: Program, *ops: int) -> list[str]:
    """Return the registers in rows of some kinds."""
    return [f"r{number}" for number in _of(program, *ops)]


def _remembered(program: Program) -> list[Sensor]:
    """Return the sensors whose previous readings a program reads."""
    return [sensor for sensor in Sensor if sensor.index in _of(program, opcodes.PREVIOUS)]


def _of(program: Program, *ops: int) -> list[int]:
    """Return what rows of some kinds have in column A, each once."""
    rows = program.opcodes
    return sorted(set(rows[np.isin(rows[:, opcodes.OP], ops), opcodes.A].tolist()))
