"""The rigid body on its three contacts, in the plane: tyres that creep, a caster that rubs, loads that shift."""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from benchmarks.concealed.continuous.drive import ANGLE, TERMINAL, step_drive
from benchmarks.concealed.continuous.numbers import Numbers
from benchmarks.concealed.robot import CASTER_RADIUS, GRAVITY, WHEEL_MASS

# State: place and velocity of the centre of mass [m, m/s], heading and its rate [rad, rad/s], wheels' angles and speeds
# [rad, rad/s], deflections of both treads and of the caster's contact, ahead and left [m], of the tyres' flexing
# [rad], force of the floor in the step before, ahead and left [N], way rolled [m], heading of a castor wheel [rad],
# for how long a contact has been lifted [s], angle turned since the start [rad], place of a weight on a string [m],
# way of hair wound round the caster [m], how far a table has tipped and to which side it does.
X, Y, TURN, VX, VY, RATE, WHEEL, WHEEL_SPEED = 0, 1, 2, 3, 4, 5, 6, 8
TREAD, BALL, FLEX, FLOOR, ROLLED, CASTOR, LIFTED, TURNED, WEIGHT, WOUND, TIPPED, SIZE = (
    10,
    14,
    16,
    18,
    20,
    21,
    22,
    23,
    24,
    26,
    27,
    29,
)

# Brush tyre with a first-order relaxation of the contact (Pacejka, Tire and Vehicle Dynamics, 3rd ed., ch. 3 and 7).
# Slip stiffness over load is 10-30 for cars; a small solid tyre under a newton is stiffer.
SLIP_STIFFNESS = 160.0  # of load per unit slip
RELAXATION = 0.004  # m, half the length of the contact patch
_TREAD_DAMPING = 20.0  # N s / m, while it sticks
# Dahl's solid friction (1968) for the caster's ball and for the tyres' flexing: like LuGre without viscous parts.
_BALL_SLIDES = 0.0002  # m
_FLEX_SLIDES = 0.01  # rad
_LOAD_FOLLOWS = 0.002  # s: loads follow the floor's forces as quickly as tyres settle
_DRAG_BLEND = 0.02  # m / s
_TWIST_SLIPS = 6.0  # rad
_SCRUB_BLEND = 0.2  # rad / s
_FAN_SWINGS = 0.7  # rad
_FAN_BEAM = 0.25  # rad
_MIDDLE_X, _MIDDLE_Y = 1.2, 0.6  # of the field [m]
_TIPPING = 0.1  # s
_RIDGE_RADIUS = 0.20  # m, of the lying cylinder whose cap is the ridge
STEPS = 10  # of a tick: 0.1 ms; halving it moves nothing that a sensor sees


@numba.njit(cache=True)
def advance(
    n: Numbers,
    b: npt.NDArray[np.float64],
    d: npt.NDArray[np.float64],
    duties: npt.NDArray[np.float64],
    gusts: npt.NDArray[np.float64],
    time_s: float,
    tick_s: float,
    dt: float,
    seen: npt.NDArray[np.float64],
) -> None:
    """Advance everything by some ticks.

    Parameters
    ----------
    n
        The robot.
    b, d
        States of body and drive, changed in place.
    duties
        What :func:`benchmarks.concealed.continuous.drive.step_drive` takes, in each tick (ticks, 3).
    gusts
        Rows of start, length [s], force x, y [N].
    time_s, tick_s
        Time since the recording began, and the length of a tick, by the log's clock [s].
    dt
        A step of true time [s].
    seen
        Receives what :func:`observe` gives after each tick (ticks, 7).
    """
    torques, loads = np.zeros(2), np.zeros(3)
    for tick in range(len(duties)):
        for step in range(STEPS):
            now = time_s + tick_s * (tick + step / STEPS)
            step_drive(
                n, d, duties[tick], b[WHEEL : WHEEL + 2], b[WHEEL_SPEED : WHEEL_SPEED + 2], now, dt, torques
            )
            _step_body(n, b, torques, loads, gusts, time_s + tick_s * tick, dt)
        observe(n, b, d, seen[tick])


