"""A fourth set of physics outside the catalogue, for examinations by what nobody has met.

It was written by someone who had not read the tool that is examined, nor what it had been found to miss. Whoever works
on the tool had better not read it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.kinds.outside import Drawn, Outside, same_in_all, some_phase, some_side, some_sign
from benchmarks.concealed.robot import NEUTRAL

# Drivetrain, tyres, chassis, caster.


@same_in_all
def _gear_loss(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lose 2 % at each mesh of clean spur gears, or a half in three dry ones with grit (Merritt, Gears, 1954)."""
    share, side = strength(rng, 0.04, 0.6, least), some_side(rng)
    return {"gear_loss": (share, side)}, {"share": share, "side": side}


@same_in_all
def _grease(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Stiffen grease that stands, which shearing breaks down again (Barnes, Thixotropy - a review, 1997)."""
    torque, side = strength(rng, 0.006, 0.06, least), some_side(rng)
    rest, shear = float(rng.uniform(1.0, 5.0)), float(rng.uniform(4.0, 15.0))
    numbers = {"torque_nm": torque, "rest_s": rest, "shear_rad": shear, "side": side}
    return {"grease": (torque, rest, shear, side)}, numbers


@same_in_all
def _frame_rub(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Press a wheel on the frame by a turn's side force: LEGO axles slide a millimetre in their holes."""
    rub, way, side = strength(rng, 0.008, 0.12, least), some_sign(rng), some_side(rng)
    numbers = {"nm_s2_per_m": rub, "turning": way, "side": side}
    return {"frame_rub": (rub, way, side)}, numbers


@same_in_all
def _hair(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Jam the caster's ball with hair and threads off the floor; driving backward unwinds them."""
    force, way = strength(rng, 0.1, 1.5, least), float(rng.uniform(0.5, 2.0))
    return {"hair": (force, way)}, {"force_n": force, "way_m": way}


# Battery, motors' drivers, firmware.


@same_in_all
def _slow_sag(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Polarise six worn cells, behind a time constant of seconds (Chen and Rincon-Mora 2006)."""
    resistance, time = strength(rng, 0.4, 6.0, least), float(rng.uniform(1.0, 6.0))
    return {"slow_sag": (resistance, time)}, {"ohm": resistance, "time_s": time}


@same_in_all
def _holding(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """End moves by hold, as LEGO's firmware and Pybricks can besides brake and coast [share of supply per rad]."""
    gain = strength(rng, 0.02, 1.0, least)
    return {"holding": gain}, {"per_rad": gain}


def _latch(rng: Rng, runs: int, least: float) -> Drawn:
    """Take commands at 30 Hz down to 4, as remote programs over Bluetooth do; recordings begin anywhere between."""
    period = strength(rng, 0.03, 0.25, least)
    robots = [replace(NEUTRAL, latch=(period, float(rng.uniform()))) for _ in range(runs)]
    return robots, {"period_s": period}


# The colour sensor and its light.


@same_in_all
def _second_spot(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Let a shiny beam beside the sensor, or a lens off its seat, show it another place, too."""
    share, away, way = strength(rng, 0.04, 0.5, least), float(rng.uniform(0.012, 0.04)), some_phase(rng)
    ahead, left = away * math.cos(way), away * math.sin(way)
    return {"second_spot": (share, ahead, left)}, {"share": share, "ahead_m": ahead, "left_m": left}


@same_in_all
def _auto_gain(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Adapt to the light, as cameras and light meters do: exponent of the mean, and its time [s]."""
    power, time = strength(rng, 0.1, 1.0, least), float(rng.uniform(0.1, 0.8))
    return {"auto_gain": (power, time)}, {"power": power, "time_s": time}


# The camera and its clock.


@same_in_all
def _keystone(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tilt a camera 2 m above the floor by 2 to 25 degrees, its scale right in the middle only [1/m]."""
    size, way = strength(rng, 0.015, 0.23, least), some_phase(rng)
    return {"keystone": (size * math.cos(way), size * math.sin(way))}, {"per_m": size, "way_rad": way}


@same_in_all
def _frame_count(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Time poses by counting frames, at the rate printed on a camera that takes them faster."""
    rate = strength(rng, 0.004, 0.08, least)
    return {"frame_rate": rate}, {"rate": rate}


# The floor.


@same_in_all
def _grooves(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lay boards or ribbed rubber: a ball that bears 2.8 N rolls along a groove and is held back across it."""
    force, way = strength(rng, 0.08, 1.2, least), some_phase(rng)
    return {"grooves": (force, way)}, {"force_n": force, "heading_rad": way}


_LIGHT, _POSE = ("reflection_pct",), ("x_m", "y_m", "heading_deg")

UNMET: dict[str, Outside] = {
    "lossy_gears": Outside(
        "one gear train loses a share of the torque that it carries, driving or driven", _gear_loss, last=True
    ),
    "stiff_grease": Outside(
        "one gear's grease stiffens at rest and is worked soft by turning", _grease, last=True
    ),
    "frame_rub": Outside(
        "one wheel rubs on the frame in turns of one way, the more the faster", _frame_rub, last=True
    ),
    "wound_hair": Outside(
        "the caster drags more as it rolls ahead, and less as it rolls back", _hair, last=True
    ),
    "slow_sag": Outside(
        "the battery sags seconds after it is loaded, and recovers as slowly", _slow_sag, last=True
    ),
    "position_hold": Outside(
        "at duty 0 the firmware drives each motor back to where it was stopped", _holding, last=True
    ),
    "polled_commands": Outside("the firmware looks for new duties only now and then", _latch, last=True),
    "second_spot": Outside(
        "the sensor also sees another place on the floor", _second_spot, _LIGHT, last=True
    ),
    "auto_gain": Outside(
        "the sensor's gain follows the mean of what it has just seen", _auto_gain, _LIGHT, last=True
    ),
    "keystone": Outside(
        "the camera looks down askew: scale changes across the field", _keystone, _POSE, last=True
    ),
    "frame_count": Outside(
        "poses are timed by counted frames, and come ever later", _frame_count, _POSE, last=True
    ),
    "grooved_floor": Outside("grooves in the floor resist the caster across them", _grooves, last=True),
}
