"""What programs calculate with: sensors, timer, registers, numbers, and operations on them, as a tree."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from gecar.language import opcodes


class Sensor(Enum):
    """A colour sensor: the words programs use for what it reads and what it read before, and its number in opcodes."""

    CENTRE = ("SensorValue", "PreviousValue", opcodes.SENSOR)
    LEFT = ("LeftSensorValue", "LeftPreviousValue", opcodes.LEFT_SENSOR)
    RIGHT = ("RightSensorValue", "RightPreviousValue", opcodes.RIGHT_SENSOR)

    def __init__(self, word: str, previous: str, index: int) -> None:
        self.word = word
        self.previous = previous
        self.index = index


class Operator(Enum):
    """Arithmetic: the mark programs use, its number in opcodes, and how tightly it binds."""

    ADD = ("+", opcodes.ADD, 1)
    SUBTRACT = ("-", opcodes.SUBTRACT, 1)
    MULTIPLY = ("*", opcodes.MULTIPLY, 2)
    DIVIDE = ("/", opcodes.DIVIDE, 2)

    def __init__(self, word: str, op: int, binding: int) -> None:
        self.word = word
        self.op = op
        self.binding = binding


@dataclass(frozen=True)
class Constant:
    """A number [thousandths]."""

    thousandths: int

    def __str__(self) -> str:
        return decimal(self.thousandths)


@dataclass(frozen=True)
class Reading:
    """What a sensor reports now [whole percent]."""

    sensor: Sensor

    def __str__(self) -> str:
        return self.sensor.word


@dataclass(frozen=True)
class Previous:
    """What a sensor reported when the last motor statement began [whole percent]; 0 before the first."""

    sensor: Sensor

    def __str__(self) -> str:
        return self.sensor.previous


@dataclass(frozen=True)
class Timer:
    """Time since the drive began, or since ``reset_timer()`` [whole ms]."""

    def __str__(self) -> str:
        return "Timer"


@dataclass(frozen=True)
class Register:
    """What a register holds; 0 at first."""

    number: int

    def __str__(self) -> str:
        return f"r{self.number}"


@dataclass(frozen=True)
class Operation:
    """Two values added, subtracted, multiplied or divided."""

    operator: Operator
    left: Value
    right: Value

    def __str__(self) -> str:
        binding = self.operator.binding
        return f"{_within(self.left, binding)} {self.operator.word} {_within(self.right, binding + 1)}"


Value = Constant | Reading | Previous | Timer | Register | Operation


def _within(value: Value, binding: int) -> str:
    """Write a value, in parentheses if it binds less tightly than what is around it."""
    loose = isinstance(value, Operation) and value.operator.binding < binding
    return f"({value})" if loose else str(value)


def decimal(thousandths: int) -> str:
    """Write thousandths as a decimal number."""
    whole, rest = divmod(abs(thousandths), opcodes.ONE)
    digits = f"{whole}.{rest:03d}".rstrip("0").rstrip(".")
    return f"-{digits}" if thousandths < 0 else digits
