"""Dead reckoning of a differential drive: motion in the robot's own frame added up to a path.

Source: midpoint integration, Siegwart, Nourbakhsh, Scaramuzza, Introduction to Autonomous Mobile Robots (2nd ed.),
section 5.2.4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def integrated(ahead: Array, aside: Array, turn: Array, start: Sequence[float] | Array) -> Array:
    """Add up steps of motion to a path.

    Parameters
    ----------
    ahead, aside, turn
        Moves ahead and to the left [m], and turns [rad], from row to row, shape (rows - 1,).
    start
        First pose [m, m, rad], shape (3,).

    Returns
    -------
    numpy.ndarray
        Poses [m, m, rad], shape (rows, 3).
    """
    heading = start[2] + np.r_[0.0, np.cumsum(turn)]
    middle = heading[:-1] + 0.5 * turn
    x = start[0] + np.r_[0.0, np.cumsum(ahead * np.cos(middle) - aside * np.sin(middle))]
    y = start[1] + np.r_[0.0, np.cumsum(ahead * np.sin(middle) + aside * np.cos(middle))]
    return np.column_stack([x, y, heading])


def wheel_odometry(
    left_rad: Array,
    right_rad: Array,
    wheel_radius: float,
    track_width: float,
    start: Sequence[float] | Array = (0.0, 0.0, 0.0),
) -> Array:
    """Return the path that wheel angles alone tell, shape (rows, 3) [m, m, rad].

    Parameters
    ----------
    left_rad, right_rad
        Wheel angles without gaps [rad], shape (rows,).
    wheel_radius, track_width
        Of the robot [m].
    start
        First pose [m, m, rad], shape (3,).
    """
    left, right = (wheel_radius * np.diff(angle) for angle in (left_rad, right_rad))
    return integrated(0.5 * (left + right), np.zeros(len(left)), (right - left) / track_width, start)
