"""Odometry: simulated motion, corrected by what the encoders counted beyond it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.recordings.dead_reckoning import integrated
from gecar.reality.replay.kernel import HEADING, X, Y
from gecar.reality.replay.replayer import Replayer

Array = npt.NDArray[np.float64]
SMOOTH_ROWS = 5  # whole degrees of an encoder are smoothed over so many rows


def odometry(replayer: Replayer, physics: npt.NDArray[Any]) -> Array:
    """Return the axle centre's pose at every row by dead reckoning, shape (rows, 3) [m, m, rad].

    Slip and the body's swing are simulated; what the encoders counted beyond the simulation is taken for rolling.
    """
    rows = replayer.open_loop().play(physics).rows
    p = physics[0]
    measured = replayer.measured[:, :2]
    rolled = np.column_stack([smoothed_rows(measured[:, k] - rows[:, k], replayer.t) for k in range(2)])
    radius = p["wheel_radius"] * p["radius_scale"]
    rolled = np.diff(rolled * radius * (1.0 + 0.5 * p["radius_difference"] * np.array([-1.0, 1.0])), axis=0)
    pose = rows[:, [X, Y, HEADING]]
    move = np.diff(pose, axis=0)
    middle = pose[:-1, 2] + 0.5 * move[:, 2]
    ahead = move[:, 0] * np.cos(middle) + move[:, 1] * np.sin(middle) + rolled.mean(axis=1)
    aside = move[:, 1] * np.cos(middle) - move[:, 0] * np.sin(middle)
    turn = move[:, 2] + (rolled[:, 1] - rolled[:, 0]) / (p["track_width"] * p["track_scale"])
    return integrated(ahead, aside, turn, pose[0])


def smoothed_rows(values: Array, t: Array) -> Array:
    """Return a running mean over `SMOOTH_ROWS`, gaps filled straight; 0 where nothing was measured."""
    there = ~np.isnan(values)
    if there.sum() < 2:
        return np.zeros(len(values))
    filled = np.interp(t, t[there], values[there])
    ones = np.ones(SMOOTH_ROWS)
    out: Array = np.convolve(filled, ones, "same") / np.convolve(np.ones(len(filled)), ones, "same")
    return out
