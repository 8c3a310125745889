"""Terms: laws in a robot's record, worked out step by step (`gecar.world.kernel.laws`) and handed to the ports.

A term's store is a first-order low pass of a law of its own.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import any_integer, blank, kernel, subroutine
from gecar.world.kernel.contacts import caster_load, impulses_on_body, slips, wheel_loads
from gecar.world.kernel.laws import (
    ASKED_FIELDS,
    ASKED_OF_PORT,
    AT_ASKED,
    AT_KEPT,
    AT_VALUES,
    MEAN,
    OF_BODY,
    SCRATCH,
    SUPPLY_ASKED,
    VIEW,
    law,
    store_view,
    work_out,
)
from gecar.world.kernel.motor import motor_current
from gecar.world.ports import (
    AT_A_POINT,
    AT_X,
    AT_Y,
    BOTH,
    LAW,
    LENGTH,
    OF_ITSELF,
    PORT,
    PORT_NUMBER,
    RIGHT,
    SIDE,
    STORE_LAW,
    STORE_LENGTH,
    STORE_S,
    VARIABLE,
)

Array = npt.NDArray[np.float64]

_APART = 0.01  # rad, over which a radius's growth with the wheel's angle is measured
_ANGLE, _LOAD, _X, _Y = (VARIABLE[name] for name in ("angle", "load", "x", "y"))
_DISTANCE, _STORE = VARIABLE["distance"], VARIABLE["store"]
_AHEAD, _ASIDE, _TURN_RATE, _HEADING = (VARIABLE[name] for name in ("ahead", "aside", "turn_rate", "heading"))

PORT_ENCODER, PORT_GYRO, PORT_POSE_X, _COLOUR, _SENSOR_AHEAD, _SENSOR_ASIDE = (
    any_integer(PORT_NUMBER[name])
    for name in (
        "encoder_reading",
        "gyro_reading",
        "pose_x",
        "colour_reading",
        "sensor_ahead",
        "sensor_aside",
    )
)
_LAW, _STORE_LAW, _ONE, _FIRST = (any_integer(number) for number in (LAW, STORE_LAW, 1, 0))
WHOLE = any_integer(0)
"""Hand of a reading that neither wheel has for itself."""
_TOWARD, _POSE_TOWARD, _POSE_TURN = (PORT_NUMBER[name] for name in AT_A_POINT)
_POSE_LATE = PORT_NUMBER["pose_late"]
_RADIUS, _PLAY, _TRACK = (PORT_NUMBER[name] for name in ("rolling_radius", "gear_play", "track_width"))
_ASKED_AT = np.array([ASKED_FIELDS.index(names[0]) for names in ASKED_OF_PORT])
_OF_WHEEL = np.array([port.of_wheel for port in OF_BODY])
_TORQUE, _FORCE_X, _FORCE_Y, _SUPPLY, _CONTACT, _SHAPE = (
    ASKED_FIELDS.index(name)
    for name in ("left_motor_torque", "force_x", "force_y", "supply_voltage", "left_contact", "shape_terms")
)


@kernel
def look_at(s: Any, left_command: float, right_command: float, p: Any, c: Any, v: Any) -> None:
    """Set what laws see in a step whose velocities in the body frame are known; loads and current are of the last.

    Parameters
    ----------
    s
        Record of dtype `STATE`; ``u`` and ``w`` are the step's own.
    left_command, right_command
        Commands of the step [-1..1].
    p, c
        Records of dtypes `PHYSICS` and `DERIVED`.
    v
        Record of dtype `VIEW`, overwritten.
    """
    ahead, aside = impulses_on_body(s)
    v.left_time = v.right_time = s.t
    v.left_voltage = v.right_voltage = s.voltage if s.t > 0.0 else p.voltage * p.supply_scale
    v.left_ahead = v.right_ahead = s.u
    v.left_aside = v.right_aside = s.w - s.yaw_rate * p.com_ahead
    v.left_turn_rate = v.right_turn_rate = s.yaw_rate
    v.left_x = v.right_x = s.x - p.com_ahead * s.cos
    v.left_y = v.right_y = s.y - p.com_ahead * s.sin
    v.left_heading = v.right_heading = s.heading
    v.left_reading = v.right_reading = 0.0
    v.left_distance = v.right_distance = v.left_store = v.right_store = 0.0
    v.left_command = v.right_other_command = left_command
    v.right_command = v.left_other_command = right_command
    v.left_angle = v.right_other_angle = s.left_angle
    v.right_angle = v.left_other_angle = s.right_angle
    v.left_speed = v.right_other_speed = s.left_speed
    v.right_speed = v.left_other_speed = s.right_speed
    v.left_current = motor_current(s.left_drive, s.voltage, s.left_speed, p)
    v.right_current = motor_current(s.right_drive, s.voltage, s.right_speed, p)
    draw = max(s.left_drive * v.left_current, 0.0) + max(s.right_drive * v.right_current, 0.0)
    v.left_draw = v.right_draw = draw
    v.left_load, v.right_load = wheel_loads(caster_load(ahead * c.inv_dt, c), aside * c.inv_dt, c)
    v.left_slip, v.right_slip, _ = slips(s, c)
    v.left_side, v.right_side = -1.0, 1.0


@kernel
def ask(robots: npt.NDArray[Any], alike: bool, dt: float, stores: Array, scratch: Array, lanes: int) -> None:
    """Set what terms ask for in a step, of robots whose terms act at the same ports, and let their stores fill.

    Parameters
    ----------
    robots
        With their terms, dtype `PHYSICS`, shape (lanes,).
    alike
        Whether their laws differ in constants alone: then all lanes go through a law together.
    dt
        Step [s].
    stores
        ``N_STORES`` fields of all lanes, updated.
    scratch
        ``N_SCRATCH`` fields of all lanes; what laws see is set, what they ask for is overwritten.
    lanes
        A constant where this is called.
    """
    scratch[AT_ASKED * lanes : AT_VALUES * lanes] = 0.0
    first = robots[0]
    for k in range(int(first.n_terms)):
        port, side = int(first.terms[k, PORT]), int(first.terms[k, SIDE])
        if port >= PORT_ENCODER:
            continue
        for each in range(2 * lanes):
            scratch[2 * _STORE * lanes + each] = stores[2 * k * lanes + each]
        hand = side if _OF_WHEEL[port] else MEAN
        if port == _TOWARD:
            _pull(robots, alike, k, scratch, lanes)
        else:
            work_out(robots, alike, k, _LAW, LENGTH, hand, scratch, lanes)
            _add(_ASKED_AT[port], hand, scratch, lanes)
        if port == _RADIUS:
            _lift(robots, alike, k, side, scratch, lanes)
        if port in (_RADIUS, _PLAY, _TRACK):
            scratch[(AT_ASKED + _SHAPE) * lanes : (AT_ASKED + _SHAPE + 1) * lanes] = 1.0
        if first.terms[k, STORE_LENGTH] > 0.0:
            _fill(robots, alike, k, dt, stores, scratch, lanes)
    for lane in range(lanes):
        stores[SUPPLY_ASKED * lanes + lane] = scratch[(AT_ASKED + _SUPPLY) * lanes + lane]


@kernel
def _add(field: int, hand: int, scratch: Array, lanes: int) -> None:
    """Add a law's values to what is asked for: of both wheels (`BOTH`), of one, or of the body."""
    at, values = (AT_ASKED + field) * lanes, AT_VALUES * lanes
    if hand != RIGHT:
        for lane in range(lanes):
            scratch[at + lane] += scratch[values + lane]
    if hand in (BOTH, RIGHT):
        for lane in range(lanes):
            scratch[at + lanes + lane] += scratch[values + lanes + lane]


