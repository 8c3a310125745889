"""Quantiles of times to GOAL, the same in tables, pictures and reports."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats


def quantile(times: npt.ArrayLike, share: float, axis: int | None = None) -> npt.NDArray[np.float64]:
    """Return the least of the times that a share of them do not exceed; an even number's upper median.

    A mean of two would be infinite or made up where one of them did not get to GOAL.

    Parameters
    ----------
    times
        At least one along the axis; inf, or 10^4, where a run did not get there.
    share
        0..1.
    axis
        Along which; None: of all.
    """
    found: npt.NDArray[np.float64] = np.quantile(np.asarray(times, float), share, axis=axis, method="higher")
    return found


def median_interval(times: npt.ArrayLike, level: float = 0.95) -> tuple[float, float]:
    """Return an exact interval of a median, from the order of the times (`scipy.stats.quantile_test`).

    Parameters
    ----------
    times
        May be inf, where a run did not get there (runs,).
    level
        Its least coverage, 0..1. From five runs there is none of 95 %: (nan, nan).
    """
    values = np.asarray(times, float)
    if not values.size:
        return float("nan"), float("nan")
    interval: Any = stats.quantile_test(values, q=0.0, p=0.5).confidence_interval(level)
    low, high = interval
    return (float("nan"), float("nan")) if np.isnan([low, high]).any() else (float(low), float(high))
