"""Motors, gears and battery: pure compiled functions from duty to a shaft's speed."""

from __future__ import annotations

import math
from typing import Any

from gecar.compiled import kernel
from gecar.world.kernel.series import decay, sine

# rad/s at a regulated command of 100 %: Motor.run takes 10 deg/s per percent
FULL_SPEED = math.radians(1000.0)


FULL_DUTY = 0.999  # from here on a bridge no longer switches


@kernel
def conduct(
    duty: float, voltage: float, angle: float, speed: float, p: Any, c: Any, effects: bool = True
) -> float:
    """Return a shaft's speed [rad/s] after the motor's torque, before dry friction and load.

    J dw/dt = Kt (duty V - Ke w) / R - b w, stepped exactly: the back-EMF damps the shaft within 0.1 s.
    """
    free = c.keep * speed
    driven = free + c.drive_gain * duty * voltage
    if not effects:
        return driven
    if c.ripple != 0.0:
        driven += c.ripple * sine(p.ripple_cycles * angle + p.ripple_phase)
    if c.torque != 0.0 or c.lean != 0.0:
        driven += c.torque - c.lean * abs(speed)
    # Firmware may take power away to hold the limit, not reverse it.
    driven = min(driven, max(p.speed_limit, free))
    return max(driven, min(-p.speed_limit, free))


@kernel
def awake(duty: float, t: float, p: Any, c: Any) -> float:
    """Return a duty as motors that first answer some time after the start get it; t is the step's start [s]."""
    if p.start_latency > 0.0:
        return duty * min(max((t + 0.5 * c.dt - p.start_latency) / c.dt, 0.0), 1.0)
    return duty


@kernel
def effective_duty(duty: float, gain: float, dead: float, p: Any, effects: bool = True) -> float:
    """Return the share of the supply that a driver gives a motor of a gain and a dead band.

    Besides these: what differs by direction, the driver's curve, and full duty's own gain.
    """
    if not effects:
        return duty * gain
    threshold = max(dead + math.copysign(0.5 * p.dead_band_forward, duty), 0.0)
    if abs(duty) < threshold:
        return 0.0
    past = duty - math.copysign(threshold * p.dead_band_offset, duty)
    if p.duty_bulge != 0.0:
        past *= (1.0 + p.duty_bulge) / (1.0 + p.duty_bulge * abs(past))
    direction = 1.0 + p.direction_gain if duty > 0.0 else 1.0 - p.direction_gain
    if abs(duty) >= FULL_DUTY:
        past *= 1.0 + p.full_duty_gain
    return past * gain * direction


@kernel
def within_current(drive: float, voltage: float, speed: float, p: Any) -> float:
    """Return the share of the supply that keeps a motor's current, |drive V - Ke w| / R, within the driver's limit."""
    if p.current_limit < math.inf:
        back, reach = p.back_emf_constant * speed / voltage, abs(p.current_limit * p.resistance / voltage)
        drive = min(max(drive, back - reach), back + reach)
    return drive


@kernel
def friction_budget(speed: float, load: float, radius: float, p: Any, c: Any, effects: bool = True) -> float:
    """Return the largest impulse [N m s] dry friction can give a shaft in one step."""
    budget = c.sliding
    if not effects:
        return budget
    if p.static_friction != 0.0:
        ratio = speed / p.stribeck_speed
        budget += p.static_friction * c.dt * decay(ratio * ratio)
    ratio = p.friction_ratio if speed > 0.0 else -p.friction_ratio
    return budget * (1.0 + ratio) + p.rolling_resistance * load * radius * c.dt


@kernel
def bare_shaft(
    duty: float,
    voltage: float,
    angle: float,
    speed: float,
    p: Any,
    c: Any,
    torque: float = 0.0,
    friction: float = 0.0,
) -> float:
    """Return the next speed [rad/s] of a shaft that carries nothing: a motor on a bench, a wheel in the air.

    Beside the motor's own, a torque and a friction [N m] may act on it.
    """
    driven = conduct(duty, voltage, angle, speed, p, c) + torque * c.dt * c.inv_rotor
    budget = max(friction_budget(driven, 0.0, 0.0, p, c) + friction * c.dt, 0.0) * c.inv_rotor
    return driven - min(max(driven, -budget), budget)


@kernel
def supply(s: Any, p: Any) -> float:
    """Return the battery's terminal voltage [V] under the last step's current."""
    return p.voltage * p.supply_scale - p.battery_drain * s.t - p.battery_resistance * s.battery_current


