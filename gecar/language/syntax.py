"""Reading the robot language: text to statements.

    program   = { statement | ";" }
    statement = "motor" "(" sum "," sum "," sum ")"
              | "motor_until" "(" sum "," sum "," sum "," condition ")"
              | "if" condition branch { "elif" condition branch } [ "else" branch ]
              | "while" condition branch
              | register "=" sum
              | "reset_timer" "(" ")"
              | "def" name "(" ")" branch | name "(" ")"
              | "pass"
    branch    = "{" program "}" | ":" block | "if" ...   (only after else: "else if" is "elif")
    condition = both { "or" both }
    both      = single { "and" single }
    single    = "not" single | sum comparison sum, in any number of parentheses
    sum       = numbers and values with + - * / and parentheses; numbers alone are worked out while reading
    value     = sensor | sensor's previous reading | "Timer" | register
    register  = "r0" | ... | "r7"

Statements may follow each other with or without line ends and semicolons; ``#`` begins a comment. A block
after a colon is the rest of the line or, if nothing follows there, the lines indented deeper than the line
of its ``if``, all alike. Outside such blocks indentation means nothing. So both of the paper's ways of
writing (Table 3, Fig. 6) are read.

``def`` names statements; where the name is called, they stand: a macro, without arguments. It can only be called
below, and so not by itself. `Program.source` has the statements in the place of each call.

Duties become whole percent, times whole milliseconds and thresholds and numbers that the robot calculates with
thousandths, by rounding. Times are numbers alone.
"""

from __future__ import annotations

import re
from functools import lru_cache

from gecar.errors import InputError, expected
from gecar.language import opcodes
from gecar.language.conditions import Condition
from gecar.language.expressions import REGISTERS, Expressions
from gecar.language.statements import If, Motor, MotorUntil, ResetTimer, Set, Statement, While
from gecar.language.values import Value

MAX_CHARACTERS = 100_000
MAX_STATEMENTS = 10_000

_STATEMENT = "motor, motor_until, if, while, r0 = ..., reset_timer, def, a name it defined"
_KEPT = re.compile(
    r"(motor|motor_until|if|elif|else|while|pass|def|reset_timer|and|or|not|Timer|r[0-9]+|\w*Value)"
)


def parse_statements(text: str, source: str) -> tuple[Statement, ...]:
    """Read a program's text.

    Parameters
    ----------
    text
        The program, its line ends plain.
    source
        Its file's name, for errors.

    Raises
    ------
    InputError
        If it is not a program, or beyond the limits above; the message names line and column.
    """
    if len(text) > MAX_CHARACTERS:
        raise expected(source, f"{len(text)} characters", f"a program of at most {MAX_CHARACTERS}")
    try:
        return _Parser(text, source, whole=True).program()
    except InputError:  # once more, token by token, for the place of the fault
        return _Parser(text, source).program()


@lru_cache(maxsize=16_384)
def _call(text: str) -> Statement:
    """Read a ``motor(...)`` of plain numbers; populations repeat few of them thousands of times."""
    return _Parser(text, "<call>").motor()


@lru_cache(maxsize=16_384)
def _condition(text: str) -> Condition:
    """Read a comparison of a sensor with plain numbers."""
    parser = _Parser(text, "<condition>")
    condition = parser.condition()
    if parser.next.kind != "end":
        raise parser.fault("the end of the condition")
    return condition


