"""Laws as the kernels work them out: postfix programs over variables and constants, of one robot or of many at once.

Whatever a law says, the result is a finite number (`_total`). One robot's law runs on six values without a loop over
memory; robots whose laws differ in constants alone go through them together, token by token, as vector code.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import LANES, any_integer, kernel, lane_access, subroutine
from gecar.world.ports import (
    BOTH,
    CONSTANTS,
    FIRST_OPERATOR,
    FIRST_VARIABLE,
    LEFT,
    N_TERMS,
    OF_TWO,
    OPERATOR,
    PORT_NUMBER,
    PORTS,
    RIGHT,
    STACK,
    VARIABLE,
)

Array = npt.NDArray[np.float64]

HANDS = ("left", "right")
VIEW = np.dtype([(f"{hand}_{name}", np.float64) for name in VARIABLE for hand in HANDS])
"""What laws see: every variable, of the left wheel and of the right one."""

OF_BODY = PORTS[: PORT_NUMBER["encoder_reading"]]
ASKED_OF_PORT = [(f"left_{port.id}", f"right_{port.id}") if port.of_wheel else (port.id,) for port in OF_BODY]
ASKED_FIELDS = (*itertools.chain(*ASKED_OF_PORT), "left_contact", "right_contact", "shape_terms")
ASKED = np.dtype([(field, np.float64) for field in ASKED_FIELDS])
"""What terms ask for at the ports of the dynamics in a step."""

SUPPLY_ASKED = len(HANDS) * N_TERMS
N_STORES = SUPPLY_ASKED + 1
"""What each term has stored, of either wheel; and what terms asked of the battery in the last step [V]."""

# Terms of several robots are worked out together, one robot a lane; field f of lane k stands at ``f * lanes + k``.
_SEEN = 0
AT_ASKED = len(VIEW.descr)
AT_VALUES = AT_ASKED + len(ASKED.descr)
_AT_STACK = AT_VALUES + len(HANDS)
AT_KEPT = _AT_STACK + STACK * len(HANDS)
N_SCRATCH = AT_KEPT + 2 * len(HANDS)
"""Fields of a lane in which terms are worked out: what is seen, what is asked for, a law's values, its stack, and what
is kept meanwhile."""
SCRATCH = np.dtype([("of", np.float64, (N_SCRATCH,))])
_, store_view = lane_access(VIEW, _SEEN)
load_asked, _ = lane_access(ASKED, AT_ASKED)

_LARGEST = 1e6
_LEAST_DIVISOR = 1e-9
_LARGEST_EXPONENT = 50.0
_ROW = len(HANDS) * LANES
MEAN = any_integer(2)
"""Hand of what both wheels share."""
_RIGHT, _ZERO = any_integer(RIGHT), any_integer(0)

_MIN, _MAX = OPERATOR["min"], OPERATOR["max"]
_PLUS, _MINUS, _TIMES, _OVER = (OPERATOR[mark] for mark in "+-*/")
_NEGATIVE, _ABS, _SIGN, _SQUARE = (OPERATOR[name] for name in ("negative", "abs", "sign", "square"))
_SQRT, _EXP, _SIN, _COS = (OPERATOR[name] for name in ("sqrt", "exp", "sin", "cos"))
_TANH, _RAMP = OPERATOR["tanh"], OPERATOR["ramp"]
_LAST_OF_TWO = FIRST_OPERATOR + OF_TWO


@kernel
def _total(value: float) -> float:
    """Return a finite number, whatever was worked out."""
    if math.isnan(value):
        return 0.0
    return min(max(value, -_LARGEST), _LARGEST)


@kernel
def _of_two(code: int, a: float, b: float) -> float:
    if code == _PLUS:
        return a + b
    if code == _MINUS:
        return a - b
    if code == _TIMES:
        return a * b
    if code == _OVER:
        return a / (b if abs(b) > _LEAST_DIVISOR else math.copysign(_LEAST_DIVISOR, b))
    return min(a, b) if code == _MIN else max(a, b)


@kernel
def _of_one(code: int, a: float) -> float:  # noqa: C901, PLR0911
    if code == _NEGATIVE:
        return -a
    if code == _ABS:
        return abs(a)
    if code == _SIGN:
        return 1.0 if a > 0.0 else -1.0 if a < 0.0 else 0.0
    if code == _SQUARE:
        return a * a
    if code == _SQRT:
        return math.sqrt(abs(a))
    if code == _EXP:
        return math.exp(min(a, _LARGEST_EXPONENT))
    if code == _SIN:
        return math.sin(a)
    if code == _COS:
        return math.cos(a)
    if code == _TANH:
        return math.tanh(a)
    if code == _RAMP:
        return max(a, 0.0)
    return 1.0 if a > 0.0 else 0.0


@subroutine
def law(robot: Any, k: int, first: int, length: int, seen: Array, lanes: int, lane: int, hand: int) -> float:
    """Return what a law gives for one wheel; hand `MEAN` stands for both wheels' mean variables."""
    a = b = d = e = f = g = 0.0  # the stack, its top first
    for at in range(first, first + length):
        code = int(robot.terms[k, at])
        if code < FIRST_VARIABLE:
            a, b, d, e, f, g = robot.terms[k, CONSTANTS + code], a, b, d, e, f
        elif code < FIRST_OPERATOR:
            a, b, d, e, f, g = _variable(code - FIRST_VARIABLE, seen, lanes, lane, hand), a, b, d, e, f
        elif code < _LAST_OF_TWO:
            a, b, d, e, f = _total(_of_two(code, b, a)), d, e, f, g
        else:
            a = _total(_of_one(code, a))
    return _total(a)


