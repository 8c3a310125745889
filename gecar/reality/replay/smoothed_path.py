"""The path a robot was measured to take: camera poses smoothed with the help of a replay."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.replay.kernel import HEADING, X, Y
from gecar.reality.replay.replayer import Prediction, Replayer

Array = npt.NDArray[np.float64]
# Over this the difference between camera and replay is averaged: long against a frame, short against an error's growth.
SMOOTH_S = 0.12
REACH, FAR = 7.5, 1e-12  # normal weights beyond so many deviations are less than what all values weigh


def measured_path(replayer: Replayer, physics: npt.NDArray[Any]) -> Array:
    """Return the axle centre's pose at every row, shape (rows, 3) [m, m, rad], on the brick's clock.

    A following replay gives the shape between frames; what the camera says besides is smoothed forwards and backwards,
    so that the path neither lags nor carries the camera's noise, nor the errors that the robot's laws give it.
    """
    played = replayer.play(physics)
    path: Array = played.rows[:, [X, Y, HEADING]].copy()
    t = replayer.inputs.pose_t - late_s(replayer, physics)
    errors = camera_errors(replayer, physics, played)
    for k in range(3):
        seen = ~np.isnan(replayer.inputs.pose[:, k])
        replayed = np.interp(t[seen], replayer.t, path[:, k]) + errors[seen, k]
        path[:, k] += _smoothed(t[seen], replayer.inputs.pose[seen, k] - replayed, replayer.t)
    return path


def camera_errors(replayer: Replayer, physics: npt.NDArray[Any], played: Prediction) -> Array:
    """Return the camera's errors at every pose, of its scale and of a robot's laws, shape (poses, 3) [m, m, rad]."""
    if physics["n_terms"][0] == 0.0 and physics["pose_scale"][0] == 1.0:
        return np.zeros((len(replayer.inputs.pose_t), 3))
    t = replayer.inputs.pose_t - late_s(replayer, physics)
    path = played.rows[:, [X, Y, HEADING]]
    return played.poses - np.stack([np.interp(t, replayer.t, path[:, k]) for k in range(3)], axis=1)


def late_s(replayer: Replayer, physics: npt.NDArray[Any]) -> float:
    """Return how late the camera's poses are on the brick's clock [s]."""
    return float(physics["pose_delay"][0]) + replayer.clock_offset_s


def _smoothed(t: Array, values: Array, at: Array) -> Array:
    """Return values smoothed by local straight-line fits with normal weights, at times ``at``; times ``t`` increase.

    In a gap that is wider than those weights reach, all values count alike.
    """
    if len(t) < 2:
        return np.full(len(at), values.mean() if len(values) else 0.0)
    grid = np.arange(at[0], at[-1] + 0.02, 0.02)
    first, end = (np.searchsorted(t, grid + side * REACH * SMOOTH_S) for side in (-1.0, 1.0))
    near = first[:, None] + np.arange(max(int((end - first).max()), 1))
    there, near = near < end[:, None], np.minimum(near, len(t) - 1)
    reach = grid[:, None] - t[near]
    w = np.where(there, np.exp(-0.5 * (reach / SMOOTH_S) ** 2), 0.0)
    far = FAR * np.stack([np.ones(len(t)), values, t, t * values, t * t]).sum(axis=1)
    s0 = w.sum(1) + far[0]
    s1 = (w * reach).sum(1) + grid * far[0] - far[2]
    s2 = (w * reach**2).sum(1) + grid**2 * far[0] - 2.0 * grid * far[2] + far[4]
    v0 = (w * values[near]).sum(1) + far[1]
    v1 = (w * reach * values[near]).sum(1) + grid * far[1] - far[3]
    line = (v0 * s2 - v1 * s1) / (s0 * s2 - s1 * s1 + 1e-30)
    return np.interp(at, grid, line)
