"""Where on the course a recording without a camera began: the one start from which its readings fit.

Every start of a grid is tried with the path by dead reckoning, on a blurred floor; the best are refined on ever
sharper floors. A start counts where no other fits nearly as well, but those that see the same.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from gecar.reality.optimisation.least_squares import KNEE, least_squares, row_by_row
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.replay.rigid_alignment import starting_at
from gecar.reality.start_pose.grid_search import FINE_SPOT_M, SAME_M, SAME_RAD, likely_starts, near
from gecar.world.course.course import Course

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]
Stages = tuple[tuple[float, int], ...]

ARC_M = 0.01  # what the sensor's path is sampled at
# Spots a path is refined with [m], and how many changes of `with_other_wheels` are free: the start; wheels and track.
SHARPER: Stages = ((FINE_SPOT_M, 3), (0.0, 3))
WITH_WHEELS: Stages = ((0.03, 6), (FINE_SPOT_M, 6), (0.0, 6))
# Scales of those changes in a fit.
CHANGES = np.array([0.01, 0.01, 0.02, 0.01, 0.01, 0.05])
PROBE, FARTHEST = 0.05, 5.0
OTHER_WHEELS_GAIN, FITS_PCT = (
    1.5,
    3.0,
)  # a misfit so many times smaller, and as small, with other wheels: they are other
LEAST_CONTRAST = 5.0  # standard deviation of readings along the path [%]: less has not crossed a line
KNEE_PCT = 5.0  # misfits this large and larger count less than their squares
# Standard deviations of a start pose that is found [m, m, rad].
LEAST_KNOWN = np.array([0.004, 0.004, math.radians(1.0)])
CORRELATED = 10.0  # readings that are wrong together: one crossing is one event
RIVAL_COST = 1.5  # times the best fit's cost: a rival's
SAME_PCT = 2.0  # readings that differ by less do not tell two places apart
# Over so long readings of even floor change by less, in percent and in their noise.
EVEN_S, EVEN_PCT, EVEN_SD = 0.5, 4.0, 6.0


def with_other_wheels(path: Array, change: Array) -> Array:
    """Return a path from another start and with other wheels, shape (rows, 3).

    Parameters
    ----------
    path
        Poses [m, m, rad], shape (rows, 3).
    change
        What is added to the start's pose [m, m, rad]; by which share distances and turns grow, and the turn distances
        add [rad/m], shape (6,): dead reckoning is off like that where wheels and track are not what they are thought
        to be.
    """
    ahead, turn, veer = change[3:]
    move = np.diff(path, axis=0)
    way = np.arctan2(move[:, 1], move[:, 0]) - path[:-1, 2]
    length = np.hypot(move[:, 0], move[:, 1])
    heading = path[0, 2] + np.r_[0.0, np.cumsum((1.0 + turn) * move[:, 2] + veer * length * np.cos(way))]
    length = (1.0 + ahead) * length
    x = path[0, 0] + np.r_[0.0, np.cumsum(length * np.cos(heading[:-1] + way))]
    y = path[0, 1] + np.r_[0.0, np.cumsum(length * np.sin(heading[:-1] + way))]
    return starting_at(np.column_stack([x, y, heading]), path[0] + change[:3])


def find_start(t: Array, path: Array, readings: Array, course: Course, physics: Physics) -> Array | None:
    """Return where a recording began [m, m, rad], shape (3,); None where its readings do not tell.

    Parameters
    ----------
    t, path
        Times [s], shape (rows,), and poses by dead reckoning from anywhere [m, m, rad], shape (rows, 3).
    readings
        Reflection [%], nan where there is none, shape (rows,).
    course
        What it drove on.
    physics
        Record of the robot, shape (1,).
    """
    points, seen = _sampled(path, readings, physics)
    if len(seen) < 10 or np.std(seen) < LEAST_CONTRAST:
        return None
    readings_misfit = _ReadingMisfit(t, readings, course, physics)
    starts = likely_starts(points, seen, course, physics)
    found = sorted(
        (readings_misfit.refined(starting_at(path, start)) for start in starts), key=lambda one: one[1]
    )
    best, least = found[0]
    if (readings_misfit.spread(best) > LEAST_KNOWN).any():
        return None
    rivals = [other for other, misfit in found if misfit < RIVAL_COST * least]
    for other in rivals[1:]:
        if not near(best[0], other[0], SAME_M, SAME_RAD) and readings_misfit.differ(best, other) > SAME_PCT:
            return None
    home = np.array([course.start.x_m, course.start.y_m])
    nearest = min(rivals, key=lambda other: float(np.hypot(*(other[0, :2] - home))))
    misfit = readings_misfit.typical(nearest)
    others = readings_misfit.typical(readings_misfit.refined(nearest, WITH_WHEELS)[0])
    if others < FITS_PCT and misfit > OTHER_WHEELS_GAIN * others:
        return None
    start: Array = nearest[0]
    return start


def _sampled(path: Array, readings: Array, physics: Physics) -> tuple[Array, Array]:
    """Return where the sensor was seen from the start's pose, shape (n, 2) [m], and mean readings there, shape (n,)."""
    p = physics[0]
    own = starting_at(path, np.zeros(3))
    cos, sin = np.cos(own[:, 2]), np.sin(own[:, 2])
    x = own[:, 0] + p["sensor_ahead"] * cos - p["sensor_left"] * sin
    y = own[:, 1] + p["sensor_ahead"] * sin + p["sensor_left"] * cos
    arc = np.r_[0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y)))]
    there = ~np.isnan(readings)
    of = (arc[there] / ARC_M).astype(int)
    count = np.bincount(of)
    kept = count > 0
    mean = [np.bincount(of, v[there])[kept] / count[kept] for v in (x, y, readings)]
    return np.column_stack(mean[:2]), mean[2]