@kernel
def _variable(number: int, seen: Array, lanes: int, lane: int, hand: int) -> float:
    left, right = 2 * number * lanes + lane, (2 * number + 1) * lanes + lane
    if hand == MEAN:
        return 0.5 * (seen[left] + seen[right])
    return seen[right] if hand == RIGHT else seen[left]


@kernel
def work_out(
    robots: npt.NDArray[Any],
    alike: bool,
    k: int,
    tokens: int,
    length: int,
    hand: int,
    scratch: Array,
    lanes: int,
) -> None:
    """Set the values of a term's law, or of its store's: of the left wheel (or the body) and of the right one.

    Parameters
    ----------
    robots, alike, scratch, lanes
        As in `ask`.
    k
        Which term.
    tokens, length
        Where in its row the tokens begin, and where their number stands.
    hand
        Of which wheel: `BOTH`, 0 or 1; `MEAN`: of the body.
    """
    values = AT_VALUES * lanes
    if alike and lanes == LANES:
        _law_of_lanes(robots, k, tokens, int(robots[0].terms[k, length]), hand == MEAN, scratch)
        return
    for lane in range(lanes):
        robot = robots[lane]
        many = int(robot.terms[k, length])
        if hand != RIGHT:
            whose = LEFT if hand == BOTH else hand
            scratch[values + lane] = law(robot, k, tokens, many, scratch, lanes + _ZERO, lane, whose)
        if hand in (BOTH, RIGHT):
            scratch[values + lanes + lane] = law(robot, k, tokens, many, scratch, lanes + _ZERO, lane, _RIGHT)


@subroutine
def _law_of_lanes(
    robots: npt.NDArray[Any], k: int, first: int, length: int, whole: bool, scratch: Array
) -> None:
    """Do what `law` does for both wheels of `LANES` robots at once, token by token."""
    top = (_AT_STACK - 2) * LANES
    for at in range(first, first + length):
        code = int(robots[0].terms[k, at])
        if code < FIRST_VARIABLE:
            top += _ROW
            for lane in range(LANES):
                value = robots[lane].terms[k, CONSTANTS + code]
                scratch[top + lane] = scratch[top + LANES + lane] = value
        elif code < FIRST_OPERATOR:
            top += _ROW
            seen = (code - FIRST_VARIABLE) * _ROW
            if whole:
                for lane in range(LANES):
                    value = 0.5 * (scratch[seen + lane] + scratch[seen + LANES + lane])
                    scratch[top + lane] = scratch[top + LANES + lane] = value
            else:
                for each in range(_ROW):
                    scratch[top + each] = scratch[seen + each]
        elif code < _LAST_OF_TWO:
            top -= _ROW
            _all_of_two(code, top, scratch)
        else:
            _all_of_one(code, top, scratch)
    for each in range(_ROW):
        scratch[AT_VALUES * LANES + each] = _total(scratch[top + each])


@kernel
def _all_of_two(code: int, top: int, scratch: Array) -> None:
    for each in range(_ROW):
        scratch[top + each] = _total(_of_two(code, scratch[top + each], scratch[top + _ROW + each]))


@kernel
def _all_of_one(code: int, top: int, scratch: Array) -> None:
    for each in range(_ROW):
        scratch[top + each] = _total(_of_one(code, scratch[top + each]))
