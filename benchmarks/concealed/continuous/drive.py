"""Battery, motors and gears in continuous time: inductance, LuGre friction, and a gear that twists."""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from benchmarks.concealed.continuous.numbers import Numbers

# State: currents [A], shaft speeds [rad/s], shaft angles [rad], bristle deflections [rad], left and right; then the
# voltage of the battery's slow branch [V], the voltage at its terminals [V] and what the firmware adds to both duties;
# then angles at which motors were stopped [rad], share of a grease's stiffness that is left, less one, voltage of a
# worn battery's slow part [V], and how warm the motors' fuses are, against what their rated current makes of them;
# then for how long drivers have borne too much current, and until when they are off [s], and how far wheels slipped
# on their axles [rad]; then how far the left motor was ahead when both were given the same [rad], and
# whether they are.
CURRENT, SPEED, ANGLE, BRISTLE, SLOW, TERMINAL, KEPT = 0, 2, 4, 6, 8, 9, 10
HELD, GREASE, SAGGED, WARM, BORNE, OFF, SLIPPED, LED, ALIKE, SIZE = 12, 14, 15, 16, 18, 20, 22, 24, 25, 26

# Gears and axle twist by 1.4 degrees under a newton metre, 0.1 degree in a hard start: felt by nobody, and never rigid.
GEAR_STIFFNESS = 40.0  # N m / rad
GEAR_DAMPING = 0.03  # N m s / rad
_TOOTH_ROUNDING = 0.0003  # rad: flanks meet gradually
# LuGre (Canudas de Wit, Olsson, Astrom and Lischinsky 1995): bristle damping 0.3 of critical, fading with speed as
# Olsson (1996) proposed, so that it never acts while sliding.
_BRISTLE_DAMPING = 0.3
_BRISTLE_FADES = 0.5  # rad / s
# A battery's polarisation: part of its resistance acts behind a time constant of seconds (Chen and Rincon-Mora 2006).
_SLOW_SHARE = 0.1
_SLOW_TIME = 1.0  # s
_LIMITER = 20.0  # V s / rad
_BAND_SLIPS = 10.0  # rad
_DRAG_BLEND = 0.2  # rad / s
_RUB_BLEND = 0.5  # rad / s
_GREASE_BLEND = 0.3  # rad / s
_MOST_SYNCED = 0.3  # share of the supply
_MOST_HELD = 0.8  # share of the supply, the duty cap


@numba.njit(cache=True)
def step_drive(
    n: Numbers,
    d: npt.NDArray[np.float64],
    duties: npt.NDArray[np.float64],
    wheel_angles: npt.NDArray[np.float64],
    wheel_speeds: npt.NDArray[np.float64],
    time_s: float,
    dt: float,
    torques: npt.NDArray[np.float64],
) -> None:
    """Advance battery, motors and shafts by one step, and give the torques that reach the wheels.

    Parameters
    ----------
    n
        The robot.
    d
        State, changed in place.
    duties
        Signed shares of the terminal voltage, and whether both motors are given the same, but not 0 (3,).
    wheel_angles, wheel_speeds
        Of the wheels, behind the gears (2,) [rad, rad/s].
    time_s
        Time since the recording began, by the log's clock [s].
    dt
        Step [s].
    torques
        Receives the gears' torques on the wheels (2,) [N m].
    """
    left, right = _keep(n, d, 0, duties[0], dt), _keep(n, d, 1, duties[1], dt)
    if n.sync > 0.0:
        left, right = _together(n, d, left, right, duties[2])
    if n.holding > 0.0:
        left, right = _hold(n, d, 0, left), _hold(n, d, 1, right)
    drawn = left * d[CURRENT] + right * d[CURRENT + 1]
    source = n.supply - n.drain * time_s
    if n.sag > 0.0:
        source -= d[SAGGED]
        d[SAGGED] += dt / n.sag_time * (n.sag * drawn - d[SAGGED])
    if n.loose > 0.0:
        source -= source * _lost(n, d)
    if n.pulses > 0.0 and (time_s / n.pulses_period + n.pulses_gone) % 1.0 < n.pulses_on:
        source -= n.pulses * source
    terminal = source - (1.0 - _SLOW_SHARE) * n.inner_resistance * drawn - d[SLOW]
    d[SLOW] += dt / _SLOW_TIME * (_SLOW_SHARE * n.inner_resistance * drawn - d[SLOW])
    d[TERMINAL] = terminal
    rub = n.axle_rub * math.tanh((d[SPEED] - d[SPEED + 1]) / _RUB_BLEND)
    for side in range(2):
        speed, angle = d[SPEED + side], d[ANGLE + side]
        torque = _motor(n, d, side, left if side == 0 else right, terminal, time_s, dt)
        torque += _cogs(n, side, speed, angle)
        torque -= _friction(n, d, side, speed, dt) + n.viscous * speed
        torque -= rub if side == 0 else -rub
        if n.grease > 0.0 and n.grease_side == side:
            torque -= _shear(n, d, speed, dt)
        if n.hum > 0.0 and n.hum_side == side:
            torque -= _hum(n, speed)
        play = n.play + (n.loosening_left if side == 0 else n.loosening_right) * time_s
        twist = angle - wheel_angles[side] - d[SLIPPED + side]
        gear = _gear(play / 2.0, twist, speed - wheel_speeds[side])
        most = n.clutch_left if side == 0 else n.clutch_right
        if abs(gear) > most:
            held = min(max(gear, -most), most)
            d[SLIPPED + side] += (gear - held) / GEAR_STIFFNESS
            gear = held
        d[SPEED + side] += dt * (torque - gear) / n.shaft_inertia
        d[ANGLE + side] += dt * d[SPEED + side]
        torques[side] = gear


