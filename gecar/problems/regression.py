"""Symbolic regression: texts read as formulas, and the benchmarks Keijzer-6 and Vladislavleva-4.

A text is parsed, never executed, and a compiled stack machine works it out for all cases at once. Its functions are
those of PonyGE2 (Fenton et al. 2017) and White et al., "Better GP benchmarks", Genetic Programming and Evolvable
Machines 14, 2013: ``pdiv(a,b)`` is a/b, and 1 where b is 0; ``psqrt(a)`` is the root of abs(a); ``plog(a)`` is
log(1 + abs(a)).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.language.mapping import Derivation

Floats = npt.NDArray[np.float64]
Int32s = npt.NDArray[np.int32]
Bytes = npt.NDArray[np.uint8]

MAX_CHARACTERS = 10_000
"""Longest text that is read as a formula."""

CONSTANT, VARIABLE, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE, PDIV, PSQRT, SIN, TANH, EXP, PLOG = range(13)
_OPEN, _CLOSE, _COMMA = 20, 21, 22
_WORDS = {"+": ADD, "-": SUBTRACT, "*": MULTIPLY, "/": DIVIDE, "(": _OPEN, ")": _CLOSE, ",": _COMMA} | {
    "pdiv": PDIV, "psqrt": PSQRT, "sin": SIN, "tanh": TANH, "exp": EXP, "plog": PLOG,
}  # fmt: skip
_WORD = re.compile(r"\d+\.?\d*|[A-Za-z_]\w*|\S")


@dataclass(frozen=True)
class Formula:
    """A formula of some variables.

    Attributes
    ----------
    text
        As it was derived.
    codes, values
        In postfix order: what to do, and the constant or the variable's number (steps,).
    """

    text: str
    codes: Int32s = field(repr=False, compare=False)
    values: Floats = field(repr=False, compare=False)

    def __call__(self, x: Floats) -> Floats:
        """Return its values (cases,); nan or inf where it has none.

        Parameters
        ----------
        x
            The variables (variables, cases).
        """
        return _work_out(self.codes, self.values, x)

    def __str__(self) -> str:
        return self.text


def read_formula(text: object, variables: tuple[str, ...] = ("x",)) -> Formula | None:
    """Read a formula; None where the text is none.

    Parameters
    ----------
    text
        Numbers, variables, ``+ - * /``, parentheses and the functions above; or what has such a text by ``str``, as a
        `gecar.language.mapping.Derivation` has, so that this is a phenotype.
    variables
        Their names.
    """
    text = str(text)
    if len(text) > MAX_CHARACTERS:
        return None
    names = _names(variables)
    steps, numbers, n = np.empty(len(text), np.int32), np.empty(len(text)), -1
    if text.isascii() and names is not None:
        n = _read(np.frombuffer(text.encode(), np.uint8), *names, steps, numbers)
    if n < 0:
        steps, numbers = _postfix(*_words_of(text, variables))
        n = len(steps)
    return Formula(text, steps[:n], numbers[:n]) if n else None


def _words_of(text: str, variables: tuple[str, ...]) -> tuple[Int32s, Floats]:
    """Return what each word of a text is, and its value, whatever its characters and numbers."""
    known = _words(variables)
    codes, values = [], []
    for word in _WORD.findall(text):
        code, value = known.get(word) or (CONSTANT if word[0].isdigit() else -1, 0.0)
        codes.append(code)
        values.append(float(word) if code == CONSTANT else value)
    return np.array(codes, np.int32), np.array(values, float)


@cache
def _words(variables: tuple[str, ...]) -> dict[str, tuple[int, float]]:
    """Return what each word but numbers stands for: its code, and of a variable the number."""
    words = {word: (code, 0.0) for word, code in _WORDS.items()}
    return words | {name: (VARIABLE, float(k)) for k, name in enumerate(variables)}


@cache
def _names(variables: tuple[str, ...]) -> tuple[Bytes, Int32s, Int32s, Floats] | None:
    """Return the names in a formula as `_lex` takes them; None where a variable is no plain name."""
    if not all(name.isascii() and name.isidentifier() for name in variables):
        return None
    known = {name: meaning for name, meaning in _words(variables).items() if name.isidentifier()}
    ends = np.cumsum([0, *map(len, known)]).astype(np.int32)
    codes, values = zip(*known.values(), strict=True)
    return np.frombuffer("".join(known).encode(), np.uint8), ends, np.array(codes, np.int32), np.array(values)


@compiled
def _read(
    text: Bytes, names: Bytes, ends: Int32s, meanings: Int32s, values: Floats, steps: Int32s, numbers: Floats
) -> int:
    """Write an ASCII text's formula in postfix order; return its length, 0 if it is none, -1 as `_lex`."""
    n = _lex(text, names, ends, meanings, values, steps, numbers)
    if n < 0:
        return n
    found, its_values = _postfix(steps[:n], numbers[:n])
    for k in range(found.size):
        steps[k], numbers[k] = found[k], its_values[k]
    return found.size


