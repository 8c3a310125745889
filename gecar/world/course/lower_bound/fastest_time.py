"""A lower bound on the time to GOAL, shown beside every result: no program on this robot is faster if its tyres hold.

docs/lower_bound.md has the proof, what it assumes, and what is known of tyres that slide. In short:

1. **Way.** The outer wheel travels the length plus half the track times all turning
   (`gecar.world.course.lower_bound.outer_wheel`, `gecar.world.course.lower_bound.shortest_way`).
2. **Speed.** The motor of the outer wheel speeds it up from rest to the speed at which torques balance,

       r (Kt V / R - friction + push) / (Kt Ke / R + b),

   within a time constant; turning shifts a small share of the body's momentum to it (`exchange`).

The time is where the distance under that speed equals the way. Each effect counts with what makes it faster.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gecar.world.course.lower_bound.outer_wheel import outer_wheel_m
from gecar.world.course.lower_bound.shortest_way import ShortestWay
from gecar.world.kernel.motor import FULL_DUTY
from gecar.world.kernel.state import GRAVITY
from gecar.world.robot import Robot

LEAST_DAMPING = 1e-9  # N m s/rad
_LONGEST_S, _LONGEST_STEP_S = 3600.0, 0.01  # of a drive; gecar.world.rollout holds them


class Sprint(NamedTuple):
    """The fastest a robot can be.

    Attributes
    ----------
    speed
        The outer wheel's speed at which its motor's torques balance [m/s].
    limit
        What firmware leaves of it [m/s].
    time_constant
        Of the way there from rest [s].
    dead_s
        What passes before the motors answer [s]; negative where steps let them answer early.
    downhill
        What gravity gives a robot that slides [m/s^2]; 0 where the tyres hold.
    exchange
        Share of the turning that the body's momentum can give.
    coasting_m
        How far the body slides on when the wheels stop; infinite where nothing stops it.
    play_m
        How far the wheels turn freely within the gears' play.
    """

    speed: float
    limit: float
    time_constant: float
    dead_s: float = 0.0
    downhill: float = 0.0
    exchange: float = 0.0
    coasting_m: float = 0.0
    play_m: float = 0.0


def sprint(robot: Robot, until_s: float = 0.0) -> Sprint:
    """Return how fast a robot can be until a time, taking from each of its effects what makes it faster."""
    p = robot.physics[0]
    small, large = (
        p["wheel_radius"] * p["radius_scale"] * (1.0 + s * abs(p["radius_difference"])) for s in (-0.5, 0.5)
    )
    damping = p["torque_constant"] * p["back_emf_constant"] / p["resistance"] + p["viscous_friction"]
    damping = max(damping - 0.5 * abs(p["viscous_difference"]), LEAST_DAMPING)
    torque = p["torque_constant"] * _voltage(p, until_s) / p["resistance"]
    drag = p["coulomb_friction"] * (1.0 - abs(p["friction_ratio"]))
    tilt = math.hypot(math.sin(p["tilt_x"]), math.sin(p["tilt_y"]))
    track, behind = 0.5 * p["track_width"] * p["track_scale"], abs(p["com_ahead"])
    downhill = 0.5 * p["mass"] * GRAVITY * tilt * large * math.hypot(1.0, behind / track)
    push = downhill + abs(p["ripple_amplitude"]) + abs(p["constant_torque"])
    grip = max(p["tyre_friction"], p["patch_friction"] if p["patch_radius"] > 0.0 else 0.0)
    # Unlike wheels: whatever the ground gives the larger as the outer one need not be paid back by the smaller.
    unlike = 0.5 * (large**2 - small**2) / damping * grip * p["mass"] * GRAVITY
    # What drags aside pushes the outer wheel where the robot turns fast, or farther out than the wheels are.
    lever = 0.5 * abs(1.0 - abs(p["drag_left"]) / track) if p["drag_left"] != 0.0 else 0.0
    dragged = p["drag_force"] * lever * large
    speed = large * (torque + push + dragged - drag) / damping + unlike
    inertia = p["inertia"] * p["inertia_scale"]
    rolling = 0.5 * p["mass"] * small**2
    yaw = p["yaw_inertia"] * p["yaw_inertia_scale"] + p["mass"] * behind**2
    turning = 0.5 * yaw * (small / track) ** 2
    uneven = math.sqrt((inertia + max(rolling, turning)) / (inertia + min(rolling, turning)))
    over = 2.0 * abs(rolling - turning) / (2.0 * inertia + rolling + turning)
    free = push > 0.0 or unlike > 0.0
    holding = _holding(p, tilt)
    dead = 0.0 if free else max(p["actuation_delay"], p["start_latency"])
    # A saturated regulator hides the half step that commands wait for velocities, a curve that gives more than half at
    # half duty part of it, and what pushes without a command does not wait: the robot starts that much early.
    early = 0.5 * _LONGEST_STEP_S if p["regulated"] or p["duty_bulge"] > 0.0 or push > 0.0 else 0.0
    return Sprint(
        float(speed),
        math.inf if free or dragged > 0.0 else float(large * p["speed_limit"] * (1.0 + over)),
        float((inertia + min(rolling, turning)) / damping),
        float(dead - early),
        GRAVITY * tilt if holding <= 0.0 else 0.0,
        float(p["mass"] * behind * max(speed, 0.0) * uneven * large**2 / (2.0 * track**2 * damping)),
        float(speed**2 / (2.0 * holding)) if holding > 0.0 else math.inf,
        float(p["backlash"] * large),
    )


def _voltage(p: np.void, until_s: float) -> float:
    """Return the highest voltage at a motor until a time [V]; a supply that falls below zero drives backwards."""
    full = p["voltage"] * p["supply_scale"]
    supply = max(full, abs(full - p["battery_drain"] * until_s))
    cap = 1.0 if p["regulated"] else p["duty_cap"]  # a regulator may use the whole battery to hold its speed
    full = 1.0 + max(p["full_duty_gain"], 0.0) if cap >= FULL_DUTY else 1.0
    bulge = max(p["duty_bulge"], 0.0)
    curved = cap * (1.0 + bulge) / (1.0 + bulge * cap)
    return supply * curved * full * (1.0 + 0.5 * abs(p["gain_difference"])) * (1.0 + abs(p["direction_gain"]))


def _holding(p: np.void, tilt: float) -> float:
    """Return what slows a sliding body [m/s^2]: the least grip, under what load speeding up leaves the wheels.

    On a tilted floor it has to hold the body twice over, as a tyre that also pushes has only part of its grip left.
    """
    grip = min(p["tyre_friction"], p["patch_friction"] if p["patch_radius"] > 0.0 else math.inf)
    share = 1.0 - p["com_ahead"] / p["caster_ahead"]
    return GRAVITY * (grip * share / (1.0 + grip * p["com_height"] / abs(p["caster_ahead"])) - 2.0 * tilt)


def bound_words(bound_s: float) -> str:
    """Write a lower bound [s], and for what it is proven."""
    return f"lower bound {bound_s:.2f} s if tyres hold"


def travelled(fast: Sprint, time_s: float) -> float:
    """Return how far [m] the outer wheel can be after a time from the start."""
    t = max(time_s - fast.dead_s, 0.0)
    if fast.speed <= 0.0:
        return 0.5 * fast.downhill * t**2
    tau = fast.time_constant
    rise = -tau * math.log1p(-fast.limit / fast.speed) if fast.limit < fast.speed else math.inf
    early, late = min(t, rise), max(t - rise, 0.0)
    rolled = fast.speed * (early - tau * -math.expm1(-early / tau)) + (
        fast.limit * late if late > 0.0 else 0.0
    )
    # Steps see the start's jerk early: at most a quarter of its acceleration times the square of a step.
    return rolled + 0.5 * fast.downhill * t**2 + 0.25 * fast.speed / tau * _LONGEST_STEP_S**2


def way_of_outer_wheel(way: ShortestWay, heading_rad: float, robot: Robot, fast: Sprint) -> float:
    """Return how far [m] the outer wheel has to travel along a course."""
    bends = max(len(way.legs) - 1, 0)
    p = robot.physics[0]
    half_track = 0.5 * p["track_width"] * p["track_scale"] * max(1.0 - fast.exchange, 0.0)
    loose = way.length_m - sum(leg.length_m for leg in way.legs)
    turned = loose + outer_wheel_m(way.legs, heading_rad, half_track, fast.coasting_m)
    return turned - fast.play_m * (bends + 1)


def fastest_time(way: ShortestWay, heading_rad: float, robot: Robot, free_to_turn: bool = True) -> float:
    """Return the least time [s] in which a robot at rest can take a way.

    Parameters
    ----------
    way
        The shortest way.
    heading_rad
        Heading at the start [rad].
    robot
        Whose constants and effects.
    free_to_turn
        Whether there is nothing on the course that could turn the robot; where there is, turning costs nothing.

    Returns
    -------
    float
        Infinite if the robot does not get there in the longest drive.
    """
    fast = sprint(robot)
    need = _needed(way, heading_rad, robot, fast, free_to_turn)

    def arrived(time_s: float) -> bool:
        if robot.physics["battery_drain"][0] == 0.0:
            return travelled(fast, time_s) >= need
        now = sprint(robot, time_s)
        return travelled(now, time_s) >= _needed(way, heading_rad, robot, now, free_to_turn)

    if need <= 0.0:
        return 0.0
    if not arrived(_LONGEST_S):
        return math.inf
    early, late = 0.0, _LONGEST_S
    while late - early > 1e-9 * late:
        middle = 0.5 * (early + late)
        early, late = (early, middle) if arrived(middle) else (middle, late)
    return early


def _needed(way: ShortestWay, heading_rad: float, robot: Robot, fast: Sprint, free_to_turn: bool) -> float:
    if free_to_turn:
        return way_of_outer_wheel(way, heading_rad, robot, fast)
    return way.length_m - fast.play_m
