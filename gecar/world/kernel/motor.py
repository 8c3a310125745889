"""Motors, gears and battery: pure compiled functions from duty to a shaft's speed."""

from __future__ import annotations

import math
from typing import Any

from gecar.compiled import kernel
from gecar.world.kernel.contacts import rub_shafts
from gecar.world.kernel.series import decay, sine
from gecar.world.kernel.state import ALL, PLAIN

# rad/s at a regulated command of 100 %: Motor.run takes 10 deg/s per percent
FULL_SPEED = math.radians(1000.0)


FULL_DUTY = 0.999  # from here on a bridge no longer switches
STILL = 1e-15  # m/s and rad/s


@kernel
def conduct(
    duty: float, voltage: float, angle: float, speed: float, p: Any, c: Any, effects: int = ALL
) -> float:
    """Return a shaft's speed [rad/s] after the motor's torque, before dry friction and load.

    J dw/dt = Kt (duty V - Ke w) / R - b w, stepped exactly: the back-EMF damps the shaft within 0.1 s.
    """
    free = c.keep * speed
    driven = free + c.drive_gain * duty * voltage
    if effects == PLAIN:
        return driven
    if effects == ALL and c.ripple != 0.0:
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
def effective_duty(duty: float, gain: float, dead: float, p: Any, effects: int = ALL) -> float:
    """Return the share of the supply that a driver gives a motor of a gain and a dead band.

    Besides these: what differs by direction, the driver's curve, and full duty's own gain.
    """
    if effects == PLAIN:
        return duty * gain
    threshold = max(dead + math.copysign(0.5 * p.dead_band_forward, duty), 0.0)
    if abs(duty) < threshold:
        return 0.0
    past = duty - math.copysign(threshold * p.dead_band_offset, duty)
    if effects == ALL and p.duty_bulge != 0.0:
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
def friction_budget(speed: float, load: float, radius: float, p: Any, c: Any, effects: int = ALL) -> float:
    """Return the largest impulse [N m s] dry friction can give a shaft in one step."""
    budget = c.sliding
    if effects == PLAIN:
        return budget
    if effects == ALL and p.static_friction != 0.0:
        ratio = speed / p.stribeck_speed
        budget += p.static_friction * c.dt * decay(ratio * ratio)
    ratio = p.friction_ratio if speed > 0.0 else -p.friction_ratio
    return budget * (1.0 + ratio) + p.rolling_resistance * load * radius * c.dt


@kernel
def run_motors(
    s: Any,
    left_duty: float,
    right_duty: float,
    left_torque: float,
    right_torque: float,
    p: Any,
    c: Any,
    effects: int,
) -> None:
    """Turn commands, and torques [N m] beside the motors', into the shafts' free speeds, at the step's voltage.

    Then dry friction gives what it owes from the step before. A step knows one direction of a shaft and one torque:
    where it turns round or sets off within the step, friction is off by up to twice what it can give, at random, as
    that depends on where in the step it falls. What it then owes comes a step late, which is second order in the step.
    """
    left_stood, right_stood = s.left_before == 0.0, s.right_before == 0.0
    s.left_before, s.right_before = s.left_speed, s.right_speed
    left_sudden = right_sudden = 1.0
    if effects != PLAIN and p.regulated != 0.0:
        left_duty, s.left_integral = regulate(left_duty, s.left_speed, s.left_integral, c)
        right_duty, s.right_integral = regulate(right_duty, s.right_speed, s.right_integral, c)
    if effects == ALL:
        left_duty, right_duty = awake(left_duty, s.t, p, c), awake(right_duty, s.t, p, c)
        if p.command_slew < math.inf:
            s.left_began, s.left_duty, s.left_mean, acts, left_sudden = ramped(
                s.left_began, s.left_mean, s.left_earlier_command, s.left_command, left_duty, c
            )
            s.left_earlier_command, s.left_command, left_duty = s.left_command, left_duty, acts
            s.right_began, s.right_duty, s.right_mean, acts, right_sudden = ramped(
                s.right_began, s.right_mean, s.right_earlier_command, s.right_command, right_duty, c
            )
            s.right_earlier_command, s.right_command, right_duty = s.right_command, right_duty, acts
    s.left_drive = effective_duty(left_duty, c.left_gain, c.left_dead, p, effects)
    s.right_drive = effective_duty(right_duty, c.right_gain, c.right_dead, p, effects)
    if effects == ALL:
        s.left_drive = within_current(s.left_drive, s.voltage, s.left_speed, p)
        s.right_drive = within_current(s.right_drive, s.voltage, s.right_speed, p)
    left = conduct(s.left_drive, s.voltage, s.left_angle, s.left_speed, p, c, effects)
    right_angle = s.right_angle + p.ripple_lead
    right = conduct(s.right_drive, s.voltage, right_angle, s.right_speed, p, c, effects)
    left += left_torque * c.dt * c.inv_rotor
    right += right_torque * c.dt * c.inv_rotor
    s.left_speed, s.left_due = repaid(left, s.left_before, left_stood, s.left_due, left_sudden, s.left_dry, c)
    s.right_speed, s.right_due = repaid(
        right, s.right_before, right_stood, s.right_due, right_sudden, s.right_dry, c
    )


