"""Intervals where derivatives tell nothing: a random walk over parameters that fit about as well (MCMC).

A path that crosses a patch once has seen two points of its edge: many discs go through both, and no derivative says so.

Source: adaptive Metropolis, Haario, Saksman, Tamminen, Bernoulli 7 (2001) 223-242, with its scale of 2.4 squared over
the number of coordinates.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import cost
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]

STEPS, BURN_IN, EVERY = (
    2400,
    400,
    100,
)  # steps, those that are forgotten, and after how many the pace is set anew
TOLERANCE = 4.0  # times as much cost as noise alone allows: noise lingers, and simulations are off
BEGUN = 0.1  # coordinates: the first pace


def walked_quantiles(estimator: Estimator, model: Model, seed: int = 0) -> dict[int, tuple[float, float]]:
    """Return the 2.5 and 97.5 % quantiles of coordinates whose derivatives tell nothing, by coordinate."""
    own = [k for k, c in enumerate(model.parameters.coordinates) if not BY_ID[c.effect.id].differentiable]
    if not own:
        return {}
    walked = _walk(estimator, model, seed)[BURN_IN:]
    ends = np.quantile(walked, (0.025, 0.975), axis=0)
    return {k: (float(ends[0, k]), float(ends[1, k])) for k in own}


def _walk(estimator: Estimator, model: Model, seed: int) -> Array:
    """Return where a Metropolis walk went, shape (steps, coordinates)."""
    rng, residual = (
        np.random.default_rng((seed, len(model.errors))),
        estimator.residual(model.parameters),
    )
    low, high = model.parameters.bounds
    count = len(model.z)
    z, here = model.z.copy(), model.cost
    walked = np.empty((STEPS, count))
    root: Array = BEGUN * np.eye(count)
    for step in range(STEPS):
        if step and step % EVERY == 0:
            spread = np.cov(walked[step // 2 : step], rowvar=False).reshape(count, count)
            root = np.asarray(np.linalg.cholesky(2.4**2 / count * spread + 1e-8 * np.eye(count)), float)
        there = z + root @ rng.standard_normal(count)
        if (there > low).all() and (there < high).all():
            found = cost(residual(there))
            if rng.random() < np.exp(min((here - found) / TOLERANCE, 0.0)):
                z, here = there, found
        walked[step] = z
    return walked