@numba.njit(cache=True)
def _step_body(
    n: Numbers,
    b: npt.NDArray[np.float64],
    torques: npt.NDArray[np.float64],
    loads: npt.NDArray[np.float64],
    gusts: npt.NDArray[np.float64],
    time_s: float,
    dt: float,
) -> None:
    cos, sin = math.cos(b[TURN]), math.sin(b[TURN])
    axle_x, axle_y = b[X] - n.com_ahead * cos, b[Y] - n.com_ahead * sin
    ahead, left = cos * b[VX] + sin * b[VY], cos * b[VY] - sin * b[VX]  # of the centre of mass
    along_x, along_y = _slope(n, b, axle_x, axle_y, dt)
    down = math.sqrt(max(1.0 - math.sin(along_x) ** 2 - math.sin(along_y) ** 2, 0.0))
    _share_load(n, b, n.mass * GRAVITY * down, loads, dt)

    # Tyres and wheels.
    force_ahead, force_left, torque = 0.0, 0.0, 0.0
    for side in range(2):
        lever = n.half_track if side == 0 else -n.half_track
        radius, rise = _shape(n, side, b[WHEEL + side], time_s)
        rolling = ahead - b[RATE] * lever
        toe = n.toe if n.toe_side == side else 0.0
        slip_x, slip_y = turned(rolling, left - b[RATE] * n.com_ahead, -toe)
        slip_x -= radius * b[WHEEL_SPEED + side]
        holding = grip(n, b, side, axle_x, axle_y)
        tread = b[TREAD + 2 * side : TREAD + 2 * side + 2]
        push_x, push_y = _tyre(
            n, tread, slip_x, slip_y, radius * b[WHEEL_SPEED + side], holding, loads[side], dt
        )
        inertia = 0.5 * WHEEL_MASS * radius * radius
        flexed = _dahl(b, FLEX + side, b[WHEEL_SPEED + side], _FLEX_SLIDES, dt)
        brake = flexed * n.rolling * loads[side] * radius
        brake += flexed * sticking(n, side, axle_x, axle_y, b[TURN])
        if n.frame_rub > 0.0:
            brake += flexed * rubbing(n, side, ahead, b[RATE])
        # A wheel that lifts its axle as it turns is held back by its load.
        turning = torques[side] - radius * push_x - brake - loads[side] * rise
        b[WHEEL_SPEED + side] += dt * turning / inertia
        b[WHEEL + side] += dt * b[WHEEL_SPEED + side]
        push_x, push_y = turned(push_x, push_y, toe)
        force_ahead += push_x
        force_left += push_y
        torque += -lever * push_x - n.com_ahead * push_y

    rub_x, rub_y = _rub(n, b, ahead, left, loads[2], dt)
    force_ahead += rub_x
    force_left += rub_y
    torque += (n.caster - n.com_ahead) * rub_y
    follow = dt / _LOAD_FOLLOWS
    b[FLOOR] += follow * (force_ahead - b[FLOOR])
    b[FLOOR + 1] += follow * (force_left - b[FLOOR + 1])

    # What does not pass through the contacts.
    force_x, force_y = cos * force_ahead - sin * force_left, sin * force_ahead + cos * force_left
    force_x += n.mass * GRAVITY * math.sin(along_x)
    force_y += n.mass * GRAVITY * math.sin(along_y)
    if n.ridge > 0.0:
        climb_x, climb_y, climb_turn = _climb(n, axle_x, axle_y, cos, sin, loads)
        force_x, force_y, torque = force_x + climb_x, force_y + climb_y, torque + climb_turn
    axle_vx, axle_vy = b[VX] + n.com_ahead * sin * b[RATE], b[VY] - n.com_ahead * cos * b[RATE]
    push_x, push_y, push_turn = pushes(
        n, b, axle_x, axle_y, b[TURN], axle_vx, axle_vy, b[RATE], gusts, time_s, dt
    )
    force_x, force_y, torque = force_x + push_x, force_y + push_y, torque + push_turn
    if n.nap > 0.0:
        carried_x, carried_y = turned(dt * n.nap * abs(ahead), 0.0, n.nap_way)
        b[X] += carried_x
        b[Y] += carried_y

    _move(n, b, force_x, force_y, torque, dt)