@kernel
def _pull(robots: npt.NDArray[Any], alike: bool, k: int, scratch: Array, lanes: int) -> None:
    """Add to the forces on the floor's axes what a law gives toward its point."""
    for lane in range(lanes):
        dx, dy = _way_to_point(robots[lane], k, scratch, lanes, lane)
        distance = math.sqrt(dx * dx + dy * dy)
        scratch[2 * _DISTANCE * lanes + lane] = scratch[(2 * _DISTANCE + 1) * lanes + lane] = distance
    work_out(robots, alike, k, _LAW, LENGTH, MEAN, scratch, lanes)
    for lane in range(lanes):
        dx, dy = _way_to_point(robots[lane], k, scratch, lanes, lane)
        pull = scratch[AT_VALUES * lanes + lane] / max(scratch[2 * _DISTANCE * lanes + lane], 1e-6)
        scratch[(AT_ASKED + _FORCE_X) * lanes + lane] += pull * dx
        scratch[(AT_ASKED + _FORCE_Y) * lanes + lane] += pull * dy


@kernel
def _way_to_point(robot: Any, k: int, seen: Array, lanes: int, lane: int) -> tuple[float, float]:
    """Return the way from the robot to a law's point, along x and y [m]."""
    dx = robot.terms[k, AT_X] - seen[2 * _X * lanes + lane]
    return dx, robot.terms[k, AT_Y] - seen[2 * _Y * lanes + lane]