@kernel
def repaid(
    free: float, before: float, stood: bool, due: float, sudden: float, budget: float, c: Any
) -> tuple[float, float]:
    """Return a shaft's free speed with what friction owes, and the motor's impulse in this step if the shaft stands.

    Such an impulse is also what is ``due`` of a shaft that ``stood`` before the last step, which had the ``budget``.
    """
    pull = (free - before) * c.rotor
    owes = owed_at_start(due, pull, budget) if stood else due
    stands = before == 0.0 and (stood or due == 0.0)
    return free + owes * c.inv_rotor, pull * sudden if stands else 0.0


@kernel
def owed_at_start(pull: float, now: float, budget: float) -> float:
    """Return the impulse [N m s] that dry friction owes a shaft which stood, and may have set off, in the last step.

    The motor's impulse was ``pull`` then and is ``now`` in this one: a torque that came at once acted for pull / now of
    the step. Friction held the shaft back for as long, and not before.
    """
    if pull * now <= 0.0 or abs(now) <= max(budget, abs(pull)):
        return 0.0
    due = abs(pull) * (1.0 - budget / abs(now)) - max(abs(pull) - budget, 0.0)
    return math.copysign(due, pull)


@kernel
def owe(s: Any, left_load: float, right_load: float) -> None:
    """Let shafts that hardly turn stand, and set what dry friction owes those that turned before the step.

    ``load`` is the inertia that it turns [kg m²].
    """
    s.left_speed, s.right_speed = unless_still(s.left_speed), unless_still(s.right_speed)
    if s.left_before != 0.0:
        s.left_due = owed(s.left_before, s.left_speed, s.left_friction, s.left_dry, left_load)
    if s.right_before != 0.0:
        s.right_due = owed(s.right_before, s.right_speed, s.right_friction, s.right_dry, right_load)


@kernel
def owed(before: float, after: float, friction: float, budget: float, load: float) -> float:
    """Return the impulse [N m s] that dry friction owes a shaft that turned before the step.

    At a constant torque it is slowed down until it stands, by friction and all else, for a share of the step. In the
    rest it turns the other way, against friction, if all else is stronger.
    """
    way = math.copysign(1.0, before)
    if after * way > 0.0 and friction == -way * budget:
        return 0.0
    had = abs(before) * load
    slows = had + way * (friction - after * load)  # all else, in the whole step
    if slows + budget <= had:  # it does not come to a stand
        return -way * budget - friction
    turned = way * min(budget - slows, 0.0) * (1.0 - had / (slows + budget))
    return turned - after * load


@kernel
def unless_still(speed: float) -> float:
    """End motion too slow to matter: sticking leaves ever smaller speeds, and denormal numbers cost 50 times more."""
    return speed if abs(speed) > STILL else 0.0


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
def ramped(
    began: float, mean: float, earlier: float, now: float, later: float, c: Any
) -> tuple[float, float, float, float, float]:
    """Return a ramp's duty at a step's beginning and end, its mean, the duty that acts, and the share after its end.

    What acts is the mean, with what the mean of the step before owes.

    Parameters
    ----------
    began, mean
        The duty at the beginning of the step before, and the mean taken for it then.
    earlier, now, later
        As in `slewed`; the last is the step's own command.
    """
    began, did = slewed(began, earlier, now, later, c)
    reached, taken, follows = _towards(began, later, 1.0, c)
    return began, reached, follows, follows + (did - mean), 1.0 - taken


@kernel
def slewed(last: float, earlier: float, now: float, later: float, c: Any) -> tuple[float, float]:
    """Return the duty that a ramp reached at the end of the step before, and its mean over that step.

    A command that changes within a step is known by its mean alone. Those of the steps before and after tell when it
    changed: what a ramp did is known a step late, which is second order in the step.

    Parameters
    ----------
    last
        The duty at the beginning of that step.
    earlier, now, later
        The mean commands of the step before it, of that step, and of the next one.
    """
    jump = earlier - later
    share = min(max((now - later) / jump, 0.0), 1.0) if jump != 0.0 else 0.0
    duty, _, before = _towards(last, earlier, share, c)
    duty, _, after = _towards(duty, later, 1.0 - share, c)
    return duty, before + after


@kernel
def _towards(duty: float, command: float, share: float, c: Any) -> tuple[float, float, float]:
    """Return the duty a ramp reaches in a share of a step, the share it took, and the duty's integral in steps."""
    rise = command - duty
    taken = min(abs(rise) / c.slew, share)
    reached = duty + math.copysign(taken * c.slew, rise) if taken == share else command
    return reached, taken, 0.5 * (duty + reached) * taken + command * (share - taken)


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
    """Advance both shafts by one step at the step's voltage; torques and frictions [N m] may act beside the motor's."""
    run_motors(s, left_duty, right_duty, left_torque, right_torque, p, c, ALL)
    s.left_dry = max(friction_budget(s.left_speed, 0.0, 0.0, p, c) + left_friction * c.dt, 0.0)
    s.right_dry = max(friction_budget(s.right_speed, 0.0, 0.0, p, c) + right_friction * c.dt, 0.0)
    s.left_friction = s.right_friction = 0.0
    rub_shafts(s, c)
    owe(s, c.rotor, c.rotor)
    s.left_angle += s.left_speed * c.dt
    s.right_angle += s.right_speed * c.dt
    s.battery_current = battery_current(s, p)
    s.t += c.dt
