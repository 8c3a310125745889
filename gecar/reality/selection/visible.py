"""Which effects of the catalogue a set of recordings can show at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gecar.reality.residuals.of_recording import Strip
from gecar.world.effects import CATALOGUE
from gecar.world.motor import FULL_DUTY

SIGHT = ("sensor_lag", "sensor_delay", "sensor_gain", "sensor_position", "spot_size", "line_shift")
_MOTION = tuple(e.id for e in CATALOGUE if e.id not in SIGHT)
# What a bench can not show: nothing touches the floor, and no camera looks.
_FLOOR_ONLY = frozenset(
    [
        "wheel_radius",
        "wheel_radius_difference",
        "track_width",
        "tyre_friction",
        "slippery_patch",
        "caster_drag",
        "rolling_resistance",
        "floor_tilt",
        "load_transfer",
        "com_offset",
        "backlash",
        "pose_delay",
    ]
)


def visible(strips: Sequence[Strip]) -> tuple[str, ...]:
    """Return the effects of motion these recordings can show at all."""
    recordings = [s.recording for s in strips]
    hidden: set[str] = set()
    if all(r.setup.rig == "bench" for r in recordings):
        hidden |= _FLOOR_ONLY
    if all(np.isnan(r.left_duty).all() or np.isnan(r.right_duty).all() for r in recordings):
        hidden |= {"motor_gain_asymmetry"}
    duties = np.concatenate([r.commands.ravel() for r in recordings])
    if duties.min() >= 0.0 or duties.max() <= 0.0:
        hidden |= {"friction_asymmetry"}
    if np.abs(duties).max() < FULL_DUTY:
        hidden |= {"full_duty"}
    if not any(len(s.film.reel.pose_t) for s in strips):
        hidden |= {"pose_delay", "slippery_patch"}
    return tuple(e for e in _MOTION if e not in hidden)


def visible_to_sight(strips: Sequence[Strip]) -> tuple[str, ...]:
    """Return the effects of sensor and course that readings along these recordings' paths can show.

    Where a start was found from the readings themselves, a shifted line is another start.
    """
    seen = any(s.looks and len(s.film.reel.pose_t) for s in strips)
    return SIGHT if seen else tuple(e for e in SIGHT if e != "line_shift")
