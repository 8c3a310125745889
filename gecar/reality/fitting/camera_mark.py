"""The place of the camera's mark on the robot, fitted under a model of the motion.

A mark that is not over the axle's centre swings out when the robot turns, and along the camera's path the colour sensor
seems to sit elsewhere. It belongs to no robot: a nuisance, the same in all recordings, fitted and never named.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.optimisation.least_squares import (
    costs,
    jacobian,
    least_squares,
    left_out_costs,
    row_by_row,
)
from gecar.reality.residuals.of_case import Residuals

Array = npt.NDArray[np.float64]

UNIT = np.array([2e-3, 2e-3, math.radians(0.5)])  # ahead, left [m], turned [rad]: steps of finite differences
LARGEST = np.array([0.3, 0.3, 0.6]) / UNIT  # what `gecar calibrate` allows
ROUNDS = 5
LEAST_TOLD = (
    0.02  # share of what is known of it that other recordings must tell: else it is over the axle there
)


def with_fitted_mark(estimator: Estimator, physics: npt.NDArray[Any]) -> tuple[Residuals, float]:
    """Return residuals with the camera's mark fitted, and what that gains on recordings left out (log-likelihood).

    Parameters
    ----------
    estimator
        Of residuals of motion, with any mark, in which a camera told headings.
    physics
        The model, shape (1,).
    """
    residuals, folds = estimator.residuals, estimator.blocks.folds
    residual = row_by_row(lambda z: estimator.whitened(residuals.with_mark(z * UNIT).errors(physics)))
    bounds, probes = (-LARGEST, LARGEST), np.ones(len(UNIT))
    start = np.array(residuals.mark) / UNIT
    found = least_squares(residual, start, bounds, probes, ROUNDS)
    slopes = jacobian(residual, found.z, found.errors, probes, LARGEST)
    before = np.bincount(folds, costs(residual(start)))
    left_out = left_out_costs(found, slopes, bounds, residual, folds, LEAST_TOLD)
    return residuals.with_mark(found.z * UNIT), float(np.sum(before - left_out))