@numba.njit(cache=True)
def _slope(n: Numbers, b: npt.NDArray[np.float64], x: float, y: float, dt: float) -> tuple[float, float]:
    """Advance a table that tips; give the floor's slope here, along x and y [rad]."""
    along_x, along_y = n.tilt_x, n.tilt_y
    if n.wave > 0.0:
        wave = 2.0 * math.pi / n.wave_length
        along_x += n.wave * math.sin(wave * x + n.wave_x)
        along_y += n.wave * math.sin(wave * y + n.wave_y)
    if n.curl > 0.0:
        along_x += n.curl * curled(x, 2.0 * _MIDDLE_X, n.curl_width)
        along_y += n.curl * curled(y, 2.0 * _MIDDLE_Y, n.curl_width)
    if n.rocking > 0.0:
        leaning = n.rocking * tip(n, b, x, y, dt)
        along_x += leaning * math.cos(n.rocking_way)
        along_y += leaning * math.sin(n.rocking_way)
    return along_x, along_y


@numba.njit(cache=True)
def curled(place: float, length: float, wide: float) -> float:
    """Give the share of its edges' slope that a curled mat has here, down to the middle."""
    if place < wide:
        return min(1.0 - place / wide, 1.0)
    if length - place < wide:
        return -min(1.0 - (length - place) / wide, 1.0)
    return 0.0


@numba.njit(cache=True)
def _move(
    n: Numbers, b: npt.NDArray[np.float64], force_x: float, force_y: float, torque: float, dt: float
) -> None:
    """Advance the body under the forces [N] at, and the torque [N m] about, its centre of mass."""
    b[VX] += dt * force_x / n.mass
    b[VY] += dt * force_y / n.mass
    b[RATE] += dt * torque / n.yaw_inertia
    b[X] += dt * b[VX]
    b[Y] += dt * b[VY]
    b[TURN] += dt * b[RATE]
    b[ROLLED] += dt * (abs(b[WHEEL_SPEED]) + abs(b[WHEEL_SPEED + 1])) * n.radius_left / 2.0


@numba.njit(cache=True)
def turned(x: float, y: float, angle: float) -> tuple[float, float]:
    """Turn a vector counter-clockwise [rad]."""
    if angle == 0.0:
        return x, y
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


@numba.njit(cache=True)
def sticking(n: Numbers, side: int, x: float, y: float, turn: float) -> float:
    """Give the torque with which a strip across the floor, or one of its patches, holds a wheel on it [N m]."""
    if n.strip == 0.0 and n.patches == 0.0:
        return 0.0
    off_x, off_y = turned(0.0, n.half_track if side == 0 else -n.half_track, turn)
    if n.patches > 0.0:
        return n.patches * _drawn(
            math.floor((x + off_x) / n.patches_size),
            math.floor((y + off_y) / n.patches_size),
            n.patches_pattern,
        )
    across, _ = turned(x + off_x - n.strip_x, y + off_y - 0.6, -n.strip_angle)
    return n.strip if abs(across) < n.strip_width / 2.0 else 0.0


@numba.njit(cache=True)
def _drawn(column: float, row: float, pattern: float) -> float:
    """Give a number between 0 and 1 that neighbouring places do not share, and the same place always has."""
    big = math.sin(12.9898 * column + 78.233 * row + pattern) * 43758.5453
    return big - math.floor(big)


@numba.njit(cache=True)
def tip(n: Numbers, b: npt.NDArray[np.float64], x: float, y: float, dt: float) -> float:
    """Advance a table that tips to the side of its hinge where the robot is; give how far it has, from -1 to 1."""
    beyond, _ = turned(x - n.rocking_x, y - _MIDDLE_Y, -n.rocking_way)
    if abs(beyond) > n.rocking_play:
        b[TIPPED + 1] = np.sign(beyond)
    before = b[TIPPED]
    b[TIPPED] += dt / _TIPPING * (b[TIPPED + 1] - before)
    return before


