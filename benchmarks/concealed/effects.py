"""Draw catalogue effects: which numbers of the robot change, and what the sealed label says about it.

Identifiers are the catalogue's; parameter names and units are those a verdict uses, so that the scorer can compare.
Strengths are log-uniform from about one and a half times the size worth a name (``discovery.md``) to strong.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.concealed.robot import NEUTRAL

Rng = np.random.Generator
Parameters = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Drawn:
    """One effect as drawn: fields of ``Concealed`` to replace, and the label's parameters."""

    changes: Mapping[str, Any]
    parameters: Parameters


@dataclass(frozen=True)
class Effect:
    """A row of the catalogue that this world can hold.

    Parameters
    ----------
    draw
        From randomness and the least strength, as a share of the log range, to an effect.
    group
        Effects of one group imitate each other; two concealed at once are taken from two groups.
    needs
        Columns without which the effect leaves no trace.
    """

    draw: Callable[[Rng, float], Drawn]
    group: str
    needs: tuple[str, ...] = ()


class Exactly(float):
    """A share of the log range to take as it is; less than 0 is weaker than the range's lower end."""


def strength(rng: Rng, low: float, high: float, least: float) -> float:
    """Draw log-uniformly between bounds, from a share ``least`` of the log range upwards, or ``Exactly`` there."""
    drawn = rng.random()
    share = float(least) if isinstance(least, Exactly) else least + (1.0 - least) * drawn
    return float(low * (high / low) ** share)


def value(number: float, unit: str) -> dict[str, Any]:
    """Write one parameter of a label."""
    return {"value": round(float(number), 7), "unit": unit}


def _sign(rng: Rng, share_positive: float = 0.5) -> float:
    return 1.0 if rng.random() < share_positive else -1.0


def _added(
    field: str, name: str, unit: str, low: float, high: float, *, neutral: float = 0.0, positive: float = 1.0
) -> Callable[[Rng, float], Drawn]:
    """Make a draw that adds a strength, of either sign, to one number."""

    def draw(rng: Rng, least: float) -> Drawn:
        number = neutral + _sign(rng, positive) * strength(rng, low, high, least)
        return Drawn({field: number}, {name: value(number, unit)})

    return draw


def _scaled(
    field: str, name: str, low: float, high: float, positive: float = 0.5
) -> Callable[[Rng, float], Drawn]:
    """Make a draw that multiplies or divides one number by 1 + strength."""

    def draw(rng: Rng, least: float) -> Drawn:
        number = (1.0 + strength(rng, low, high, least)) ** _sign(rng, positive)
        return Drawn({field: number}, {name: value(number, "-")})

    return draw


def _static_friction(rng: Rng, least: float) -> Drawn:
    extra, speed = strength(rng, 0.005, 0.05, least), strength(rng, 0.5, 4.0, 0.0)
    changes = {"static_friction": extra, "stribeck_speed": speed}
    return Drawn(changes, {"extra_torque_nm": value(extra, "N m"), "speed_rad_s": value(speed, "rad/s")})


def _friction_asymmetry(rng: Rng, least: float) -> Drawn:
    """Unequal friction or unequal drive, forward and backward, never both."""
    if rng.random() < 0.5:
        ratio = _sign(rng) * strength(rng, 0.12, 0.7, least)
        return Drawn({"friction_ratio": ratio}, {"friction_ratio": value(ratio, "-")})
    gain = _sign(rng) * strength(rng, 0.008, 0.12, least)
    return Drawn({"direction_gain": gain}, {"gain_ratio": value(gain, "-")})


def _dead_band(rng: Rng, least: float) -> Drawn:
    """Draw a dead zone (output starts at 0 at its edge) or, as often, a threshold (it starts at the edge's duty)."""
    threshold = rng.random() < 0.5
    band = strength(rng, 8.0, 30.0, least) if threshold else strength(rng, 1.5, 18.0, least)
    share = value(0.0 if threshold else 1.0, "-")
    changes = {"dead_band_pct": band, "dead_band_is_threshold": threshold}
    return Drawn(changes, {"duty_pct": value(band, "%"), "offset_share": share})


def _command_slew(rng: Rng, least: float) -> Drawn:
    rate = 1.0 / strength(rng, 1.0 / 1500.0, 1.0 / 120.0, least)
    return Drawn({"command_slew": rate}, {"rate_pct_s": value(rate, "%/s")})


def _torque_ripple(rng: Rng, least: float) -> Drawn:
    """Nothing ties the two motors' cogs together: each has its own phase."""
    size, cycles = strength(rng, 0.005, 0.05, least), int(rng.choice([1, 2, 3, 4, 6, 8, 12]))
    phases = tuple(float(phase) for phase in rng.uniform(-math.pi, math.pi, 2))
    changes = {"ripple_torque": size, "ripple_cycles": cycles, "ripple_phases": phases}
    return Drawn(changes, {"amplitude_nm": value(size, "N m"), "cycles_per_rev": value(cycles, "1/rev")})


def _speed_limit(rng: Rng, least: float) -> Drawn:
    limit = 1.0 / strength(rng, 1.0 / 13.0, 1.0 / 6.0, least)
    return Drawn({"speed_limit": limit}, {"speed_rad_s": value(limit, "rad/s")})


