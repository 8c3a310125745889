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

from gecar.reality.calibrate.constants import Constant, FreeConstants
from gecar.reality.calibrate.identifiability import PROBE
from gecar.reality.optimisation.least_squares import Minimum, cost, least_squares
from gecar.reality.residuals.of_case import Residuals

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


def fitted(residuals: Residuals, constants: FreeConstants, identified: Chosen, last: Array) -> Array:
    """Return the vector that fits best, 0 where a constant is not identified, shape (k,).

    Parameters
    ----------
    residuals, constants
        What to fit, and with which constants.
    identified
        Which of them are free, shape (k,).
    last
        Where the last fit ended, with others free: the next begins there; all 0 for none.
    """
    if not identified.any():
        return np.zeros(len(identified))
    starts = [last] if last.any() else _starts(residuals, constants, identified)
    ends = [_from(residuals, constants, identified, start) for start in starts]
    return _whole(np.zeros(len(identified)), identified, min(ends, key=lambda end: end.cost).z)


def _starts(residuals: Residuals, constants: FreeConstants, identified: Chosen) -> Iterator[Array]:
    begin = np.zeros(len(identified))
    if not residuals.sensor:
        yield begin
        return
    levels = identified & _named(constants.constants, _LEVELS)
    if levels.any():
        begin = _whole(begin, levels, _from(residuals, constants, levels, begin).z)
    yield begin
    for names in _PLACES:
        begin = _scanned(residuals, constants, identified & _named(constants.constants, names), begin)
        yield begin


def _from(residuals: Residuals, constants: FreeConstants, free: Chosen, start: Array) -> Minimum:
    """Fit from a start; sight again from its end with finer differences, until that helps no more.

    The sensor's place and the course's are separated by corners only: a long, narrow valley, in which a fit with
    coarse differences stops short.
    """
    low, high = constants.bounds

    def once(at: Array, probe: float) -> Minimum:
        probes = np.full(int(free.sum()), probe)

        def residual(part: Array) -> Array:
            return constants.errors(residuals, _whole(start, free, part))

        return least_squares(residual, at, (low[free], high[free]), probes, rounds=_ROUNDS)

    end = once(start[free], PROBE)
    for _ in range(_AGAIN if residuals.sensor else 0):
        finer = once(end.z, 0.25 * PROBE)
        if finer.cost > (1.0 - _WORTH) * end.cost:
            return min(end, finer, key=lambda found: found.cost)
        end = finer
    return end


def _scanned(residuals: Residuals, constants: FreeConstants, free: Chosen, begin: Array) -> Array:
    """Return the best of a grid of places around a vector."""
    if not free.any():
        return begin
    low, high = constants.bounds
    shifts = product(_SCAN, repeat=int(free.sum()))
    grid = [np.clip(_whole(begin, free, begin[free] + shift), low, high) for shift in shifts]
    return min(grid, key=lambda z: cost(constants.errors(residuals, z)))


def _named(constants: Sequence[Constant], fields: Sequence[str]) -> Chosen:
    return np.array([c.field in fields for c in constants], bool)


def _whole(z: Array, free: Chosen, part: Array) -> Array:
    out = np.broadcast_to(z, (*part.shape[:-1], len(z))).copy()
    out[..., free] = part
    return out
