"""Nuisance parameters of one recording, fitted with every model and never an effect: clock, mark, start and path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SensorPath:
    """The path along which a colour sensor was carried.

    Attributes
    ----------
    poses
        Of the axle's centre at every row, shape (rows, 3) [m, m, rad].
    late_s
        How late the camera's clock was taken to be when the path was made [s].
    blur_m
        Standard deviation of its positions [m]; an uncertain path sees edges blurred on average.
    reading_sd
        Standard deviation of each reading, the path's uncertainty included, shape (rows,) [%]; nan: not compared.
    """

    poses: Array
    late_s: float
    blur_m: float
    reading_sd: Array


@dataclass(frozen=True)
class Nuisances:
    """Nuisance parameters of one recording.

    Attributes
    ----------
    clock_offset_s
        How late the camera's clock is [s].
    mark
        Place of the camera's mark on the robot: ahead, left [m], turned [rad].
    start
        Start pose found from readings, where no camera looked [m, m, rad], shape (3,); None: not found, or not needed.
    bare_floor
        Rows at which a recording of unknown place read even floor, shape (rows,); None: not needed.
    path
        Along which readings are predicted; None: not made yet.
    """

    clock_offset_s: float = 0.0
    mark: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start: npt.NDArray[np.float64] | None = None
    bare_floor: npt.NDArray[np.bool_] | None = None
    path: SensorPath | None = None
