"""Whether a law is real: left-out recordings ask for it, more than any law of the whole search gains by chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gecar.reality.invent.search import Law, Library, fit
from gecar.reality.invent.sentences import shortened
from gecar.reality.optimisation.least_squares import costs, jacobian, left_out_costs
from gecar.reality.selection.thresholds import PRICE, SIGNIFICANCE

Array = npt.NDArray[np.float64]

DRAWS = 500
LEAST_PART = (
    0.05  # of a law's gain, on a bench: there nothing is noise, and a part that brings little gains thousands
)


@dataclass(frozen=True)
class Proof:
    """What a law gains on left-out folds, shape (folds,), and what any law gains by chance, shape (draws,)."""

    gains: Array
    nulls: Array

    @property
    def gain(self) -> float:
        """What it gains on all of them."""
        return float(self.gains.sum())

    @property
    def null_95(self) -> float:
        """The 95 % quantile of what any law gains by chance."""
        return float(np.quantile(self.nulls, 0.95))

    @property
    def p(self) -> float:
        """Share of draws in which some law gains as much."""
        return float((1 + np.sum(self.nulls >= self.gain)) / (1 + len(self.nulls)))

    @property
    def holds(self) -> bool:
        """Whether it gains more than chance would give any law, and on most folds."""
        return bool(self.p < SIGNIFICANCE and np.mean(self.gains > 0.0) > 0.5)


def left_out_gains(library: Library, law: Law) -> Array:
    """Return what a law gains on each fold with its constants fitted to the others (one Newton step back), (folds,).

    The model without it is as it was fitted to all.
    """
    blocks = library.problem.estimator.blocks
    free, z, errors = law.parameters, law.minimum.z, law.minimum.errors
    residual = library.problem.estimator.residual(free)
    folds = np.unique(blocks.folds)
    if len(folds) < 2:
        return np.array([law.gain])
    slopes = jacobian(residual, z, errors, free.probes, free.bounds[1])
    after = left_out_costs(law.minimum, slopes, free.bounds, residual, blocks.folds)
    out: Array = (np.bincount(blocks.folds, costs(library.model.errors)) - after)[folds]
    return out


def simplified(library: Library, law: Law) -> tuple[Law, Array]:
    """Return a law without the parts that left-out recordings do not ask for, and what it gains on them, (folds,)."""
    gains = left_out_gains(library, law)
    least_share = LEAST_PART if library.problem.on_bench else 0.0
    while shorter := [fit(library, rest) for rest in shortened(law.terms)]:
        without = [left_out_gains(library, rest) for rest in shorter]
        least = min(range(len(shorter)), key=lambda k: (gains - without[k]).sum())
        asked = gains - without[least]
        if asked.sum() >= max(PRICE, least_share * gains.sum()) and np.mean(asked > 0.0) > 0.5:
            break
        law, gains = shorter[least], without[least]
    return law, gains


def largest_gains(library: Library, seed: int) -> Array:
    """Return the largest gain of any law the search tried, where spans of half a second have random signs, (draws,).

    As `gecar.reality.selection.null_distribution` does for the catalogue: the search is part of the null.
    """
    scores = np.stack(list(library.scores.values()))
    signs = np.random.default_rng((seed, len(scores))).choice(
        np.array([-1.0, 1.0], np.float32), (DRAWS, scores.shape[1])
    )
    best = np.zeros(DRAWS, np.float32)
    for first in range(0, len(scores), 512):
        best = np.maximum(best, np.max(np.abs(signs @ scores[first : first + 512].T), axis=1))
    return 0.5 * best.astype(float) ** 2
