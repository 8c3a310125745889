"""Quantiles of times to GOAL, the same in tables, pictures and reports."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


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
