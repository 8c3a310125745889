"""Terms: laws in a robot's record, worked out step by step and handed to the ports.

A law is a postfix program over variables and constants, run on six values without a loop over memory; whatever it says,
the result is a finite number (`_total`). A term's store is a first-order low pass of a law of its own.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gecar.compiled import blank, kernel, subroutine
from gecar.world.kernel.motor import motor_current
from gecar.world.ports import (
    AT_X,
    AT_Y,
    BOTH,
    CONSTANTS,
    FIRST_OPERATOR,
    FIRST_VARIABLE,
    LAW,
    LENGTH,
    N_TERMS,
    OF_ITSELF,
    OF_TWO,
    OPERATOR,
    PORT,
    PORT_NUMBER,
    SIDE,
    STORE_LAW,
    STORE_LENGTH,
    STORE_S,
    VARIABLE,
    VARIABLES,
)

VIEW = np.dtype([("of", np.float64, (2, len(VARIABLES)))])
"""What laws see: every variable, of the left wheel and of the right one."""

STORES = np.dtype([("of", np.float64, (2, N_TERMS)), ("supply_voltage", np.float64)])
"""What each term has stored, of either wheel; and what terms asked of the battery in the last step [V]."""

_ASKED = (
    "left_command right_command supply_voltage left_torque right_torque left_friction right_friction "
    "left_radius right_radius left_load right_load left_grip right_grip "
    "force_ahead force_aside force_x force_y yaw_moment left_play right_play track caster shape_terms"
)
ASKED = np.dtype([(field, np.float64) for field in _ASKED.split()])
"""What terms ask for at the ports of the dynamics in a step."""

_LARGEST = 1e6
_LEAST_DIVISOR = 1e-9
_LARGEST_EXPONENT = 50.0
_APART = 0.01  # rad, over which a radius's growth with the wheel's angle is measured
_TIME, _COMMAND, _VOLTAGE, _CURRENT, _ANGLE, _SPEED, _LOAD, _SLIP, _OTHER_ANGLE, _OTHER_SPEED, _OF_SIDE = (
    range(11)
)
_AHEAD, _ASIDE, _TURN_RATE, _X, _Y, _HEADING, _DISTANCE, _READING, _STORE, _DRAW = range(11, 21)
assert VARIABLE["draw"] == _DRAW

_PORT_COMMAND, _PORT_SUPPLY, _PORT_TORQUE, _PORT_FRICTION, _PORT_RADIUS, _PORT_LOAD, _PORT_GRIP = range(7)
_PORT_FORCE_AHEAD, _PORT_FORCE_ASIDE, _PORT_FORCE_X, _PORT_FORCE_Y, _PORT_TOWARD, _PORT_YAW = range(7, 13)
_PORT_PLAY, _PORT_TRACK, _PORT_CASTER = 13, 14, 15
PORT_ENCODER, PORT_GYRO, PORT_POSE_X, PORT_POSE_Y, PORT_POSE_HEADING, _PORT_COLOUR = range(16, 22)
_PORT_POSE_TOWARD, _PORT_SENSOR_AHEAD, _PORT_SENSOR_ASIDE, _PORT_POSE_TURN = range(22, 26)
assert PORT_NUMBER["pose_turn"] == _PORT_POSE_TURN

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
def _law(laws: Any, k: int, first: int, length: int, v: Any, hand: int) -> float:
    """Return what a law gives for one wheel; hand 2 stands for the mean of both wheels' variables."""
    a = b = d = e = f = g = 0.0  # the stack, its top first
    for at in range(first, first + length):
        code = int(laws.terms[k, at])
        if code < FIRST_OPERATOR:
            a, b, d, e, f, g = _value(laws, k, code, v, hand), a, b, d, e, f
        elif code < _LAST_OF_TWO:
            a, b, d, e, f = _total(_of_two(code, b, a)), d, e, f, g
        else:
            a = _total(_of_one(code, a))
    return _total(a)


@kernel
def _value(laws: Any, k: int, code: int, v: Any, hand: int) -> float:
    if code < FIRST_VARIABLE:
        return laws.terms[k, CONSTANTS + code]
    number = code - FIRST_VARIABLE
    if hand == 2:
        return 0.5 * (v.of[0, number] + v.of[1, number])
    return v.of[hand, number]


