"""What programs ask: comparisons, and ``and``, ``or``, ``not`` of them, as a tree."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from gecar.language import opcodes
from gecar.language.values import Sensor, Value, decimal


class Comparison(Enum):
    """How two values are compared: the mark programs use, and its number in opcodes."""

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

    @property
    def opposite(self) -> Comparison:
        """The comparison that holds exactly if this one does not."""
        return _OPPOSITE[self]


_TURNED = {
    Comparison.GREATER: Comparison.LESS,
    Comparison.LESS: Comparison.GREATER,
    Comparison.GREATER_EQUAL: Comparison.LESS_EQUAL,
    Comparison.LESS_EQUAL: Comparison.GREATER_EQUAL,
}
_OPPOSITE = {
    Comparison.GREATER: Comparison.LESS_EQUAL,
    Comparison.LESS: Comparison.GREATER_EQUAL,
    Comparison.GREATER_EQUAL: Comparison.LESS,
    Comparison.LESS_EQUAL: Comparison.GREATER,
    Comparison.EQUAL: Comparison.NOT_EQUAL,
    Comparison.NOT_EQUAL: Comparison.EQUAL,
}


@dataclass(frozen=True)
class Threshold:
    """A sensor compared with a threshold [thousandths of a percent]."""

    sensor: Sensor
    comparison: Comparison
    threshold: int

    def __str__(self) -> str:
        return f"{self.sensor.word} {self.comparison.word} {decimal(self.threshold)}"


@dataclass(frozen=True)
class Compared:
    """Two values compared, which are not a sensor and a number."""

    left: Value
    comparison: Comparison
    right: Value

    def __str__(self) -> str:
        return f"{self.left} {self.comparison.word} {self.right}"


@dataclass(frozen=True)
class Not:
    """The opposite of a condition."""

    condition: Condition

    def __str__(self) -> str:
        return f"not {_whole(self.condition)}"


@dataclass(frozen=True)
class And:
    """Both conditions; the second is only asked if the first holds."""

    left: Condition
    right: Condition

    def __str__(self) -> str:
        return f"{_whole(self.left, Or)} and {_whole(self.right)}"


@dataclass(frozen=True)
class Or:
    """At least one of the conditions; the second is only asked if the first does not hold."""

    left: Condition
    right: Condition

    def __str__(self) -> str:
        return f"{_whole(self.left, And)} or {_whole(self.right)}"


Condition = Threshold | Compared | Not | And | Or


def _whole(condition: Condition, apart: type[And | Or] | None = None) -> str:
    """Write a part of a condition, in parentheses if it has parts itself: all such, or those of one kind."""
    return f"({condition})" if isinstance(condition, apart or And | Or) else str(condition)