@kernel
def _lift(robots: npt.NDArray[Any], alike: bool, k: int, side: int, scratch: Array, lanes: int) -> None:
    """Add the torque on the shaft of a wheel that is not round, which lifts the axle [N m], and move its contact [m].

    What the radius grows by a radian is how far ahead of the axle the wheel touches the floor [m]; by virtual work,
    load times that is the torque. A term at ``rolling_radius`` gives a share of the radius.
    """
    angle, load, values, kept = 2 * _ANGLE * lanes, 2 * _LOAD * lanes, AT_VALUES * lanes, AT_KEPT * lanes
    for each in range(2 * lanes):
        scratch[kept + each] = scratch[angle + each]
        scratch[angle + each] += _APART
    work_out(robots, alike, k, _LAW, LENGTH, side, scratch, lanes)
    for each in range(2 * lanes):
        scratch[kept + 2 * lanes + each] = scratch[values + each]
        scratch[angle + each] = scratch[kept + each] - _APART
    work_out(robots, alike, k, _LAW, LENGTH, side, scratch, lanes)
    for lane in range(lanes):
        radius = robots[lane].wheel_radius * robots[lane].radius_scale
        for each in (lane, lanes + lane):
            scratch[angle + each] = scratch[kept + each]
            grown = scratch[kept + 2 * lanes + each] - scratch[values + each]
            scratch[values + each] = radius * grown / (2.0 * _APART)
    _add(_CONTACT, side, scratch, lanes)
    for each in range(2 * lanes):
        scratch[values + each] *= -scratch[load + each]
    _add(_TORQUE, side, scratch, lanes)


@kernel
def _fill(
    robots: npt.NDArray[Any], alike: bool, k: int, dt: float, stores: Array, scratch: Array, lanes: int
) -> None:
    """Let a term's store fill for a step.

    It is exact where what the store fills toward stands still, or, of one that looks at itself, where its change does.
    """
    work_out(robots, alike, k, _STORE_LAW, STORE_LENGTH, BOTH, scratch, lanes)
    for lane in range(lanes):
        robot = robots[lane]
        keep = math.exp(-dt / robot.terms[k, STORE_S])
        if robot.terms[k, OF_ITSELF] > 0.0:
            keep = max(1.0 - dt / robot.terms[k, STORE_S], 0.0)
        for each in (lane, lanes + lane):
            goal = scratch[AT_VALUES * lanes + each]
            at = 2 * k * lanes + each
            stores[at] = goal + (stores[at] - goal) * keep


