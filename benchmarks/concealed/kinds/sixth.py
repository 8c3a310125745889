"""A sixth set of physics outside the catalogue, for examinations by what nobody has met.

It was written by someone who had not read the tool that is examined, nor what it had been found to miss.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.kinds.outside import Drawn, Outside, same_in_all, some_phase, some_side, some_sign
from benchmarks.concealed.robot import NEUTRAL

# Firmware, motors' drivers, battery.


@same_in_all
def _expo(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Bend the stick's curve as radio controls do ("expo"), either way; a bridge whose current gaps bends it, too."""
    share = some_sign(rng) * strength(rng, 0.02, 0.5, least)
    return {"expo": share}, {"cubic_share": share}


@same_in_all
def _cut_out(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Switch a bridge off after too much current for too long, and on again later, as TI's DRV8833 does (SLVSAR1E).

    That one trips and recovers far sooner; where a microcontroller watches the current, it takes as long as this.
    """
    rests, most = strength(rng, 0.004, 0.12, least), float(rng.uniform(0.35, 0.65))
    bears = float(rng.uniform(0.02, 0.05))
    return {"cut_out": (most, bears, rests)}, {"limit_a": most, "bears_s": bears, "rests_s": rests}


def _pulses(rng: Rng, runs: int, least: float) -> Drawn:
    """Run a third motor, as of a gripper or a pump, on and off: 0.1 to 1.7 A through the 1.5 ohm of worn cells."""
    share, period = strength(rng, 0.015, 0.3, least), float(rng.uniform(0.5, 2.5))
    on = float(rng.uniform(0.25, 0.6))
    robots = [replace(NEUTRAL, pulses=(share, period, on, float(rng.uniform()))) for _ in range(runs)]
    return robots, {"share": share, "period_s": period, "on_share": on}


# Drivetrain, body, air, floor.


@same_in_all
def _clutch(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Drive one wheel through LEGO's clutch gear, marked 2.5 to 5.0 N cm, or, weaker, a hub worn round on its axle."""
    torque, side = 1.0 / strength(rng, 1.0 / 0.05, 1.0 / 0.008, least), some_side(rng)
    return {"clutch": (torque, side)}, {"torque_nm": torque, "side": side}


@same_in_all
def _outrigger(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Move weight to the ends of a beam: two times 100 g a quarter of a metre out add 0.0125 to 0.004 kg m^2."""
    share = strength(rng, 0.3, 5.0, least)
    return {"yaw_inertia_scale": 1.0 + share}, {"share": share}


@same_in_all
def _fin(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Turn a robot with an upright card behind into the draught, as a weathercock.

    3 m/s on 0.02 m^2, 0.15 m behind the axle, make 0.016 N m; the side force itself is the tyres'.
    """
    torque, way = strength(rng, 0.0015, 0.025, least), some_phase(rng)
    return {"fin": (torque, way)}, {"torque_nm": torque, "heading_rad": way}


@same_in_all
def _nap(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Carry the robot along a carpet's nap by a share of its way (carpet drift: iRobot's patent US 9223312)."""
    share, way = strength(rng, 0.008, 0.12, least), some_phase(rng)
    return {"nap": (share, way)}, {"share": share, "way_rad": way}


# The colour sensor and the course.


@same_in_all
def _wobble(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lay the line as tape by hand: it weaves by half a millimetre up to almost a centimetre."""
    size, length = strength(rng, 0.0006, 0.008, least), float(rng.uniform(0.15, 0.5))
    return {"wobble": (size, length, some_phase(rng), some_phase(rng))}, {"size_m": size, "length_m": length}


@same_in_all
def _seams(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Put the course together from tiles of 0.30 m, as the paper did, with gaps of 3 to 8 mm that give no light."""
    share, half = min(strength(rng, 0.12, 1.0, least), 1.0), float(rng.uniform(0.0015, 0.004))
    return {"seams": (share, half)}, {"share": share, "half_width_m": half}


@same_in_all
def _nod(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Let soft tyres pitch the robot as it speeds up and brakes.

    Light falls with the sensor's height, by a tenth or more per millimetre (an inverse square at 10 mm gives a fifth).
    """
    lost, time = strength(rng, 0.015, 0.2, least), float(rng.uniform(0.03, 0.10))
    return {"nod": (lost, time)}, {"s2_per_m": lost, "time_s": time}


# What sees the pose.


@same_in_all
def _aspect(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Stretch the image, as video of another aspect ratio is: 4:3 shown as 16:9 would be 0.14."""
    share = some_sign(rng) * strength(rng, 0.008, 0.12, least)
    return {"aspect": share}, {"share": share}


@same_in_all
def _compass(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Take the heading from a compass near motors: hard iron deviates it once a turn, soft iron twice (Smith 1843)."""
    size, periods = math.radians(strength(rng, 1.0, 15.0, least)), int(rng.integers(1, 3))
    numbers = {"size_rad": size, "periods_per_turn": periods}
    return {"compass": (size, periods, some_phase(rng))}, numbers


_LIGHT, _POSE = ("reflection_pct",), ("x_m", "y_m", "heading_deg")

SIXTH: dict[str, Outside] = {
    "duty_expo": Outside(
        "duties act along a bent curve: a share of each grows with its cube", _expo, last=True
    ),
    "driver_cut_out": Outside(
        "a motor's driver is off for a while whenever it has borne too much current", _cut_out, last=True
    ),
    "pulsed_load": Outside(
        "something else loads the battery, on and off by the clock: its voltage falls and recovers",
        _pulses,
        last=True,
    ),
    "slipping_clutch": Outside(
        "one wheel slips on its axle where it would take more than some torque", _clutch, last=True
    ),
    "outriggers": Outside("the robot turns heavily: weight sits far out", _outrigger, last=True),
    "weathercock": Outside(
        "a draught turns the robot to one heading, the more the farther it is off", _fin, last=True
    ),
    "carpet_drift": Outside(
        "the floor carries the robot one way, by a share of the way it goes", _nap, _POSE, last=True
    ),
    "weaving_line": Outside("the line weaves to and fro along its way", _wobble, _LIGHT, last=True),
    "tile_seams": Outside("dark seams cross the floor at every tile", _seams, _LIGHT, last=True),
    "nodding_sensor": Outside(
        "the reading falls as the robot speeds up, and rises as it brakes", _nod, _LIGHT, last=True
    ),
    "stretched_image": Outside("the camera's image is too wide and too low", _aspect, _POSE, last=True),
    "compass_deviation": Outside(
        "the heading is wrong by an amount that repeats as the robot turns round", _compass, _POSE, last=True
    ),
}
