"""The conditions of a drive: what may differ between two drives of one program on one course."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.world.kernel.dynamics import is_plain
from gecar.world.kernel.state import DERIVED, derive


class Conditions(NamedTuple):
    """Conditions of n drives, one a row.

    Attributes
    ----------
    physics, derived
        Constants and effects of the robot, dtypes `PHYSICS` and `DERIVED`, shape (n,); the step is ``derived.dt``.
    plain
        Whether the robot differs from the nominal one in constants alone; see `gecar.world.kernel.dynamics.is_plain`.
    start
        Pose of the axle's centre [m, m, rad], shape (n, 3).
    phase_ms
        When the program begins [ms].
    limit, patience
        Steps until the time is out, and until a drive that reaches no further tile of the sequence is given up.
    sensor_noise_pct, motor_noise
        Standard deviations of a reading [%], and of a command as a share of it.
    statement_ms
        How long the brick takes for a motor statement, beside the time the statement asks for [ms].
    """

    physics: npt.NDArray[Any]
    derived: npt.NDArray[Any]
    plain: npt.NDArray[np.bool_]
    start: npt.NDArray[np.float64]
    phase_ms: npt.NDArray[np.float64]
    limit: npt.NDArray[np.int64]
    patience: npt.NDArray[np.int64]
    sensor_noise_pct: npt.NDArray[np.float64]
    motor_noise: npt.NDArray[np.float64]
    statement_ms: npt.NDArray[np.float64]

    def __len__(self) -> int:
        """How many drives."""
        return len(self.physics)

    def changed(self, **columns: npt.NDArray[Any]) -> Conditions:
        """Return these with other columns; `_replace` takes the number of drives for that of columns."""
        return Conditions(**{**self._asdict(), **columns})


def conditions(
    physics: npt.NDArray[Any],
    step_s: npt.ArrayLike,
    start: npt.ArrayLike,
    time_limit_s: float,
    phase_ms: npt.ArrayLike = 0.0,
    sensor_noise_pct: npt.ArrayLike = 0.0,
    motor_noise: npt.ArrayLike = 0.0,
    statement_ms: npt.ArrayLike = 0.0,
) -> Conditions:
    """Put conditions together; numbers count for all rows.

    Parameters
    ----------
    physics
        Dtype `PHYSICS`, shape (n,).
    step_s, start, phase_ms, sensor_noise_pct, motor_noise, statement_ms
        As in `Conditions`; a number, or one for each row; ``start`` shape (3,) or (n, 3).
    time_limit_s
        When a drive ends without GOAL [s].
    """
    n = len(physics)
    steps, derived = np.broadcast_to(np.asarray(step_s, float), n), np.zeros(n, DERIVED)
    for k in range(n):
        derive(physics[k], float(steps[k]), derived[k])

    def each(value: npt.ArrayLike) -> npt.NDArray[np.float64]:
        return np.broadcast_to(np.asarray(value, float), n).copy()

    limit = np.rint(time_limit_s / steps).astype(np.int64)
    return Conditions(
        np.ascontiguousarray(physics),
        derived,
        is_plain(physics),
        np.broadcast_to(np.asarray(start, float), (n, 3)).copy(),
        each(phase_ms),
        limit,
        limit,
        each(sensor_noise_pct),
        each(motor_noise),
        each(statement_ms),
    )


def select(under: Conditions, rows: Sequence[int] | slice) -> Conditions:
    """Return some rows."""
    columns: list[Any] = [column[rows] for column in under]
    return Conditions(*columns)


def impatient(under: Conditions) -> Conditions:
    """Return conditions under which a drive that reaches no further tile for a third of the time limit is given up."""
    return under.changed(patience=under.limit // 3)


def joined(several: Sequence[Conditions]) -> Conditions:
    """Return the rows of several conditions, one after the other."""
    columns: list[Any] = [np.concatenate(column) for column in zip(*several, strict=True)]
    return Conditions(*columns)
