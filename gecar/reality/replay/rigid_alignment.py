"""A path turned and carried onto the poses measured: its start pose is a nuisance."""

from __future__ import annotations

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


def moved_start(measured: Array, simulated: Array, sd: Array, start: Array) -> Array:
    """Return the start pose with which a path, carried and turned along with it, fits best, shape (3,) [m, m, rad].

    Slides far off must not tilt the start: an error e counts as tanh(e / `SLID_OFF`).

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
    x, y = (simulated[:, :2] - start[:2]).T
    scale = SLID_OFF * np.array([sd[0], sd[0], sd[1]])

    def misfit(shift: Array) -> Array:
        ahead, aside, turn = shift * _REACH
        cos, sin = np.cos(turn), np.sin(turn)
        there = np.column_stack([x * cos - y * sin + ahead, x * sin + y * cos + aside, np.full(len(x), turn)])
        there[:, :2] += start[:2]
        there[:, 2] += simulated[:, 2]
        return np.tanh(((measured - there) / scale)[seen])

    def slope(shift: Array) -> Array:
        turn = shift[2] * _REACH[2]
        cos, sin = np.cos(turn), np.sin(turn)
        moves = np.zeros((*measured.shape, 3))
        moves[:, 0, 0] = moves[:, 1, 1] = moves[:, 2, 2] = 1.0
        moves[:, 0, 2], moves[:, 1, 2] = -x * sin - y * cos, x * cos - y * sin
        flat = (1.0 - misfit(shift) ** 2)[:, None]
        return -flat * (moves * _REACH / scale[:, None])[seen]

    found = least_squares(misfit, np.zeros(3), slope, max_nfev=20).x
    return start + found * _REACH
