"""What the kernels carry from step to step, and what follows from a robot's constants once per drive."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gecar.compiled import kernel

# How much of a robot's physics a step works out: its constants alone, or with effects, but for those that take long, or
# all. Python's integers are literals to Numba, which leaves out what they rule out before LLVM sees it: as variables
# with the same values they made plain drives in lanes a fifth slower.
PLAIN, LIGHT, ALL = 0, 1, 2
GRAVITY = 9.81  # m/s^2
REGULATOR_RATE = 30.0  # rad/s

_STATE_FIELDS = (
    "t x y heading cos sin vx vy yaw_rate "
    "left_angle right_angle left_speed right_speed left_play right_play "
    "left_push right_push left_side right_side caster_push caster_side drag_push drag_side "
    "left_friction right_friction left_slides right_slides scrub "
    "left_duty right_duty left_integral right_integral battery_current "
    # where duties ramp: those at the beginning of the last step and on the mean, and the commands of the last two
    "left_began right_began left_mean right_mean left_command right_command left_earlier_command right_earlier_command "
    # the shafts' speeds before the step, and what dry friction has yet to give them [N m s]
    "left_before right_before left_due right_due "
    # the tyres' pushes of the last steps, what would have held them, and whether they held or slid
    "left_latest right_latest left_earlier right_earlier left_asks right_asks left_asked right_asked "
    "left_slid right_slid left_held right_held "
    # for what share of the last step gears that closed in it had been open
    "left_opened right_opened aside_found "
    # within a step: velocity in the body frame, budgets of dry friction, grip and drag, and what drives
    "half_turn u w "
    "left_dry right_dry left_circle right_circle caster_circle drag_circle grip left_closed right_closed "
    "left_bears right_bears caster_load aside "
    "left_drive right_drive voltage"
)
_DERIVED_FIELDS = (
    "dt inv_dt late mass inv_mass inv_inertia half_track axle caster left_radius right_radius inv_rotor rotor "
    "drive_gain keep left_gain right_gain left_dead right_dead slew torque lean "
    "m_ll m_lr m_rr m_ls m_rs m_ss n_ll n_ls n_lss n_rr n_rs n_rss left_mass right_mass side_mass caster_mass "
    "drag_mass left_load right_load "
    "weight caster_static caster_arm transfer_side drag_ahead drag_left left_gap right_gap apart tilt_x tilt_y "
    "sliding ripple regulator_p regulator_i"
)

STATE = np.dtype([(field, np.float64) for field in _STATE_FIELDS.split()])
"""What changes. Angles and speeds of the shafts are the motors'; the wheels differ from them by the play."""

DERIVED = np.dtype([(field, np.float64) for field in _DERIVED_FIELDS.split()])
"""What follows from the robot's constants and the step size."""


@kernel
def derive(p: Any, dt: float, c: Any) -> None:
    """Compute a drive's derived constants.

    Parameters
    ----------
    p
        Record of dtype `PHYSICS`.
    dt
        Step [s].
    c
        Record of dtype `DERIVED`, overwritten.
    """
    c.dt = dt
    c.inv_dt = 1.0 / dt
    c.late = p.actuation_delay / dt + 0.5  # steps a command is late: half a one, as velocities are
    c.mass = p.mass
    c.inv_mass = 1.0 / p.mass
    c.inv_inertia = 1.0 / (p.yaw_inertia * p.yaw_inertia_scale)
    c.axle = -p.com_ahead
    c.apart = 0.0
    c.caster = p.caster_ahead - p.com_ahead
    c.drag_ahead = p.drag_off_axle - p.com_ahead
    c.drag_left = p.drag_left
    _rotor(p, dt, c)
    c.left_gain = 1.0 - 0.5 * p.gain_difference
    c.right_gain = 1.0 + 0.5 * p.gain_difference
    c.left_dead = p.dead_band - 0.5 * p.dead_band_right
    c.right_dead = p.dead_band + 0.5 * p.dead_band_right
    c.slew = p.command_slew * dt
    c.weight = p.mass * GRAVITY
    c.caster_static = c.weight * p.com_ahead / p.caster_ahead
    c.caster_arm = -p.com_height / p.caster_ahead
    c.left_gap = c.right_gap = 0.5 * p.backlash
    c.tilt_x = GRAVITY * math.sin(p.tilt_x) * dt
    c.tilt_y = GRAVITY * math.sin(p.tilt_y) * dt
    c.sliding = p.coulomb_friction * dt
    c.ripple = p.ripple_amplitude * dt / c.rotor
    c.torque = p.constant_torque * dt / c.rotor
    c.lean = 0.5 * p.viscous_difference * dt / c.rotor
    roll_on(p, 0.0, 0.0, 0.0, c)


@kernel
def roll_on(p: Any, left_share: float, right_share: float, track_share: float, c: Any) -> None:
    """Let the wheels roll on radii that are larger, and at a distance that is larger, by these shares."""
    c.half_track = 0.5 * p.track_width * p.track_scale
    c.transfer_side = p.com_height / p.track_width / p.track_scale
    if track_share != 0.0:
        c.half_track *= max(1.0 + track_share, 0.1)
        c.transfer_side /= max(1.0 + track_share, 0.1)
    c.left_radius = p.wheel_radius * p.radius_scale * (1.0 - 0.5 * p.radius_difference)
    c.right_radius = p.wheel_radius * p.radius_scale * (1.0 + 0.5 * p.radius_difference)
    if left_share != 0.0 or right_share != 0.0:
        c.left_radius *= max(1.0 + left_share, 0.1)
        c.right_radius *= max(1.0 + right_share, 0.1)
    _contact_masses(c)


