"""Robot programs: statements, the text people read, and the rows a compiled interpreter runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.files import read_text
from gecar.language import opcodes
from gecar.language.source_position import plain
from gecar.language.statements import Condition, If, Motor, MotorUntil, Sensor, Statement
from gecar.language.syntax import parse_statements

Opcodes = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Program:
    """Statements the robot repeats for ever.

    Attributes
    ----------
    statements
        In order; none is a program that does nothing and takes no time.
    """

    statements: tuple[Statement, ...]

    @cached_property
    def _layout(self) -> _Layout:
        layout = _Layout()
        layout.block(self.statements, 0)
        return layout

    @cached_property
    def source(self) -> str:
        """The program in the form of the paper's Fig. 6, without a line end at its end."""
        return "\n".join(self._layout.lines)

    @cached_property
    def opcodes(self) -> Opcodes:
        """Return the compiled program (rows, 6); `gecar.language.opcodes` explains the columns."""
        return np.array(self._layout.rows, np.int32).reshape(-1, opcodes.N_COLUMNS)

    @cached_property
    def canonical(self) -> bytes:
        """What two programs share exactly if they do the same row by row: the opcodes without their lines."""
        return self.opcodes[:, : opcodes.LINE].tobytes()

    @cached_property
    def sensors(self) -> frozenset[Sensor]:
        """The sensors the program reads."""
        tests = self.opcodes[self.opcodes[:, opcodes.OP] == opcodes.TEST]
        return frozenset(sensor for sensor in Sensor if sensor.index in tests[:, opcodes.A])

    def __str__(self) -> str:
        return self.source


class _Layout:
    """Writes lines and rows side by side, so that each row knows its line."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.rows: list[list[int]] = []

    def block(self, statements: Iterable[Statement], depth: int) -> None:
        for statement in statements:
            self.lines.append("    " * depth + str(statement))
            if isinstance(statement, If):
                self.conditional(statement, depth)
            else:
                self.drive(statement)

    def drive(self, statement: Motor | MotorUntil) -> None:
        if isinstance(statement, Motor):
            self.row(opcodes.MOTOR, statement.left, statement.right, statement.time)
        else:
            self.row(opcodes.MOTOR_UNTIL, statement.left, statement.right, statement.time)
            self.test(statement.condition)

    def conditional(self, statement: If, depth: int) -> None:
        line = len(self.lines)
        test = self.test(statement.condition)
        if statement.then:
            self.block(statement.then, depth + 1)
        else:
            self.lines.append("    " * (depth + 1) + "pass")
        if statement.otherwise:
            jump = self.row(opcodes.JUMP)
            jump[opcodes.LINE] = line
            test[opcodes.TARGET] = len(self.rows)
            self.lines.append("    " * depth + "else:")
            self.block(statement.otherwise, depth + 1)
            jump[opcodes.TARGET] = len(self.rows)
        else:
            test[opcodes.TARGET] = len(self.rows)

    def test(self, condition: Condition) -> list[int]:
        return self.row(opcodes.TEST, condition.sensor.index, condition.comparison.index, condition.threshold)

    def row(self, op: int, a: int = 0, b: int = 0, c: int = 0) -> list[int]:
        row = [op, a, b, c, 0, len(self.lines)]
        self.rows.append(row)
        return row


def parse_program(text: str, source: str = "<program>") -> Program:
    """Read a robot program in either of the paper's ways of writing.

    Parameters
    ----------
    text
        The program; `gecar.language.syntax` says what may stand in it.
    source
        Its file's name, for errors.

    Raises
    ------
    InputError
        If it is no program, or longer than 100,000 characters, than 10,000 statements or nested deeper than
        100; the message names line and column, what is there and what should be.
    """
    return Program(parse_statements(plain(text), source))


def read_program(path: Path) -> Program:
    """Read a program file.

    Raises
    ------
    InputError
        If the file cannot be read, holds no statement, or as `parse_program`.
    """
    program = parse_program(read_text(path, "a program file"), str(path))
    if not program.statements:
        raise expected(path, "an empty program", "a statement, as motor(50,50,100)")
    return program


def mirrored(program: Program) -> Program:
    """Exchange left and right: duties and side sensors, everywhere."""
    return Program(tuple(_mirrored(statement) for statement in program.statements))


def _mirrored(statement: Statement) -> Statement:
    if isinstance(statement, Motor):
        return Motor(statement.right, statement.left, statement.time)
    condition = _mirrored_condition(statement.condition)
    if isinstance(statement, MotorUntil):
        return MotorUntil(statement.right, statement.left, statement.time, condition)
    then, otherwise = (tuple(map(_mirrored, branch)) for branch in (statement.then, statement.otherwise))
    return If(condition, then, otherwise)


def _mirrored_condition(condition: Condition) -> Condition:
    sides = {Sensor.LEFT: Sensor.RIGHT, Sensor.RIGHT: Sensor.LEFT}
    return replace(condition, sensor=sides.get(condition.sensor, condition.sensor))
