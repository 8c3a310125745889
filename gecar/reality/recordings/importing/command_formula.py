"""Commands that were not logged, as formulas of time: ``100*sin(2*pi*t)``, ``60*(t < 2)``."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.columns import Series

LONGEST = 500  # characters; so that neither the parser nor what it makes can be deep
_OPERATORS: Mapping[type, Callable[..., Any]] = MappingProxyType({
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: np.divide, ast.Mod: np.mod,
    ast.Pow: np.power, ast.USub: operator.neg, ast.UAdd: operator.pos,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
})  # fmt: skip
_FUNCTIONS: Mapping[str, Callable[..., Any]] = MappingProxyType({
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "abs": np.abs,
    "sign": np.sign, "floor": np.floor, "round": np.round, "min": np.minimum, "max": np.maximum,
})  # fmt: skip
_CONSTANTS = MappingProxyType({"pi": math.pi, "e": math.e})
_ARGUMENTS = MappingProxyType({name: 2 if name in ("min", "max") else 1 for name in _FUNCTIONS})


def command_of(text: str, option: str = "--command") -> Callable[[Series], Series]:
    """Make a function of time [s] from a formula; comparisons are 1 where they hold, else 0.

    It is read by Python's parser and worked out from its tree: numbers, ``t``, ``pi``, ``e``, ``+ - * / % **``,
    comparisons, and the functions sin, cos, tan, exp, log, sqrt, abs, sign, floor, round, min and max. Nothing else
    is known, and nothing is executed.

    Raises
    ------
    InputError
        If it is no such formula; from the function, if a value is no number.
    """
    wanted = f"a formula of t [s], as 100*sin(2*pi*t), with {', '.join(_FUNCTIONS)}"
    if len(text) > LONGEST:
        raise expected(option, f"{len(text)} characters", f"at most {LONGEST}")
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval").body
        _worked_out(tree, np.zeros(1))
    except (SyntaxError, ValueError, TypeError, RecursionError, MemoryError, OverflowError) as error:
        found = str(error) if isinstance(error, _UnknownError) else repr(text)
        raise expected(option, found, wanted) from None

    def at(t_s: Series) -> Series:
        values = np.broadcast_to(_worked_out(tree, t_s), t_s.shape).astype(np.float64)
        if not np.isfinite(values).all():
            bad = float(t_s[~np.isfinite(values)][0])
            raise InputError(f"{option}: {text!r} is no number at t = {bad:g} s")
        return values

    return at


class _UnknownError(ValueError):
    """A part of a formula that is not known."""


def _worked_out(node: ast.expr, t: Series) -> Any:
    with np.errstate(all="ignore"):
        return _value(node, t)


def _value(node: ast.expr, t: Series) -> Any:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return np.float64(value)
        case ast.Name(id=name) if name == "t" or name in _CONSTANTS:
            return t if name == "t" else np.float64(_CONSTANTS[name])
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(operand, t))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(left, t), _value(right, t))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _OPERATORS:
            return 1.0 * _OPERATORS[type(op)](_value(left, t), _value(right, t))
        case ast.Call(func=ast.Name(id=name), args=given, keywords=[]) if _ARGUMENTS.get(name) == len(given):
            return _FUNCTIONS[name](*(_value(argument, t) for argument in given))
        case _:
            raise _UnknownError(repr(ast.unparse(node)))
