"""Where an encoder counts from: a simulation from the recording's start, a robot from when it was switched on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.recordings.columns import Series

# A command acts from the log's zero where its first row comes at most this much later.
LATEST_FIRST_ROW_S = 0.1
# An EV3 large motor turns at most 1050 deg/s at 9 V (Pybricks motor data); half as much again is a jump.
FASTEST_DPS = 1600.0
_QUANTUM_DEG = 2.0  # an encoder of whole degrees, and its jitter
_FIRST_ROWS = 5  # to tell a wheel's first speed by


def encoder_zero(t_s: Series, angle_deg: Series) -> float:
    """Return the angle an encoder showed when the recording began [deg].

    It is 0 where the first sample is as small as a wheel that started from rest with the recording has turned by
    then: the first row may come a little after the first command, and an encoder's after the recording's.

    Parameters
    ----------
    t_s, angle_deg
        Times and angles, shape (rows,) [s, deg]; NaN where there is no sample.
    """
    seen = np.flatnonzero(~np.isnan(angle_deg))
    if len(seen) < 2:
        return 0.0
    first = float(angle_deg[seen[0]])
    if abs(first) <= _QUANTUM_DEG + _speed(t_s, angle_deg, seen) * _since(t_s, seen[0]):
        return 0.0
    return first


def _since(t_s: Series, row: int | np.intp) -> float:
    """Return how long before a row the recording began [s]."""
    begin = 0.0 if 0.0 < t_s[0] <= LATEST_FIRST_ROW_S else t_s[0]
    return float(t_s[row] - begin)


def _speed(t_s: Series, angle_deg: Series, seen: npt.NDArray[np.intp]) -> float:
    """Return how fast a wheel that started from rest can have turned before its first sample [deg/s]."""
    if seen[0] > 0:
        return FASTEST_DPS
    last = seen[min(len(seen), _FIRST_ROWS) - 1]
    return abs(float(angle_deg[last] - angle_deg[seen[0]])) / float(t_s[last] - t_s[seen[0]])
