"""Robot programs: statements, the text people read, and the rows a compiled interpreter runs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.files import read_text
from gecar.language import opcodes
from gecar.language.layout import Layout
from gecar.language.mirror import mirror
from gecar.language.source_position import plain
from gecar.language.statements import Statement
from gecar.language.syntax import MAX_CHARACTERS, parse_statements
from gecar.language.values import Sensor

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
    def _layout(self) -> Layout:
        return Layout(self.statements)

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
        used = sensors_used(self.opcodes)
        return frozenset(sensor for sensor in Sensor if used[sensor.index])

    def __str__(self) -> str:
        return self.source


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
    program = Program(parse_statements(plain(text), source))
    if "def" in text and len(program.source) > MAX_CHARACTERS:
        found = f"{len(program.source)} characters, macros written out"
        raise expected(source, found, f"a program of at most {MAX_CHARACTERS}")
    return program


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


_READS = np.isin(np.arange(opcodes.LOOP + 1), opcodes.READING_OPS)  # by kind of row


def sensors_used(rows: Opcodes) -> npt.NDArray[np.bool_]:
    """Return which of the sensors (centre, left, right) a program's rows read, shape (3,)."""
    used = np.zeros(3, np.bool_)
    used[rows[_READS[rows[:, opcodes.OP]], opcodes.A]] = True
    return used


def mirrored(program: Program) -> Program:
    """Exchange left and right: duties and side sensors, everywhere."""
    return Program(mirror(program.statements))
