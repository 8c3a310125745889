"""The robot on a bench: wheels in the air, or one motor alone; nothing touches, only the battery couples them."""

from __future__ import annotations

from typing import Any

from gecar.compiled import kernel
from gecar.world.motor import awake, bare_shaft, effective_duty, motor_current, regulate, slewed, supply


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
    if p.regulated != 0.0:
        left_duty, s.left_integral = regulate(left_duty, s.left_speed, s.left_integral, c)
        right_duty, s.right_integral = regulate(right_duty, s.right_speed, s.right_integral, c)
    s.left_duty = slewed(awake(left_duty, s.t, p, c), s.left_duty, c)
    s.right_duty = slewed(awake(right_duty, s.t, p, c), s.right_duty, c)
    s.left_drive = effective_duty(s.left_duty, c.left_gain, p)
    s.right_drive = effective_duty(s.right_duty, c.right_gain, p)
    s.left_speed = bare_shaft(s.left_drive, s.voltage, s.left_angle, s.left_speed, p, c)
    s.right_speed = bare_shaft(s.right_drive, s.voltage, s.right_angle + p.ripple_lead, s.right_speed, p, c)
    s.left_angle += s.left_speed * c.dt
    s.right_angle += s.right_speed * c.dt
    left = s.left_drive * motor_current(s.left_drive, s.voltage, s.left_speed, p)
    right = s.right_drive * motor_current(s.right_drive, s.voltage, s.right_speed, p)
    s.battery_current = max(left, 0.0) + max(right, 0.0)
    s.t += c.dt