@kernel
def motor_current(duty: float, voltage: float, speed: float, p: Any) -> float:
    """Return a motor's current [A]."""
    return (duty * voltage - p.back_emf_constant * speed) / p.resistance


@kernel
def battery_current(s: Any, p: Any) -> float:
    """Return the current that both motors draw from the battery [A].

    A bridge that switches at a duty draws that share of the motor's current: what goes in comes out (Mohan, Undeland,
    Robbins, "Power Electronics", 3rd ed., 2003, eq. 7-5).
    """
    left = s.left_drive * motor_current(s.left_drive, s.voltage, s.left_speed, p)
    right = s.right_drive * motor_current(s.right_drive, s.voltage, s.right_speed, p)
    # A motor that brakes does not charge the battery: the practice case with a sagging battery says so.
    return max(left, 0.0) + max(right, 0.0)


@kernel
def slewed(duty: float, last: float, c: Any) -> tuple[float, float]:
    """Return the duty that a ramp reaches in a step, ``slew`` from the last one at most, and the mean that acts in it.

    What acts is the mean over a step that lies half a step back, as for all commands (`gecar.world.kernel.state`): on
    the way it is the last one. A ramp that acted with what it reaches would be a whole step early.
    """
    rise = duty - last
    if abs(rise) > c.slew:
        return last + math.copysign(c.slew, rise), last
    return duty, duty - rise * (abs(rise) / c.slew)


@kernel
def regulate(command: float, speed: float, integral: float, c: Any) -> tuple[float, float]:
    """Return (duty, integral) of a speed regulator, as `Motor.run`: 10 deg/s per percent of command.

    Proportional-integral, critically damped at `REGULATOR_RATE` for the motor's own gain and time constant, without
    a proportional part where the motor is quicker than that (`gecar.world.kernel.state`); the integral stops where the
    duty saturates. The brick's own gains are not published in these terms.
    """
    error = command * FULL_SPEED - speed
    wanted = c.regulator_p * error + integral
    duty = min(max(wanted, -1.0), 1.0)
    if duty == wanted:
        integral += c.regulator_i * error
    return duty, integral


@kernel
def bench_step(s: Any, left_duty: float, right_duty: float, p: Any, c: Any) -> None:
    """Advance both shafts by one step; the body stays where it is.

    Parameters
    ----------
    s
        Record of dtype `STATE`, updated.
    left_duty, right_duty
        Commands after cap and delay [-1..1], of half a step ago.
    p, c
        Records of dtypes `PHYSICS` and `DERIVED`.
    """
    s.voltage = supply(s, p)
    turn_bare_shafts(s, left_duty, right_duty, 0.0, 0.0, 0.0, 0.0, p, c)


@kernel
def turn_bare_shafts(
    s: Any,
    left_duty: float,
    right_duty: float,
    left_torque: float,
    right_torque: float,
    left_friction: float,
    right_friction: float,
    p: Any,
    c: Any,
) -> None:
    """Advance both shafts by one step at the step's voltage; see `bare_shaft` for torques and frictions."""
    if p.regulated != 0.0:
        left_duty, s.left_integral = regulate(left_duty, s.left_speed, s.left_integral, c)
        right_duty, s.right_integral = regulate(right_duty, s.right_speed, s.right_integral, c)
    s.left_duty, left_duty = slewed(awake(left_duty, s.t, p, c), s.left_duty, c)
    s.right_duty, right_duty = slewed(awake(right_duty, s.t, p, c), s.right_duty, c)
    left = effective_duty(left_duty, c.left_gain, c.left_dead, p)
    right = effective_duty(right_duty, c.right_gain, c.right_dead, p)
    s.left_drive = within_current(left, s.voltage, s.left_speed, p)
    s.right_drive = within_current(right, s.voltage, s.right_speed, p)
    right_angle = s.right_angle + p.ripple_lead
    s.left_speed = bare_shaft(
        s.left_drive, s.voltage, s.left_angle, s.left_speed, p, c, left_torque, left_friction
    )
    s.right_speed = bare_shaft(
        s.right_drive, s.voltage, right_angle, s.right_speed, p, c, right_torque, right_friction
    )
    s.left_angle += s.left_speed * c.dt
    s.right_angle += s.right_speed * c.dt
    s.battery_current = battery_current(s, p)
    s.t += c.dt