@kernel
def _look_at(s: Any, left_command: float, right_command: float, p: Any, c: Any, v: Any) -> None:
    """Set what laws see in a step whose velocities in the body frame are known; loads and current are of the last."""
    ahead = (s.left_push + s.right_push + s.caster_push) * c.inv_dt
    aside = (s.left_side + s.right_side + s.caster_side) * c.inv_dt
    wheel = 0.5 * (c.weight - min(max(c.caster_static + ahead * c.caster_arm, 0.0), c.weight))
    x, y = s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin
    for hand in range(2):
        v.of[hand, _TIME] = s.t
        v.of[hand, _VOLTAGE] = s.voltage if s.t > 0.0 else p.voltage * p.supply_scale
        v.of[hand, _AHEAD] = s.u
        v.of[hand, _ASIDE] = s.w - s.yaw_rate * p.com_ahead
        v.of[hand, _TURN_RATE] = s.yaw_rate
        v.of[hand, _X] = x
        v.of[hand, _Y] = y
        v.of[hand, _HEADING] = s.heading
        v.of[hand, _READING] = v.of[hand, _DISTANCE] = v.of[hand, _STORE] = 0.0
    v.of[0, _COMMAND], v.of[1, _COMMAND] = left_command, right_command
    v.of[0, _ANGLE] = v.of[1, _OTHER_ANGLE] = s.left_angle
    v.of[1, _ANGLE] = v.of[0, _OTHER_ANGLE] = s.right_angle
    v.of[0, _SPEED] = v.of[1, _OTHER_SPEED] = s.left_speed
    v.of[1, _SPEED] = v.of[0, _OTHER_SPEED] = s.right_speed
    v.of[0, _CURRENT] = motor_current(s.left_drive, s.voltage, s.left_speed, p)
    v.of[1, _CURRENT] = motor_current(s.right_drive, s.voltage, s.right_speed, p)
    draw = max(s.left_drive * v.of[0, _CURRENT], 0.0) + max(s.right_drive * v.of[1, _CURRENT], 0.0)
    v.of[0, _DRAW] = v.of[1, _DRAW] = draw
    v.of[0, _LOAD] = min(max(wheel - aside * c.transfer_side, 0.0), 2.0 * wheel)
    v.of[1, _LOAD] = min(max(wheel + aside * c.transfer_side, 0.0), 2.0 * wheel)
    v.of[0, _SLIP] = s.left_speed * c.left_radius - (s.u - s.yaw_rate * c.half_track)
    v.of[1, _SLIP] = s.right_speed * c.right_radius - (s.u + s.yaw_rate * c.half_track)
    v.of[0, _OF_SIDE], v.of[1, _OF_SIDE] = -1.0, 1.0


@kernel
def ask(s: Any, left_command: float, right_command: float, p: Any, c: Any, stores: Any, asked: Any) -> None:
    """Set what a robot's terms ask for in a step, and let their stores fill.

    Parameters
    ----------
    s
        Record of dtype `STATE`; ``u`` and ``w`` are the step's own.
    left_command, right_command
        Commands of the step [-1..1].
    p, c
        Records of dtypes `PHYSICS`, the robot's own with its terms, and `DERIVED`.
    stores, asked
        Records of dtypes `STORES`, updated, and `ASKED`, overwritten.
    """
    v = blank(VIEW)
    _look_at(s, left_command, right_command, p, c, v)
    _ask(p, c.dt, stores, v, asked)


@subroutine
def _ask(laws: Any, dt: float, stores: Any, v: Any, asked: Any) -> None:
    """Work out all terms; what several ask for at a port adds up."""
    asked.left_command = asked.right_command = asked.supply_voltage = 0.0
    asked.left_torque = asked.right_torque = asked.left_friction = asked.right_friction = 0.0
    asked.left_radius = asked.right_radius = asked.left_load = asked.right_load = 0.0
    asked.left_grip = asked.right_grip = asked.force_ahead = asked.force_aside = 0.0
    asked.force_x = asked.force_y = asked.yaw_moment = asked.track = asked.shape_terms = 0.0
    asked.left_play = asked.right_play = asked.caster = 0.0
    for k in range(int(laws.n_terms)):
        port = int(laws.terms[k, PORT])
        if port >= PORT_ENCODER:
            continue
        for hand in range(2):
            v.of[hand, _STORE] = stores.of[hand, k]
        if port == _PORT_TOWARD:
            force_x, force_y = _toward(laws, k, v)
            asked.force_x += force_x
            asked.force_y += force_y
        elif port in (
            _PORT_SUPPLY,
            _PORT_FORCE_AHEAD,
            _PORT_FORCE_ASIDE,
            _PORT_FORCE_X,
            _PORT_FORCE_Y,
            _PORT_YAW,
            _PORT_TRACK,
            _PORT_CASTER,
        ):
            _add_whole(asked, port, _law(laws, k, LAW, int(laws.terms[k, LENGTH]), v, 2))
        else:
            for hand in range(2):
                if int(laws.terms[k, SIDE]) in (BOTH, hand):
                    _add_of_wheel(asked, port, hand, _law(laws, k, LAW, int(laws.terms[k, LENGTH]), v, hand))
                    if port == _PORT_RADIUS:
                        _add_of_wheel(asked, _PORT_TORQUE, hand, _lift(laws, k, v, hand))
        if laws.terms[k, STORE_LENGTH] > 0.0:
            _fill(laws, k, dt, v, stores)
    stores.supply_voltage = asked.supply_voltage


