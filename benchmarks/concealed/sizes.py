"""How far apart two worlds drive, in units people know."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from benchmarks.concealed.history import Array
from benchmarks.concealed.recording import CHANNELS, POSE
from benchmarks.concealed.robot import NEUTRAL

_POSE_AT = [CHANNELS.index(name) for name in POSE]
_LIGHT_AT = CHANNELS.index("reflection_pct")
NAMES = ("mm_1m", "deg_1m", "mm_drive", "deg_drive", "reading_pct")
# From here on what is concealed matters to somebody who drives a course.
MATERIAL = {"mm_1m": 10.0, "deg_1m": 2.0, "reading_pct": 3.0}
# How well a course, a camera and a sensor are set up. At a line's edge, 8 mm wide, a third of a millimetre already
# changes a reading by 3 %; a robot that follows it drives as far aside as that.
FAR_M = 0.003
_PLACES = {
    "sensor_position": {"ahead_m": NEUTRAL.sensor_ahead, "left_m": NEUTRAL.sensor_left},
    "line_shift": {"dx_m": 0.0, "dy_m": 0.0},
}


def size(pairs: Iterable[tuple[Array, Array]], repeatedly: bool = False) -> dict[str, float]:
    """Compare the recorded channels of two worlds that were given the same commands.

    Parameters
    ----------
    pairs
        For every recording, noise-free channels (rows, channels) with and without what is concealed.
    repeatedly
        Whether one recording in four must reach a size, and two at least where there are two. Where tyres slip over an
        edge, worlds part whatever differs: a rotor lighter by 0.007 % once turned a robot by 19 degrees in a metre.

    Returns
    -------
    dict[str, float]
        The largest over the recordings, or that which they reach repeatedly: distance of the axle's centre [mm] and of
        the heading [deg] after the first metre of the way (``mm_1m``, ``deg_1m``; 0 where none is that long) and at the
        end (``mm_drive``, ``deg_drive``), both counted from the start; root mean square of the reflection's difference
        along the same path (``reading_pct``).
    """
    each = [_apart(there, absent) for there, absent in pairs]
    rank = min(max(2, math.ceil(len(each) / 4)), len(each)) if repeatedly else 1
    return {name: round(sorted(one[name] for one in each)[-rank], 3) for name in NAMES}


def _apart(there: Array, absent: Array) -> dict[str, float]:
    """Return how far apart a recording of two worlds is."""
    here, other = _from_start(there[:, _POSE_AT]), _from_start(absent[:, _POSE_AT])
    apart, turned = 1e3 * np.hypot(*(here - other)[:, :2].T), np.abs(here - other)[:, 2]
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(other[:, :2], axis=0).T))])
    light = np.clip(there[:, _LIGHT_AT], 0.0, 100.0) - np.clip(absent[:, _LIGHT_AT], 0.0, 100.0)
    metre = int(np.searchsorted(way, 1.0)) if way[-1] >= 1.0 else 0  # where worlds are together
    found = apart[metre], turned[metre], apart[-1], turned[-1], np.sqrt(np.mean(light**2))
    return dict(zip(NAMES, map(float, found), strict=True))


def sizes_in(label: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Return the sizes by which it is judged what is material; labels of old have the largest alone."""
    found: dict[str, dict[str, float]] = label.get("size_repeatedly") or label.get("size") or {}
    return found


def is_material(sizes: Mapping[str, float]) -> bool:
    """Say whether a difference matters to somebody who drives a course."""
    return any(sizes[name] >= least for name, least in MATERIAL.items())


def is_far(thing: Mapping[str, Any]) -> bool:
    """Say whether a place that a label states is farther off than it is set up; of other things it is true."""
    nominal = _PLACES.get(thing["id"])
    if nominal is None:
        return True
    return math.hypot(*(thing["parameters"][name]["value"] - at for name, at in nominal.items())) >= FAR_M


def _from_start(pose: Array) -> Array:
    """Pose [m, m, deg] counted from where, and how, the recording begins."""
    turn = np.radians(pose[0, 2])
    arm = pose[:, :2] - pose[0, :2]
    ahead = np.cos(turn) * arm[:, 0] + np.sin(turn) * arm[:, 1]
    left = np.cos(turn) * arm[:, 1] - np.sin(turn) * arm[:, 0]
    return np.column_stack([ahead, left, pose[:, 2] - pose[0, 2]])
