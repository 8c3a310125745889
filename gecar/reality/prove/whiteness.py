"""Whether what is left could be the sensors' noise: its excess energy against white noise."""

from __future__ import annotations

import numpy as np

from gecar.reality.fitting.model import Model
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import SIGNIFICANCE, WHITE_MOTION, WHITE_READINGS

DRAWS = 200


def whiteness(problem: Problem, model: Model, seed: int = 0) -> tuple[bool, float]:
    """Return whether a model's residuals pass for the sensors' noise, its constants fitted, and the p-value.

    What the simulation itself leaves where nothing is missing (`WHITE_MOTION`, `WHITE_READINGS`) is allowed for.
    """
    blocks = problem.estimator.blocks
    if not blocks.count:
        return True, 1.0
    rng = np.random.default_rng((seed, blocks.count))
    left = blocks.excess_energy(problem.residuals.errors(problem.with_small_changes(model)))
    drawn = np.sqrt(blocks.samples) * rng.standard_normal(
        (DRAWS, blocks.count)
    )  # a block's sums of white noise
    left -= (WHITE_READINGS if problem.residuals.sensor else WHITE_MOTION) * blocks.count
    p = float((1 + sum(blocks.excess_energy_of_sums(sums) >= left for sums in drawn)) / (1 + DRAWS))
    return p > SIGNIFICANCE, p
