"""Derivative-free minimisation, for costs that jump: slip, play, the edge of a patch on the floor.

Source: covariance matrix adaptation evolution strategy (CMA-ES), Hansen, arXiv:1604.00772, with its default weights
and learning rates.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

PATIENCE = 6  # generations without such a gain after which the search ends
LEAST_GAIN = 0.1  # of cost, a log likelihood: smaller gains do not restart the patience


def cma_es(
    costs: Callable[[Array], Array],
    start: Array,
    spread: Array,
    bounds: tuple[Array, Array],
    rng: np.random.Generator,
    generations: int = 22,
    wider: int = 1,
    patience: int = PATIENCE,
    least_gain: float = LEAST_GAIN,
) -> tuple[Array, float]:
    """Return the best vector met, and its cost.

    Parameters
    ----------
    costs
        What to minimise, at several vectors: shape (m, k) to (m,).
    start, spread
        Initial mean and standard deviations, shape (k,).
    bounds
        Lowest and highest vectors; what falls outside is tried at the bound.
    rng
        Random generator.
    generations
        Of 7 + 3 ln(k) trials each.
    wider
        Factor on the number of trials a generation, for costs with many local minima.
    patience, least_gain
        The search ends after so many generations without a gain of so much cost.
    """
    trials = wider * (7 + int(3 * math.log(len(start))) if len(start) > 1 else 6)
    strategy = _Strategy(len(start), trials)
    best = np.clip(start, *bounds)
    least = float(costs(best[None])[0])
    reference, since = least, 0
    for _ in range(generations):
        steps = strategy.ask(rng)
        places = np.clip(start + spread * (strategy.mean + strategy.sigma * steps), *bounds)
        found = costs(places)
        order = np.argsort(found)
        if found[order[0]] < least:
            best, least = places[order[0]], float(found[order[0]])
        since += 1
        if least < reference - least_gain:
            reference, since = least, 0
        if since >= patience:
            break
        strategy.tell(steps[order])
    return best, least


class _Strategy:
    """Mean, size and shape of a cloud of trials, and how they adapt; names are those of the source."""

    def __init__(self, k: int, trials: int) -> None:
        self.trials = trials
        weight = math.log(trials // 2 + 0.5) - np.log(np.arange(1, trials // 2 + 1))
        self._weight = weight / weight.sum()
        mass = 1.0 / float(np.sum(self._weight**2))
        self._c_sigma = (mass + 2.0) / (k + mass + 5.0)
        self._damp = 1.0 + self._c_sigma + 2.0 * max(0.0, math.sqrt((mass - 1.0) / (k + 1.0)) - 1.0)
        self._c_path = (4.0 + mass / k) / (k + 4.0 + 2.0 * mass / k)
        self._c_one = 2.0 / ((k + 1.3) ** 2 + mass)
        c_mu = 2.0 * (mass - 2.0 + 1.0 / mass) / ((k + 2.0) ** 2 + mass)
        self._c_mu, self._mass = min(1.0 - self._c_one, c_mu), mass
        self._usual = math.sqrt(k) * (1.0 - 1.0 / (4.0 * k) + 1.0 / (21.0 * k * k))
        self.mean, self.sigma, self._shape = np.zeros(k), 1.0, np.eye(k)
        self._path, self._path_sigma, self._told = np.zeros(k), np.zeros(k), 0
        self._axes, self._lengths = np.eye(k), np.ones(k)

    def ask(self, rng: np.random.Generator) -> Array:
        """Draw a generation's steps from the mean, shape (trials, k)."""
        values, self._axes = np.linalg.eigh(self._shape)
        self._lengths = np.sqrt(np.maximum(values, 1e-12))
        steps: Array = rng.standard_normal((self.trials, len(values))) @ (self._axes * self._lengths).T
        return steps

    def tell(self, steps: Array) -> None:
        """Adapt to a generation's steps, the best first."""
        steps = steps[: len(self._weight)]
        move = self._weight @ steps
        self.mean = self.mean + self.sigma * move
        self._told += 1
        c = self._c_sigma
        self._path_sigma = (1 - c) * self._path_sigma + math.sqrt(c * (2 - c) * self._mass) * (
            self._axes @ ((self._axes.T @ move) / self._lengths)
        )
        length = float(np.linalg.norm(self._path_sigma))
        settled = math.sqrt(1 - (1 - c) ** (2 * self._told))
        calm = length / settled < (1.4 + 2 / (len(move) + 1)) * self._usual
        kept = math.sqrt(self._c_path * (2 - self._c_path) * self._mass)
        self._path = (1 - self._c_path) * self._path + calm * kept * move
        wide = sum(w * np.outer(s, s) for w, s in zip(self._weight, steps, strict=True))
        along = np.outer(self._path, self._path)
        self._shape = (1 - self._c_one - self._c_mu) * self._shape + self._c_one * along + self._c_mu * wide
        self.sigma *= math.exp(min((c / self._damp) * (length / self._usual - 1.0), 1.0))
