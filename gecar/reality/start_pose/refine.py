"""Where a path by dead reckoning begins, for each model of the sensor anew: its start is a nuisance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.optimisation.least_squares import fit
from gecar.reality.start_pose.localise import moved

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]
Along = Callable[..., Array]

STEPS = np.array([0.001, 0.001, 0.005])  # what a start is refitted in [m, m, rad]
WITHIN = 30.0  # of them
EVERY = 3  # of the rows will do: a few millimetres apart, less than a spot
READING_SD = 5.0  # a start is settled to what a sensor's model leaves of readings [%], not to their noise
SETTLED = 0.05  # cost a reading that needs no second try: a misfit of 1.5 %
BLURRED_SPOT_M = 0.03


def settled(path: Array, readings: Array, physics: Physics, along: Along) -> Array:
    """Return a path moved to the start from which readings fit a model of the sensor best, shape (rows, 3).

    Parameters
    ----------
    path
        Poses [m, m, rad], shape (rows, 3).
    readings
        What was read [%], shape (rows,); nan where nothing was.
    physics
        Record of the model, shape (1,).
    along
        Predicts readings along a path of every n-th row, under a physics record: ``along(path, physics, every=n)``.
    """
    whole, path, readings = path, path[::EVERY], readings[::EVERY]
    near, least = _nearby(path, readings, physics, along)
    if least > SETTLED:
        # A sensor mounted elsewhere has another start, a line's width away: found on a blurred floor.
        blurred = physics.copy()
        blurred["spot_diameter"] = np.hypot(physics["spot_diameter"], BLURRED_SPOT_M)
        rough = _nearby(path, readings, blurred, along)[0]
        other, misfit = _nearby(rough, readings, physics, along)
        near = other if misfit < least else near
    return moved(whole, near[0])


def _nearby(path: Array, readings: Array, physics: Physics, along: Along) -> tuple[Array, float]:
    """Return the path nearby along which readings fit best, and the cost a reading."""
    there = ~np.isnan(readings)

    def misfit(z: Array) -> Array:
        errors = along(moved(path, path[0] + z * STEPS), physics, every=EVERY) - readings
        return errors[there] / READING_SD

    far = np.full(3, WITHIN)
    found = fit(misfit, np.zeros(3), (-far, far), np.ones(3), rounds=6)
    return moved(path, path[0] + found.z * STEPS), found.cost / max(int(there.sum()), 1)