def _tyre_friction(rng: Rng, least: float) -> Drawn:
    grip = 1.0 / strength(rng, 1.0 / 0.7, 1.0 / 0.15, least)
    return Drawn({"tyre_friction": grip}, {"coefficient": value(grip, "-")})


def _slippery_patch(rng: Rng, least: float) -> Drawn:
    """Draw a disc among the places where open-loop recordings start."""
    x, y = float(rng.uniform(0.9, 1.5)), float(rng.uniform(0.45, 0.75))
    radius, grip = strength(rng, 0.10, 0.30, least), 1.0 / strength(rng, 1.0 / 0.35, 1.0 / 0.05, least)
    parameters = {"x_m": value(x, "m"), "y_m": value(y, "m"), "radius_m": value(radius, "m")}
    return Drawn({"patch": (x, y, radius, grip)}, {**parameters, "coefficient": value(grip, "-")})


def _point_drag(rng: Rng, least: float) -> Drawn:
    """Draw what hangs down as the kind `dragging_brush` does, which came first: beside the robot's middle."""
    force, ahead = strength(rng, 0.05, 0.5, least), float(rng.uniform(-0.09, 0.09))
    left = _sign(rng) * float(rng.uniform(0.04, 0.09))
    parameters = {
        "force_n": value(force, "N"),
        "left_m": value(left, "m"),
        "off_axle_m": value(abs(ahead), "m"),
    }
    return Drawn({"brush": (force, ahead, left)}, parameters)


def _floor_tilt(rng: Rng, least: float) -> Drawn:
    size, way = strength(rng, 0.008, 0.10, least), rng.uniform(-math.pi, math.pi)
    x, y = float(size * math.cos(way)), float(size * math.sin(way))
    return Drawn({"tilt": (x, y)}, {"x_rad": value(x, "rad"), "y_rad": value(y, "rad")})


def _load_transfer(rng: Rng, least: float) -> Drawn:
    """Lower, or higher but not so high that a hard stop throws the robot on its nose."""
    height = 0.050 - strength(rng, 0.015, 0.040, least) if rng.random() < 0.5 else 0.0
    height = height or 0.050 + strength(rng, 0.015, 0.035, least)
    return Drawn({"com_height": height}, {"height_m": value(height, "m")})


def _com_offset(rng: Rng, least: float) -> Drawn:
    """Further back, or a little forward; more, and a hard stop throws the robot on its nose."""
    forward = rng.random() < 0.3
    ahead = -0.0322 + (strength(rng, 0.005, 0.012, least) if forward else -strength(rng, 0.006, 0.035, least))
    return Drawn({"com_ahead": ahead}, {"ahead_m": value(ahead, "m")})


def _sensor_gain(rng: Rng, least: float) -> Drawn:
    """Draw a gain, an offset or both: white above 100 % is clipped, so gains below one are drawn more often."""
    which = rng.integers(3)
    gain = 1.0 + _sign(rng, 0.2) * strength(rng, 0.03, 0.30, least) if which != 1 else 1.0
    offset = _sign(rng, 0.3) * strength(rng, 1.5, 10.0, least) if which != 0 else 0.0
    if gain > 1.0 and offset > 0.0:
        offset = -offset
    changes = {"sensor_gain": gain, "sensor_offset_pct": offset}
    return Drawn(changes, {"gain": value(gain, "-"), "offset_pct": value(offset, "%")})


def _sensor_position(rng: Rng, least: float) -> Drawn:
    size, way = strength(rng, 0.0025, 0.025, least), rng.uniform(-math.pi, math.pi)
    ahead, left = float(0.081 + size * math.cos(way)), float(size * math.sin(way))
    changes = {"sensor_ahead": ahead, "sensor_left": left}
    return Drawn(changes, {"ahead_m": value(ahead, "m"), "left_m": value(left, "m")})


def _line_shift(rng: Rng, least: float) -> Drawn:
    size, way = strength(rng, 0.003, 0.025, least), rng.uniform(-math.pi, math.pi)
    dx, dy = float(size * math.cos(way)), float(size * math.sin(way))
    angle = _sign(rng) * strength(rng, 0.003, 0.015, least) if rng.random() < 0.5 else 0.0
    parameters = {"dx_m": value(dx, "m"), "dy_m": value(dy, "m"), "angle_rad": value(angle, "rad")}
    return Drawn({"line_shift": (dx, dy, angle)}, parameters)


# More than one number says how large they are, where a limit states one.
SEVERAL = (
    "dead_band", "floor_tilt", "friction_asymmetry", "line_shift", "point_drag", "sensor_gain", "sensor_position",
    "slippery_patch", "static_friction", "torque_ripple",
)  # fmt: skip


