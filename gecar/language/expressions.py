"""Reading the robot language: tokens, numbers worked out while reading, and conditions on sensors."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

from gecar.errors import InputError, expected
from gecar.language import opcodes
from gecar.language.source_position import place
from gecar.language.statements import Comparison, Condition, Sensor

MAX_DEPTH = 100  # of ifs and parentheses within each other
MAX_NUMBER = 10**12

_SPACE = r"[^\S\n]*(?:#[^\n]*)?"
_KINDS = (
    r"(?P<line>\n)|(?P<number>[0-9]+(?:\.[0-9]*)?|\.[0-9]+)|(?P<word>[A-Za-z_]\w*)"
    r"|(?P<mark>[<>=!]=|[-+*/(){},:;<>])|(?P<stray>\S)|\Z"
)
_TOKEN = re.compile(f"{_SPACE}(?:{_KINDS})")
_WHOLE = r"(?P<call>motor\([-+*/0-9, ]*\))|(?P<condition>\w+ ?[<>]=? ?[-+*/0-9() ]*(?=[{:]))"
_TOKEN_OR_WHOLE = re.compile(rf"{_SPACE}(?:{_WHOLE}|{_KINDS})")
_SENSORS = {sensor.word: sensor for sensor in Sensor}
_COMPARISONS = {comparison.word: comparison for comparison in Comparison}

Number = int | Fraction


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
        self.next = next(self.tokens)
        self.line_indent = max(self.next.indent, 0)

    def condition(self) -> Condition:
        """Read a comparison of a sensor with a number."""
        start = self.next
        value = self.comparison()
        if isinstance(value, Condition):
            return value
        raise self.fault("a comparison, as SensorValue > 50", start)

    def comparison(self) -> Number | Sensor | Condition:
        """Read a sum, or two with a comparison between."""
        start = self.next
        left = self.sum()
        comparison = _COMPARISONS.get(self.next.text)
        if comparison is None:
            return left
        self.take()
        right = self.sum()
        if isinstance(left, Sensor) and isinstance(right, int | Fraction):
            return Condition(left, comparison, self.threshold(right, start))
        if isinstance(right, Sensor) and isinstance(left, int | Fraction):
            return Condition(right, comparison.turned, self.threshold(left, start))
        raise self.fault("a sensor on one side of the comparison and a number on the other", start)

    def sum(self) -> Number | Sensor | Condition:
        """Read terms with + and - between."""
        start = self.next
        total = self.product()
        while self.next.text in {"+", "-"}:
            sign = 1 if self.take().text == "+" else -1
            term = self.number(self.product(), start)
            total = self.fold(self.number(total, start) + sign * term, start)
        return total

    def product(self) -> Number | Sensor | Condition:
        """Read factors with * and / between."""
        start = self.next
        total = self.factor()
        while self.next.text in {"*", "/"}:
            operator, start = self.take(), self.next
            factor = self.number(self.factor(), start)
            total = self.number(total, start)
            if operator.text == "*":
                total = self.fold(total * factor, start)
            elif factor == 0:
                raise self.fault("a divisor other than 0", start)
            else:
                total = self.fold(Fraction(total, factor), start)
        return total

    def factor(self) -> Number | Sensor | Condition:
        """Read a number, a sensor or something in parentheses, with signs before it."""
        start, sign = self.next, 0
        while self.next.text in {"-", "+"}:
            minus = self.take().text == "-"
            sign = (-1 if minus else 1) * (sign or 1)
        value = self.atom()
        return sign * self.number(value, start) if sign else value

    def atom(self) -> Number | Sensor | Condition:
        """Read a number, a sensor or something in parentheses."""
        token = self.next
        if token.kind == "number":
            return self.literal()
        if token.text in _SENSORS:
            self.take()
            return _SENSORS[token.text]
        if token.text != "(":
            raise self.fault(f"a number or {', '.join(_SENSORS)}")
        self.deeper()
        self.take()
        value = self.comparison()
        self.mark(")")
        self.depth -= 1
        return value

    def literal(self) -> Number:
        """Read a number as written."""
        token = self.take()
        if len(token.text) > 20:
            raise self.fault("a number of at most 20 digits", token)
        return self.fold(int(token.text) if token.text.isdigit() else Fraction(token.text), token)

    def number(self, value: Number | Sensor | Condition, start: Token) -> Number:
        """Check that a value is a number."""
        if isinstance(value, int | Fraction):
            return value
        raise self.fault("a number, since sensors are only compared", start)

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