@subroutine
def _lift(laws: Any, k: int, v: Any, hand: int) -> float:
    """Return the torque on a wheel's shaft as the wheel, which is not round, lifts or lowers the axle [N m].

    By virtual work, load times what the radius grows by a radian: a term at ``rolling_radius`` gives a share of it.
    """
    angle, length = v.of[hand, _ANGLE], int(laws.terms[k, LENGTH])
    v.of[hand, _ANGLE] = angle + _APART
    after = _law(laws, k, LAW, length, v, hand)
    v.of[hand, _ANGLE] = angle - _APART
    before = _law(laws, k, LAW, length, v, hand)
    v.of[hand, _ANGLE] = angle
    radius = laws.wheel_radius * laws.radius_scale
    return -v.of[hand, _LOAD] * radius * (after - before) / (2.0 * _APART)


@kernel
def _fill(laws: Any, k: int, dt: float, v: Any, stores: Any) -> None:
    """Let a term's store fill for a step.

    It is exact where what the store fills toward stands still, or, of one that looks at itself, where its change does.
    """
    keep = math.exp(-dt / laws.terms[k, STORE_S])
    if laws.terms[k, OF_ITSELF] > 0.0:
        keep = max(1.0 - dt / laws.terms[k, STORE_S], 0.0)
    for hand in range(2):
        goal = _law(laws, k, STORE_LAW, int(laws.terms[k, STORE_LENGTH]), v, hand)
        stores.of[hand, k] = goal + (stores.of[hand, k] - goal) * keep


@kernel
def _add_whole(asked: Any, port: int, value: float) -> None:
    if port == _PORT_SUPPLY:
        asked.supply_voltage += value
    elif port == _PORT_FORCE_AHEAD:
        asked.force_ahead += value
    elif port == _PORT_FORCE_ASIDE:
        asked.force_aside += value
    elif port == _PORT_FORCE_X:
        asked.force_x += value
    elif port == _PORT_FORCE_Y:
        asked.force_y += value
    elif port == _PORT_YAW:
        asked.yaw_moment += value
    elif port == _PORT_CASTER:
        asked.caster += value
    else:
        asked.shape_terms += 1.0
        asked.track += value


@kernel
def _add_of_wheel(asked: Any, port: int, hand: int, value: float) -> None:
    left, right = (value, 0.0) if hand == 0 else (0.0, value)
    if port == _PORT_COMMAND:
        asked.left_command += left
        asked.right_command += right
    elif port == _PORT_TORQUE:
        asked.left_torque += left
        asked.right_torque += right
    elif port == _PORT_FRICTION:
        asked.left_friction += left
        asked.right_friction += right
    elif port == _PORT_RADIUS:
        asked.shape_terms += 1.0
        asked.left_radius += left
        asked.right_radius += right
    elif port == _PORT_LOAD:
        asked.left_load += left
        asked.right_load += right
    elif port == _PORT_PLAY:
        asked.shape_terms += 1.0
        asked.left_play += left
        asked.right_play += right
    else:
        asked.left_grip += left
        asked.right_grip += right


