"""How far the outer wheel must travel on a course: length and turning together.

A wheel's contact moves at |u| + b |W| on the outer side, with the centre's speed u along the heading, the turning
rate W and half the track b, so the outer wheel travels the length plus b times all turning, whichever way the robot
turns and whether it drives forwards or backwards. The least of that sum over all drives through the tiles is bounded
from below leg by leg: a leg of the shortest way of length L, driven with a heading never nearer than d to its line,
takes at least L / cos(d). docs/lower_bound.md has the proof.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter1d

from gecar.world.course.layout import Layout

Place = tuple[float, float]
Array = npt.NDArray[np.float64]

_EPS = 1e-9
_HEADINGS = 3600  # of a half turn: a line is driven forwards or backwards
_CELL = math.pi / _HEADINGS


class Leg(NamedTuple):
    """A straight piece of the shortest way.

    Attributes
    ----------
    length_m
        Its length [m].
    direction_rad
        Where it leads [rad].
    most
        At most so many times its length may be charged to a robot that looks elsewhere; 1: its length alone.
    """

    length_m: float
    direction_rad: float
    most: float


def legs_of(layout: Layout, tiles: Sequence[int], way: Sequence[Place]) -> list[Leg]:
    """Return the legs of a shortest way through neighbouring tiles.

    Parameters
    ----------
    layout
        The course's tiles.
    tiles
        The tiles the way leads through, in order.
    way
        Its bends, in tiles, ends included.
    """
    bends = _bends(way)
    directions = [_direction(a, b) for a, b in pairwise(bends)]
    most = [math.inf] * len(directions)
    here = 0
    for k in range(1, len(directions)):
        here, before, after = _best_tile(layout, tiles, here, bends[k], directions[k - 1], directions[k])
        most[k - 1], most[k] = min(most[k - 1], before), min(most[k], after)
    size = layout.tile_size_m
    return [
        Leg(size * math.dist(a, b), math.atan2(d[1], d[0]), m)
        for (a, b), d, m in zip(pairwise(bends), directions, most, strict=True)
    ]


def _bends(way: Sequence[Place]) -> list[Place]:
    """Return a way's ends and the points where it bends."""
    kept: list[Place] = []
    for place in way:
        if kept and math.dist(place, kept[-1]) < _EPS:
            continue
        if len(kept) > 1 and math.dist(_direction(kept[-2], kept[-1]), _direction(kept[-1], place)) < _EPS:
            kept.pop()
        kept.append(place)
    return kept


def _direction(a: Place, b: Place) -> Place:
    length = math.dist(a, b)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _best_tile(
    layout: Layout, tiles: Sequence[int], here: int, bend: Place, before: Place, after: Place
) -> tuple[int, float, float]:
    """Return the tile at which to end one leg and begin the next, and how much each may be charged.

    Of the tiles from ``here`` on that have the bend for a corner, before the way leaves it for good.
    """
    best = here, 1.0, 1.0
    met = False
    for k in range(here, len(tiles)):
        column, row = layout.place(tiles[k])
        x, y = bend[0] - column, bend[1] - row
        if min(abs(x), abs(1.0 - x)) > _EPS or min(abs(y), abs(1.0 - y)) > _EPS:
            if met:
                break
            continue
        met = True
        sides = (1.0 - 2.0 * round(x), 0.0), (0.0, 1.0 - 2.0 * round(y))
        charges = _charges(sides, before, after)
        if min(charges) > min(best[1:]):
            best = k, *charges
    return best


def _charges(sides: tuple[Place, Place], before: Place, after: Place) -> tuple[float, float]:
    """Return how often the legs' lengths may be charged at a tile, given its sides as seen from the bend.

    With charges p and q, (p before - q after) must not point out of the tile: along no side may it be negative,
    for any p and q up to what is returned. Where that fails even for p = q = 1, both are 1.
    """
    most_before = most_after = math.inf
    for side in sides:
        p, q = (side[0] * d[0] + side[1] * d[1] for d in (before, after))
        if p < q - _EPS:
            return 1.0, 1.0
        if q > _EPS:
            most_after = min(most_after, max(p / q, 1.0))
        elif p < -_EPS:
            most_before = min(most_before, max(q / p, 1.0))
    return most_before, most_after


def outer_wheel_m(
    legs: Sequence[Leg], heading_rad: float, half_track_m: float, slide_m: float = 0.0
) -> float:
    """Return a length [m] the outer wheel travels at least, from a start heading over all legs.

    The least, over the headings t(k) nearest to each leg's line, of

        sum of L(k) min(1 / |cos(t(k) - a(k))|, most(k)) + max(b |t(k) - t(k-1)| - slide, 0),

    found by dynamic programming over headings in cells of 0.05 degrees, each counted at its cheapest.

    Parameters
    ----------
    legs
        Of the shortest way.
    heading_rad
        At the start [rad].
    half_track_m
        b, between the axle's centre and a wheel [m].
    slide_m
        What sliding may save at each bend; none is saved before the first leg, at rest [m].
    """
    length = sum(leg.length_m for leg in legs)
    reach = math.ceil(min(slide_m / half_track_m, math.pi) / _CELL) if half_track_m > 0.0 else _HEADINGS
    if 2 * reach >= _HEADINGS:
        return length
    headings = _CELL * np.arange(_HEADINGS)
    ahead = np.zeros(_HEADINGS)
    for k, leg in reversed(list(enumerate(legs))):
        away = np.abs((headings - leg.direction_rad + 0.5 * math.pi) % math.pi - 0.5 * math.pi)
        stretch = 1.0 / np.cos(np.clip(away - 0.5 * _CELL, 0.0, 0.5 * math.pi - 1e-6))
        ahead = _turned(ahead + leg.length_m * np.minimum(stretch, leg.most), half_track_m * _CELL)
        if k > 0:
            ahead = minimum_filter1d(ahead, 2 * reach + 1, mode="wrap")
    start = round((heading_rad % math.pi) / _CELL) % _HEADINGS
    rounding = half_track_m * _CELL * (len(legs) + 1)
    return max(float(ahead[start]) - rounding, length)


def _turned(cost: Array, step: float) -> Array:
    """Return the least of each heading's cost and another's plus the turn there, on the circle of headings."""
    up = step * np.arange(2 * len(cost))
    twice = np.concatenate([cost, cost])
    after = np.minimum.accumulate(twice - up) + up
    before = np.minimum.accumulate((twice - up[::-1])[::-1])[::-1] + up[::-1]
    n = len(cost)
    return np.minimum(after[n:], before[:n])
