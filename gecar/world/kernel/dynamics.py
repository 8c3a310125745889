"""The robot's motion, written once: pure compiled functions from duty and state to the next state.

Frames: the body frame has u ahead and w to the left; impulses act at the wheels' contacts, at the axle, ``half_track``
to the left and right of its centre, at the caster, and where something drags. Position and velocity are those of the
centre of mass.

A step turns commands into torques, sets what friction can give under each wheel's load, and lets
`gecar.world.kernel.contacts` find the impulses; the same impulses, one step later, give the load transfer. Branches
only lead forwards, so that a compiler can turn them into selects and take several lanes through a step at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import blank, kernel, subroutine
from gecar.world.kernel.contacts import (
    caster_load,
    impulses_on_body,
    release_contacts,
    repay_tyres,
    shove,
    sweep,
    sweep_on,
    wheel_loads,
)
from gecar.world.kernel.laws import SCRATCH, VIEW, load_asked, store_view
from gecar.world.kernel.motor import (
    battery_current,
    friction_budget,
    owe,
    run_motors,
    supply,
    turn_bare_shafts,
    unless_still,
)
from gecar.world.kernel.series import small_cosine, small_sine
from gecar.world.kernel.state import ALL, PLAIN, roll_on
from gecar.world.kernel.terms import ask, look_at

_LIGHT_FIELDS = (
    "tilt_x", "tilt_y", "regulated", "dead_band", "dead_band_right", "dead_band_forward", "direction_gain",
    "full_duty_gain", "viscous_difference", "constant_torque", "friction_ratio", "rolling_resistance", "patch_radius",
    "battery_drain", "battery_resistance",
)  # fmt: skip
_LIGHT_LIMITS = ("speed_limit",)
_OTHER_FIELDS = (
    "start_latency", "duty_bulge", "ripple_amplitude", "static_friction", "backlash", "caster_friction", "drag_force",
)  # fmt: skip
_OTHER_LIMITS = ("command_slew", "current_limit")


def is_plain(physics: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return whether robots differ from the nominal one in constants alone, shape (n,).

    Parameters
    ----------
    physics
        Records of dtype `PHYSICS`, shape (n,).
    """
    return is_light(physics) & _are_without(physics, _LIGHT_FIELDS, _LIGHT_LIMITS)


