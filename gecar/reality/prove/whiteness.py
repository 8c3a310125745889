"""Whether what is left could be noise: its structure against simulated recordings with nothing to find."""

from __future__ import annotations

import numpy as np

from gecar.reality.fitting.model import Model
from gecar.reality.fitting.model_tolerance import subtle_slopes
from gecar.reality.selection.selection import Selection
from gecar.reality.selection.thresholds import MOTION

DRAWS = 200
SUBTLE = 0.5  # of the smallest sizes worth a name: the nulls' robots are off by up to so much in everything


def whiteness(selection: Selection, model: Model) -> tuple[bool, float]:
    """Return whether a model's residuals pass for noise, and the p-value.

    The nulls are recordings of robots that differ from the model in every constant by less than is worth a name, with
    white noise; but never by more than a simulation is off where nothing is missing (`limits.MOTION`). Without that
    cap sensors far finer than such sizes would let anything pass: a motor on a bench, a thousandfold its noise.
    """
    if not selection.blocks.count:
        return True, 1.0
    rng = np.random.default_rng(selection.blocks.count)
    blocks = selection.blocks
    slopes = np.concatenate(subtle_slopes(selection, selection.catalogue, model), axis=1)
    felt = np.stack([blocks.sums(column) for column in slopes.T], axis=1)
    drawn = []
    for _ in range(DRAWS):
        noise = np.sqrt(blocks.samples) * rng.standard_normal(blocks.count)  # a block's sum of white noise
        off = felt @ rng.uniform(-SUBTLE, SUBTLE, felt.shape[1])
        off *= min(1.0, np.sqrt(MOTION.floor / max(float(np.mean(off**2 / blocks.samples)), 1e-12)))
        drawn.append(blocks.structure_of_sums(noise + off))
    p = float((1 + np.sum(np.array(drawn) >= model.structure)) / (1 + DRAWS))
    return p > 0.05, p
