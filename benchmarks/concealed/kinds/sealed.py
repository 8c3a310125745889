"""A second set of physics outside the catalogue: what real robots suffer. Half of it waits for the last examination."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.kinds.outside import Drawn, Outside, same_in_all, some_phase, some_side, some_sign
from benchmarks.concealed.robot import NEUTRAL


@same_in_all
def _heat(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Copper gains 0.39 % of resistance a kelvin: 5 to 80 K."""
    share, time_s, side = strength(rng, 0.02, 0.30, least), float(rng.uniform(2.0, 8.0)), some_side(rng)
    return {"heat": (share, time_s, side)}, {"resistance_share": share, "time_s": time_s, "side": side}


@same_in_all
def _loosening(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    rate, side = strength(rng, 0.15, 3.0, least), some_side(rng)
    return {"loosening": (math.radians(rate), side)}, {"deg_per_s": rate, "side": side}


@same_in_all
def _duty_steps(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    step = strength(rng, 3.0, 15.0, least)
    return {"duty_step_pct": step}, {"step_pct": step}


@same_in_all
def _shared_drop(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    share = strength(rng, 0.01, 0.15, least)
    return {"shared_drop": share}, {"share": share}


@same_in_all
def _current_limit(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    limit = 1.0 / strength(rng, 1.0 / 1.2, 1.0 / 0.25, least)
    return {"current_limit": limit}, {"limit_a": limit}


@same_in_all
def _dust(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Grip left: 40 % of 0.9 down to 6 %."""
    left, way = 1.0 / strength(rng, 1.0 / 0.4, 1.0 / 0.06, least), float(rng.uniform(0.5, 1.5))
    return {"dust": (max(1.0 - left, 0.01), way)}, {"grip_left": left, "way_m": way}


@same_in_all
def _pile(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    force, way = strength(rng, 0.1, 1.0, least), some_phase(rng)
    return {"pile": (force, way)}, {"force_n": force, "heading_rad": way}


@same_in_all
def _yaw_pull(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    torque = some_sign(rng) * strength(rng, 0.002, 0.03, least)
    return {"yaw_pull": torque}, {"torque_nm": torque}


def _camera_bump(rng: Rng, runs: int, least: float) -> Drawn:
    """Draw a bump of the same kind in every recording, at its own time."""
    size, turn = strength(rng, 0.003, 0.03, least), some_sign(rng) * strength(rng, 0.003, 0.02, least)
    robots = []
    for _ in range(runs):
        way = some_phase(rng)
        bump = (float(rng.uniform(2.0, 10.0)), size * math.cos(way), size * math.sin(way), turn)
        robots.append(replace(NEUTRAL, camera_bump=bump))
    return robots, {"shift_m": size, "turn_rad": turn}


@same_in_all
def _flicker(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    share, hertz = strength(rng, 0.02, 0.3, least), float(rng.uniform(0.6, 1.6))
    return {"flicker": (share, hertz, some_phase(rng))}, {"share": share, "hz": hertz}


@same_in_all
def _tooth(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    torque, width = strength(rng, 0.03, 0.3, least), float(rng.uniform(0.15, 0.5))
    side = some_side(rng)
    changes = {"tooth": (torque, width, side, some_phase(rng) + math.pi)}
    return changes, {"torque_nm": torque, "width_rad": width, "side": side}


@same_in_all
def _sway(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Softer mounts swing further: 12 mm per m/s^2 at 1.5 Hz, 0.4 mm at 8 Hz."""
    hertz = 1.0 / strength(rng, 1.0 / 8.0, 1.0 / 1.5, least)
    return {"sway": (hertz, float(rng.uniform(0.1, 0.4)))}, {"hz": hertz}


@same_in_all
def _hop(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    left, fast = 1.0 / strength(rng, 1.0 / 0.5, 1.0 / 0.02, least), float(rng.uniform(3.0, 6.0))
    side = some_side(rng)
    return {"hop": (max(1.0 - left, 0.01), fast, side)}, {"grip_left": left, "from_rad_s": fast, "side": side}


@same_in_all
def _coasting(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    share = min(strength(rng, 0.1, 1.0, least), 1.0)
    return {"coasting": share}, {"share": share}


@same_in_all
def _swivel(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    force, trail = strength(rng, 0.05, 0.8, least), float(rng.uniform(0.008, 0.02))
    return {"swivel": (force, trail)}, {"force_n": force, "trail_m": trail}


@same_in_all
def _rubber_band(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    stiffness, side = strength(rng, 0.0003, 0.006, least), some_side(rng)
    return {"rubber_band": (stiffness, side)}, {"nm_per_rad": stiffness, "side": side}


_LIGHT, _POSE = ("reflection_pct",), ("x_m", "y_m", "heading_deg")

SEALED: dict[str, Outside] = {
    "motor_heat": Outside("one motor grows weaker as it warms up", _heat),
    "loosening_wheel": Outside("one wheel comes loose: play that grows with time", _loosening),
    "duty_steps": Outside("duties are rounded to coarse steps", _duty_steps),
    "shared_drop": Outside("each motor is weaker while the other is driven, too", _shared_drop),
    "current_limit": Outside("the driver limits each motor's current", _current_limit),
    "dusty_tyres": Outside("grip is lost along the way", _dust, _POSE),
    "carpet_pile": Outside("the floor resists in one direction more than in the other", _pile),
    "yaw_pull": Outside("a drawn-in cable turns the robot one way", _yaw_pull),
    "camera_bump": Outside("the camera is knocked in the middle of each recording", _camera_bump, _POSE),
    "flicker": Outside("the light waxes and wanes about once a second", _flicker, _LIGHT),
    "damaged_tooth": Outside("a gear sticks at one angle of each turn", _tooth, last=True),
    "swinging_sensor": Outside(
        "the sensor's mount swings as the robot accelerates", _sway, _LIGHT, last=True
    ),
    "hopping_wheel": Outside("one wheel loses grip half of each turn when fast", _hop, _POSE, last=True),
    "coasting": Outside("at duty 0 the motors brake less than when shorted", _coasting, last=True),
    "swivel_caster": Outside(
        "a castor wheel instead of a ball: it must turn round first", _swivel, last=True
    ),
    "rubber_band": Outside("a rubber band round one axle winds up", _rubber_band, last=True),
}