@compiled
def _lex(  # noqa: C901, PLR0912
    text: Bytes, names: Bytes, ends: Int32s, meanings: Int32s, numbers: Floats, codes: Int32s, values: Floats
) -> int:
    """Find a text's words; return how many, or -1 where a number has more digits than are read exactly here.

    Parameters
    ----------
    text
        Its ASCII characters.
    names, ends, meanings, numbers
        All names, one after the other, and where each ends; what each is, and its value.
    codes, values
        Receive what each word is, and its value.
    """
    n, at = 0, 0
    while at < text.size:
        letter = text[at]
        if letter == 32 or 9 <= letter <= 13 or 28 <= letter <= 31:
            at += 1
            continue
        begin, code, value = at, -1, 0.0
        at += 1
        if 48 <= letter <= 57:
            whole, digits, decimals, point = letter - 48.0, int(letter > 48), 0, False
            while at < text.size and (48 <= text[at] <= 57 or (text[at] == 46 and not point)):
                if text[at] == 46:
                    point = True
                else:
                    whole = 10.0 * whole + (text[at] - 48.0)
                    digits += digits > 0 or text[at] > 48
                    decimals += point
                at += 1
            if digits > 15 or decimals > 22:
                return -1
            scale = 1.0  # up to 10^22 and 10^15 both are exact, so that their quotient is the nearest number
            for _ in range(decimals):
                scale *= 10.0
            code, value = CONSTANT, whole / scale
        elif letter == 95 or 65 <= letter <= 90 or 97 <= letter <= 122:
            while at < text.size and (
                text[at] == 95 or 48 <= text[at] <= 57 or 65 <= text[at] <= 90 or 97 <= text[at] <= 122
            ):
                at += 1
            for k in range(meanings.size):
                if _same(text[begin:at], names[ends[k] : ends[k + 1]]):
                    code, value = meanings[k], numbers[k]
        else:
            for k in range(_SIGNS.size):
                if letter == _SIGNS[k]:
                    code = _SIGN_CODES[k]
        codes[n], values[n] = code, value
        n += 1
    return n


_SIGNS = np.frombuffer(b"+-*/(),", np.uint8)
_SIGN_CODES = np.array([_WORDS[chr(sign)] for sign in _SIGNS], np.int32)


@compiled
def _same(one: Bytes, other: Bytes) -> bool:
    if one.size != other.size:
        return False
    for k in range(one.size):  # noqa: SIM110  Numba compiles no generators
        if one[k] != other[k]:
            return False
    return True


@compiled
def _postfix(codes: Int32s, values: Floats) -> tuple[Int32s, Floats]:  # noqa: C901, PLR0911, PLR0912
    """Put a formula's words in postfix order (Dijkstra's shunting yard); none where they are no formula."""
    n = codes.size
    steps, numbers = np.empty(n, np.int32), np.empty(n)
    stack, arguments = (
        np.empty(n + 1, np.int32),
        np.empty(n + 1, np.int32),
    )  # what waits; of a bracket, its arguments
    written, top, operand = 0, -1, True
    for k in range(n):
        code = codes[k]
        if operand and code <= VARIABLE:
            if code < 0:
                return steps[:0], numbers[:0]
            steps[written], numbers[written] = code, values[k]
            written += 1
            operand = False
        elif operand and (code in (SUBTRACT, ADD, _OPEN) or PDIV <= code <= PLOG):
            if PDIV <= code <= PLOG and (k + 1 == n or codes[k + 1] != _OPEN):
                return steps[:0], numbers[:0]
            if code != ADD:
                top += 1
                stack[top] = NEGATE if code == SUBTRACT else code
                arguments[top] = 1
        elif not operand and (ADD <= code <= DIVIDE or code in (_CLOSE, _COMMA)):
            bound = 0 if code >= _OPEN else 1 if code <= SUBTRACT else 2
            while top >= 0 and stack[top] <= NEGATE and (stack[top] > SUBTRACT) + 1 >= bound:
                steps[written], numbers[written] = stack[top], 0.0
                written += 1
                top -= 1
            if code < _OPEN:
                top += 1
                stack[top] = code
                operand = True
                continue
            if top < 0:
                return steps[:0], numbers[:0]
            called = stack[top - 1] if top > 0 and PDIV <= stack[top - 1] <= PLOG else -1
            if code == _COMMA:
                arguments[top] += 1
                operand = True
                if called != PDIV:
                    return steps[:0], numbers[:0]
                continue
            if called >= 0:
                if arguments[top] != (2 if called == PDIV else 1):
                    return steps[:0], numbers[:0]
                steps[written], numbers[written] = called, 0.0
                written += 1
            top -= 2 if called >= 0 else 1
        else:
            return steps[:0], numbers[:0]
    while top >= 0 and stack[top] <= NEGATE:
        steps[written], numbers[written] = stack[top], 0.0
        written += 1
        top -= 1
    if operand or top >= 0:
        return steps[:0], numbers[:0]
    return steps[:written].copy(), numbers[:written].copy()


