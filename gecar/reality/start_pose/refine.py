"""The start pose of a path by dead reckoning, refined for every model of the sensor: a nuisance parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.optimisation.least_squares import least_squares, row_by_row
from gecar.reality.replay.rigid_alignment import starting_at

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]
Predict = Callable[..., Array]

STEPS = np.array([0.001, 0.001, 0.005])  # what a start is refitted in [m, m, rad]
WITHIN = 30.0  # of them
EVERY = 3  # of the rows will do: a few millimetres apart, less than a spot
READING_SD = 5.0  # [%]: what a sensor's model leaves of readings, which is more than their noise
GOOD_COST = 0.05  # cost a reading that needs no second try: a misfit of 1.5 %
BLURRED_SPOT_M = 0.03


def refined(path: Array, readings: Array, physics: Physics, predict: Predict) -> Array:
    """Return a path moved to the start from which readings fit a model of the sensor best, shape (rows, 3).

    Parameters
    ----------
    path
        Poses [m, m, rad], shape (rows, 3).
    readings
        What was read [%], shape (rows,); nan where nothing was.
    physics
        Record of the model, shape (1,).
    predict
        Predicts readings along a path of every n-th row, under a physics record: ``predict(path, physics, every=n)``.
    """
    whole, path, readings = path, path[::EVERY], readings[::EVERY]
    near, least = _nearby(path, readings, physics, predict)
    if least > GOOD_COST:
        # A sensor mounted elsewhere has another start, a line's width away: found on a blurred floor.
        blurred = physics.copy()
        blurred["spot_diameter"] = np.hypot(physics["spot_diameter"], BLURRED_SPOT_M)
        rough = _nearby(path, readings, blurred, predict)[0]
        other, misfit = _nearby(rough, readings, physics, predict)
        near = other if misfit < least else near
    return starting_at(whole, near[0])


def _nearby(path: Array, readings: Array, physics: Physics, predict: Predict) -> tuple[Array, float]:
    """Return the path nearby along which readings fit best, and the cost a reading."""
    there = ~np.isnan(readings)

    def misfit(z: Array) -> Array:
        errors = predict(starting_at(path, path[0] + z * STEPS), physics, every=EVERY) - readings
        return errors[there] / READING_SD

    far = np.full(3, WITHIN)
    found = least_squares(row_by_row(misfit), np.zeros(3), (-far, far), np.ones(3), rounds=6)
    return starting_at(path, path[0] + found.z * STEPS), found.cost / max(int(there.sum()), 1)
