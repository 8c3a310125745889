"""The robot language's statements, as a tree."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from gecar.language import opcodes


class Sensor(Enum):
    """A colour sensor: the word programs use, and its number in opcodes."""

    CENTRE = ("SensorValue", opcodes.SENSOR)
    LEFT = ("LeftSensorValue", opcodes.LEFT_SENSOR)
    RIGHT = ("RightSensorValue", opcodes.RIGHT_SENSOR)

    def __init__(self, word: str, index: int) -> None:
        self.word = word
        self.index = index


class Comparison(Enum):
    """How a sensor is compared with a threshold: the mark programs use, and its number in opcodes."""

    GREATER = (">", opcodes.GREATER)
    LESS = ("<", opcodes.LESS)
    GREATER_EQUAL = (">=", opcodes.GREATER_EQUAL)
    LESS_EQUAL = ("<=", opcodes.LESS_EQUAL)
    EQUAL = ("==", opcodes.EQUAL)
    NOT_EQUAL = ("!=", opcodes.NOT_EQUAL)

    def __init__(self, word: str, index: int) -> None:
        self.word = word
        self.index = index

    @property
    def turned(self) -> Comparison:
        """The comparison that says the same with its sides exchanged."""
        return _TURNED.get(self, self)


_TURNED = {
    Comparison.GREATER: Comparison.LESS,
    Comparison.LESS: Comparison.GREATER,
    Comparison.GREATER_EQUAL: Comparison.LESS_EQUAL,
    Comparison.LESS_EQUAL: Comparison.GREATER_EQUAL,
}


@dataclass(frozen=True)
class Condition:
    """A sensor compared with a threshold [thousandths of a percent]."""

    sensor: Sensor
    comparison: Comparison
    threshold: int

    def __str__(self) -> str:
        whole, rest = divmod(abs(self.threshold), opcodes.THRESHOLDS_PER_PCT)
        digits = f"{whole}.{rest:03d}".rstrip("0").rstrip(".")
        sign = "-" if self.threshold < 0 else ""
        return f"{self.sensor.word} {self.comparison.word} {sign}{digits}"


@dataclass(frozen=True)
class Motor:
    """Drive with two duties [%] for a time [ms]."""

    left: int
    right: int
    time: int

    def __str__(self) -> str:
        return f"motor({self.left},{self.right},{self.time})"


@dataclass(frozen=True)
class MotorUntil:
    """Drive with two duties [%] until a condition holds, at most for a time [ms]."""

    left: int
    right: int
    time: int
    condition: Condition

    def __str__(self) -> str:
        return f"motor_until({self.left},{self.right},{self.time},{self.condition})"


@dataclass(frozen=True)
class If:
    """Run the statements of one branch or the other; either may be empty."""

    condition: Condition
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...] = ()

    def __str__(self) -> str:
        return f"if({self.condition}):"


Statement = Motor | MotorUntil | If