@kernel
def reading_error(port: int, hand: int, s: Any, p: Any, laws: Any) -> float:
    """Return what a robot's terms add to what is measured of its motion, in the port's unit.

    Parameters
    ----------
    port
        ``PORT_ENCODER``, ``PORT_GYRO``, or ``PORT_POSE_X`` and the two after it.
    hand
        Of which wheel: 0 left, 1 right; or `WHOLE`.
    s, p
        Records of dtypes `STATE` and `PHYSICS`.
    laws
        Record of dtype `PHYSICS` with the terms.
    """
    v = blank(VIEW)
    v.left_time = v.right_time = s.t
    v.left_heading = v.right_heading = s.heading
    v.left_turn_rate = v.right_turn_rate = s.yaw_rate
    v.left_x = v.right_x = s.x - p.com_ahead * s.cos
    v.left_y = v.right_y = s.y - p.com_ahead * s.sin
    v.left_ahead = v.right_ahead = s.vx * s.cos + s.vy * s.sin
    v.left_aside = v.right_aside = s.vy * s.cos - s.vx * s.sin - s.yaw_rate * p.com_ahead
    v.left_angle, v.right_angle = s.left_angle, s.right_angle
    v.left_speed, v.right_speed = s.left_speed, s.right_speed
    v.left_side, v.right_side = -1.0, 1.0
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
    _stand(v, time, x, y, heading)
    v.left_reading = v.right_reading = reading
    return _reading_error(_COLOUR, WHOLE, v, laws)


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
    _stand(v, time, x, y, heading)
    v.left_ahead = v.right_ahead = ahead
    v.left_aside = v.right_aside = aside
    v.left_turn_rate = v.right_turn_rate = turn_rate
    return _reading_error(_SENSOR_AHEAD, WHOLE, v, laws), _reading_error(_SENSOR_ASIDE, WHOLE, v, laws)


@kernel
def _stand(v: Any, time: float, x: float, y: float, heading: float) -> None:
    """Set when [s] and where [m, m, rad] laws see the robot."""
    v.left_time = v.right_time = time
    v.left_x = v.right_x = x
    v.left_y = v.right_y = y
    v.left_heading = v.right_heading = heading


@subroutine
def _reading_error(port: int, hand: int, v: Any, laws: Any) -> float:
    seen = blank(SCRATCH).of
    store_view(seen, 1, 0, v)
    total, axis = 0.0, port - PORT_POSE_X
    for k in range(int(laws.n_terms)):
        of_wheel = port == PORT_ENCODER
        acts_at, side = int(laws.terms[k, PORT]), int(laws.terms[k, SIDE])
        if acts_at == port and (not of_wheel or side in (BOTH, hand)):
            total += law(
                laws, k, _LAW, int(laws.terms[k, LENGTH]), seen, _ONE, _FIRST, hand if of_wheel else MEAN
            )
        elif acts_at == _POSE_TOWARD and 0 <= axis < 2:
            total += _toward(laws, k, seen)[axis]
        elif acts_at == _POSE_TURN and 0 <= axis < 3:
            total += _turned(laws, k, seen)[axis]
        elif acts_at == _POSE_LATE and 0 <= axis < 3:
            late = law(laws, k, _LAW, int(laws.terms[k, LENGTH]), seen, _ONE, _FIRST, MEAN)
            total -= late * _pose_rates(seen)[axis]
    return total


@kernel
def _pose_rates(seen: Array) -> tuple[float, float, float]:
    """Return how fast a pose changes: x, y [m/s] and heading [rad/s]."""
    ahead, aside = seen[2 * _AHEAD], seen[2 * _ASIDE]
    sine, cosine = math.sin(seen[2 * _HEADING]), math.cos(seen[2 * _HEADING])
    return ahead * cosine - aside * sine, ahead * sine + aside * cosine, seen[2 * _TURN_RATE]


@kernel
def _toward(laws: Any, k: int, seen: Array) -> tuple[float, float]:
    """Return along x and y what a law gives toward its point."""
    dx, dy, value = _at_a_point(laws, k, seen)
    pull = value / max(seen[2 * _DISTANCE], 1e-6)
    return pull * dx, pull * dy


@kernel
def _turned(laws: Any, k: int, seen: Array) -> tuple[float, float, float]:
    """Return how far a pose seems to move when the camera's picture turns about a point: x, y [m] and heading [rad]."""
    dx, dy, turn = _at_a_point(laws, k, seen)
    sine, less = math.sin(turn), math.cos(turn) - 1.0
    return sine * dy - less * dx, -sine * dx - less * dy, turn


@kernel
def _at_a_point(laws: Any, k: int, seen: Array) -> tuple[float, float, float]:
    """Return the way from the robot to a law's point, along x and y [m], and what the law gives at that distance."""
    dx, dy = _way_to_point(laws, k, seen, _ONE, _FIRST)
    seen[2 * _DISTANCE] = seen[2 * _DISTANCE + 1] = math.sqrt(dx * dx + dy * dy)
    return dx, dy, law(laws, k, _LAW, int(laws.terms[k, LENGTH]), seen, _ONE, _FIRST, MEAN)
