"""Search on rough ground: where slip, play or an edge of a patch makes the cost jump, slopes mislead.

Source: covariance matrix adaptation evolution strategy (CMA-ES), Hansen, arXiv:1604.00772, with its default weights
and learning rates.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

PATIENCE = 6  # generations without a gain worth mentioning, after which a search ends
MENTIONED = 0.1  # of cost: log likelihoods, so this is nothing


def rough_search(
    cost: Callable[[Array], float],
    start: Array,
    spread: Array,
    bounds: tuple[Array, Array],
    rng: np.random.Generator,
    generations: int = 22,
    wider: int = 1,
) -> tuple[Array, float]:
    """Return the best vector met, and its cost.

    Parameters
    ----------
    cost
        What to minimise.
    start, spread
        Where to look, and how far about it, shape (k,).
    bounds
        Lowest and highest vectors; what falls outside is tried at the bound.
    rng
        Source of chance.
    generations
        Of 7 + 3 ln(k) trials each.
    wider
        Times so many trials, where there are many valleys.
    """
    k = len(start)
    trials = wider * (7 + int(3 * math.log(k)) if k > 1 else 6)
    parents = trials // 2
    weight = math.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    weight /= weight.sum()
    mass = 1.0 / float(np.sum(weight**2))
    c_sigma = (mass + 2.0) / (k + mass + 5.0)
    damp = 1.0 + c_sigma + 2.0 * max(0.0, math.sqrt((mass - 1.0) / (k + 1.0)) - 1.0)
    c_path = (4.0 + mass / k) / (k + 4.0 + 2.0 * mass / k)
    c_one = 2.0 / ((k + 1.3) ** 2 + mass)
    c_mu = min(1.0 - c_one, 2.0 * (mass - 2.0 + 1.0 / mass) / ((k + 2.0) ** 2 + mass))
    usual = math.sqrt(k) * (1.0 - 1.0 / (4.0 * k) + 1.0 / (21.0 * k * k))
    mean, sigma, shape = np.zeros(k), 1.0, np.eye(k)
    path, path_sigma = np.zeros(k), np.zeros(k)
    best, best_cost = np.clip(start, *bounds), cost(np.clip(start, *bounds))
    mentioned, since = best_cost, 0
    for generation in range(generations):
        values, axes = np.linalg.eigh(shape)
        root = axes * np.sqrt(np.maximum(values, 1e-12))
        steps = rng.standard_normal((trials, k)) @ root.T
        places = np.clip(start + spread * (mean + sigma * steps), *bounds)
        found = np.array([cost(place) for place in places])
        order = np.argsort(found)
        if found[order[0]] < best_cost:
            best, best_cost = places[order[0]], float(found[order[0]])
        since += 1
        if best_cost < mentioned - MENTIONED:
            mentioned, since = best_cost, 0
        if since >= PATIENCE:
            break
        move = weight @ steps[order[:parents]]
        mean = mean + sigma * move
        path_sigma = (1 - c_sigma) * path_sigma + math.sqrt(c_sigma * (2 - c_sigma) * mass) * (
            axes @ ((axes.T @ move) / np.sqrt(np.maximum(values, 1e-12)))
        )
        length = float(np.linalg.norm(path_sigma))
        calm = length / math.sqrt(1 - (1 - c_sigma) ** (2 * generation + 2)) < (1.4 + 2 / (k + 1)) * usual
        path = (1 - c_path) * path + calm * math.sqrt(c_path * (2 - c_path) * mass) * move
        spread_out = sum(w * np.outer(s, s) for w, s in zip(weight, steps[order[:parents]], strict=True))
        shape = (1 - c_one - c_mu) * shape + c_one * np.outer(path, path) + c_mu * spread_out
        sigma *= math.exp(min((c_sigma / damp) * (length / usual - 1.0), 1.0))
    return best, best_cost