@numba.njit(cache=True)
def _blow(n: Numbers, x: float, y: float, time_s: float) -> tuple[float, float]:
    """Give the force of a fan that swings to and fro: a free jet's, which fades with the distance squared [N]."""
    off_x, off_y = x - n.fan_x, y - n.fan_y
    swing = _FAN_SWINGS * math.sin(2.0 * math.pi * time_s / n.fan_period + n.fan_phase)
    aim_x, aim_y = turned(_MIDDLE_X - n.fan_x, _MIDDLE_Y - n.fan_y, swing)
    aside = math.atan2(aim_x * off_y - aim_y * off_x, aim_x * off_x + aim_y * off_y)
    away = math.hypot(off_x, off_y)
    push = 2.0 * n.fan / (1.0 + away**2) * math.exp(-((aside / _FAN_BEAM) ** 2))
    return push * off_x / away, push * off_y / away


@numba.njit(cache=True)
def rubbing(n: Numbers, side: int, ahead: float, rate: float) -> float:
    """Give the torque with which the frame holds a wheel that a turn presses on it [N m]."""
    if n.frame_rub == 0.0 or n.frame_rub_side != side:
        return 0.0
    return n.frame_rub * max(n.frame_rub_way * ahead * rate, 0.0)


@numba.njit(cache=True)
def _drag_caster(
    n: Numbers, b: npt.NDArray[np.float64], turn: float, vx: float, vy: float, rate: float, dt: float
) -> tuple[float, float, float]:
    """Give the drag of hair and grooves on the caster [N], and its torque about the centre of mass [N m]."""
    off_x, off_y = turned(0.0, n.caster * rate, turn)
    x, y = vx + off_x, vy + off_y
    force_x, force_y = 0.0, 0.0
    if n.hair > 0.0:
        rolling, _ = turned(x, y, -turn)
        b[WOUND] = min(max(b[WOUND] + dt * rolling, 0.0), n.hair_way)
        speed = math.hypot(x, y)
        # tanh(v / blend) / v, whose limit at rest is 1 / blend.
        drag = math.tanh(speed / _DRAG_BLEND) / speed if speed > 1e-9 else 1.0 / _DRAG_BLEND
        drag *= n.hair * b[WOUND] / n.hair_way
        force_x, force_y = -drag * x, -drag * y
    if n.grooves > 0.0:
        _, across = turned(x, y, -n.grooves_way)
        side_x, side_y = turned(0.0, -n.grooves * math.tanh(across / _DRAG_BLEND), n.grooves_way)
        force_x, force_y = force_x + side_x, force_y + side_y
    _, side = turned(force_x, force_y, -turn)
    return force_x, force_y, (n.caster - n.com_ahead) * side


@numba.njit(cache=True)
def _sweep(n: Numbers, turn: float, vx: float, vy: float, rate: float) -> tuple[float, float, float]:
    """Give the drag of a brush beside the robot [N], and its torque about the centre of mass [N m]."""
    if n.brush == 0.0:
        return 0.0, 0.0, 0.0
    ahead, left = turned(vx, vy, -turn)
    ahead, left = ahead - rate * n.brush_left, left + rate * n.brush_ahead
    speed = math.hypot(ahead, left)
    drag = -n.brush * (math.tanh(speed / _DRAG_BLEND) / speed if speed > 1e-9 else 1.0 / _DRAG_BLEND)
    force_x, force_y = turned(drag * ahead, drag * left, turn)
    return force_x, force_y, (n.brush_ahead - n.com_ahead) * drag * left - n.brush_left * drag * ahead


@numba.njit(cache=True)
def _haul(
    n: Numbers, b: npt.NDArray[np.float64], x: float, y: float, turn: float, dt: float
) -> tuple[float, float, float]:
    """Drag a weight on a string along; give its pull [N] and the torque about the centre of mass [N m]."""
    arm_x, arm_y = turned(n.caster, 0.0, turn)
    string_x, string_y = b[WEIGHT] - x - arm_x, b[WEIGHT + 1] - y - arm_y
    over = math.hypot(string_x, string_y) - n.trailer_length
    if over <= 0.0:  # slack
        return 0.0, 0.0, 0.0
    way_x, way_y = string_x / (over + n.trailer_length), string_y / (over + n.trailer_length)
    b[WEIGHT] -= over * way_x
    b[WEIGHT + 1] -= over * way_y
    pull = n.trailer * math.tanh(over / dt / _DRAG_BLEND)
    _, across = turned(way_x, way_y, -turn)
    return pull * way_x, pull * way_y, (n.caster - n.com_ahead) * pull * across


