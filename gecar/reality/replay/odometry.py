"""The path a robot took by its own account: simulated motion, corrected by what the wheels were measured to turn."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.replay.kernel import HEADING, X, Y
from gecar.reality.replay.replayer import Film

Array = npt.NDArray[np.float64]
SMOOTH_ROWS = 5  # whole degrees of an encoder are smoothed over so many rows


def odometry(film: Film, physics: npt.NDArray[Any]) -> Array:
    """Return the axle centre's pose at every row by dead reckoning, shape (rows, 3) [m, m, rad].

    What slides and swings is simulated; what the encoders counted besides rolls. It begins where the film starts.

    Source: midpoint dead reckoning of a differential drive, Siegwart, Nourbakhsh, Scaramuzza, Introduction to
    Autonomous Mobile Robots (2nd ed.), section 5.2.4.
    """
    rows = film.open_loop().play(physics)[0]
    p = physics[0]
    measured = film.reel.measured[len(film.reel.t) - len(film.t) :, :2]
    rolled = np.column_stack([_smoothed(measured[:, k] - rows[:, k], film.t) for k in range(2)])
    radius = p["wheel_radius"] * p["radius_scale"]
    rolled = np.diff(rolled * radius * (1.0 + 0.5 * p["radius_difference"] * np.array([-1.0, 1.0])), axis=0)
    pose = rows[:, [X, Y, HEADING]]
    move = np.diff(pose, axis=0)
    middle = pose[:-1, 2] + 0.5 * move[:, 2]
    ahead = move[:, 0] * np.cos(middle) + move[:, 1] * np.sin(middle) + rolled.mean(axis=1)
    aside = move[:, 1] * np.cos(middle) - move[:, 0] * np.sin(middle)
    turn = move[:, 2] + (rolled[:, 1] - rolled[:, 0]) / (p["track_width"] * p["track_scale"])
    heading = pose[0, 2] + np.r_[0.0, np.cumsum(turn)]
    middle = heading[:-1] + 0.5 * turn
    x = pose[0, 0] + np.r_[0.0, np.cumsum(ahead * np.cos(middle) - aside * np.sin(middle))]
    y = pose[0, 1] + np.r_[0.0, np.cumsum(ahead * np.sin(middle) + aside * np.cos(middle))]
    return np.column_stack([x, y, heading])


def _smoothed(values: Array, t: Array) -> Array:
    """Return a running mean over `SMOOTH_ROWS`, gaps filled straight; 0 where nothing was measured."""
    there = ~np.isnan(values)
    if there.sum() < 2:
        return np.zeros(len(values))
    filled = np.interp(t, t[there], values[there])
    ones = np.ones(SMOOTH_ROWS)
    out: Array = np.convolve(filled, ones, "same") / np.convolve(np.ones(len(filled)), ones, "same")
    return out
