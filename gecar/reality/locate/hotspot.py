"""Hotspots: excess energy at one place on the floor, too little to count over a whole recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.model import Model
from gecar.reality.replay.kernel import X, Y
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.stepwise import Explanation
from gecar.reality.selection.thresholds import HOTSPOT, SEVERAL

Array = npt.NDArray[np.float64]

CELL_M = 0.1
MOST_OF_A_BLOCK = 60.0  # one wild frame is no place
LEAST_BLOCKS = 10
ABOUT_M = 0.35  # about a spot: a patch, a magnet or a draught is no larger, or it is no spot


def hotspot(problem: Problem, model: Model) -> tuple[float, float] | None:
    """Return the place [m] at which a model of motion leaves excess energy; None if there is none, or no poses."""
    score, place = strongest_place(problem, model)
    return place if score >= HOTSPOT else None


def with_spot(explained: Explanation) -> Explanation:
    """Return an explanation with the place on the floor where something is left; what is material there counts."""
    problem, model = explained.problem, explained.taken
    spot = hotspot(problem, model)
    if spot is None:
        return explained
    left = problem.sizes.left_about(problem.with_small_changes(model), spot)
    material = problem.material.times(left) > SEVERAL
    if not (material or explained.unexplained):
        return explained
    return replace(explained, unexplained=True, spot=spot)


def strongest_place(problem: Problem, model: Model) -> tuple[float, tuple[float, float]]:
    """Return the largest excess energy in a cell of the floor, in standard deviations of noise, and where."""
    places, excess, count = _excess(problem, model)
    if not len(places):
        return 0.0, (np.nan, np.nan)
    scores = np.where(count >= LEAST_BLOCKS, excess / np.sqrt(2.0 * count), 0.0)
    best = int(np.argmax(scores))
    x, y = places[best]
    return max(float(scores[best]), 0.0), (float(x), float(y))


def middle(problem: Problem, model: Model, spot: tuple[float, float]) -> tuple[float, float]:
    """Return the middle [m] of the excess energy about a spot."""
    places, excess, _ = _excess(problem, model)
    weight = np.maximum(excess, 0.0) * (np.hypot(*(places - spot).T) < ABOUT_M)
    x, y = weight @ places / weight.sum()
    return float(x), float(y)


def _excess(problem: Problem, model: Model) -> tuple[Array, Array, npt.NDArray[np.intp]]:
    """Return each cell the robot was in: its middle, shape (cells, 2) [m], excess energy, and number of blocks."""
    cells = _cells(problem, model)
    there = ~np.isnan(cells[:, 0])
    errors = problem.residuals.errors(problem.with_small_changes(model))
    excess = np.minimum(problem.estimator.blocks.excess_by_block(errors)[there], MOST_OF_A_BLOCK)
    places, of = np.unique(cells[there], axis=0, return_inverse=True)
    energy: Array = np.bincount(of.ravel(), excess).astype(float)
    return (places + 0.5) * CELL_M, energy, np.bincount(of.ravel())


def _cells(problem: Problem, model: Model) -> Array:
    """Return the cell of the floor the robot was in at each block, shape (blocks, 2); nan where no camera looked."""
    blocks, physics = problem.estimator.blocks, model.physics
    cells = np.full((blocks.count, 2), np.nan)
    for number, run in enumerate(problem.residuals.recordings):
        if run.replayer.has_poses:
            rows, own = run.replayer.play(physics).rows, blocks.recording == number
            for k, column in enumerate((X, Y)):
                cells[own, k] = np.floor(np.interp(blocks.t_s[own], run.replayer.t, rows[:, column]) / CELL_M)
    return cells