@kernel
def reading_error(port: int, hand: int, s: Any, p: Any, laws: Any) -> float:
    """Return what a robot's terms add to what is measured of its motion, in the port's unit.

    Parameters
    ----------
    port
        ``PORT_ENCODER``, ``PORT_GYRO``, or ``PORT_POSE_X`` to ``PORT_POSE_HEADING``.
    hand
        Of which wheel: 0 left, 1 right.
    s, p
        Records of dtypes `STATE` and `PHYSICS`.
    laws
        Record of dtype `PHYSICS` with the terms.
    """
    v = blank(VIEW)
    for each in range(2):
        v.of[each, _TIME], v.of[each, _HEADING], v.of[each, _TURN_RATE] = s.t, s.heading, s.yaw_rate
        v.of[each, _X], v.of[each, _Y] = s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin
        v.of[each, _AHEAD] = s.vx * s.cos + s.vy * s.sin
        v.of[each, _ASIDE] = s.vy * s.cos - s.vx * s.sin - s.yaw_rate * p.com_ahead
    v.of[0, _ANGLE], v.of[1, _ANGLE] = s.left_angle, s.right_angle
    v.of[0, _SPEED], v.of[1, _SPEED] = s.left_speed, s.right_speed
    v.of[0, _OF_SIDE], v.of[1, _OF_SIDE] = -1.0, 1.0
    return _reading_error(port, hand, v, laws)


@kernel
def colour_error(time: float, x: float, y: float, heading: float, reading: float, laws: Any) -> float:
    """Return what a robot's terms add to a reading of the colour sensor [%].

    Parameters
    ----------
    time, x, y, heading
        When [s] and where [m, m, rad] the robot is.
    reading
        What the sensor would read without them [%].
    laws
        Record of dtype `PHYSICS` with the terms.
    """
    v = blank(VIEW)
    for each in range(2):
        v.of[each, _TIME], v.of[each, _X], v.of[each, _Y], v.of[each, _HEADING] = time, x, y, heading
        v.of[each, _READING] = reading
    return _reading_error(_PORT_COLOUR, 0, v, laws)


@kernel
def sensor_shift(
    time: float, x: float, y: float, heading: float, ahead: float, aside: float, turn_rate: float, laws: Any
) -> tuple[float, float]:
    """Return how far a robot's terms move its colour sensors to the front and to the left [m].

    Parameters
    ----------
    time, x, y, heading
        When [s] and where [m, m, rad] the robot is.
    ahead, aside, turn_rate
        How it moves [m/s, m/s, rad/s].
    laws
        Record of dtype `PHYSICS` with the terms.
    """
    v = blank(VIEW)
    for each in range(2):
        v.of[each, _TIME], v.of[each, _X], v.of[each, _Y], v.of[each, _HEADING] = time, x, y, heading
        v.of[each, _AHEAD], v.of[each, _ASIDE], v.of[each, _TURN_RATE] = ahead, aside, turn_rate
    return _reading_error(_PORT_SENSOR_AHEAD, 0, v, laws), _reading_error(_PORT_SENSOR_ASIDE, 0, v, laws)


@subroutine
def _reading_error(port: int, hand: int, v: Any, laws: Any) -> float:
    total, axis = 0.0, port - PORT_POSE_X
    for k in range(int(laws.n_terms)):
        of_wheel = port == PORT_ENCODER
        acts_at, side = int(laws.terms[k, PORT]), int(laws.terms[k, SIDE])
        if acts_at == port and (not of_wheel or side in (BOTH, hand)):
            total += _law(laws, k, LAW, int(laws.terms[k, LENGTH]), v, hand if of_wheel else 2)
        elif acts_at == _PORT_POSE_TOWARD and 0 <= axis < 2:
            total += _toward(laws, k, v)[axis]
        elif acts_at == _PORT_POSE_TURN and 0 <= axis < 3:
            total += _turned(laws, k, v)[axis]
    return total


@kernel
def _toward(laws: Any, k: int, v: Any) -> tuple[float, float]:
    """Return along x and y what a law gives toward its point."""
    dx, dy, value = _at_a_point(laws, k, v)
    pull = value / max(v.of[0, _DISTANCE], 1e-6)
    return pull * dx, pull * dy


@kernel
def _turned(laws: Any, k: int, v: Any) -> tuple[float, float, float]:
    """Return how far a pose seems to move when the camera's picture turns about a point: x, y [m] and heading [rad]."""
    dx, dy, turn = _at_a_point(laws, k, v)
    sine, less = math.sin(turn), math.cos(turn) - 1.0
    return sine * dy - less * dx, -sine * dx - less * dy, turn


@kernel
def _at_a_point(laws: Any, k: int, v: Any) -> tuple[float, float, float]:
    """Return the way from the robot to a law's point, along x and y [m], and what the law gives at that distance."""
    dx, dy = laws.terms[k, AT_X] - v.of[0, _X], laws.terms[k, AT_Y] - v.of[0, _Y]
    v.of[0, _DISTANCE] = v.of[1, _DISTANCE] = math.sqrt(dx * dx + dy * dy)
    return dx, dy, _law(laws, k, LAW, int(laws.terms[k, LENGTH]), v, 2)