class _Parser(Expressions):
    """Recursive descent through statements and the expressions in them."""

    def __init__(self, text: str, source: str, whole: bool = False) -> None:
        super().__init__(text, source, whole)
        self.statements = 0
        self.macros: dict[str, tuple[Statement, ...]] = {}
        self.sizes: dict[str, int] = {}

    def program(self) -> tuple[Statement, ...]:
        """Read statements to the end of the text."""
        statements: list[Statement] = []
        while self.next.kind != "end":
            self.statement(statements)
        return tuple(statements)

    def statement(self, statements: list[Statement]) -> None:
        """Read one statement, ``pass`` or semicolon, and add what it does."""
        word = self.next.text
        self.count(1)
        self.operations = 0
        if self.next.kind == "call":
            statements.append(_call(self.take().text))
        elif word in self.macros:
            statements.extend(self.called())
        elif word == "def":
            self.define()
        elif word in {";", "pass"}:
            self.take()
        else:
            statements.append(self.single())

    def count(self, statements: int) -> None:
        """Count statements, those of macros wherever they are called."""
        self.statements += statements
        if self.statements > MAX_STATEMENTS:
            raise self.fault(f"a program of at most {MAX_STATEMENTS} statements")

    def single(self) -> Statement:
        """Read one statement that begins with a word of the language."""
        word = self.next.text
        if word in REGISTERS:
            return self.assignment()
        if word == "motor":
            return self.motor()
        if word == "if":
            return self.conditional()
        if word == "motor_until":
            return self.motor_until()
        if word == "while":
            return self.loop()
        if word == "reset_timer":
            return self.reset_timer()
        before = "an if before it and in line with it, or " if word in {"else", "elif"} else ""
        raise self.fault(before + _STATEMENT)

    def define(self) -> None:
        """Read ``def name(): ...``."""
        indent, before = self.line_indent, self.statements
        self.deeper()
        self.take()
        name = self.next.text
        if self.next.kind != "word" or _KEPT.fullmatch(name) or name in self.macros:
            raise self.fault("a new name")
        self.take()
        self.mark("(")
        self.mark(")")
        statements = self.branch(indent)
        self.macros[name], self.sizes[name] = statements, self.statements - before
        self.depth -= 1

    def called(self) -> tuple[Statement, ...]:
        """Read ``name()``, and return what it stands for."""
        name = self.take().text
        self.mark("(")
        self.mark(")")
        self.count(self.sizes[name])
        return self.macros[name]

    def assignment(self) -> Set:
        """Read ``r0 = sum``."""
        register = REGISTERS[self.take().text]
        self.mark("=")
        start = self.next
        return Set(register, self.value(self.sum(), start))

    def reset_timer(self) -> ResetTimer:
        """Read ``reset_timer()``."""
        self.take()
        self.mark("(")
        self.mark(")")
        return ResetTimer()

    def loop(self) -> While:
        """Read a ``while`` with its branch."""
        indent = self.line_indent
        self.deeper()
        self.take()
        condition = self.before_branch()
        statement = While(condition, self.branch(indent))
        self.depth -= 1
        return statement

    def before_branch(self) -> Condition:
        """Read the condition of an ``if`` or ``while``."""
        return _condition(self.take().text) if self.next.kind == "condition" else self.condition()

    def motor(self) -> Motor:
        """Read ``motor(left, right, time)``."""
        self.take()
        motor = Motor(*self.drive())
        self.mark(")")
        return motor

    def motor_until(self) -> MotorUntil:
        """Read ``motor_until(left, right, time, test)``."""
        self.take()
        drive = self.drive()
        self.mark(",")
        statement = MotorUntil(*drive, self.condition())
        self.mark(")")
        return statement

    def drive(self) -> tuple[int | Value, int | Value, int]:
        """Read the arguments all motor statements share."""
        self.mark("(")
        left = self.duty()
        self.mark(",")
        right = self.duty()
        self.mark(",")
        return left, right, self.bounded(0, opcodes.MAX_TIME_MS, f"a time of 0..{opcodes.MAX_TIME_MS} ms")

    def conditional(self) -> If:
        """Read an ``if`` (or ``elif``) with its branches."""
        indent = self.line_indent
        self.deeper()
        self.take()
        condition = self.before_branch()
        braces = self.next.text == "{"
        then = self.branch(indent)
        otherwise: tuple[Statement, ...] = ()
        if self.next.text in {"else", "elif"} and self.belongs(indent, braces):
            otherwise = self.alternative(indent)
        self.depth -= 1
        return If(condition, then, otherwise)

    def belongs(self, indent: int, braces: bool) -> bool:
        """Whether the ``else`` that comes next is that of an ``if`` in a line indented by `indent`."""
        return self.next.indent in {-1, indent} or (braces and self.next.indent > indent)

    def alternative(self, indent: int) -> tuple[Statement, ...]:
        """Read what follows a then-branch: ``else`` and its branch, ``else if`` or ``elif``."""
        if self.next.text == "else":
            self.take()
            if self.next.text != "if":
                return self.branch(indent)
        return (self.conditional(),)

    def branch(self, indent: int) -> tuple[Statement, ...]:
        """Read the statements of one branch of an ``if`` in a line indented by `indent`."""
        statements: list[Statement] = []
        if self.next.text == "{":
            self.take()
            while self.next.text != "}":
                if self.next.kind == "end":
                    raise self.fault("} to close the branch")
                self.statement(statements)
            self.take()
        elif self.next.text == ":":
            self.take()
            self.block(indent, statements)
        else:
            raise self.fault(": or {")
        return tuple(statements)

    def block(self, indent: int, statements: list[Statement]) -> None:
        """Read the statements after a colon: the rest of the line, or lines indented deeper than `indent`."""
        level = self.next.indent
        if self.next.kind == "end" or -1 < level <= indent:
            raise self.fault(f"{_STATEMENT} or pass after the colon, or indented below it")
        first = True
        while first or self.next.text not in {"", "}", "else", "elif"}:
            if not first and self.next.indent > -1 and (level == -1 or self.next.indent <= indent):
                break
            if self.next.indent not in {-1, level}:
                raise self.fault(f"an indent of {level}, as in the block's first line, or at most {indent}")
            self.statement(statements)
            first = False