@numba.njit(cache=True)
def _rub(
    n: Numbers, b: npt.NDArray[np.float64], ahead: float, left: float, load: float, dt: float
) -> tuple[float, float]:
    """Advance the caster's contact; give its friction, ahead and left [N]."""
    slide_x, slide_y = ahead, left + b[RATE] * (n.caster - n.com_ahead)
    speed = math.hypot(slide_x, slide_y)
    if speed > 0.0:
        fade = math.exp(-dt * speed / _BALL_SLIDES)
        gain = (1.0 - fade) * _BALL_SLIDES / speed
        b[BALL] = fade * b[BALL] + gain * slide_x
        b[BALL + 1] = fade * b[BALL + 1] + gain * slide_y
    level = n.caster_friction * load / _BALL_SLIDES
    return -level * b[BALL], -level * b[BALL + 1]


@numba.njit(cache=True)
def _share_load(
    n: Numbers, b: npt.NDArray[np.float64], weight: float, loads: npt.NDArray[np.float64], dt: float
) -> None:
    """Share the weight among left tyre, right tyre and caster [N] by the balance of moments."""
    caster = (n.com_ahead * weight - n.com_height * b[FLOOR]) / n.caster
    shift = -n.com_height * b[FLOOR + 1] / n.half_track / 2.0
    tyres = (weight - caster) / 2.0
    b[LIFTED] = b[LIFTED] + dt if min(caster, tyres - abs(shift)) < 0.0 else 0.0
    loads[2] = min(max(caster, 0.0), weight)
    tyres = (weight - loads[2]) / 2.0
    shift = min(max(shift, -tyres), tyres)
    loads[0], loads[1] = tyres + shift, tyres - shift


@numba.njit(cache=True)
def _shape(n: Numbers, side: int, angle: float, time_s: float) -> tuple[float, float]:
    """Height of the axle above the floor [m], and how it grows as the wheel turns [m/rad]."""
    radius = n.radius_left if side == 0 else n.radius_right
    if n.leak > 0.0 and n.leak_side == side:
        radius -= radius * n.leak * (1.0 - math.exp(-time_s / n.leak_time))
    if n.off_centre > 0.0:
        at = angle + (n.off_left if side == 0 else n.off_right)
        return radius + n.off_centre * math.sin(at), n.off_centre * math.cos(at)
    if n.oval > 0.0:
        at = angle + (n.oval_left if side == 0 else n.oval_right)
        long, short = (radius + n.oval) ** 2, (radius - n.oval) ** 2
        height = math.sqrt(long * math.sin(at) ** 2 + short * math.cos(at) ** 2)
        return height, (long - short) * math.sin(at) * math.cos(at) / height
    return radius, 0.0


@numba.njit(cache=True)
def grip(n: Numbers, b: npt.NDArray[np.float64], side: int, x: float, y: float) -> float:
    """Friction of one tyre where it is now."""
    coefficient = n.grip
    if n.patch_radius > 0.0 and math.hypot(x - n.patch_x, y - n.patch_y) < n.patch_radius:
        coefficient = n.patch_grip
    if n.dust > 0.0:
        coefficient *= 1.0 - n.dust * (1.0 - math.exp(-b[ROLLED] / n.dust_way))
    fast = n.hop > 0.0 and n.hop_side == side and abs(b[WHEEL_SPEED + side]) > n.hop_speed
    return coefficient * (1.0 - n.hop) if fast and math.sin(b[WHEEL + side]) > 0.0 else coefficient