@numba.njit(cache=True)
def drive_on(
    n: Numbers,
    d: npt.NDArray[np.float64],
    duties: npt.NDArray[np.float64],
    wheel_angles: npt.NDArray[np.float64],
    wheel_speeds: npt.NDArray[np.float64],
    time_s: float,
    tick_s: float,
    dt: float,
    steps: int,
) -> npt.NDArray[np.float64]:
    """Advance by some steps while the wheels keep their speeds; give the mean torques that reach them (2,) [N m].

    Parameters
    ----------
    n, d, duties, wheel_angles, wheel_speeds, time_s, dt
        As :func:`step_drive` takes them, at the beginning.
    tick_s
        Length of a step by the log's clock [s].
    steps
        How many.
    """
    torques, total = np.zeros(2), np.zeros(2)
    for step in range(steps):
        angles = wheel_angles + dt * step * wheel_speeds
        step_drive(n, d, duties, angles, wheel_speeds, time_s + tick_s * step, dt, torques)
        total += torques
    return total / steps


@numba.njit(cache=True)
def _keep(n: Numbers, d: npt.NDArray[np.float64], side: int, duty: float, dt: float) -> float:
    """Advance the integral of the speed that one motor lacks, none at duty 0; give the duty that acts."""
    if n.keeper == 0.0:
        return duty
    wanted = duty * n.nominal_supply / n.back_emf
    step = dt * n.keeper * (wanted - d[SPEED + side]) * n.back_emf / n.nominal_supply
    d[KEPT + side] = min(max(d[KEPT + side] + step, -n.keeper_most), n.keeper_most) if duty != 0.0 else 0.0
    return min(max(duty + d[KEPT + side], -1.0), 1.0)


@numba.njit(cache=True)
def _together(
    n: Numbers, d: npt.NDArray[np.float64], left: float, right: float, alike: float
) -> tuple[float, float]:
    """Remember how two motors stand when first given the same; give duties that keep them so."""
    ahead = d[ANGLE] - d[ANGLE + 1]
    if alike == 0.0 or d[ALIKE] == 0.0:
        d[ALIKE], d[LED] = alike, ahead
        return left, right
    most = 2.0 * _MOST_SYNCED
    fix = min(max(n.sync * (ahead - d[LED]), -most), most) / 2.0
    return min(max(left - fix, -1.0), 1.0), min(max(right + fix, -1.0), 1.0)


@numba.njit(cache=True)
def _hold(n: Numbers, d: npt.NDArray[np.float64], side: int, duty: float) -> float:
    """Remember where a motor is while it is driven; give the duty that brings it back there when it is not."""
    if duty != 0.0:
        d[HELD + side] = d[ANGLE + side]
        return duty
    return min(max(n.holding * (d[HELD + side] - d[ANGLE + side]), -_MOST_HELD), _MOST_HELD)


@numba.njit(cache=True)
def _shear(n: Numbers, d: npt.NDArray[np.float64], speed: float, dt: float) -> float:
    """Advance the structure of a gear's grease, which turning breaks down and time builds up; give its drag [N m]."""
    structure = 1.0 + d[GREASE]
    d[GREASE] += dt * ((1.0 - structure) / n.grease_rest - structure * abs(speed) / n.grease_shear)
    return n.grease * structure * math.tanh(speed / _GREASE_BLEND)


@numba.njit(cache=True)
def _lost(n: Numbers, d: npt.NDArray[np.float64]) -> float:
    """Give the share of the voltage that is lost at the spring of a cell which the curve pulls away from it."""
    sideways = n.loose_arm * (d[SPEED + 1] - d[SPEED]) * (d[SPEED + 1] + d[SPEED])
    if sideways <= 0.0:
        return 0.0
    return n.loose / (1.0 + (n.loose_half / sideways) ** 2)


@numba.njit(cache=True)
def _hum(n: Numbers, speed: float) -> float:
    """Give the torque that shaking the frame takes, most where the gears' rate is the frame's own [N m]."""
    off = (abs(speed) - n.hum_speed) / n.hum_width
    return n.hum / (1.0 + off * off) * math.tanh(speed / _DRAG_BLEND)