def at_size(effect: str, size: float, rng: Rng) -> Drawn:
    """Return an effect that differs from neutral by so much, on a side that is drawn.

    Parameters
    ----------
    effect
        None of `SEVERAL`.
    size
        Difference from neutral, or, of a limit that is infinite where it is neutral, that limit; in the label's unit.
    rng
        Source of randomness.
    """
    drawn = EFFECTS[effect].draw(rng, 0.0)
    (field, number), (label, about) = *drawn.changes.items(), *drawn.parameters.items()
    neutral = getattr(NEUTRAL, field)
    there = size if math.isinf(neutral) else neutral + math.copysign(size, number - neutral)
    if there <= 0.0 < neutral:  # neither friction nor a height is negative
        there = neutral + size
    return Drawn({field: there}, {label: value(there, about["unit"])})


def is_below(effect: str, parameters: Mapping[str, Mapping[str, float]], limit: float) -> bool:
    """Say whether an effect of a label, none of `SEVERAL`, is weaker than a limit that a verdict states."""
    ((field, _),) = EFFECTS[effect].draw(np.random.default_rng(0), 0.0).changes.items()
    neutral, (about,) = getattr(NEUTRAL, field), parameters.values()
    return about["value"] > limit if math.isinf(neutral) else abs(about["value"] - neutral) < limit


_POSE = ("x_m", "y_m", "heading_deg")
_LIGHT = ("reflection_pct",)

EFFECTS: dict[str, Effect] = {
    "coulomb_friction": Effect(
        _added("coulomb_friction", "torque_nm", "N m", 0.003, 0.04, neutral=0.0165), "dry"
    ),
    "viscous_friction": Effect(
        _added("viscous_friction", "coefficient_nms", "N m s/rad", 6e-4, 0.01), "top speed"
    ),
    "static_friction": Effect(_static_friction, "dry"),
    "friction_asymmetry": Effect(_friction_asymmetry, "direction"),
    "backlash": Effect(_added("backlash_deg", "angle_deg", "deg", 1.2, 10.0), "late"),
    "dead_band": Effect(_dead_band, "dry"),
    "rotor_inertia": Effect(_scaled("inertia_scale", "scale", 0.08, 0.6), "late"),
    "actuation_delay": Effect(_added("actuation_delay", "time_s", "s", 0.008, 0.12), "late"),
    "command_slew": Effect(_command_slew, "late"),
    "motor_gain_asymmetry": Effect(
        _added("gain_difference", "right_minus_left", "-", 0.008, 0.15, positive=0.5), "sides"
    ),
    "supply_voltage": Effect(_scaled("supply_scale", "scale", 0.01, 0.2, 0.3), "top speed"),
    "battery_resistance": Effect(_added("battery_resistance", "resistance_ohm", "ohm", 0.15, 2.5), "sag"),
    "battery_drain": Effect(_added("battery_drain", "rate_v_s", "V/s", 0.006, 0.12), "drain"),
    "torque_ripple": Effect(_torque_ripple, "ripple"),
    "speed_limit": Effect(_speed_limit, "top speed"),
    "wheel_radius": Effect(_scaled("radius_scale", "scale", 0.015, 0.10), "top speed", _POSE),
    "wheel_radius_difference": Effect(
        _added("radius_difference", "right_minus_left", "-", 0.008, 0.10, positive=0.5), "sides", _POSE
    ),
    "track_width": Effect(_scaled("track_scale", "scale", 0.015, 0.12), "track", _POSE),
    "yaw_inertia": Effect(_scaled("yaw_inertia_scale", "scale", 0.2, 1.5, 0.8), "late"),
    "tyre_friction": Effect(_tyre_friction, "grip", _POSE),
    "slippery_patch": Effect(_slippery_patch, "grip", _POSE),
    "caster_drag": Effect(_added("caster_friction", "coefficient", "-", 0.07, 0.8), "dry"),
    "point_drag": Effect(_point_drag, "dry"),
    "rolling_resistance": Effect(_added("rolling_resistance", "coefficient", "-", 0.015, 0.12), "dry"),
    "floor_tilt": Effect(_floor_tilt, "tilt"),
    "load_transfer": Effect(_load_transfer, "grip", _POSE),
    "com_offset": Effect(_com_offset, "grip", _POSE),
    "sensor_lag": Effect(_added("sensor_lag", "time_constant_s", "s", 0.008, 0.12), "sensor time", _LIGHT),
    "sensor_delay": Effect(_added("sensor_delay", "time_s", "s", 0.008, 0.10), "sensor time", _LIGHT),
    "sensor_gain": Effect(_sensor_gain, "sensor level", _LIGHT),
    "sensor_position": Effect(_sensor_position, "sensor place", _LIGHT),
    "spot_size": Effect(
        _added("spot_diameter", "diameter_m", "m", 0.003, 0.02, neutral=0.008), "sensor time", _LIGHT
    ),
    "line_shift": Effect(_line_shift, "sensor place", (*_LIGHT, *_POSE)),
    "clock_skew": Effect(_added("clock_skew", "rate", "-", 0.004, 0.05, positive=0.5), "top speed"),
    "pose_delay": Effect(_added("pose_delay", "time_s", "s", 0.008, 0.15), "pose time", _POSE),
}
# Those that plans draw from: had what came later joined the rest, no seed would draw what it drew before.
PLANNED = tuple(name for name in EFFECTS if name not in ("yaw_inertia", "point_drag"))