@numba.njit(cache=True)
def _tyre(
    n: Numbers,
    tread: npt.NDArray[np.float64],
    slip_x: float,
    slip_y: float,
    rolling: float,
    grip: float,
    load: float,
    dt: float,
) -> tuple[float, float]:
    """Advance one tread's deflection; give the floor's force on the robot, ahead and left [N]."""
    fade = math.exp(-dt * abs(rolling) / RELAXATION)
    tread[0] = fade * tread[0] + dt * slip_x
    tread[1] = fade * tread[1] + dt * slip_y
    stiffness = SLIP_STIFFNESS / n.creep
    most = 3.0 * grip * RELAXATION / stiffness  # deflection from which the whole contact slides
    size = math.hypot(tread[0], tread[1])
    if size > most:
        tread[0], tread[1], size = tread[0] * most / size, tread[1] * most / size, most
    if size == 0.0:
        return 0.0, 0.0
    share = size / most
    force = grip * load * (3.0 * share - 3.0 * share**2 + share**3) / size
    damping = _TREAD_DAMPING * (1.0 - share) ** 2
    return -force * tread[0] - damping * slip_x, -force * tread[1] - damping * slip_y


@numba.njit(cache=True)
def _dahl(b: npt.NDArray[np.float64], at: int, speed: float, slides: float, dt: float) -> float:
    """Advance one dry friction that grows with the way; give its share of the full level, signed."""
    if speed != 0.0:
        final = slides * np.sign(speed)
        b[at] = final + (b[at] - final) * math.exp(-dt * abs(speed) / slides)
    return b[at] / slides


@numba.njit(cache=True)
def _climb(
    n: Numbers, x: float, y: float, cos: float, sin: float, loads: npt.NDArray[np.float64]
) -> tuple[float, float, float]:
    """Force [N] and torque about the centre of mass [N m] of a ridge under wheels and caster."""
    force_x, force_y, torque = 0.0, 0.0, 0.0
    normal_x, normal_y = math.cos(n.ridge_angle), math.sin(n.ridge_angle)
    for contact in range(3):
        ahead = n.caster if contact == 2 else 0.0
        lever = 0.0 if contact == 2 else (n.half_track if contact == 0 else -n.half_track)
        radius = CASTER_RADIUS if contact == 2 else n.radius_left
        here_x, here_y = x + cos * ahead - sin * lever, y + sin * ahead + cos * lever
        away = (here_x - n.ridge_x) * normal_x + (here_y - 0.6) * normal_y
        reach = _RIDGE_RADIUS + radius  # the contact's middle moves on a circle round the cylinder's
        top = reach * reach - away * away
        if top <= (reach - n.ridge) ** 2:
            continue
        push = loads[contact] * away / math.sqrt(top)
        force_x += push * normal_x
        force_y += push * normal_y
        arm_x, arm_y = here_x - x - cos * n.com_ahead, here_y - y - sin * n.com_ahead
        torque += arm_x * push * normal_y - arm_y * push * normal_x
    return force_x, force_y, torque