@numba.njit(cache=True)
def _motor(
    n: Numbers,
    d: npt.NDArray[np.float64],
    side: int,
    duty: float,
    terminal: float,
    time_s: float,
    dt: float,
) -> float:
    """Advance one motor's current, implicitly, and give its torque [N m]."""
    speed, volts = d[SPEED + side], duty * terminal
    volts *= 1.0 + n.direction_gain * np.sign(volts)
    if abs(speed) > n.speed_limit - 1.0:
        turn = np.sign(speed)
        holding = n.back_emf * abs(speed) + n.coulomb * n.resistance / n.torque_constant
        volts = turn * min(turn * volts, max(holding + _LIMITER * (n.speed_limit - abs(speed)), 0.0))
    resistance = n.resistance
    if n.heat > 0.0 and n.heat_side == side:
        resistance *= 1.0 + n.heat * (1.0 - math.exp(-time_s / n.heat_time))
    if n.fuse > 0.0:
        resistance *= 1.0 + n.fuse * d[WARM + side]
        heating = (d[CURRENT + side] / n.fuse_current) ** 2
        d[WARM + side] += dt / n.fuse_time * (heating - d[WARM + side])
    follow = dt / n.inductance
    current = (d[CURRENT + side] + follow * (volts - n.back_emf * speed)) / (1.0 + follow * resistance)
    current = min(max(current, -n.current_limit), n.current_limit)
    if n.cut_rests > 0.0:
        current = _guarded(n, d, side, current, time_s, dt)
    d[CURRENT + side] = current
    if duty == 0.0:
        current *= 1.0 - n.coasting
    elif duty * current < 0.0:
        current *= 1.0 - n.overrun
    torque = n.torque_constant * current
    if n.gear_loss > 0.0 and n.gear_loss_side == side:
        torque -= n.gear_loss * abs(torque) * math.tanh(speed / _DRAG_BLEND)
    return torque


@numba.njit(cache=True)
def _guarded(
    n: Numbers, d: npt.NDArray[np.float64], side: int, current: float, time_s: float, dt: float
) -> float:
    """Let a driver that has borne too much current for too long be off for a while; give the current that flows [A]."""
    if time_s < d[OFF + side]:
        return 0.0
    d[BORNE + side] = d[BORNE + side] + dt if abs(current) > n.cut_current else 0.0
    if d[BORNE + side] > n.cut_bears:
        d[BORNE + side], d[OFF + side] = 0.0, time_s + n.cut_rests
    return current


@numba.njit(cache=True)
def _cogs(n: Numbers, side: int, speed: float, angle: float) -> float:
    """Give the torque that depends on the shaft's angle [N m]: cogging, a damaged tooth, a rubber band."""
    phase = n.ripple_left if side == 0 else n.ripple_right
    torque = n.ripple * math.sin(n.ripple_cycles * angle + phase)
    if n.tooth > 0.0 and n.tooth_side == side and (angle + n.tooth_phase) % (2.0 * math.pi) < n.tooth_width:
        torque -= n.tooth * math.tanh(speed / _DRAG_BLEND)
    if n.band_side == side:
        torque -= n.band * angle / (1.0 + abs(angle) / _BAND_SLIPS)
    return torque


@numba.njit(cache=True)
def _friction(n: Numbers, d: npt.NDArray[np.float64], side: int, speed: float, dt: float) -> float:
    """Advance the bristles of one gear train, exactly for a steady speed; give the friction [N m]."""
    level = n.coulomb * (1.0 + n.friction_ratio * np.sign(speed))
    level = max(level + n.static * math.exp(-((speed / n.stribeck) ** 2)), 1e-6)
    stiffness = max(n.coulomb + n.static, 1e-6) / n.presliding
    before = d[BRISTLE + side]
    if speed != 0.0:
        final = level / stiffness * np.sign(speed)
        d[BRISTLE + side] = final + (before - final) * math.exp(-dt * stiffness * abs(speed) / level)
    rate = (d[BRISTLE + side] - before) / dt
    damping = 2.0 * _BRISTLE_DAMPING * math.sqrt(stiffness * n.shaft_inertia)
    return stiffness * d[BRISTLE + side] + damping * rate * math.exp(-((speed / _BRISTLE_FADES) ** 2))


@numba.njit(cache=True)
def _gear(half: float, twist: float, rate: float) -> float:
    """Give the torque of a twisted gear with play [N m]; its dead zone has round corners."""
    if half <= 0.0:
        return GEAR_STIFFNESS * twist + GEAR_DAMPING * rate
    over = math.hypot(twist - half, _TOOTH_ROUNDING)
    under = math.hypot(twist + half, _TOOTH_ROUNDING)
    beyond = twist + (over - under) / 2.0
    touching = 1.0 + ((twist - half) / over - (twist + half) / under) / 2.0
    return GEAR_STIFFNESS * beyond + GEAR_DAMPING * rate * touching