def is_light(physics: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return whether robots are light: without terms, and without the effects that take long in a step, shape (n,).

    Parameters
    ----------
    physics
        Records of dtype `PHYSICS`, shape (n,).
    """
    return ~has_terms(physics) & _are_without(physics, _OTHER_FIELDS, _OTHER_LIMITS)


def _are_without(
    physics: npt.NDArray[Any], fields: tuple[str, ...], limits: tuple[str, ...]
) -> npt.NDArray[np.bool_]:
    """Return whether robots have neither effects of some fields nor some limits, shape (n,)."""
    without = np.ones(len(physics), bool)
    for field in fields:
        without &= physics[field] == 0.0
    for field in limits:
        without &= physics[field] == np.inf
    return without


def has_terms(physics: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return whether robots have terms, shape (n,): then a step is `step_with_terms`."""
    found: npt.NDArray[np.bool_] = physics["n_terms"] > 0.0
    return found


@kernel
def step(s: Any, left_duty: float, right_duty: float, p: Any, c: Any) -> None:
    """Advance velocities, shafts and contact impulses by one step; `drift` then moves the body.

    Parameters
    ----------
    s
        Record of dtype `STATE`, updated.
    left_duty, right_duty
        Commands after cap and delay [-1..1], of half a step ago: positions are those at a step's ends, velocities
        those at its middle (leapfrog), so that path and angles are second order in the step.
    p, c
        Records of dtypes `PHYSICS` and `DERIVED`.
    """
    settled = begin_step(s, left_duty, right_duty, p, c, ALL)
    if not settled:
        sweep_on(s, c, ALL)
    end_step(s, p, c, ALL)


@kernel
def begin_step(s: Any, left_duty: float, right_duty: float, p: Any, c: Any, effects: int) -> bool:
    """Begin a step: turn commands into torques, set what friction can give, and sweep once over the contacts.

    ``effects`` is `PLAIN` where a robot differs from the nominal one in constants alone (`is_plain`), `LIGHT` where it
    has none of the effects that take long (`is_light`), else `ALL`. What then has no part in the result is left out:
    eight robots at once take a `LIGHT` step in half the time. A step is this, up to two more sweeps, and `end_step`.

    Returns
    -------
    bool
        Whether another sweep would change nothing.
    """
    enter_step(s, c, effects)
    repay_tyres(s, c)
    s.voltage = supply(s, p) if effects != PLAIN else p.voltage * p.supply_scale
    run_motors(s, left_duty, right_duty, 0.0, 0.0, p, c, effects)
    _set_budgets(s, p, c, effects)
    release_contacts(s)
    return sweep(s, c, effects, False, True)


@kernel
def step_with_terms(
    s: Any,
    left_duty: float,
    right_duty: float,
    robot: npt.NDArray[Any],
    c: Any,
    stores: npt.NDArray[np.float64],
) -> None:
    """Advance a robot with terms by one step, as `step` does; what they ask for enters at the ports.

    Parameters
    ----------
    s, left_duty, right_duty
        As in `step`.
    robot
        Its physics with the terms, dtype `PHYSICS`, shape (1,).
    c
        Record of dtype `DERIVED`; terms may change the robot's shape in it.
    stores
        What terms have stored, shape (`gecar.world.kernel.laws.N_STORES`,), updated.
    """
    p = robot[0]
    enter_step(s, c, ALL)
    scratch = blank(SCRATCH).of
    _ask(s, left_duty, right_duty, robot, c, stores, scratch)
    asked = load_asked(scratch, 1, 0)
    if asked.shape_terms > 0.0:
        reshape(p, asked, c)
    if not begin_as_asked(s, left_duty, right_duty, p, c, asked):
        sweep_on(s, c, ALL, True)
    end_step(s, p, c, ALL)


@subroutine
def _ask(
    s: Any,
    left_duty: float,
    right_duty: float,
    robot: npt.NDArray[Any],
    c: Any,
    stores: npt.NDArray[np.float64],
    scratch: npt.NDArray[np.float64],
) -> None:
    """Set what the terms of one robot, shape (1,), ask for; ``scratch`` as in `gecar.world.kernel.terms.ask`."""
    v = blank(VIEW)
    look_at(s, left_duty, right_duty, robot[0], c, v)
    store_view(scratch, 1, 0, v)
    ask(robot, False, c.dt, stores, scratch, 1)


@kernel
def begin_as_asked(s: Any, left_duty: float, right_duty: float, p: Any, c: Any, asked: Any) -> bool:
    """Begin a step that was entered, as `begin_step` does, with what terms ask for, but for the robot's shape."""
    _force(s, asked, c)
    repay_tyres(s, c)
    s.voltage = supply(s, p) + asked.supply_voltage
    left, right = left_duty + asked.left_command, right_duty + asked.right_command
    run_motors(s, left, right, asked.left_motor_torque, asked.right_motor_torque, p, c, ALL)
    _set_budgets(s, p, c, ALL)
    s.left_dry = max(s.left_dry + asked.left_gear_friction * c.dt, 0.0)
    s.right_dry = max(s.right_dry + asked.right_gear_friction * c.dt, 0.0)
    grip = _grip(s, p) * c.dt
    s.left_circle = max(s.left_circle + grip * asked.left_wheel_load, 0.0) * max(
        1.0 + asked.left_tyre_grip, 0.0
    )
    s.right_circle = max(s.right_circle + grip * asked.right_wheel_load, 0.0) * max(
        1.0 + asked.right_tyre_grip, 0.0
    )
    s.caster_circle = max(s.caster_circle + asked.caster_friction * s.caster_load * c.dt, 0.0)
    release_contacts(s)
    return sweep(s, c, ALL, True, True)


@kernel
def bench_step_with_terms(
    s: Any,
    left_duty: float,
    right_duty: float,
    robot: npt.NDArray[Any],
    c: Any,
    stores: npt.NDArray[np.float64],
) -> None:
    """Advance the shafts of a robot with terms on a bench, as `gecar.world.kernel.motor.bench_step` does."""
    scratch = blank(SCRATCH).of
    _ask(s, left_duty, right_duty, robot, c, stores, scratch)
    asked = load_asked(scratch, 1, 0)
    s.voltage = supply(s, robot[0]) + asked.supply_voltage
    turn_bare_shafts(
        s,
        left_duty + asked.left_command,
        right_duty + asked.right_command,
        asked.left_motor_torque,
        asked.right_motor_torque,
        asked.left_gear_friction,
        asked.right_gear_friction,
        robot[0],
        c,
    )


@kernel
def reshape(p: Any, asked: Any, c: Any) -> None:
    """Let the radii, the track and the play be what terms make of them in a step."""
    c.axle = 0.5 * (asked.left_contact + asked.right_contact) - p.com_ahead
    c.apart = abs(asked.right_contact - asked.left_contact)
    roll_on(p, asked.left_rolling_radius, asked.right_rolling_radius, asked.track_width, c)
    c.left_gap = 0.5 * max(p.backlash + asked.left_gear_play, 0.0)
    c.right_gap = 0.5 * max(p.backlash + asked.right_gear_play, 0.0)


@kernel
def _force(s: Any, asked: Any, c: Any) -> None:
    """Let forces act on the body for a step."""
    shove(s, asked.force_ahead * c.dt, asked.force_aside * c.dt, c)
    s.u += (asked.force_x * s.cos + asked.force_y * s.sin) * c.dt * c.inv_mass
    s.w += (asked.force_y * s.cos - asked.force_x * s.sin) * c.dt * c.inv_mass
    s.yaw_rate += asked.yaw_moment * c.dt * c.inv_inertia


@kernel
def enter_step(s: Any, c: Any, effects: int) -> None:
    """Set the velocities ahead and to the left, along the heading at mid-step: the path is then second order in it."""
    s.half_turn = 0.5 * c.dt * s.yaw_rate
    turn(s, s.half_turn)
    if effects != PLAIN:
        s.vx += c.tilt_x
        s.vy += c.tilt_y
    s.u = s.vx * s.cos + s.vy * s.sin
    s.w = s.vy * s.cos - s.vx * s.sin


@kernel
def end_step(s: Any, p: Any, c: Any, effects: int) -> None:
    """End a step: what the contacts left of the velocities moves the shafts; `drift` then moves the body."""
    s.u, s.w, s.yaw_rate = unless_still(s.u), unless_still(s.w), unless_still(s.yaw_rate)
    # A wheel that slides, or is within its play, leaves friction the rotor alone.
    owe(
        s,
        c.left_load if s.left_push != 0.0 and s.left_slides == 0.0 else c.rotor,
        c.right_load if s.right_push != 0.0 and s.right_slides == 0.0 else c.rotor,
    )
    s.left_angle += s.left_speed * c.dt
    s.right_angle += s.right_speed * c.dt
    if effects == ALL:
        _close_play(s, c)
    if effects != PLAIN:
        _load_battery(s, p)
    s.vx = s.u * s.cos - s.w * s.sin
    s.vy = s.u * s.sin + s.w * s.cos
    s.t += c.dt


@kernel
def _load_battery(s: Any, p: Any) -> None:
    """Set the current both motors draw, which lowers the voltage of the next step."""
    if p.battery_resistance > 0.0:
        s.battery_current = battery_current(s, p)


@kernel
def drift(s: Any, c: Any) -> None:
    """Move the body with its new velocity: what the rigid-body engine does where there is nothing to touch."""
    s.x += s.vx * c.dt
    s.y += s.vy * c.dt
    s.heading += s.yaw_rate * c.dt
    turn(s, s.yaw_rate * c.dt - s.half_turn)


@kernel
def turn(s: Any, angle: float) -> None:
    """Turn the heading's cosine and sine by a small angle [rad]."""
    sine, cosine = small_sine(angle), small_cosine(angle)
    c, n = s.cos, s.sin
    s.cos = c * cosine - n * sine
    s.sin = n * cosine + c * sine


@kernel
def _set_budgets(s: Any, p: Any, c: Any, effects: int) -> None:
    """Set what dry friction, tyres, caster and what drags can give in this step.

    Loads are static, plus transfer from the last step's contact impulses: fore-aft onto the caster, sideways from
    wheel to wheel.
    """
    ahead, s.aside = impulses_on_body(s)
    s.caster_load = caster_load(ahead * c.inv_dt, c)
    left, right = wheel_loads(s.caster_load, s.aside * c.inv_dt, c)
    s.left_bears, s.right_bears = left, right
    s.left_dry = friction_budget(s.left_speed, left, c.left_radius, p, c, effects)
    s.right_dry = friction_budget(s.right_speed, right, c.right_radius, p, c, effects)
    s.grip = _grip(s, p) if effects != PLAIN else p.tyre_friction
    s.left_circle = s.grip * c.dt * left
    s.right_circle = s.grip * c.dt * right
    s.caster_circle = p.caster_friction * s.caster_load * c.dt
    s.drag_circle = p.drag_force * c.dt


@kernel
def _grip(s: Any, p: Any) -> float:
    """Return the tyres' friction coefficient where the axle's centre is."""
    if p.patch_radius > 0.0:
        dx = s.x - p.com_ahead * s.cos - p.patch_x
        dy = s.y - p.com_ahead * s.sin - p.patch_y
        if dx * dx + dy * dy < p.patch_radius * p.patch_radius:
            return p.patch_friction
    return p.tyre_friction


@kernel
def _close_play(s: Any, c: Any) -> None:
    """Move the play: the wheel rolls with the ground, the shaft with the motor, at most the gap apart."""
    if c.left_gap > 0.0:
        left = s.left_play + c.dt * (s.left_speed - (s.u - s.yaw_rate * c.half_track) / c.left_radius)
        s.left_play = min(max(left, -c.left_gap), c.left_gap)
    if c.right_gap > 0.0:
        right = s.right_play + c.dt * (s.right_speed - (s.u + s.yaw_rate * c.half_track) / c.right_radius)
        s.right_play = min(max(right, -c.right_gap), c.right_gap)
