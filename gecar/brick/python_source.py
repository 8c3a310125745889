"""A program's statements as the Python that a brick runs and a person reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gecar.language.opcodes import THRESHOLDS_PER_PCT
from gecar.language.statements import Condition, If, Motor, MotorUntil, Sensor, Statement

# The function that reads each sensor.
READERS = {
    Sensor.CENTRE: "sensor_value",
    Sensor.LEFT: "left_sensor_value",
    Sensor.RIGHT: "right_sensor_value",
}


def function_text(statements: Sequence[Statement]) -> str:
    """Return ``def program(): ...`` for some statements."""
    return "\n".join(["def program():", *_block(statements, 1)]) + "\n"


def _block(statements: Sequence[Statement], depth: int) -> Iterator[str]:
    if not statements:
        yield "    " * depth + "pass"
    for statement in statements:
        yield from _lines(statement, depth)


def _lines(statement: Statement, depth: int) -> Iterator[str]:
    indent = "    " * depth
    if isinstance(statement, Motor):
        yield f"{indent}motor({statement.left}, {statement.right}, {statement.time})"
    elif isinstance(statement, MotorUntil):
        duties = f"{statement.left}, {statement.right}, {statement.time}"
        yield f"{indent}motor_until({duties}, lambda: {_condition(statement.condition)})"
    else:
        yield from _if_lines(statement, depth)


def _if_lines(statement: If, depth: int) -> Iterator[str]:
    indent = "    " * depth
    yield f"{indent}if {_condition(statement.condition)}:"
    yield from _block(statement.then, depth + 1)
    if statement.otherwise:
        yield f"{indent}else:"
        yield from _block(statement.otherwise, depth + 1)


def _condition(condition: Condition) -> str:
    threshold = f"{condition.threshold / THRESHOLDS_PER_PCT:g}"
    return f"{READERS[condition.sensor]}() {condition.comparison.word} {threshold}"
