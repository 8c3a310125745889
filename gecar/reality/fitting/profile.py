"""Profile likelihood: how far a coordinate can go while the others are refitted.

Source: Venzon and Moolgavkar, Applied Statistics 37 (1988) 87.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import Residual, cost, least_squares

Array = npt.NDArray[np.float64]

RISE_95 = 1.92  # of cost: half the 95 % quantile of a chi-square with one degree of freedom
FIRST, GROWTH, HALVINGS = 0.1, 1.5, 6


def refitted(
    residual: Residual, model: Model, free: npt.NDArray[np.intp], fixed: tuple[int, float] | None = None
) -> tuple[Array, float]:
    """Return a model's coordinates with some refitted and one fixed, and the cost there."""
    start = model.z.copy()
    if fixed is not None:
        start[fixed[0]] = fixed[1]
    if not len(free):
        return start, cost(residual(start))

    def whole(part: Array) -> Array:
        z = np.broadcast_to(start, (*part.shape[:-1], len(start))).copy()
        z[..., free] = part
        return z

    low, high = model.parameters.bounds
    bounds, probes = (low[free], high[free]), model.parameters.probes[free]
    found = least_squares(lambda part: residual(whole(part)), start[free], bounds, probes)
    return whole(found.z), found.cost


def reaches(
    residual: Residual, model: Model, k: int, others: npt.NDArray[np.intp], rise: float = RISE_95
) -> tuple[float, float]:
    """Return how far down and up coordinate k can go, others refitted, before the cost rises by so much."""
    least = cost(residual(model.z))
    low, high = (float(bound[k]) for bound in model.parameters.bounds)
    z = float(model.z[k])

    def risen(value: float) -> bool:
        return refitted(residual, model, others, (k, value))[1] - least >= rise

    return _reach(risen, z, -1.0, z - low), _reach(risen, z, 1.0, high - z)


def _reach(risen: Callable[[float], bool], z: float, side: float, most: float) -> float:
    near, far = 0.0, FIRST
    while far < most and not risen(z + side * far):
        near, far = far, GROWTH * far
    if far >= most:
        if not risen(z + side * most):
            return most
        far = most
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        near, far = (near, middle) if risen(z + side * middle) else (middle, far)
    return far
