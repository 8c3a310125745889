"""What every world gives back: one run at 1 kHz, free of noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Pose = tuple[float, float, float]
Controller = Callable[[float, int], "tuple[int, int] | None"]

TICK_S = 0.001  # every world's firmware and sensors act at 1 kHz
ROW_TICKS = 10  # a row of the recording, and a turn of the controller, every 10 ms


class ToppledError(ValueError):
    """The robot fell over: no recording of a drive."""


@dataclass(frozen=True)
class History:
    """One run at 1 kHz: times [s], what was commanded, and what was.

    ``commands`` (n, 2) [%]; ``angles`` (n, 2), motor side [rad]; ``pose`` (n, 3) of the axle's centre [m, m, rad],
    heading unwrapped; ``light`` (n,) [%] before noise; ``readings`` (n,) integers [%]; ``terminal_v`` (n,);
    ``yaw_rate`` (n,) [rad/s].
    """

    time_s: Array
    commands: Array
    angles: Array
    pose: Array
    light: Array
    readings: Array
    terminal_v: Array
    yaw_rate: Array

    @classmethod
    def blank(cls, count: int) -> History:
        """Make room for so many ticks."""
        one, two, three = np.zeros(count), np.zeros((count, 2)), np.zeros((count, 3))
        time_s: Array = np.arange(count, dtype=np.float64) * TICK_S
        return cls(time_s, two, two.copy(), three, one, one.copy(), one.copy(), one.copy())

    def until(self, count: int) -> History:
        """Cut off everything from tick ``count`` on."""
        return History(**{name: array[:count] for name, array in vars(self).items()})


def replayed(commands: Array, row_ticks: int = ROW_TICKS) -> Controller:
    """Make a controller that gives recorded commands again, one row after the other, whatever the sensor says.

    Parameters
    ----------
    commands
        Left and right duty per row (n, 2) [%].
    row_ticks
        Ticks from row to row.

    Returns
    -------
    Controller
    """
    rows = [(int(left), int(right)) for left, right in commands]
    last = len(rows) - 1
    return lambda time_s, _: rows[min(round(time_s / (TICK_S * row_ticks)), last)]
