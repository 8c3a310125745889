"""From statements to lines that people read and rows that the compiled interpreter runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gecar.language import opcodes
from gecar.language.conditions import And, Compared, Condition, Not, Or, Threshold
from gecar.language.statements import If, Motor, MotorUntil, ResetTimer, Set, Statement, While
from gecar.language.values import Constant, Operation, Operator, Reading, Register, Timer, Value

Row = list[int]


class Layout:
    """Writes lines and rows side by side, so that each row knows its line.

    Parameters
    ----------
    statements
        The program.

    Attributes
    ----------
    lines
        The program in the form of the paper's Fig. 6.
    rows
        Compiled, as `gecar.language.opcodes` has them.
    """

    def __init__(self, statements: Sequence[Statement]) -> None:
        self.remembered: list[int] = []
        self.write(statements)
        before = {row[opcodes.A] for row in self.rows if row[opcodes.OP] == opcodes.PREVIOUS}
        if before:
            self.remembered = sorted(before)
            self.write(statements)

    def write(self, statements: Sequence[Statement]) -> None:
        """Write a program."""
        self.lines: list[str] = []
        self.rows: list[Row] = []
        self.block(statements, 0)

    def block(self, statements: Iterable[Statement], depth: int) -> None:
        """Write statements at a depth of indentation."""
        for statement in statements:
            self.lines.append("    " * depth + str(statement))
            if isinstance(statement, If):
                self.conditional(statement, depth)
            elif isinstance(statement, While):
                self.loop(statement, depth)
            elif isinstance(statement, Set):
                self.value(statement.value)
                self.row(opcodes.SET, statement.register)
            elif isinstance(statement, ResetTimer):
                self.row(opcodes.RESET_TIMER)
            else:
                self.drive(statement)

    def body(self, statements: Sequence[Statement], depth: int) -> None:
        """Write what is indented below a line."""
        if statements:
            self.block(statements, depth + 1)
        else:
            self.lines.append("    " * (depth + 1) + "pass")

    def drive(self, statement: Motor | MotorUntil) -> None:
        """Write a motor statement: in the rows of Table 3's language where those can say it."""
        left, right = statement.left, statement.right
        condition = statement.condition if isinstance(statement, MotorUntil) else None
        known = isinstance(condition, Threshold | None)
        if known and isinstance(left, int) and isinstance(right, int):
            self.remember()
            self.row(opcodes.MOTOR_UNTIL if condition else opcodes.MOTOR, left, right, statement.time)
            if condition:
                self.test(condition)
            return
        for duty in (left, right):
            self.value(Constant(duty * opcodes.ONE) if isinstance(duty, int) else duty)
        self.remember()
        drive = self.row(opcodes.DRIVE, 0, int(condition is not None), statement.time)
        if condition:
            over = self.test(condition, wanted=False)
            self.row(opcodes.HOLD)
            self.land([drive, *over])

    def remember(self) -> None:
        """Keep what sensors report, where the program asks for it later."""
        for sensor in self.remembered:
            self.row(opcodes.REMEMBER, sensor)

    def conditional(self, statement: If, depth: int) -> None:
        """Write an ``if`` below its line."""
        line = len(self.lines)
        otherwise = self.test(statement.condition)
        self.body(statement.then, depth)
        if statement.otherwise:
            jump = self.row(opcodes.JUMP)
            jump[opcodes.LINE] = line
            self.land(otherwise)
            self.lines.append("    " * depth + "else:")
            self.block(statement.otherwise, depth + 1)
            self.land([jump])
        else:
            self.land(otherwise)

    def loop(self, statement: While, depth: int) -> None:
        """Write a ``while`` below its line."""
        line, first = len(self.lines), len(self.rows)
        over = self.test(statement.condition)
        self.body(statement.body, depth)
        turn = self.row(opcodes.LOOP)
        turn[opcodes.TARGET], turn[opcodes.LINE] = first, line
        self.land(over)

    def test(self, condition: Condition, wanted: bool = True) -> list[Row]:
        """Write rows that lead on where a condition is as wanted; return those whose target is where it is not."""
        if isinstance(condition, Not):
            return self.test(condition.condition, not wanted)
        if isinstance(condition, And | Or):
            return self.tests(condition, wanted)
        comparison = condition.comparison if wanted else condition.comparison.opposite
        if isinstance(condition, Threshold):
            return [self.row(opcodes.TEST, condition.sensor.index, comparison.index, condition.threshold)]
        return self.compare(condition, comparison.index)

    def tests(self, condition: And | Or, wanted: bool) -> list[Row]:
        """Do the same for two conditions; the second's rows are passed over where the first decides."""
        first = self.test(condition.left, wanted)
        if isinstance(condition, And) == wanted:  # both have to be as wanted
            return first + self.test(condition.right, wanted)
        decided = self.row(opcodes.JUMP)
        self.land(first)
        second = self.test(condition.right, wanted)
        self.land([decided])
        return second

    def compare(self, condition: Compared, comparison: int) -> list[Row]:
        """Write the comparison of two values."""
        self.value(condition.left)
        known, number = self.right(condition.right)
        return [self.row(opcodes.COMPARE, known, comparison, number)]

    def value(self, value: Value) -> None:
        """Write rows that push a value."""
        if isinstance(value, Operation):
            self.operation(value)
        elif isinstance(value, Constant):
            self.row(opcodes.CONSTANT, 0, 0, value.thousandths)
        elif isinstance(value, Register):
            self.row(opcodes.REGISTER, value.number)
        elif isinstance(value, Timer):
            self.row(opcodes.TIMER)
        else:
            op = opcodes.READING if isinstance(value, Reading) else opcodes.PREVIOUS
            self.row(op, value.sensor.index)

    def operation(self, value: Operation) -> None:
        """Write rows that push what an operation gives."""
        left, right = value.left, value.right
        if isinstance(left, Constant) and value.operator in (Operator.ADD, Operator.MULTIPLY):
            left, right = right, left
        self.value(left)
        known, number = self.right(right)
        self.row(value.operator.op, known, 0, number)

    def right(self, value: Value) -> tuple[int, int]:
        """Return whether a right side is a number, and which; write rows that push it if not."""
        if isinstance(value, Constant):
            return 1, value.thousandths
        self.value(value)
        return 0, 0

    def land(self, rows: Iterable[Row]) -> None:
        """Let rows lead to the next one to be written."""
        for row in rows:
            row[opcodes.TARGET] = len(self.rows)

    def row(self, op: int, a: int = 0, b: int = 0, c: int = 0) -> Row:
        """Write a row of the last line."""
        row = [op, a, b, c, 0, len(self.lines)]
        self.rows.append(row)
        return row
