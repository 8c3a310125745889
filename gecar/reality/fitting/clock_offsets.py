"""Camera against brick: how late each recording's camera clock is.

Clocks that were started by hand are late by another time in every recording: a nuisance, taken out and never named.
One lateness common to all is the effect ``pose_delay``. They compete with the effects at every stage, on equal terms:
taken out too early, a late motor would pass for a late camera.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from gecar.reality.optimisation.least_squares import cost, costs, weights
from gecar.reality.residuals.of_case import Comparison

Array = npt.NDArray[np.float64]

ROUNDS = 5
PROBE_S = 0.002
LONGEST_S = 0.2
SCATTER_S = 0.002  # offsets that spread by less are one common delay


def fitted_offsets(comparison: Comparison, residual: Callable[[], Array]) -> tuple[Array, float]:
    """Fit each recording's camera clock offset under a model; the comparison's own offsets stay as they are.

    Parameters
    ----------
    comparison
        Whose clocks.
    residual
        Whitened residuals under the model, at the comparison's present offsets.

    Returns
    -------
    tuple
        Offsets [s], shape (recordings,), and the cost with them.
    """
    standing = comparison.offsets
    rows = comparison.cells.recording
    count = len(standing)
    best, errors = standing.copy(), residual()
    least = np.bincount(rows, costs(errors), count)
    for _ in range(ROUNDS):
        comparison.set_offsets(best + PROBE_S)
        slopes = (residual() - errors) / PROBE_S
        w = weights(errors)
        normal = np.bincount(rows, w * slopes**2, count)
        move = -np.bincount(rows, w * slopes * errors, count) / np.maximum(normal, 1e-9)
        tried = np.clip(best + np.clip(move, -0.03, 0.03), -LONGEST_S, LONGEST_S)
        comparison.set_offsets(tried)
        after = residual()
        found = np.bincount(rows, costs(after), count)
        better = found < least
        best = np.where(better, tried, best)
        comparison.set_offsets(best)
        errors = residual()
        least = np.bincount(rows, costs(errors), count)
        if not better.any() or np.max(np.abs(move)) < 2e-4:
            break
    comparison.set_offsets(standing)
    return best, cost(errors)


def scattered(offsets: Array) -> bool:
    """Whether offsets differ from recording to recording by more than one common delay can."""
    if len(offsets) < 2:
        return False
    return float(np.std(offsets)) > SCATTER_S
