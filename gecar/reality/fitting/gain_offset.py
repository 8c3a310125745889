"""The colour sensor's gain and offset, read off where the floor is even.

Readings at 0 and 100 % are clipped, so greys must help to tell a gain from an offset; and greys are seen at edges.
There a path's errors lean: a robot that follows a line is nearer its edge than a path with errors says, and what was
predicted darkest reads lighter on the mean, by up to ten percent where the camera's noise lingers. So edges count for
little.

Source: regression to the mean where what is regressed on has errors, Fuller, Measurement Error Models (1987), ch. 1.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import cost, least_squares

Array = npt.NDArray[np.float64]

EFFECT = "sensor_gain"
EVEN = 1.5  # times a reading's noise: where the path's uncertainty moves it by more, there is an edge
EDGE_CAUTION = 10.0  # an edge's residuals are so many times less certain than their noise
RISE = 1.92  # of cost: half the 95 % quantile of a chi-square
GROWTH = 1.5


def with_gain_from_even_floor(estimator: Estimator, model: Model) -> Model:
    """Return a model of sight whose gain and offset are read off where the floor is even; the rest stays."""
    own = _own(model)
    if not len(own):
        return model
    return estimator.at(model, _fitted(_weighted(estimator, model), model, own)[0])


def gain_intervals(estimator: Estimator, model: Model) -> dict[int, tuple[float, float]]:
    """Return how far gain and offset reach down and up, by coordinate: profile likelihood."""
    own = _own(model)
    if not len(own):
        return {}
    residual = _weighted(estimator, model)
    least = cost(residual(model.z))
    low, high = model.parameters.bounds
    out = {}
    for k in own:
        others = own[own != k]

        def rise(value: float, k: int = k, others: npt.NDArray[np.intp] = others) -> float:
            return _fitted(residual, model, others, (k, value))[1] - least

        z = float(model.z[k])
        out[int(k)] = (_reach(rise, z, -1.0, z - low[k]), _reach(rise, z, 1.0, high[k] - z))
    return out


def _own(model: Model) -> npt.NDArray[np.intp]:
    return np.flatnonzero([c.effect.id == EFFECT for c in model.parameters.coordinates])


def _weighted(estimator: Estimator, model: Model) -> Callable[[Array], Array]:
    residual = estimator.residual(model.parameters, model.tolerated)
    sd, even = estimator.residuals.reading_sd, estimator.residuals.recordings[0].noise.reflection_sd
    weight = np.where(sd > EVEN * even, 1.0 / EDGE_CAUTION, 1.0)
    return lambda z: residual(z) * weight


def _fitted(
    residual: Callable[[Array], Array],
    model: Model,
    free: npt.NDArray[np.intp],
    fixed: tuple[int, float] | None = None,
) -> tuple[Array, float]:
    """Return the model's coordinates with some refitted, and the cost there."""
    start = model.z.copy()
    if fixed is not None:
        start[fixed[0]] = fixed[1]

    def whole(part: Array) -> Array:
        z = start.copy()
        z[free] = part
        return z

    low, high = model.parameters.bounds
    found = least_squares(
        lambda part: residual(whole(part)),
        start[free],
        (low[free], high[free]),
        model.parameters.probes[free],
    )
    return whole(found.z), found.cost


def _reach(rise: Callable[[float], float], z: float, side: float, most: float) -> float:
    """Return how far one coordinate can go to a side before the cost, the other refitted, rises by `RISE`."""
    near, far = 0.0, 0.1
    while far < most and rise(z + side * far) < RISE:
        near, far = far, GROWTH * far
    far = min(far, most)
    for _ in range(6):
        middle = 0.5 * (near + far)
        near, far = (middle, far) if rise(z + side * middle) < RISE else (near, middle)
    return far
