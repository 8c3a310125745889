"""Each recording's camera clock offset, fitted under a model of the motion.

Clocks started by hand are late by another time in every recording: a nuisance, fitted and never named. So is a clock
that is early, by the same time in all; one delay common to all is the effect ``pose_delay``. Both compete with the
effects at every stage: fitted too early, clocks would take up a delay of the motors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.optimisation.least_squares import costs, weights
from gecar.reality.residuals.of_case import Residuals

Array = npt.NDArray[np.float64]

ROUNDS = 5
PROBE_S = 0.002
LONGEST_S = 0.2
LARGEST_MOVE_S = 0.03
CLOSE_S = 2e-4


def with_fitted_clocks(residuals: Residuals, physics: npt.NDArray[Any]) -> tuple[Residuals, float]:
    """Return residuals with every camera clock fitted, and their cost.

    Parameters
    ----------
    residuals
        Of motion, at any clock offsets.
    physics
        The model, shape (1,).
    """
    rows, count = residuals.index.recording, len(residuals.recordings)
    best, errors = residuals.clock_offsets_s, residuals.errors(physics)
    least = np.bincount(rows, costs(errors), count)
    for _ in range(ROUNDS):
        slopes = (residuals.with_clock_offsets(best + PROBE_S).errors(physics) - errors) / PROBE_S
        w = weights(errors)
        normal = np.bincount(rows, w * slopes**2, count)
        move = -np.bincount(rows, w * slopes * errors, count) / np.maximum(normal, 1e-9)
        tried = np.clip(best + np.clip(move, -LARGEST_MOVE_S, LARGEST_MOVE_S), -LONGEST_S, LONGEST_S)
        found = np.bincount(rows, costs(residuals.with_clock_offsets(tried).errors(physics)), count)
        better = found < least
        best = np.where(better, tried, best)
        errors = residuals.with_clock_offsets(best).errors(physics)
        least = np.bincount(rows, costs(errors), count)
        if not better.any() or np.max(np.abs(move)) < CLOSE_S:
            break
    return residuals.with_clock_offsets(best), float(np.sum(costs(errors)))
