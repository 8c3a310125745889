"""Whether what is left could be noise: its excess energy against simulated recordings with nothing to find."""

from __future__ import annotations

import numpy as np

from gecar.reality.fitting.model import Model
from gecar.reality.selection.model_tolerance import small_sensitivities
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import SIGNIFICANCE, TOLERATED_IN_NULL

DRAWS = 200


def whiteness(problem: Problem, model: Model, seed: int = 0) -> tuple[bool, float]:
    """Return whether a model's residuals pass for noise, and the p-value.

    The nulls are recordings of robots that differ from the model in every constant by less than is worth a name, with
    white noise; but never by more than a simulation is off where nothing is missing (`EnergyLimits.floor`). Without
    that cap sensors far finer than such sizes would let anything pass: a motor on a bench, a thousandfold its noise.
    """
    blocks = problem.estimator.blocks
    if not blocks.count:
        return True, 1.0
    rng = np.random.default_rng((seed, blocks.count))
    slopes = np.concatenate(small_sensitivities(problem.estimator, problem.catalogue, model), axis=1)
    by_block = np.stack([blocks.sums(column) for column in slopes.T], axis=1)
    drawn = []
    for _ in range(DRAWS):
        noise = np.sqrt(blocks.samples) * rng.standard_normal(blocks.count)  # a block's sum of white noise
        off = by_block @ rng.uniform(-TOLERATED_IN_NULL, TOLERATED_IN_NULL, by_block.shape[1])
        scale = np.sqrt(problem.limits.floor / max(float(np.mean(off**2 / blocks.samples)), 1e-12))
        # Readings are off by as much even where their sensor is as known: the path's errors last.
        off *= scale if problem.residuals.sensor else min(1.0, scale)
        drawn.append(blocks.excess_energy_of_sums(noise + off))
    p = float((1 + np.sum(np.array(drawn) >= model.excess_energy)) / (1 + DRAWS))
    return p > SIGNIFICANCE, p
