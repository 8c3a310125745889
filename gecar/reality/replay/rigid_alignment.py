"""A path turned and carried onto the poses measured: its start pose is a nuisance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ITERATIONS = 3  # of Gauss-Newton, for the angle


def pose_errors(measured: Array, simulated: Array, sd: Array) -> Array:
    """Return measured less simulated poses, the latter moved and turned as a whole to fit best, shape (n, 3).

    Parameters
    ----------
    measured, simulated
        Poses [m, m, rad], shape (n, 3).
    sd
        Standard deviations of position and heading [m, rad], shape (2,).
    """
    arm = simulated[:, :2] - simulated[:, :2].mean(axis=0)
    seen = measured[:, :2] - measured[:, :2].mean(axis=0)
    ahead = measured[:, 2] - simulated[:, 2]
    turn = float(ahead.mean())
    for _ in range(ITERATIONS):
        cos, sin = np.cos(turn), np.sin(turn)
        turned = arm @ np.array([[cos, sin], [-sin, cos]])
        slope = np.column_stack([-turned[:, 1], turned[:, 0]])
        pull = np.sum((seen - turned) * slope) / sd[0] ** 2 + np.sum(ahead - turn) / sd[1] ** 2
        turn += pull / (np.sum(slope**2) / sd[0] ** 2 + len(ahead) / sd[1] ** 2)
    return np.column_stack([seen - turned, ahead - turn])
