"""The null distribution: the largest gain any effect of the catalogue reaches where there is no cause.

Nulls are the residuals themselves with random signs for spans of half a second: they keep the noise's correlation and
its outliers, and lose whatever is the same in all of them (wild bootstrap: Wu, Annals of Statistics 14 (1986) 1261).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import weights

Array = npt.NDArray[np.float64]

DRAWS = 500  # the standard error of a 5 % quantile is 1 %


def largest_gains(estimator: Estimator, catalogue: Sequence[str], model: Model) -> Array:
    """Return the largest gain of any effect on top of a model in every draw, shape (draws,)."""
    errors = model.errors
    w = np.sqrt(weights(errors))
    spans = int(estimator.blocks.spans.max()) + 1
    signs = estimator.rng.choice((-1.0, 1.0), (DRAWS, spans))
    best = np.zeros(len(signs))
    for effect in catalogue:
        if effect in model.effects:
            continue
        g = estimator.projected(model, estimator.sensitivities(model, effect) * w[:, None])
        if g.shape[1]:
            q = np.linalg.qr(g)[0] * (w * errors)[:, None]
            score = np.stack([np.bincount(estimator.blocks.spans, column, spans) for column in q.T], axis=1)
            best = np.maximum(best, 0.5 * np.sum((signs @ score) ** 2, axis=1))
    return best
