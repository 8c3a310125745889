"""A program's statements as the Python that a brick runs and a person reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gecar.language.conditions import And, Condition, Not, Or, Threshold
from gecar.language.opcodes import ONE
from gecar.language.statements import If, Motor, MotorUntil, ResetTimer, Set, Statement, While
from gecar.language.values import (
    Constant,
    Operation,
    Operator,
    Previous,
    Reading,
    Register,
    Sensor,
    Timer,
    Value,
)

# The function that reads each sensor, and the variable that keeps what it read before.
READERS = {
    Sensor.CENTRE: "sensor_value",
    Sensor.LEFT: "left_sensor_value",
    Sensor.RIGHT: "right_sensor_value",
}
KEPT = {
    Sensor.CENTRE: "previous_value",
    Sensor.LEFT: "left_previous_value",
    Sensor.RIGHT: "right_previous_value",
}
_ARITHMETIC = {
    Operator.ADD: "add",
    Operator.SUBTRACT: "subtract",
    Operator.MULTIPLY: "multiply",
    Operator.DIVIDE: "divide",
}


def function_text(statements: Sequence[Statement], registers: Sequence[str] = ()) -> str:
    """Return ``def program(): ...`` for some statements, which set some registers."""
    declared = [f"    global {', '.join(registers)}"] if registers else []
    return "\n".join(["def program():", *declared, *_Writer().block(statements, 1)]) + "\n"


class _Writer:
    """Writes statements, and numbers loops in the order of their ends."""

    def __init__(self) -> None:
        self.loops = 0

    def block(self, statements: Sequence[Statement], depth: int) -> Iterator[str]:
        if not statements:
            yield "    " * depth + "pass"
        for statement in statements:
            yield from self.lines(statement, depth)

    def lines(self, statement: Statement, depth: int) -> Iterator[str]:
        indent = "    " * depth
        if isinstance(statement, If):
            yield from self.conditional(statement, depth)
            return
        if isinstance(statement, While):
            yield from self.loop(statement, depth)
            return
        text, plain = _single(statement)
        if not plain:
            yield f"{indent}# {statement}"
        yield indent + text

    def conditional(self, statement: If, depth: int) -> Iterator[str]:
        indent = "    " * depth
        yield f"{indent}if {_condition(statement.condition)}:"
        yield from self.block(statement.then, depth + 1)
        if statement.otherwise:
            yield f"{indent}else:"
            yield from self.block(statement.otherwise, depth + 1)

    def loop(self, statement: While, depth: int) -> Iterator[str]:
        indent = "    " * depth
        yield f"{indent}while {_condition(statement.condition)}:"
        if statement.body:
            yield from self.block(statement.body, depth + 1)
        yield f"{indent}    turn({self.loops})"
        self.loops += 1


def _single(statement: Motor | MotorUntil | Set | ResetTimer) -> tuple[str, bool]:
    """Return a statement without branches, and whether it says what it does without a remark."""
    if isinstance(statement, Set):
        return f"r{statement.register} = {_value(statement.value)}", isinstance(statement.value, Register)
    if isinstance(statement, ResetTimer):
        return "reset_timer()", True
    plain = isinstance(statement.left, int) and isinstance(statement.right, int)
    duties = f"{_duty(statement.left)}, {_duty(statement.right)}, {statement.time}"
    if isinstance(statement, Motor):
        return f"motor({duties})", plain
    return f"motor_until({duties}, lambda: {_condition(statement.condition)})", plain


def _duty(duty: int | Value) -> str:
    return str(duty) if isinstance(duty, int) else f"duty({_value(duty)})"


def _value(value: Value) -> str:
    """Write a value in thousandths."""
    if isinstance(value, Operation):
        return f"{_ARITHMETIC[value.operator]}({_value(value.left)}, {_value(value.right)})"
    if isinstance(value, Constant):
        return str(value.thousandths)
    if isinstance(value, Reading):
        return f"{READERS[value.sensor]}() * {ONE}"
    if isinstance(value, Previous):
        return f"{KEPT[value.sensor]} * {ONE}"
    return "timer()" if isinstance(value, Timer) else str(value)


def _condition(condition: Condition) -> str:
    if isinstance(condition, Threshold):
        threshold = f"{condition.threshold / ONE:g}"
        return f"{READERS[condition.sensor]}() {condition.comparison.word} {threshold}"
    if isinstance(condition, Not):
        return f"not ({_condition(condition.condition)})"
    if isinstance(condition, And | Or):
        word = "and" if isinstance(condition, And) else "or"
        return f"({_condition(condition.left)}) {word} ({_condition(condition.right)})"
    return f"{_value(condition.left)} {condition.comparison.word} {_value(condition.right)}"
