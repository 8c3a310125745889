"""The null distribution: the largest gain any effect of the catalogue reaches where there is no cause.

Nulls are the residuals themselves with random signs for spans of half a second: they keep the noise's correlation and
its outliers, and lose whatever is the same in all of them (wild bootstrap: Wu, Annals of Statistics 14 (1986) 1261).

The search for an effect is part of it. A patch's place, a ripple's cycles, a limit's speed mean nothing where the
effect is absent, so that derivatives there say nothing of them: every draw takes the best of all values a search starts
from (Davies, Biometrika 74 (1987) 33; the largest score under random signs: Hansen, Econometrica 64 (1996) 413).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import weights

Array = npt.NDArray[np.float64]

DRAWS = 500  # the standard error of a 5 % quantile is 1 %


def largest_gains(estimator: Estimator, catalogue: Sequence[str], model: Model) -> Array:
    """Return the largest gain of any effect on top of a model in every draw, shape (draws,)."""
    spans = int(estimator.blocks.spans.max()) + 1
    signs = estimator.rng.choice((-1.0, 1.0), (DRAWS, spans))
    best, projected = np.zeros(DRAWS), estimator.projection(model)
    others = [effect for effect in catalogue if effect not in model.effects]
    for effect, slopes in zip(others, estimator.sensitivities(model, others), strict=True):
        for scores, searched in _scores(estimator, model, effect, slopes, projected):
            drawn = signs @ scores
            if (
                searched and drawn.shape[1] == 1
            ):  # an effect at certain values, or more of it: never its opposite
                drawn = np.maximum(drawn, 0.0)
            best = np.maximum(best, 0.5 * np.sum(drawn**2, axis=1))
    return best


def _scores(
    estimator: Estimator, model: Model, effect: str, slopes: Array, projected: Callable[[Array], Array]
) -> Iterator[tuple[Array, bool]]:
    """Yield each span's scores in the directions fitted together, shape (spans, k), and whether they were searched."""
    weighted, of = np.sqrt(weights(model.errors)) * model.errors, estimator.blocks.spans
    found = ((each, True) for each in estimator.responses(model, effect))
    for columns, searched in itertools.chain([(slopes, False)], found):
        g = projected(columns)
        if g.shape[1]:
            q = np.linalg.qr(g)[0]
            if searched and g.shape[1] == 1:
                q = q * np.sign(q[:, 0] @ g[:, 0])
            yield np.stack([np.bincount(of, column * weighted) for column in q.T], axis=1), searched
