"""The robot language's statements, as a tree."""

from __future__ import annotations

from dataclasses import dataclass

from gecar.language.conditions import Condition
from gecar.language.values import Value


@dataclass(frozen=True)
class Motor:
    """Drive with two duties [%] for a time [ms]; a duty is a whole number, or a value worked out when it begins."""

    left: int | Value
    right: int | Value
    time: int

    def __str__(self) -> str:
        return f"motor({self.left},{self.right},{self.time})"


@dataclass(frozen=True)
class MotorUntil:
    """Drive with two duties [%] until a condition holds, at most for a time [ms]."""

    left: int | Value
    right: int | Value
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


@dataclass(frozen=True)
class While:
    """Repeat statements as long as a condition holds; a turn that takes no time waits for the next step."""

    condition: Condition
    body: tuple[Statement, ...]

    def __str__(self) -> str:
        return f"while({self.condition}):"


@dataclass(frozen=True)
class Set:
    """Put a value into a register."""

    register: int
    value: Value

    def __str__(self) -> str:
        return f"r{self.register} = {self.value}"


@dataclass(frozen=True)
class ResetTimer:
    """Start the timer again."""

    def __str__(self) -> str:
        return "reset_timer()"


Statement = Motor | MotorUntil | If | While | Set | ResetTimer