def bare_floor(t: Array, readings: Array, sd: float) -> npt.NDArray[np.bool_]:
    """Return at which rows a recording of unknown place was on even floor without a line, shape (rows,).

    There readings hardly change for a while, and are no less than half of what they mostly are.
    """
    half = max(int(0.5 * EVEN_S / np.median(np.diff(t))), 1) if len(t) > 1 else 1
    filled = np.interp(t, t[~np.isnan(readings)], readings[~np.isnan(readings)])
    change = maximum_filter1d(filled, 2 * half + 1) - minimum_filter1d(filled, 2 * half + 1)
    even: npt.NDArray[np.bool_] = (change < max(EVEN_PCT, EVEN_SD * sd)) & (filled > 0.5 * np.median(filled))
    return even & ~np.isnan(readings)


class _ReadingMisfit:
    """What a recording's sensor would have read along a path."""

    def __init__(self, t: Array, readings: Array, course: Course, physics: Physics) -> None:
        self._t, self._physics = t, physics
        self._readings, self._there = readings, ~np.isnan(readings)
        self._raster, self._pitch = course.raster(course.pitch_m), course.pitch_m

    def readings(self, path: Array, spot_m: float = 0.0) -> Array:
        physics = self._physics.copy()
        physics["spot_diameter"] = math.hypot(physics["spot_diameter"][0], spot_m)
        out = np.empty(len(self._t))
        readings_along(self._t, path, 0.0, 1.0, self._raster, self._pitch, physics, np.zeros(3), out)
        return out

    def errors(self, path: Array, spot_m: float = 0.0) -> Array:
        out: Array = (self.readings(path, spot_m) - self._readings)[self._there] / (KNEE_PCT / KNEE)
        return out

    def refined(self, path: Array, stages: Stages = SHARPER) -> tuple[Array, float]:
        """Return the path nearby that fits best, and its cost a reading."""
        cost = math.inf
        for spot, free in stages:

            def change(z: Array, free: int = free) -> Array:
                return np.r_[z, np.zeros(6 - free)] * CHANGES

            def misfit(z: Array, path: Array = path, spot: float = spot, change: Any = change) -> Array:
                return self.errors(with_other_wheels(path, change(z)), spot)

            far = np.full(free, FARTHEST)
            found = least_squares(row_by_row(misfit), np.zeros(free), (-far, far), np.full(free, PROBE))
            path, cost = with_other_wheels(path, change(found.z)), found.cost / self._there.sum()
        return path, cost

    def spread(self, path: Array) -> Array:
        """Return how uncertain a path's start is, shape (3,) [m, m, rad]; infinite along a line crossed once."""
        scale = 0.5 * LEAST_KNOWN
        sides = np.diag(scale)
        ends = [(starting_at(path, path[0] + side), starting_at(path, path[0] - side)) for side in sides]
        slopes = np.stack([(self.errors(one) - self.errors(other)) / 2.0 for one, other in ends])
        normal = slopes @ slopes.T
        noise = np.mean(self.errors(path) ** 2) + (KNEE / KNEE_PCT) ** 2
        if np.linalg.cond(normal) > 1e9:
            return np.full(3, np.inf)
        out: Array = scale * np.sqrt(noise * CORRELATED * np.diag(np.linalg.inv(normal)))
        return out

    def differ(self, one: Array, other: Array) -> float:
        """Return how much readings along two paths differ on the mean [%]."""
        return float(np.mean(np.abs(self.readings(one) - self.readings(other))))

    def typical(self, path: Array) -> float:
        """Return the root mean square misfit of a reading [%]."""
        return float(KNEE_PCT / KNEE * np.sqrt(np.mean(self.errors(path) ** 2)))
