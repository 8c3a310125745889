"""Where on the course a recording without a camera began: the one start from which its readings fit.

Every start of a grid is tried with the path by dead reckoning, on a blurred floor; the best are refined on ever
sharper floors. A start counts where no other fits nearly as well, but those that see the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from gecar.reality.optimisation.least_squares import KNEE, least_squares, row_by_row
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.replay.rigid_alignment import starting_at
from gecar.reality.start_pose.grid_search import (
    FINE_SPOT_M,
    SAME_M,
    SAME_RAD,
    distinct,
    likely_starts,
    near,
)
from gecar.world.course.course import Course

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]
Stages = tuple[tuple[float, tuple[int, ...]], ...]

ARC_M = 0.01  # what the sensor's path is sampled at
# Scales of changes in a fit: those of `with_other_wheels`; the sensor's delay and lag [s], and where it is mounted [m].
CHANGES = np.array([0.01, 0.01, 0.02, 0.01, 0.01, 0.05, 0.03, 0.03, 0.01, 0.01])
START, WHEELS, SENSOR = (0, 1, 2), (3, 4, 5), (6, 7, 8, 9)
# Spots a path is refined with [m], and which of the changes are free.
SHARPER: Stages = ((FINE_SPOT_M, START), (0.0, START))
WITH_WHEELS: Stages = tuple((spot, START + WHEELS) for spot in (0.03, FINE_SPOT_M, 0.0))
WITH_SENSOR: Stages = tuple((spot, START + SENSOR) for spot in (0.03, FINE_SPOT_M, 0.0))
PROBE, FARTHEST = 0.05, 5.0
# A misfit so many times smaller, and as small, with other wheels: they are other; and so is the sensor.
OTHER_GAIN, FITS_PCT = 1.5, 3.0
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
        (readings_misfit.refined(_Fit(starting_at(path, start))) for start in starts),
        key=lambda fit: fit.cost,
    )
    found = readings_misfit.with_other_sensor(found)
    best = found[0]
    if (readings_misfit.spread(best) > LEAST_KNOWN).any():
        return None
    rivals = [other for other in found if other.cost < RIVAL_COST * best.cost]
    for other in rivals[1:]:
        apart = not near(best.path[0], other.path[0], SAME_M, SAME_RAD)
        if apart and readings_misfit.differ(best, other) > SAME_PCT:
            return None
    home = np.array([course.start.x_m, course.start.y_m])
    nearest = min(rivals, key=lambda other: float(np.hypot(*(other.path[0, :2] - home))))
    misfit = readings_misfit.typical(nearest)
    others = readings_misfit.typical(readings_misfit.refined(nearest, WITH_WHEELS))
    if others < FITS_PCT and misfit > OTHER_GAIN * others:
        return None
    start: Array = nearest.path[0]
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


@dataclass(frozen=True)
class _Fit:
    """A path, shape (rows, 3), and a sensor, which may have made the readings; its cost is that of a reading.

    ``sensor``: its delay and lag [s], and how far ahead and to the left of its place it is mounted [m].
    """

    path: Array
    sensor: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    cost: float = math.inf

    def changed(self, change: Array) -> _Fit:
        """Return this with a change of the start, the wheels and the sensor, in the order of `CHANGES`, shape (10,)."""
        delay, lag, ahead, left = (float(part) for part in self.sensor + change[6:])
        return replace(self, path=with_other_wheels(self.path, change[:6]), sensor=(delay, lag, ahead, left))


class _ReadingMisfit:
    """What a recording's sensor would have read along a path."""

    def __init__(self, t: Array, readings: Array, course: Course, physics: Physics) -> None:
        self._t, self._physics = t, physics
        self._readings, self._there = readings, ~np.isnan(readings)
        self._floor = course.surface

    def readings(self, fit: _Fit, spot_m: float = 0.0) -> Array:
        physics = self._physics.copy()
        physics["spot_diameter"] = math.hypot(physics["spot_diameter"][0], spot_m)
        delay, lag, ahead, left = fit.sensor
        physics["sensor_lag"] = max(physics["sensor_lag"][0] + lag, 0.0)
        physics["sensor_ahead"] += ahead
        physics["sensor_left"] += left
        out: Array = readings_along(self._t, fit.path, -delay, 1.0, self._floor, physics, np.zeros(3))
        return out

    def errors(self, fit: _Fit, spot_m: float = 0.0) -> Array:
        out: Array = (self.readings(fit, spot_m) - self._readings)[self._there] / (KNEE_PCT / KNEE)
        return out

    def refined(self, fit: _Fit, stages: Stages = SHARPER) -> _Fit:
        """Return the best fit near one, stage by stage."""
        for spot, free in stages:
            fit = self._refined(fit, spot, list(free))
        return fit

    def _refined(self, fit: _Fit, spot_m: float, free: list[int]) -> _Fit:
        def changed(z: Array) -> _Fit:
            change = np.zeros(len(CHANGES))
            change[free] = z * CHANGES[free]
            return fit.changed(change)

        def misfit(z: Array) -> Array:
            return self.errors(changed(z), spot_m)

        far = np.full(len(free), FARTHEST)
        found = least_squares(row_by_row(misfit), 0.0 * far, (-far, far), np.full(len(free), PROBE))
        return replace(changed(found.z), cost=found.cost / self._there.sum())

    def with_other_sensor(self, found: list[_Fit]) -> list[_Fit]:
        """Return fits refined with a late sensor mounted elsewhere, if the best fits then, and far better; else these.

        Such a sensor sees no edge where it should be: without it no start fits well, nor far better than others.
        """
        least = self.typical(found[0])
        if least < FITS_PCT:
            return found
        places = distinct([fit.path[0] for fit in found], SAME_M, SAME_RAD)
        other = sorted((self.refined(found[k], WITH_SENSOR) for k in places), key=lambda fit: fit.cost)
        return other if min(least / OTHER_GAIN, KNEE_PCT) > self.typical(other[0]) else found

    def spread(self, fit: _Fit) -> Array:
        """Return how uncertain a path's start is, shape (3,) [m, m, rad]; infinite along a line crossed once."""
        scale = 0.5 * LEAST_KNOWN
        sides = np.pad(np.diag(scale), ((0, 0), (0, len(CHANGES) - len(scale))))
        slopes = np.stack(
            [(self.errors(fit.changed(side)) - self.errors(fit.changed(-side))) / 2.0 for side in sides]
        )
        normal = slopes @ slopes.T
        noise = np.mean(self.errors(fit) ** 2) + (KNEE / KNEE_PCT) ** 2
        if np.linalg.cond(normal) > 1e9:
            return np.full(3, np.inf)
        out: Array = scale * np.sqrt(noise * CORRELATED * np.diag(np.linalg.inv(normal)))
        return out

    def differ(self, one: _Fit, other: _Fit) -> float:
        """Return how much readings along two paths differ on the mean [%]."""
        return float(np.mean(np.abs(self.readings(one) - self.readings(other))))

    def typical(self, fit: _Fit) -> float:
        """Return the root mean square misfit of a reading [%]."""
        return float(KNEE_PCT / KNEE * np.sqrt(np.mean(self.errors(fit) ** 2)))
