"""Starts on a course worth a closer look: every one of a grid tried on a blurred floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import zoom

from gecar.compiled import compiled
from gecar.world.course.course import Course
from gecar.world.kernel.sensing import spot_average

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

GRID_M, HEADINGS = 0.02, 180
COARSE_SPOT_M = 0.04  # what a degree of heading and a cell of the grid smear over some decimetres
FINE_M, FINE_RAD, FINE_STEPS = 0.005, math.radians(0.5), 8
FINE_SPOT_M = 0.015
SCANNED, RETURNED = 60, 12
READING_SD = 25.0  # of a reading on the blurred floor [%]
MOST_PER_SAMPLE = 4.0  # of cost
GIVEN_UP_AFTER = 16  # samples: how often a row of starts is looked at
NEAR_M, NEAR_RAD = 0.06, math.radians(8.0)  # what a fine scan covers
SAME_M, SAME_RAD = 0.015, math.radians(2.0)  # a line has two edges, two centimetres apart


def likely_starts(points: Array, read: Array, course: Course, physics: Physics) -> list[Array]:
    """Return the starts that fit best on a blurred floor, best first: over the whole course, then finely around.

    Parameters
    ----------
    points, read
        Where the sensor was, read from the start's pose [m], shape (n, 2), and what it read there [%], shape (n,).
    course
        What was driven on; its own start is always looked at.
    physics
        Record of the robot, shape (1,).

    Returns
    -------
    list of numpy.ndarray
        Poses of the axle's centre [m, m, rad], shape (3,) each.
    """
    order = np.random.default_rng(0).permutation(len(read))  # bad starts are given up early
    points, read, bare = points[order], read[order], float(physics["white"][0])
    x, y = (np.arange(0.5 * GRID_M, size, GRID_M) for size in (course.width_m, course.height_m))
    angles = np.linspace(0.0, math.tau, HEADINGS, endpoint=False)
    floor = _blurred(course, physics, GRID_M, COARSE_SPOT_M)
    home = np.array([course.start.x_m, course.start.y_m, course.start.heading_rad])
    best = np.empty((1, 4))
    own = home[:1], home[1:2], home[2:]  # most drives begin there
    _scan(floor, GRID_M, points, read, bare, *own, math.inf, best)
    least, best = float(best[0, 0]), np.empty((HEADINGS, 4))
    _scan(floor, GRID_M, points, read, bare, x, y, angles, least, best)
    places = [home, *_best_first(best, NEAR_M, NEAR_RAD)[:SCANNED]]
    floor = _blurred(course, physics, FINE_M, FINE_SPOT_M)
    around = np.arange(-FINE_STEPS, FINE_STEPS + 1)
    least, finer = math.inf, []
    for x0, y0, angle in places:
        best = np.empty((len(around), 4))
        own = x0 + FINE_M * around, y0 + FINE_M * around, angle + FINE_RAD * around
        _scan(floor, FINE_M, points, read, bare, *own, least, best)
        least = min(least, float(best[:, 0].min()))
        finer.append(best)
    return _best_first(np.concatenate(finer), SAME_M, SAME_RAD)[:RETURNED]


def _best_first(found: Array, near_m: float, near_rad: float) -> list[Array]:
    """Return starts, best first, without those near a better one; rows are cost, x, y, heading."""
    starts = found[np.argsort(found[:, 0])[: np.isfinite(found[:, 0]).sum()], 1:]
    return [starts[k] for k in distinct(starts, near_m, near_rad)]


def _blurred(course: Course, physics: Physics, pitch: float, spot: float) -> Array:
    """Return what a wide spot reads over the floor [%], shape (rows, columns)."""
    p = physics[0]
    averaged = spot_average(course.raster(course.pitch_m), course.pitch_m, spot)
    coarse = zoom(averaged, course.pitch_m / pitch, order=1, grid_mode=True, mode="nearest")
    level: Array = p["black"] + (p["white"] - p["black"]) * coarse.astype(np.float64) / 255.0
    return level


@compiled
def _scan(
    floor: Array,
    pitch: float,
    points: Array,
    read: Array,
    bare: float,
    x: Array,
    y: Array,
    angles: Array,
    least: float,
    best: Array,
) -> None:
    """Try every start of a grid; write the best of each heading, shape (headings, 4): cost, x, y, heading.

    The grid is as fine as the floor is drawn: a row of starts sees a row of the floor, which vector instructions
    compare at once. A row is given up at twice the least cost of any start so far, ``least`` to begin with; the cost of
    a heading without any other is infinite.
    """
    rows, columns = floor.shape
    cost = np.empty(len(x))
    for h in range(angles.shape[0]):
        cos = math.cos(angles[h]) / pitch
        sin = math.sin(angles[h]) / pitch
        best[h] = np.inf
        for i in range(y.shape[0]):
            cost[:] = 0.0
            most = min(best[h, 0], 2.0 * least)
            for k in range(points.shape[0]):
                if k % GIVEN_UP_AFTER == 0 and cost.min() >= most:
                    break
                column = math.floor(x[0] / pitch + points[k, 0] * cos - points[k, 1] * sin)
                row = math.floor(y[i] / pitch + points[k, 0] * sin + points[k, 1] * cos)
                first = min(max(-column, 0), len(cost))
                last = min(max(columns - column, first), len(cost)) if 0 <= row < rows else first
                z = (read[k] - bare) / READING_SD
                outside = min(z * z, MOST_PER_SAMPLE)
                cost[:first] += outside
                cost[last:] += outside
                if first < last:
                    here, level = cost[first:last], floor[row, column + first : column + last]
                    for j in range(len(here)):
                        z = (read[k] - level[j]) / READING_SD
                        here[j] += min(z * z, MOST_PER_SAMPLE)
            cheapest = np.argmin(cost)
            if cost[cheapest] < most:
                best[h] = cost[cheapest], x[cheapest], y[i], angles[h]
        least = min(least, best[h, 0])


def distinct(poses: Sequence[Array] | Array, near_m: float, near_rad: float) -> list[int]:
    """Return the numbers of poses, shape (3,) each, without those near an earlier one."""
    kept: list[int] = []
    for number, pose in enumerate(poses):
        if not any(near(pose, poses[other], near_m, near_rad) for other in kept):
            kept.append(number)
    return kept


def near(one: Array, other: Array, near_m: float, near_rad: float) -> bool:
    """Return whether two poses are closer to each other than a distance and an angle."""
    turn = math.remainder(one[2] - other[2], math.tau)
    return float(np.hypot(*(one[:2] - other[:2]))) < near_m and abs(turn) < near_rad
