"""Whether what is left could be noise: its structure against simulated recordings with nothing to find."""

from __future__ import annotations

import numpy as np

from gecar.reality.selection import Model, Selection

DRAWS = 200
SUBTLE = 0.5  # of the smallest sizes worth a name: the nulls' robots are off by up to so much in everything


def whiteness(selection: Selection, model: Model) -> tuple[bool, float]:
    """Return whether a model's residuals pass for noise, and the p-value.

    The nulls are recordings of robots that differ from the model in every constant by less than is worth a name, with
    white noise: structure that such robots have is the price of any model.
    """
    if not selection.blocks:
        return True, 1.0
    rng = np.random.default_rng(selection.blocks)
    slopes = np.concatenate(selection.subtle_slopes(model), axis=1)
    drawn = []
    for _ in range(DRAWS):
        errors = rng.standard_normal(len(slopes)) + slopes @ rng.uniform(-SUBTLE, SUBTLE, slopes.shape[1])
        drawn.append(selection.structure(errors))
    p = float((1 + np.sum(np.array(drawn) >= model.structure)) / (1 + DRAWS))
    return p > 0.05, p
