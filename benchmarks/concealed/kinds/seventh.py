"""A seventh set of physics outside the catalogue, for examinations by what nobody has met.

It was written by someone who had not read the tool that is examined, nor what it had been found to miss.
Whoever works on the tool had better not read it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.kinds.outside import Drawn, Outside, same_in_all, some_phase, some_side, some_sign
from benchmarks.concealed.robot import NEUTRAL

# Firmware and motors' drivers.


@same_in_all
def _overrun(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Chop by a bridge's enable pin, as is usual with ST's L298: while it is off, a motor coasts.

    With mixed decay (TI's DRV8833) a part of the time is left to brake in.
    """
    share = min(strength(rng, 0.08, 1.0, least), 1.0)
    return {"overrun": share}, {"share": share}


@same_in_all
def _motor_sync(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Synchronise motors, as LEGO's firmware can (opOutput_Step_Sync) [share of supply per rad].

    With 0.005 per rad a lead is halved in 7 s, with 0.7 it is gone within a third of a second.
    """
    gain = strength(rng, 0.005, 0.7, least)
    return {"motor_sync": gain}, {"per_rad": gain}


@same_in_all
def _sticky(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Ignore small changes, as remote controls do lest noise on a stick shake what they drive: 5 to 30 %."""
    step = strength(rng, 5.0, 30.0, least)
    return {"sticky_pct": step}, {"least_change_pct": step}


@same_in_all
def _budget(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Share a power that does not suffice for two motors: full duty is 0.8 each."""
    budget = 1.0 / strength(rng, 1.0 / 1.55, 1.0 / 0.7, least)
    return {"duty_budget": budget}, {"both_duties": budget}


# Body, tyres, floor.


@same_in_all
def _brush(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Hang a pen or a brush beside the robot: 4 to 100 g that rub with a coefficient of a half."""
    force, left = strength(rng, 0.02, 0.5, least), some_sign(rng) * float(rng.uniform(0.04, 0.09))
    ahead = float(rng.uniform(-0.09, 0.09))
    return {"brush": (force, ahead, left)}, {"force_n": force, "ahead_m": ahead, "left_m": left}


@same_in_all
def _curl(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lay out a mat that was rolled up: its edges stand up by half of slope x width, 2 mm to 5 cm."""
    slope, wide = strength(rng, 0.01, 0.25, least), float(rng.uniform(0.25, 0.45))
    return {"curl": (slope, wide)}, {"slope_rad": slope, "width_m": wide}


@same_in_all
def _leak(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Let one tyre's air out: its radius of 28 mm falls by 0.3 to 3.4 mm, and the rim's is 15 mm."""
    lost, time, side = strength(rng, 0.01, 0.12, least), float(rng.uniform(2.0, 8.0)), some_side(rng)
    return {"leak": (lost, time, side)}, {"share_at_last": lost, "time_s": time, "side": side}


def _turret(rng: Rng, runs: int, least: float) -> Drawn:
    """Swing an arm: 100 g at 15 cm, by 1 rad once in 2 s, take 0.022 N m; 300 g at 20 cm take 0.12."""
    torque, period = strength(rng, 0.012, 0.12, least), float(rng.uniform(1.2, 3.5))
    robots = [replace(NEUTRAL, turret=(torque, period, some_phase(rng))) for _ in range(runs)]
    return robots, {"torque_nm": torque, "period_s": period}


# The colour sensor and the line.


@same_in_all
def _line_wider(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lay another tape than 25 mm: they come 19, 30 and 38 mm wide; ink that runs adds a millimetre."""
    wider = some_sign(rng) * strength(rng, 0.001, 0.010, least)
    return {"line_wider": wider}, {"wider_m": wider}


@same_in_all
def _speed_lift(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Shake the sensor up as the robot goes fast: at 0.3 m/s it is higher by a fifth of a millimetre up to 2.

    Light falls with the sensor's height, by a tenth or more per millimetre (an inverse square at 10 mm
    gives a fifth).
    """
    lost = strength(rng, 0.10, 1.2, least)
    return {"speed_lift": lost}, {"s_per_m": lost}


# What sees the pose.


@same_in_all
def _stitch(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Watch the field by two cameras whose pictures are fitted together by hand, to 5 mm or worse."""
    shift, way, x = strength(rng, 0.005, 0.05, least), some_phase(rng), float(rng.uniform(1.05, 1.35))
    turn = some_sign(rng) * shift * float(rng.uniform(0.3, 1.0))  # what is off by that much a metre away
    larger = some_sign(rng) * shift * float(rng.uniform(0.3, 1.0))
    numbers = {"x_m": x, "shift_m": shift, "way_rad": way, "turn_rad": turn, "larger": larger}
    return {"stitch": (x, shift * math.cos(way), shift * math.sin(way), turn, larger)}, numbers


@same_in_all
def _predictor(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Make up for a camera's latency by constant velocity, as trackers do: 1 to 10 frames at 30 Hz."""
    ahead, mean = strength(rng, 0.03, 0.35, least), float(rng.uniform(0.03, 0.15))
    return {"predictor": (ahead, mean)}, {"ahead_s": ahead, "mean_s": mean}


_LIGHT, _POSE = ("reflection_pct",), ("x_m", "y_m", "heading_deg")

SEVENTH: dict[str, Outside] = {
    "overrunning_motors": Outside(
        "a motor that is faster than its duty asks for is not braked, but at duty 0 it is",
        _overrun,
        last=True,
    ),
    "synchronised_motors": Outside(
        "given the same duty, the motor that gets ahead is held back, and the other helped",
        _motor_sync,
        last=True,
    ),
    "sticky_duties": Outside("a new duty acts only if it differs enough from the last", _sticky, last=True),
    "shared_budget": Outside(
        "both duties are scaled down where they add up to more than there is", _budget, last=True
    ),
    "dragging_brush": Outside(
        "something rubs on the floor beside the robot, and turns it to that side", _brush, last=True
    ),
    "curled_mat": Outside("the floor rises towards its edges, and is flat inside", _curl, last=True),
    "leaking_tyre": Outside("one wheel grows smaller with time", _leak, _POSE, last=True),
    "swinging_turret": Outside(
        "something on the robot swings by the clock, and turns it to and fro", _turret, last=True
    ),
    "tape_width": Outside("the line is wider or narrower than drawn", _line_wider, _LIGHT, last=True),
    "shaken_sensor": Outside(
        "the reading falls with the speed, ahead or back alike", _speed_lift, _LIGHT, last=True
    ),
    "stitched_cameras": Outside(
        "beyond a line across the field poses are shifted, turned and stretched", _stitch, _POSE, last=True
    ),
    "predicting_tracker": Outside(
        "poses are extrapolated from earlier ones: they overshoot when the robot's speed changes",
        _predictor,
        _POSE,
        last=True,
    ),
}
