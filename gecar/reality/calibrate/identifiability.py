"""Which constants recordings tell: those whose effect no combination of constants already fitted has.

Source: identifiability by the sensitivities' condition, Ljung, System Identification (2nd ed.), ch. 4 and 13.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from gecar.reality.calibrate.constants import FreeConstants
from gecar.reality.optimisation.least_squares import jacobian, weights
from gecar.reality.residuals.of_case import Residuals

Array = npt.NDArray[np.float64]

PROBE = 0.4  # of a step, for differences
# A constant whose effect is that of others to within this sine of an angle cannot be identified: derivatives at steps
# of 2 ms are off by 0.02.
LEAST_SINE = 0.05
# Nor is one worth a number whose interval reaches further than so many of its steps either way.
WIDEST_STEPS = 25.0
BLIND = "nothing in these recordings depends on it"


def sensitivities(residuals: Residuals, free_constants: FreeConstants, z: Array) -> tuple[Array, Array]:
    """Return (residuals, their derivatives), each times the root of its robust weight."""
    errors = free_constants.errors(residuals, z)
    high = free_constants.bounds[1]
    slopes = jacobian(lambda v: free_constants.errors(residuals, v), z, errors, np.full(len(z), PROBE), high)
    root = np.sqrt(weights(errors))
    return errors * root, slopes * root[:, None]


def at_bounds(free_constants: FreeConstants, z: Array, identified: npt.NDArray[np.bool_]) -> dict[int, str]:
    """Return the constants a fit pressed against a bound, which is no measurement of them."""
    low, high = free_constants.bounds
    at = [k for k in np.flatnonzero(identified) if not low[k] + 1e-6 < z[k] < high[k] - 1e-6]
    return {
        int(
            k
        ): f"it fits best at its bound, {free_constants.values(z)[k]:g} {free_constants.constants[k].unit}"
        for k in at
    }


def identifiable(
    residuals: Residuals, free_constants: FreeConstants, z: Array, pressed: Mapping[int, str]
) -> tuple[npt.NDArray[np.bool_], dict[int, str]]:
    """Return which constants the recordings tell, and of the others why not.

    One by one, in the order they are trusted: what its sensitivity has that no combination of those before it has.
    """
    errors, slopes = sensitivities(residuals, free_constants, z)
    # Residuals larger than noise make constants less certain than noise alone would.
    size = max(float(np.sqrt(np.mean(errors**2))), 1.0)
    identified, reasons = np.zeros(len(z), bool), dict(pressed)
    for k, constant in enumerate(free_constants.constants):
        if k in pressed:
            continue
        column, taken = slopes[:, k], slopes[:, identified]
        whole = float(np.linalg.norm(column))
        if whole < 1e-6:
            reasons[k] = BLIND
            continue
        along = np.linalg.lstsq(taken, column, rcond=None)[0] if taken.size else np.zeros(0)
        own = float(np.linalg.norm(column - taken @ along)) if taken.size else whole
        if own < LEAST_SINE * whole:
            reasons[k] = (
                f"it does what {_named(free_constants, identified, along * np.linalg.norm(taken, axis=0))} does"
            )
        elif 2.0 * size / own > WIDEST_STEPS:
            reasons[k] = (
                f"known only to ± {2.0 * size / own * constant.step:.2g} {constant.unit}".removesuffix(" -")
            )
        else:
            identified[k] = True
    return identified, reasons


def _named(free_constants: FreeConstants, identified: npt.NDArray[np.bool_], shares: Array) -> str:
    """Name the constants that carry at least a tenth of the largest share."""
    names = [c.words for c, taken in zip(free_constants.constants, identified, strict=True) if taken]
    large = np.abs(shares) >= 0.1 * np.abs(shares).max()
    return " with ".join(name for name, is_large in zip(names, large, strict=True) if is_large)