@kernel
def _rotor(p: Any, dt: float, c: Any) -> None:
    """Set the shaft's inertia over a step, and how much of its speed it keeps.

    J dw/dt = T - B w, with B = Kt Ke / R + b, has the exact step w' = keep w + T dt / rotor for a constant torque T:
    keep = exp(-k), rotor = J k / (1 - keep), k = B dt / J. The contacts' impulses act on the same ``rotor``.
    """
    inertia = p.inertia * p.inertia_scale
    k = (p.torque_constant * p.back_emf_constant / p.resistance + p.viscous_friction) * dt / inertia
    c.keep = math.exp(-k)
    c.rotor = inertia * k / -math.expm1(-k)
    c.inv_rotor = 1.0 / c.rotor
    c.drive_gain = dt * p.torque_constant / (c.rotor * p.resistance)
    _regulator(c.keep, c.drive_gain * p.voltage, dt, c)


@kernel
def _regulator(keep: float, gain: float, dt: float, c: Any) -> None:
    """Set the gains of `gecar.world.kernel.motor.regulate` for a free shaft, w' = keep w + gain u.

    With u = P e + I and I' = I + Q e the loop's poles have the sum 1 + keep - gain P and the product
    keep - gain P + gain Q. Both are put at q = exp(-`REGULATOR_RATE` dt). A shaft faster than that, keep < 2 q - 1,
    would need P < 0, and drive backwards at first: P is then 0 and only one pole is at q, the other nearer to 0.
    """
    pole = math.exp(-REGULATOR_RATE * dt)
    other = min(pole, 1.0 + keep - pole)
    c.regulator_p = (1.0 + keep - pole - other) / gain
    c.regulator_i = (1.0 - pole) * (1.0 - other) / gain


@kernel
def _contact_masses(c: Any) -> None:
    """Invert the matrix that maps impulses (left, right, sideways at the axle) to the slip they end."""
    yaw = c.half_track * c.half_track * c.inv_inertia
    left = c.inv_mass + yaw + c.left_radius * c.left_radius * c.inv_rotor
    right = c.inv_mass + yaw + c.right_radius * c.right_radius * c.inv_rotor
    both = c.inv_mass - yaw
    side = c.inv_mass + c.axle * c.axle * c.inv_inertia
    cross = (
        c.half_track * c.axle * c.inv_inertia
    )  # sideways against the right wheel; the left one's is its negative
    determinant = side * (left * right - both * both) - cross * cross * (left + right + 2.0 * both)
    c.m_ll = (right * side - cross * cross) / determinant
    c.m_rr = (left * side - cross * cross) / determinant
    c.m_lr = -(both * side + cross * cross) / determinant
    c.m_ls = cross * (both + right) / determinant
    c.m_rs = -(cross * (both + left)) / determinant
    c.m_ss = (left * right - both * both) / determinant
    # The inertia that dry friction turns, with tyres that hold.
    c.left_load = c.rotor / (1.0 - c.m_ll * c.left_radius * c.left_radius * c.inv_rotor)
    c.right_load = c.rotor / (1.0 - c.m_rr * c.right_radius * c.right_radius * c.inv_rotor)
    # The same with the other wheel sliding: its impulse is then what its circle gives, whatever this one's is.
    determinant = left * side - cross * cross
    c.n_ll, c.n_ls, c.n_lss = side / determinant, cross / determinant, left / determinant
    determinant = right * side - cross * cross
    c.n_rr, c.n_rs, c.n_rss = side / determinant, -cross / determinant, right / determinant
    c.left_mass = 1.0 / left
    c.right_mass = 1.0 / right
    c.side_mass = 1.0 / side
    c.caster_mass = 1.0 / (c.inv_mass + c.caster * c.caster * c.inv_inertia)
    c.drag_mass = 1.0 / (
        c.inv_mass + (c.drag_ahead * c.drag_ahead + c.drag_left * c.drag_left) * c.inv_inertia
    )


@kernel
def place(s: Any, p: Any, x: float, y: float, heading: float) -> None:
    """Put the robot at rest with its axle's centre at a pose [m, m, rad]."""
    for_zero = 0.0
    s.t = s.vx = s.vy = s.yaw_rate = for_zero
    s.left_angle = s.right_angle = s.left_speed = s.right_speed = s.left_play = s.right_play = for_zero
    s.left_push = s.right_push = s.left_side = s.right_side = s.caster_push = s.caster_side = for_zero
    s.drag_push = s.drag_side = s.left_slides = s.right_slides = s.scrub = for_zero
    s.left_latest = s.right_latest = s.left_earlier = s.right_earlier = for_zero
    s.left_asked = s.right_asked = s.left_asks = s.right_asks = for_zero
    s.left_slid = s.right_slid = s.left_held = s.right_held = for_zero
    s.left_opened = s.right_opened = s.aside_found = for_zero
    s.left_friction = s.right_friction = s.left_duty = s.right_duty = for_zero
    s.left_integral = s.right_integral = s.battery_current = for_zero
    s.left_command = s.right_command = s.left_earlier_command = s.right_earlier_command = for_zero
    s.left_began = s.right_began = s.left_mean = s.right_mean = for_zero
    s.left_before = s.right_before = s.left_due = s.right_due = s.left_dry = s.right_dry = for_zero
    s.heading = heading
    s.cos = math.cos(heading)
    s.sin = math.sin(heading)
    s.x = x + p.com_ahead * s.cos
    s.y = y + p.com_ahead * s.sin
