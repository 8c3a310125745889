"""Reading the robot language: tokens, numbers worked out while reading, values that the robot works out, conditions."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from operator import add, mul, sub
from typing import Any, NamedTuple

from gecar.errors import InputError, expected
from gecar.language import opcodes
from gecar.language.conditions import And, Compared, Comparison, Condition, Not, Or, Threshold
from gecar.language.source_position import place
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

MAX_DEPTH = 100  # of ifs and parentheses within each other
MAX_NUMBER = 10**12

_SPACE = r"[^\S\n]*(?:#[^\n]*)?"
_KINDS = (
    r"(?P<line>\n)|(?P<number>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)|(?P<word>[A-Za-z_]\w*)"
    r"|(?P<mark>[<>=!]=|[-+*/(){},:;<>=])|(?P<stray>\S)|\Z"
)
_TOKEN = re.compile(f"{_SPACE}(?:{_KINDS})")
_WHOLE = r"(?P<call>motor\([-+*/0-9, ]*\))|(?P<condition>\w+ ?[<>]=? ?[-+*/0-9() ]*(?=[{:]))"
_TOKEN_OR_WHOLE = re.compile(rf"{_SPACE}(?:{_WHOLE}|{_KINDS})")
REGISTERS = {f"r{number}": number for number in range(opcodes.N_REGISTERS)}
_VALUES: dict[str, Value] = {
    **{sensor.word: Reading(sensor) for sensor in Sensor},
    **{sensor.previous: Previous(sensor) for sensor in Sensor},
    "Timer": Timer(),
    **{word: Register(number) for word, number in REGISTERS.items()},
}
_OPERATORS = {operator.word: operator for operator in Operator}
_COMPARISONS = {comparison.word: comparison for comparison in Comparison}

_ARITHMETIC: dict[Operator, Callable[[Any, Any], int | Fraction]] = {
    Operator.ADD: add,
    Operator.SUBTRACT: sub,
    Operator.MULTIPLY: mul,
    Operator.DIVIDE: Fraction,
}

Number = int | Fraction
Result = Number | Value | Condition


class Token(NamedTuple):
    """A word, number or mark; `indent` [columns] where it is the first of its line, else -1."""

    kind: str
    text: str
    offset: int
    indent: int


def _tokens(text: str, pattern: re.Pattern[str]) -> list[Token]:
    """Split a text; the last token, of kind "end", stands at its end."""
    tokens: list[Token] = []
    first, line_start = True, 0
    for match in pattern.finditer(text):
        kind = match.lastgroup
        if kind == "line":
            first, line_start = True, match.end()
        elif kind:
            offset = match.start(kind)
            indent = len(text[line_start:offset].expandtabs()) if first else -1
            tokens.append(Token(kind, match[kind], offset, indent))
            first = False
    tokens.append(Token("end", "", len(text.rstrip()), 0))
    return tokens


class Expressions:
    """Recursive descent; `next` is the token not yet taken, `line_indent` that of the line it stands in.

    With `whole`, a ``motor(...)`` of plain numbers is one token, of kind "call", and so is a comparison of a word with
    plain numbers before a branch, of kind "condition".
    """

    def __init__(self, text: str, source: str, whole: bool = False) -> None:
        self.text = text
        self.source = source
        self.tokens = iter(_tokens(text, _TOKEN_OR_WHOLE if whole else _TOKEN))
        self.depth = 0
        self.operations = 0
        self.next = next(self.tokens)
        self.line_indent = max(self.next.indent, 0)

    def condition(self) -> Condition:
        """Read comparisons, with ``and``, ``or``, ``not``."""
        start = self.next
        return self.asked(self.disjunction(), start)

    def disjunction(self) -> Result:
        """Read conditions with ``or`` between, or something else."""
        start = self.next
        total = self.conjunction()
        while self.next.text == "or":
            self.take()
            self.count_operation()
            total = Or(self.asked(total, start), self.asked(self.conjunction(), start))
        return total

    def conjunction(self) -> Result:
        """Read conditions with ``and`` between, or something else."""
        start = self.next
        total = self.negation()
        while self.next.text == "and":
            self.take()
            self.count_operation()
            total = And(self.asked(total, start), self.asked(self.negation(), start))
        return total

    def negation(self) -> Result:
        """Read a condition with ``not`` before it, or something else."""
        if self.next.text != "not":
            return self.comparison()
        self.take()
        self.count_operation()
        start = self.next
        return Not(self.asked(self.negation(), start))

    def comparison(self) -> Result:
        """Read a sum, or two with a comparison between."""
        start = self.next
        left = self.sum()
        comparison = _COMPARISONS.get(self.next.text)
        if comparison is None:
            return left
        self.take()
        right = self.sum()
        if isinstance(left, Reading) and isinstance(right, int | Fraction):
            return Threshold(left.sensor, comparison, self.threshold(right, start))
        if isinstance(right, Reading) and isinstance(left, int | Fraction):
            return Threshold(right.sensor, comparison.turned, self.threshold(left, start))
        if isinstance(left, int | Fraction) and isinstance(right, int | Fraction):
            raise self.fault("a sensor, timer or register on a side of the comparison", start)
        return Compared(self.value(left, start), comparison, self.value(right, start))

    def sum(self) -> Result:
        """Read terms with + and - between."""
        start = self.next
        total = self.product()
        while self.next.text in {"+", "-"}:
            operator = _OPERATORS[self.take().text]
            total = self.combined(operator, total, self.product(), start)
        return total

    def product(self) -> Result:
        """Read factors with * and / between."""
        start = self.next
        total = self.factor()
        while self.next.text in {"*", "/"}:
            operator, start = _OPERATORS[self.take().text], self.next
            total = self.combined(operator, total, self.factor(), start)
        return total

    def combined(self, operator: Operator, left: Result, right: Result, start: Token) -> Number | Value:
        """Return what an operation gives: worked out, where both sides are numbers."""
        if operator is Operator.DIVIDE and right == 0:
            raise self.fault("a divisor other than 0", start)
        if isinstance(left, int | Fraction) and isinstance(right, int | Fraction):
            return self.fold(_ARITHMETIC[operator](left, right), start)
        self.count_operation()
        return Operation(operator, self.value(left, start), self.value(right, start))

    def factor(self) -> Result:
        """Read a number, a value or something in parentheses, with signs before it."""
        start, sign = self.next, 0
        while self.next.text in {"-", "+"}:
            minus = self.take().text == "-"
            sign = (-1 if minus else 1) * (sign or 1)
        value = self.atom()
        return self.combined(Operator.MULTIPLY, sign, value, start) if sign else value

    def atom(self) -> Result:
        """Read a number, a value or something in parentheses."""
        token = self.next
        if token.kind == "number":
            return self.literal()
        if token.text in _VALUES:
            self.take()
            return _VALUES[token.text]
        if token.text != "(":
            raise self.fault(f"a number or {', '.join(_VALUES)}")
        self.deeper()
        self.take()
        value = self.disjunction()
        self.mark(")")
        self.depth -= 1
        return value

    def literal(self) -> Number:
        """Read a number as written."""
        token = self.take()
        if len(token.text) > 20:
            raise self.fault("a number of at most 20 digits", token)
        return self.fold(int(token.text) if token.text.isdigit() else Fraction(token.text), token)

    def value(self, result: Result, start: Token) -> Value:
        """Check that something read is a value, a number made one."""
        if isinstance(result, int | Fraction):
            largest = opcodes.MAX_VALUE // opcodes.ONE
            if not -largest <= result <= largest:
                raise self.fault(f"numbers within {largest} where the robot calculates", start)
            return Constant(round(result * opcodes.ONE))
        if isinstance(result, Condition):
            raise self.fault("a value, since conditions are only asked", start)
        return result

    def asked(self, result: Result, start: Token) -> Condition:
        """Check that something read is a condition."""
        if isinstance(result, Condition):
            return result
        raise self.fault("a comparison, as SensorValue > 50", start)

    def fold(self, number: Number, start: Token) -> Number:
        """Keep numbers within bounds, whatever is worked out."""
        if abs(number.numerator) > MAX_NUMBER or number.denominator > MAX_NUMBER:
            raise self.fault("numbers and divisors up to a million million", start)
        return number

    def bounded(self, low: int, high: int, wanted: str) -> int:
        """Read a sum, rounded to a whole number, within bounds."""
        start = self.next
        value = self.sum()
        if isinstance(value, int | Fraction) and low <= round(value) <= high:
            return round(value)
        raise self.fault(wanted, start)

    def duty(self) -> int | Value:
        """Read a duty: a whole number within bounds, or a value."""
        start, most = self.next, opcodes.MAX_DUTY_PCT
        result = self.sum()
        if not isinstance(result, int | Fraction):
            return self.value(result, start)
        if not -most <= round(result) <= most:
            raise self.fault(f"a duty of -{most}..{most} percent", start)
        return round(result)

    def threshold(self, value: Number, start: Token) -> int:
        """Round a threshold to thousandths of a percent."""
        if not -opcodes.MAX_THRESHOLD_PCT <= value <= opcodes.MAX_THRESHOLD_PCT:
            raise self.fault(f"a threshold within {opcodes.MAX_THRESHOLD_PCT} percent", start)
        return round(value * opcodes.THRESHOLDS_PER_PCT)

    def take(self) -> Token:
        """Step to the token after the next one."""
        taken = self.next
        self.next = next(self.tokens)
        if self.next.indent > -1:
            self.line_indent = self.next.indent
        return taken

    def count_operation(self) -> None:
        """Count what the robot does in one statement: trees stay shallow, and their rows' stack small."""
        self.operations += 1
        if self.operations > opcodes.MAX_OPERATIONS:
            raise self.fault(f"at most {opcodes.MAX_OPERATIONS} operations in a statement")

    def mark(self, wanted: str) -> None:
        """Take the one mark that may stand here."""
        if self.next.text != wanted:
            raise self.fault(wanted)
        self.take()

    def deeper(self) -> None:
        """Count one level of nesting."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.fault(f"at most {MAX_DEPTH} ifs and parentheses within each other")

    def fault(self, wanted: str, start: Token | None = None) -> InputError:
        """Make the error for the next token, or for the text from `start` up to it."""
        end = self.next.offset
        offset = start.offset if start else end
        found = self.text[offset:end].strip() or self.next.text
        found = repr(found[:40]) if found else "the end"
        return expected(place(self.source, self.text, offset), found, wanted)