@compiled
def _work_out(codes: Int32s, values: Floats, x: Floats) -> Floats:  # noqa: C901, PLR0912
    n = x.shape[1]
    stack = np.empty((codes.size, n))
    top = -1
    for step in range(codes.size):
        code = codes[step]
        if code <= VARIABLE:
            top += 1
        elif code <= DIVIDE or code == PDIV:
            top -= 1
        for k in range(n):
            a = stack[top, k]
            if code == CONSTANT:
                a = values[step]
            elif code == VARIABLE:
                a = x[int(values[step]), k]
            elif code == ADD:
                a += stack[top + 1, k]
            elif code == SUBTRACT:
                a -= stack[top + 1, k]
            elif code == MULTIPLY:
                a *= stack[top + 1, k]
            elif code == DIVIDE:
                a /= stack[top + 1, k]
            elif code == PDIV:
                a = a / stack[top + 1, k] if stack[top + 1, k] != 0.0 else 1.0
            elif code == NEGATE:
                a = -a
            elif code == PSQRT:
                a = np.sqrt(abs(a))
            elif code == SIN:
                a = np.sin(a)
            elif code == TANH:
                a = np.tanh(a)
            elif code == EXP:
                a = np.exp(a)
            else:
                a = np.log(1.0 + abs(a))
            stack[top, k] = a
    return stack[0].copy()


@dataclass(frozen=True)
class Regression:
    """Cases a formula shall meet; called with a formula it returns the root of the mean square of what it misses by.

    Attributes
    ----------
    variables
        Names of the variables.
    x, y
        Cases to fit (variables, cases), (cases,).
    unseen_x, unseen_y
        Cases set aside.
    """

    variables: tuple[str, ...]
    x: Floats
    y: Floats
    unseen_x: Floats
    unseen_y: Floats

    def read(self, derivation: Derivation) -> Formula | None:
        """Return the formula a derivation is; None where it is none."""
        return read_formula(derivation, self.variables)

    def __call__(self, formula: Formula) -> float:
        """Return the error on the cases to fit."""
        return _root_mean_square(formula, self.x, self.y)

    def errors(self, formula: Formula) -> Floats:
        """Return the error of each case, for lexicase (cases,)."""
        return np.abs(formula(self.x) - self.y)

    def unseen(self, formula: Formula) -> float:
        """Return the error on the cases set aside."""
        return _root_mean_square(formula, self.unseen_x, self.unseen_y)


def _root_mean_square(formula: Formula, x: Floats, y: Floats) -> float:
    squares = _squares(formula.codes, formula.values, x, y)
    with np.errstate(all="ignore"):
        return math.sqrt(np.add.reduce(squares) / len(squares))


@compiled
def _squares(codes: Int32s, values: Floats, x: Floats, y: Floats) -> Floats:
    missed = _work_out(codes, values, x)
    for k in range(missed.size):
        missed[k] = (missed[k] - y[k]) * (missed[k] - y[k])
    return missed


def keijzer_6() -> Regression:
    """Return the sum of 1/i for i up to x, for x = 1 to 50; unseen to 120 (Keijzer, EuroGP 2003)."""
    x = np.arange(1.0, 121.0)
    y = np.cumsum(1.0 / x)
    return Regression(("x",), x[None, :50].copy(), y[:50], x[None], y)


def vladislavleva_4(seed: int = 1) -> Regression:
    """Return 10 / (5 + the sum of (x_i - 3)^2 over five variables), drawn at random.

    1,024 cases from 0.05 to 6.05, 5,000 unseen ones from -0.25 to 6.35 (Vladislavleva, Smits and den Hertog, IEEE T-EC
    13(2), 2009).

    Parameters
    ----------
    seed
        Of the cases.
    """
    rng = np.random.default_rng(seed)
    seen, unseen = rng.uniform(0.05, 6.05, (5, 1_024)), rng.uniform(-0.25, 6.35, (5, 5_000))
    y, unseen_y = (10.0 / (5.0 + np.sum((x - 3.0) ** 2, axis=0)) for x in (seen, unseen))
    return Regression(("x1", "x2", "x3", "x4", "x5"), seen, y, unseen, unseen_y)
