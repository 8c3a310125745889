"""Nuisance parameters of one recording, fitted with every model and never an effect: clock, mark, start and path."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def in_blocks(values: Array, rows: int) -> Array:
    """Return values by row, shape (n, k), as (blocks, rows of a block, k); the last block is filled up with zeros."""
    count, columns = -(-len(values) // rows), values.shape[1]
    filled = np.pad(values, ((0, count * rows - len(values)), (0, 0)))
    return filled.reshape(count, rows, columns)


@dataclass(frozen=True)
class SensorPath:
    """The path along which a colour sensor was carried.

    Attributes
    ----------
    poses
        Of the axle's centre at every row, shape (rows, 3) [m, m, rad].
    late_s
        How late the camera's clock was taken to be when the path was made [s].
    blur_m, least_blur_m
        Standard deviation of its positions, with slow noise and without [m]; an uncertain path sees edges blurred on
        average.
    own_sd
        Standard deviation of each reading by itself: of the sensor, and of what the path's error changes from row to
        row, shape (rows,) [%]; nan: not compared.
    slopes
        What one standard deviation of the path's x, y and heading changes in each reading, shape (rows, 3) [%].
    block
        How many rows a path's error lasts.
    inflation
        By how much slow noise of x, y and heading exceeds white noise (variances), shape (3,).
    """

    poses: Array
    late_s: float
    blur_m: float
    least_blur_m: float
    own_sd: Array = field(default_factory=lambda: np.zeros(0))
    slopes: Array = field(default_factory=lambda: np.zeros((0, 3)))
    block: int = 1
    inflation: Array = field(default_factory=lambda: np.ones(3))

    @cached_property
    def reading_sd(self) -> Array:
        """Standard deviation of each reading, the path's uncertainty included, shape (rows,) [%]; nan: not compared."""
        return np.asarray(np.sqrt(self.own_sd**2 + np.sum(self.slopes**2, axis=1)))

    def whitened(self, errors: Array) -> Array:
        """Return errors of readings [%], shape (m, rows), in units of their noise, the path's error included.

        Over a block of rows the path is off by one place: an edge comes early or late, and is no wider for that. So
        errors of a block have the covariance 1 + G G', as with small changes (`gecar.reality.fitting.discrepancy`).
        """
        basis, shrinking = self._decomposed
        scaled = errors / self.own_sd
        inside = basis.transpose(0, 2, 1) @ in_blocks(np.nan_to_num(scaled).T, self.block)
        explained = basis @ (shrinking[:, :, None] * inside)
        by_row = explained.reshape(len(basis) * self.block, len(errors))
        return np.asarray(scaled - by_row[: errors.shape[1]].T)

    @cached_property
    def _decomposed(self) -> tuple[Array, Array]:
        """Singular vectors of each block's slopes, shape (blocks, rows, 3), and by how much each is shrunk."""
        slopes = np.nan_to_num(self.slopes / self.own_sd[:, None])
        basis, spread, _ = np.linalg.svd(in_blocks(slopes, self.block), full_matrices=False)
        return basis, 1.0 - 1.0 / np.sqrt(1.0 + spread**2)


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
