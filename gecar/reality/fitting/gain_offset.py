"""The colour sensor's gain and offset, read off where the floor is even.

Readings at 0 and 100 % are clipped, so greys must help to tell a gain from an offset; and greys are seen at edges.
There a path's errors lean: a robot that follows a line is nearer its edge than a path with errors says, and what was
predicted darkest reads lighter on the mean, by up to ten percent where the camera's noise lingers. So edges count for
little.

Source: regression to the mean where what is regressed on has errors, Fuller, Measurement Error Models (1987), ch. 1.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.fitting.profile import reaches, refitted
from gecar.reality.optimisation.least_squares import Residual
from gecar.reality.residuals.of_case import Residuals

Array = npt.NDArray[np.float64]

EFFECT = "sensor_gain"
EVEN = 1.5  # times a reading's noise: where the path's uncertainty moves it by more, there is an edge
EDGE_CAUTION = 10.0  # an edge's residuals are so many times less certain than their noise


def with_gain_from_even_floor(estimator: Estimator, model: Model) -> Model:
    """Return a model of the sensor whose gain and offset are read off where the floor is even; the rest stays."""
    own = _own(model)
    if not len(own):
        return model
    return estimator.at(model, refitted(_weighted(estimator, model), model, own)[0])


def gain_intervals(estimator: Estimator, model: Model) -> dict[int, tuple[float, float]]:
    """Return how far gain and offset reach down and up, by coordinate: profile likelihood."""
    own = _own(model)
    if not len(own):
        return {}
    residual = _weighted(estimator, model)
    return {int(k): reaches(residual, model, int(k), own[own != k]) for k in own}


def _own(model: Model) -> npt.NDArray[np.intp]:
    return np.flatnonzero([c.effect.id == EFFECT for c in model.parameters.coordinates])


def on_even_floor(residuals: Residuals) -> npt.NDArray[np.bool_]:
    """Return which readings were taken where the floor is even, shape (n,): an uncertain path hardly changes them."""
    even: npt.NDArray[np.bool_] = residuals.reading_sd <= EVEN * residuals.recordings[0].noise.reflection_sd
    return even


def _weighted(estimator: Estimator, model: Model) -> Residual:
    residual = estimator.residual(model.parameters)
    weight = np.where(on_even_floor(estimator.residuals), 1.0, 1.0 / EDGE_CAUTION)
    return lambda z: residual(z) * weight