@numba.njit(cache=True)
def pushes(
    n: Numbers,
    b: npt.NDArray[np.float64],
    x: float,
    y: float,
    turn: float,
    vx: float,
    vy: float,
    rate: float,
    gusts: npt.NDArray[np.float64],
    time_s: float,
    dt: float,
) -> tuple[float, float, float]:
    """Force [N] at, and torque [N m] about, the centre of mass from all that pushes but the contacts.

    Parameters
    ----------
    n, b
        The robot and its state, of which only a castor wheel's heading, the angle turned, a weight on a string and
        hair round the caster are used.
    x, y, turn
        Pose of the axle's centre [m, m, rad].
    vx, vy, rate
        Its velocity [m/s, m/s, rad/s].
    gusts, time_s, dt
        As :func:`advance` takes them.

    Returns
    -------
    tuple[float, float, float]
        In the course's frame.
    """
    cos, sin = math.cos(turn), math.sin(turn)
    force_x, force_y = n.tether * (n.tether_x - x), n.tether * (n.tether_y - y)
    torque = n.yaw_pull
    if n.magnet > 0.0:
        away = math.hypot(x - n.magnet_x, y - n.magnet_y) / n.magnet_core
        # Greatest at core / sqrt(3), where it is the stated pull.
        pull = n.magnet * 16.0 / (3.0 * math.sqrt(3.0)) / n.magnet_core / (1.0 + away**2) ** 2
        force_x += pull * (n.magnet_x - x)
        force_y += pull * (n.magnet_y - y)
    for k in range(len(gusts)):
        if gusts[k, 0] <= time_s < gusts[k, 0] + gusts[k, 1]:
            force_x += gusts[k, 2]
            force_y += gusts[k, 3]
    drag = n.air_drag * math.hypot(vx, vy)
    force_x -= drag * vx
    force_y -= drag * vy
    if n.pile > 0.0:
        ahead = cos * vx + sin * vy
        against = (1.0 - math.cos(turn - n.pile_way) * np.sign(ahead)) / 2.0
        hold = -n.pile * against * math.tanh(ahead / _DRAG_BLEND)
        force_x += hold * cos
        force_y += hold * sin
    if n.swivel > 0.0:
        castor_x, castor_y = vx - n.caster * sin * rate, vy + n.caster * cos * rate
        across = math.cos(b[CASTOR]) * castor_y - math.sin(b[CASTOR]) * castor_x
        b[CASTOR] += dt * across / n.swivel_trail
        side = -n.swivel * math.tanh(across / _DRAG_BLEND)
        force_x -= side * math.sin(b[CASTOR])
        force_y += side * math.cos(b[CASTOR])
        torque += (n.caster - n.com_ahead) * side * math.cos(b[CASTOR] - turn)
    torque -= n.twist * b[TURNED] / (1.0 + abs(b[TURNED]) / _TWIST_SLIPS)
    b[TURNED] += dt * rate
    if n.scrub > 0.0:
        torque -= n.scrub * math.tanh(rate / _SCRUB_BLEND)
    torque -= n.fin * math.sin(turn - n.fin_way)
    if n.fan > 0.0:
        blow_x, blow_y = _blow(n, x, y, time_s)
        force_x, force_y = force_x + blow_x, force_y + blow_y
    torque += n.turret * math.sin(2.0 * math.pi * time_s / n.turret_period + n.turret_phase)
    sweep_x, sweep_y, sweeping = _sweep(n, turn, vx, vy, rate)
    force_x, force_y, torque = force_x + sweep_x, force_y + sweep_y, torque + sweeping
    if n.trailer > 0.0:
        haul_x, haul_y, hauling = _haul(n, b, x, y, turn, dt)
        force_x, force_y, torque = force_x + haul_x, force_y + haul_y, torque + hauling
    if n.hair > 0.0 or n.grooves > 0.0:
        drag_x, drag_y, dragging = _drag_caster(n, b, turn, vx, vy, rate, dt)
        force_x, force_y, torque = force_x + drag_x, force_y + drag_y, torque + dragging
    return force_x, force_y, torque


@numba.njit(cache=True)
def start(n: Numbers, x: float, y: float, turn: float) -> npt.NDArray[np.float64]:
    """Give the state of a robot at rest, its axle's centre at a pose [m, m, rad]."""
    b = np.zeros(SIZE)
    b[X], b[Y] = x + n.com_ahead * math.cos(turn), y + n.com_ahead * math.sin(turn)
    b[TURN] = b[CASTOR] = turn
    back = n.caster - n.trailer_length  # a weight on a string lies straight behind
    b[WEIGHT], b[WEIGHT + 1] = x + back * math.cos(turn), y + back * math.sin(turn)
    beyond, _ = turned(x - n.rocking_x, y - _MIDDLE_Y, -n.rocking_way)
    b[TIPPED] = b[TIPPED + 1] = 1.0 if beyond >= 0.0 else -1.0
    return b


@numba.njit(cache=True)
def observe(
    n: Numbers, b: npt.NDArray[np.float64], d: npt.NDArray[np.float64], seen: npt.NDArray[np.float64]
) -> None:
    """Write the axle's pose [m, m, rad], both shafts' angles [rad], the yaw rate [rad/s] and the terminals' [V]."""
    seen[0] = b[X] - n.com_ahead * math.cos(b[TURN])
    seen[1] = b[Y] - n.com_ahead * math.sin(b[TURN])
    seen[2] = b[TURN]
    seen[3], seen[4] = d[ANGLE], d[ANGLE + 1]
    seen[5], seen[6] = b[RATE], d[TERMINAL]
