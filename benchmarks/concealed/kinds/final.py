"""A third set of physics outside the catalogue, all of it for a last examination.

It was written by someone who had not read the tool that is examined, nor what it had been found to miss.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.kinds.outside import Drawn, Outside, same_in_all, some_phase, some_side, some_sign
from benchmarks.concealed.robot import NEUTRAL

_KNOTS = 32  # of a drive that wanders: 16 s, longer than a recording
_LASTS = 0.6  # share of a knot's deviation that is left at the next


@same_in_all
def _axle_rub(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Up to twice a gearbox's own friction [N m]; with more the robot could not take a wide bend."""
    torque = strength(rng, 0.005, 0.035, least)
    return {"axle_rub": torque}, {"torque_nm": torque}


@same_in_all
def _strip(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lay it where recordings start and line followers pass; torque [N m] for each wheel on it."""
    torque, width = strength(rng, 0.01, 0.06, least), float(rng.uniform(0.15, 0.40))
    x, angle = float(rng.uniform(0.9, 1.5)), float(rng.uniform(-0.5, 0.5))
    numbers = {"torque_nm": torque, "x_m": x, "width_m": width, "angle_rad": angle}
    return {"strip": (torque, x, width, angle)}, numbers


@same_in_all
def _reversal_pause(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Drivers of model cars wait so, and so do bridges of relays."""
    pause = strength(rng, 0.008, 0.06, least)
    return {"reversal_pause": pause}, {"seconds": pause}


@same_in_all
def _toe(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Lean one axle by two and a half to seven degrees: a LEGO axle in a worn hole has as much play."""
    angle, side = some_sign(rng) * math.radians(strength(rng, 2.5, 7.0, least)), some_side(rng)
    return {"toe": (angle, side)}, {"angle_rad": angle, "side": side}


@same_in_all
def _trailer(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Hang on a weight of 20 to 160 g that rubs with a coefficient of a half [N, m]."""
    force, length = strength(rng, 0.1, 0.8, least), float(rng.uniform(0.08, 0.30))
    return {"trailer": (force, length)}, {"force_n": force, "length_m": length}


@same_in_all
def _twist(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    stiffness = strength(rng, 0.002, 0.015, least)
    return {"twist": stiffness}, {"nm_per_rad": stiffness}


@same_in_all
def _keeper(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """LEGO's own firmware regulates speed by such a sum, if asked to; rate [1/s], and the most it adds."""
    rate, most = strength(rng, 0.2, 4.0, least), float(rng.uniform(0.08, 0.20))
    return {"keeper": (rate, most)}, {"rate_per_s": rate, "most_share": most}


def _wander(rng: Rng, runs: int, least: float) -> Drawn:
    """Draw another course of the drive in every recording, with a mean of nothing."""
    share, side = strength(rng, 0.02, 0.15, least), some_side(rng)

    def knots() -> tuple[float, ...]:
        drawn = rng.normal(size=_KNOTS)
        for k in range(1, _KNOTS):
            drawn[k] = _LASTS * drawn[k - 1] + math.sqrt(1.0 - _LASTS**2) * drawn[k]
        drawn = (drawn - drawn.mean()) / drawn.std()
        return tuple(float(knot) for knot in np.clip(share * drawn, -0.5, 0.5))

    return [replace(NEUTRAL, wander=(side, knots())) for _ in range(runs)], {"share": share, "side": side}


@same_in_all
def _shadow(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    loss, x = strength(rng, 0.10, 0.30, least), float(rng.uniform(0.7, 1.7))
    blur, way = float(rng.uniform(0.01, 0.05)), some_phase(rng)
    numbers = {"loss": loss, "x_m": x, "blur_m": blur, "way_rad": way}
    return {"shadow": (loss, x, blur, way)}, numbers


@same_in_all
def _marker(rng: Rng, least: float) -> tuple[dict[str, Any], dict[str, Any]]:
    away, way = strength(rng, 0.012, 0.05, least), some_phase(rng)
    ahead, left = away * math.cos(way), away * math.sin(way)
    return {"marker": (ahead, left)}, {"ahead_m": ahead, "left_m": left}


_LIGHT, _POSE = ("reflection_pct",), ("x_m", "y_m", "heading_deg")

FINAL: dict[str, Outside] = {
    "rubbing_axles": Outside(
        "the two axles rub on each other: a torque against unlike speeds", _axle_rub, last=True
    ),
    "sticky_strip": Outside("a strip of the floor holds each wheel that rolls on it", _strip, last=True),
    "reversal_pause": Outside(
        "a motor is given nothing for a while before it turns round", _reversal_pause, last=True
    ),
    "toed_wheel": Outside(
        "one wheel does not point ahead: the robot crabs, and scrubs", _toe, _POSE, last=True
    ),
    "dragged_weight": Outside("a weight on a string behind, which pulls only when taut", _trailer, last=True),
    "twisted_cable": Outside(
        "a cable from above winds up as the robot turns, and turns it back", _twist, last=True
    ),
    "speed_keeper": Outside(
        "the firmware adds up what each wheel's speed lacks, and drives by that", _keeper, last=True
    ),
    "worn_brushes": Outside("one motor's drive wanders by chance", _wander, last=True),
    "shadow_edge": Outside("part of the floor lies in a shadow", _shadow, _LIGHT, last=True),
    "marker_offset": Outside(
        "the camera sees a point other than the axle's centre", _marker, _POSE, last=True
    ),
}
