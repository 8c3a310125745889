"""Symbolic regression: texts read as formulas, and the benchmarks Keijzer-6 and Vladislavleva-4.

A text is parsed, never executed, and a compiled stack machine works it out for all cases at once. Its functions are
those of PonyGE2 (Fenton et al. 2017) and White et al., "Better GP benchmarks", Genetic Programming and Evolvable
Machines 14, 2013: ``pdiv(a,b)`` is a/b, and 1 where b is 0; ``psqrt(a)`` is the root of abs(a); ``plog(a)`` is
log(1 + abs(a)).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.language.mapping import Derivation

Floats = npt.NDArray[np.float64]
Int32s = npt.NDArray[np.int32]

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
    known = _words(variables)
    codes, values = [], []
    for word in _WORD.findall(text):
        code, value = known.get(word) or (CONSTANT if word[0].isdigit() else -1, 0.0)
        codes.append(code)
        values.append(float(word) if code == CONSTANT else value)
    steps, numbers = _postfix(np.array(codes, np.int32), np.array(values, float))
    return Formula(text, steps, numbers) if len(steps) else None


@cache
def _words(variables: tuple[str, ...]) -> dict[str, tuple[int, float]]:
    """Return what each word but numbers stands for: its code, and of a variable the number."""
    words = {word: (code, 0.0) for word, code in _WORDS.items()}
    return words | {name: (VARIABLE, float(k)) for k, name in enumerate(variables)}


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
        return _root_mean_square(formula(self.x) - self.y)

    def errors(self, formula: Formula) -> Floats:
        """Return the error of each case, for lexicase (cases,)."""
        return np.abs(formula(self.x) - self.y)

    def unseen(self, formula: Formula) -> float:
        """Return the error on the cases set aside."""
        return _root_mean_square(formula(self.unseen_x) - self.unseen_y)


def _root_mean_square(missed: Floats) -> float:
    with np.errstate(all="ignore"):
        return float(np.sqrt(np.mean(missed * missed)))


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
