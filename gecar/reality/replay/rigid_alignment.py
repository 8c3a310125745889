"""A path turned and carried onto the poses measured: its start pose is a nuisance."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

Array = npt.NDArray[np.float64]

ITERATIONS = 3  # of Gauss-Newton, for the angle
SLID_OFF = 30.0  # standard deviations from which on an error hardly counts any more
_REACH = (0.01, 0.01, 0.05)  # m, m, rad: what starts are about uncertain by


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


def starting_at(path: Array, start: Array, began: Array | None = None) -> Array:
    """Return a path moved and turned as a whole so that it begins at another pose, shape (rows, 3).

    ``began`` is where it began, if not at its first pose.
    """
    pivot = path[0] if began is None else began
    turn = start[2] - pivot[2]
    cos, sin = math.cos(turn), math.sin(turn)
    arm = path[:, :2] - pivot[:2]
    there = arm @ np.array([[cos, sin], [-sin, cos]]) + start[:2]
    return np.column_stack([there, path[:, 2] + turn])


def moved_start(measured: Array, simulated: Array, sd: Array, start: Array) -> Array:
    """Return the start pose that brings a simulated path closest to the measured poses, shape (3,) [m, m, rad].

    The path goes along with its start as a whole. Slides far off must not tilt the start: an error e counts as
    tanh(e / `SLID_OFF`).

    Parameters
    ----------
    measured, simulated
        Poses [m, m, rad], shape (n, 3); of what was not measured, nan.
    sd
        Standard deviations of position and heading [m, rad], shape (2,).
    start
        Where the simulated path began, shape (3,) [m, m, rad].
    """
    seen = ~np.isnan(measured)
    scale = SLID_OFF * np.array([sd[0], sd[0], sd[1]])

    def misfit(z: Array) -> Array:
        path = starting_at(simulated, start + z * _REACH, start)
        return np.tanh(((measured - path) / scale)[seen])

    def slope(z: Array) -> Array:
        there = start + z * _REACH
        arm = starting_at(simulated, there, start) - there
        moves = np.tile(np.eye(3), (len(simulated), 1, 1))
        moves[:, 0, 2], moves[:, 1, 2] = -arm[:, 1], arm[:, 0]
        return -(1.0 - misfit(z) ** 2)[:, None] * (moves * _REACH / scale[:, None])[seen]

    return start + least_squares(misfit, np.zeros(3), slope, max_nfev=20).x * _REACH
