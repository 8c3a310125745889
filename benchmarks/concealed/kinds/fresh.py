"""A fifth set of physics outside the catalogue, for examinations by what nobody has met.

It was written by someone who had not read the tool that is examined, nor what it had been found to miss. Whoever works
on the tool had better not read it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.concealed.colour_sensor import FIELD
from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.kinds.outside import Drawn, Outside, same_in_all, some_phase, some_side, some_sign
from benchmarks.concealed.robot import NEUTRAL

_KNOTS = 32  # of a camera that shakes: 16 s, longer than a recording
_LASTS = 0.5  # share of a knot's deviation that is left at the next

# Drivetrain and tyres.


@same_in_all
def _hum(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Shake the frame at one rate of the gears, which takes power there only (Sommerfeld 1902)."""
    torque, at, width = (
        strength(rng, 0.002, 0.03, least),
        float(rng.uniform(4.0, 9.0)),
        float(rng.uniform(0.7, 2.0)),
    )
    side = some_side(rng)
    numbers = {"torque_nm": torque, "at_rad_s": at, "half_width_rad_s": width, "side": side}
    return {"hum": (torque, at, width, side)}, numbers


@same_in_all
def _scrub(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Turn tyres 28 mm wide on the spot: friction x load x a quarter of the width makes 0.016 N m each."""
    torque = strength(rng, 0.004, 0.05, least)
    return {"scrub": torque}, {"torque_nm": torque}


# Battery, motors' drivers, firmware.


@same_in_all
def _fuse(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Guard each motor by a polymer fuse, as the brick does: before it trips it adds a part to 5.5 ohm."""
    share, rated = strength(rng, 0.04, 0.6, least), float(rng.uniform(0.25, 0.5))
    time = float(rng.uniform(1.0, 4.0))
    numbers = {"resistance_share": share, "rated_a": rated, "time_s": time}
    return {"fuse": (share, rated, time)}, numbers


@same_in_all
def _throttle(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Give a peak, then hold with less, as drivers of valves and relays do to spare them."""
    share, after = strength(rng, 0.012, 0.2, least), float(rng.uniform(0.15, 0.45))
    return {"throttle": (share, after)}, {"share": share, "after_s": after}


@same_in_all
def _loose_cell(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Pull a cell off its spring in a curve: the contact's resistance eats up to two of six cells."""
    share, half = strength(rng, 0.025, 0.35, least), float(rng.uniform(0.1, 0.4))
    way = some_sign(rng)
    return {"loose_cell": (share, half, way)}, {"share": share, "half_at_m_s2": half, "turning": way}


# Air and floor.


def _fan(rng: Rng, runs: int, least: float) -> Drawn:
    """Let a desk fan swing; its 4 m/s, 1 m away, push a robot with 0.2 N, and one with a sheet of card with 1.5 N."""
    push, way, period = strength(rng, 0.12, 1.5, least), some_phase(rng), float(rng.uniform(3.0, 8.0))
    x, y = FIELD[0] / 2.0 + 1.6 * math.cos(way), FIELD[1] / 2.0 + 1.0 * math.sin(way)
    robots = [replace(NEUTRAL, fan=(x, y, push, period, some_phase(rng))) for _ in range(runs)]
    return robots, {"push_n": push, "x_m": x, "y_m": y, "period_s": period}


@same_in_all
def _rocking(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Shorten a leg of a table 0.8 m wide by 5 mm to 5 cm; its hinge passes where recordings start."""
    slope, x, way = strength(rng, 0.0065, 0.065, least), float(rng.uniform(0.9, 1.5)), some_phase(rng)
    play = float(rng.uniform(0.02, 0.10))
    numbers = {"slope_rad": slope, "hinge_x_m": x, "way_rad": way, "play_m": play}
    return {"rocking": (slope, x, way, play)}, numbers


@same_in_all
def _patches(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Spill and wear a floor: each spot of a few centimetres holds a wheel by chance, as a gearbox does at most."""
    torque, size = strength(rng, 0.002, 0.025, least), float(rng.uniform(0.03, 0.12))
    return {"patches": (torque, size, float(rng.integers(100)))}, {"torque_nm": torque, "size_m": size}


# The colour sensor and the print.


@same_in_all
def _warming(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Warm a red LED, which loses about 1 % of light a kelvin: by 3 to 35 K."""
    share, time = strength(rng, 0.03, 0.35, least), float(rng.uniform(1.5, 6.0))
    return {"warming": (share, time)}, {"share": share, "time_s": time}


@same_in_all
def _faded(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Wear the print where line followers pass: on the left side or the first half of the upper one."""
    lost, radius, way = (
        strength(rng, 0.15, 0.9, least),
        float(rng.uniform(0.15, 0.35)),
        float(rng.uniform(0.1, 1.2)),
    )
    x, y = (0.15, 0.60 + way) if way < 0.45 else (0.15 + way - 0.45, 1.05)
    return {"faded": (min(lost, 0.95), x, y, radius)}, {
        "ink_lost": lost,
        "x_m": x,
        "y_m": y,
        "radius_m": radius,
    }


# The camera.


def _shake(rng: Rng, runs: int, least: float) -> Drawn:
    """Hold the camera by hand: it wanders by chance, by 4 mm up to half a hand, and turns as it does."""
    shift = strength(rng, 0.004, 0.05, least)
    turn = shift * float(rng.uniform(0.3, 1.0))  # rad per metre

    def knots() -> tuple[tuple[float, float, float], ...]:
        drawn = rng.normal(size=(_KNOTS, 3))
        for k in range(1, _KNOTS):
            drawn[k] = _LASTS * drawn[k - 1] + math.sqrt(1.0 - _LASTS**2) * drawn[k]
        return tuple((float(x), float(y), float(way)) for x, y, way in drawn * np.array([shift, shift, turn]))

    return [replace(NEUTRAL, shake=knots()) for _ in range(runs)], {"shift_m": shift, "turn_rad": turn}


def _backlog(rng: Rng, runs: int, least: float) -> Drawn:
    """Fill a buffer of up to twelve frames, at 30 Hz, faster than it is read, and empty it at once when it is full."""
    most, period = strength(rng, 0.04, 0.4, least), float(rng.uniform(1.5, 5.0))
    robots = [replace(NEUTRAL, backlog=(most, period, float(rng.uniform()))) for _ in range(runs)]
    return robots, {"most_s": most, "period_s": period}


_LIGHT, _POSE = ("reflection_pct",), ("x_m", "y_m", "heading_deg")

FRESH: dict[str, Outside] = {
    "gear_resonance": Outside("one gear train takes a torque near one speed only", _hum, last=True),
    "tyre_scrub": Outside("wide tyres resist turning, however fast, and nothing else", _scrub, last=True),
    "resettable_fuses": Outside(
        "each motor's fuse warms with its current, cools slowly, and resists the more the warmer",
        _fuse,
        last=True,
    ),
    "throttled_holds": Outside(
        "the firmware lowers a duty that has not changed for a while", _throttle, last=True
    ),
    "loose_cell": Outside(
        "the battery's voltage falls in curves of one way, the more the tighter and faster",
        _loose_cell,
        last=True,
    ),
    "swinging_fan": Outside("a fan that swings to and fro blows the robot away", _fan, last=True),
    "rocking_table": Outside(
        "the table tips to the side where the robot is, when it has crossed a line", _rocking, last=True
    ),
    "patchy_floor": Outside(
        "the floor holds each wheel by chance, but the same at the same place", _patches, last=True
    ),
    "warming_lamp": Outside("the sensor's light fades as it warms up", _warming, _LIGHT, last=True),
    "faded_line": Outside("a stretch of the printed line is pale", _faded, _LIGHT, last=True),
    "shaken_camera": Outside("the camera is held by hand and wanders by chance", _shake, _POSE, last=True),
    "camera_backlog": Outside(
        "poses come ever later, until all that wait are thrown away at once", _backlog, _POSE, last=True
    ),
}
