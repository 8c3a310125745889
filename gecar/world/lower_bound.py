"""A lower bound on the time to GOAL, shown beside every result: no program on this robot can be faster.

Two steps, each of which can only make the time too short:

1. **Way.** The axle's centre has to pass the tiles in order, so it travels at least the shortest way through
   them (`gecar.world.shortest`). Steering, the line, walls and obstacles only make ways longer.
2. **Speed.** The centre's speed is the mean of the wheels' rim speeds, so it is fastest with both motors
   forward at the highest duty the robot allows. Without any friction, the motors and the body,

       J dw/dt = Kt (V - Ke w) / R - r F,     m dv/dt = 2 F,     v = r w,

   speed up from rest as v(t) = v0 (1 - exp(-t / tau)), with the no-load speed v0 = r V / Ke and
   tau = (J + m r^2 / 2) R / (Kt Ke). Turning would add inertia; slip and friction would waste torque.
   Dry friction T lowers the speed at which the torques balance to v1 = r (V - R T / Kt) / Ke: the centre
   never goes faster. So its speed is at most min(v1, v(t)).

The time is where the distance under that speed, integrated in closed form, equals the way's length.

A drive is looked at once a step, so the centre may cut a tile's corner by a step's travel, under 1 mm; the
bound counts the corner in full. The friction left out of the rise is worth several times that.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import lambertw

from gecar.world.robot import Robot
from gecar.world.state import GRAVITY


class Sprint(NamedTuple):
    """The fastest a robot can be from rest: no-load and friction-limited speed [m/s], time constant [s]."""

    no_load: float
    limit: float
    time_constant: float


def sprint(robot: Robot) -> Sprint:
    """Return how fast a robot can be, taking from each of its effects what makes it faster."""
    p = robot.physics[0]
    radius = p["wheel_radius"] * p["radius_scale"] * (1.0 + 0.5 * abs(p["radius_difference"]))
    gain = (1.0 + 0.5 * abs(p["gain_difference"])) * (1.0 + abs(p["direction_gain"]))
    cap = 1.0 if p["regulated"] else p["duty_cap"]  # a regulator may use the whole battery to hold its speed
    supply = p["voltage"] * p["supply_scale"] + max(0.0, -p["battery_drain"]) * _LONGEST_S
    voltage = supply * cap * gain
    inertia = p["inertia"] * p["inertia_scale"] + 0.5 * p["mass"] * radius**2
    damping = p["torque_constant"] * p["back_emf_constant"] / p["resistance"]
    # Gravity on a tilted floor and torque ripple, at their most helpful, as torque on each shaft.
    tilt = math.hypot(math.sin(p["tilt_x"]), math.sin(p["tilt_y"]))
    push = 0.5 * p["mass"] * GRAVITY * tilt * radius + abs(p["ripple_amplitude"])
    drag = p["coulomb_friction"] * (1.0 - abs(p["friction_ratio"]))
    no_load = radius * (voltage / p["back_emf_constant"] + push / damping)
    limit = min(no_load - radius * drag / damping, _capped(p, radius, push))
    return Sprint(float(no_load), float(max(limit, 0.0)), float(inertia / damping))


_LONGEST_S = 60.0  # a voltage that rises with time does so until the run ends


def _capped(p: np.void, radius: float, push: float) -> float:
    """Return the speed firmware allows [m/s]; a push downhill can drive the wheels past it."""
    return math.inf if push > 0.0 else float(radius * p["speed_limit"])


def fastest_time(length_m: float, robot: Robot) -> float:
    """Return the least time [s] in which a robot at rest can travel a distance [m].

    Infinite if the robot can not move.
    """
    fast = sprint(robot)
    if fast.limit <= 0.0:
        return math.inf if length_m > 0.0 else 0.0
    v0, tau = fast.no_load, fast.time_constant
    reached = -tau * math.log1p(-fast.limit / v0) if fast.limit < v0 else math.inf
    if reached < math.inf:
        run_up = v0 * reached - tau * fast.limit
        if length_m >= run_up:
            return reached + (length_m - run_up) / fast.limit
    # s = v0 (t - tau + tau exp(-t / tau)), solved for t by Lambert's W; at first s = v0 t^2 / (2 tau).
    x = length_m / (v0 * tau)
    if x < 1e-8:
        return tau * math.sqrt(2.0 * x)
    return tau * (1.0 + x + float(lambertw(-math.exp(-1.0 - x)).real))
