"""Fit constants that recordings tell, the others at their nominal values.

What moves the robot has one valley, and is fitted from where the robot stands. What the colour sensor reads has many:
an edge of the line is narrow, and a fit that begins a line's width away ends on another edge. There, white and black
are fitted first, then the sensor's and the course's places are scanned; the lowest end counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from gecar.reality.calibrate.constants import Constant, Slack
from gecar.reality.calibrate.identifiability import PROBE
from gecar.reality.optimisation.least_squares import Fit, cost, fit
from gecar.reality.residuals.of_case import Comparison

Array = npt.NDArray[np.float64]
Chosen = npt.NDArray[np.bool_]

_LEVELS = ("white", "black")
_PLACES = (("ahead", "left"), ("course_x", "course_y", "course_turn"))
_SCAN = np.linspace(-8.0, 8.0, 5)  # steps: 12 mm of the sensor's place, 16 mm and 1 degree of the course's
_ROUNDS = 20
_AGAIN, _WORTH = (
    6,
    1e-3,
)  # fits more, and the share of its cost by which one must help to be followed by another


def fitted(comparison: Comparison, slack: Slack, told: Chosen, last: Array) -> Array:
    """Return the vector that fits best, 0 where a constant is not told, shape (k,).

    Parameters
    ----------
    comparison, slack
        What to fit, and with which constants.
    told
        Which of them are free, shape (k,).
    last
        Where the last fit ended, with others free: the next begins there; all 0 for none.
    """
    if not told.any():
        return np.zeros(len(told))
    starts = [last] if last.any() else _starts(comparison, slack, told)
    ends = [_from(comparison, slack, told, start) for start in starts]
    return _whole(np.zeros(len(told)), told, min(ends, key=lambda end: end.cost).z)


def _starts(comparison: Comparison, slack: Slack, told: Chosen) -> Iterator[Array]:
    begin = np.zeros(len(told))
    if not comparison.sight:
        yield begin
        return
    levels = told & _named(slack.constants, _LEVELS)
    if levels.any():
        begin = _whole(begin, levels, _from(comparison, slack, levels, begin).z)
    yield begin
    for names in _PLACES:
        begin = _scanned(comparison, slack, told & _named(slack.constants, names), begin)
        yield begin


def _from(comparison: Comparison, slack: Slack, free: Chosen, start: Array) -> Fit:
    """Fit from a start; sight again from its end with finer differences, until that helps no more.

    The sensor's place and the course's are told apart by corners only: a long, narrow valley, in which a fit with
    coarse differences stops short.
    """
    low, high = slack.bounds

    def once(at: Array, probe: float) -> Fit:
        probes = np.full(int(free.sum()), probe)
        return fit(lambda part: slack.errors(comparison, _whole(start, free, part)), at, (low[free], high[free]),
                   probes, rounds=_ROUNDS)  # fmt: skip

    end = once(start[free], PROBE)
    for _ in range(_AGAIN if comparison.sight else 0):
        finer = once(end.z, 0.25 * PROBE)
        if finer.cost > (1.0 - _WORTH) * end.cost:
            return min(end, finer, key=lambda found: found.cost)
        end = finer
    return end


def _scanned(comparison: Comparison, slack: Slack, free: Chosen, begin: Array) -> Array:
    """Return the best of a grid of places around a vector."""
    if not free.any():
        return begin
    low, high = slack.bounds
    shifts = product(_SCAN, repeat=int(free.sum()))
    grid = [np.clip(_whole(begin, free, begin[free] + shift), low, high) for shift in shifts]
    return min(grid, key=lambda z: cost(slack.errors(comparison, z)))


def _named(constants: Sequence[Constant], fields: Sequence[str]) -> Chosen:
    return np.array([c.field in fields for c in constants], bool)


def _whole(z: Array, free: Chosen, part: Array) -> Array:
    out = z.copy()
    out[free] = part
    return out
