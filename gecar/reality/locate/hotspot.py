"""Whether what is left gathers at one place on the floor: too little to count beside all that was driven elsewhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.model import Model
from gecar.reality.replay.kernel import X, Y
from gecar.reality.selection.selection import Selection

Array = npt.NDArray[np.float64]

CELL_M = 0.1
MOST_OF_A_BLOCK = 60.0  # one wild frame is no place
LEAST_BLOCKS = 10
# Standard deviations of a cell's summed structure. Of 200 robots in a 3D engine with nothing concealed none reached 16;
# ridges of 1.3 to 2.4 mm left 34 to 79.
LIMIT = 22.0


class Spot(NamedTuple):
    """The middle of a cell of the floor [m]."""

    x_m: float
    y_m: float


def stands_out(selection: Selection, model: Model) -> Spot | None:
    """Return the place at which what a model of motion leaves gathers, None if there is none; it takes poses."""
    if selection.comparison.sight:
        return None
    score, spot = loudest_place(selection, model)
    return spot if score >= LIMIT else None


def loudest_place(selection: Selection, model: Model) -> tuple[float, Spot]:
    """Return the structure gathered in the loudest cell of the floor, in standard deviations of noise, and where."""
    cells = _cells(selection, model)
    there = ~np.isnan(cells[:, 0])
    if not there.any():
        return 0.0, Spot(np.nan, np.nan)
    excess = np.minimum(selection.blocks.excess(model.fit.errors)[there], MOST_OF_A_BLOCK)
    places, of = np.unique(cells[there], axis=0, return_inverse=True)
    count = np.bincount(of.ravel())
    scores = np.where(count >= LEAST_BLOCKS, np.bincount(of.ravel(), excess) / np.sqrt(2.0 * count), 0.0)
    best = int(np.argmax(scores))
    x, y = (places[best] + 0.5) * CELL_M
    return max(float(scores[best]), 0.0), Spot(float(x), float(y))


def _cells(selection: Selection, model: Model) -> Array:
    """Return the cell of the floor the robot was in at each block, shape (blocks, 2); nan where no camera looked."""
    blocks, physics = selection.blocks, model.freedom.physics(model.fit.z)
    cells = np.full((blocks.count, 2), np.nan)
    for number, strip in enumerate(selection.comparison.strips):
        if len(strip.film.reel.pose_t):
            rows, own = strip.film.play(physics)[0], blocks.recording == number
            for k, column in enumerate((X, Y)):
                cells[own, k] = np.floor(np.interp(blocks.t_s[own], strip.film.t, rows[:, column]) / CELL_M)
    return cells
