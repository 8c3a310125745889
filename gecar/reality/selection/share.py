"""The share of an effect, as it was fitted, that recordings ask for: 1 where it is right, 0 where it is absent.

The residuals of two models, without the effect and with it, are mixed; the share is the mixture that costs least
(forecast encompassing: the model without encompasses the one with where the share is 0). Half squares cost as much at 0
as at 1 where the share is 1/2; below that the effect as fitted predicts worse than none.

A difference of log-likelihoods has no scale of its own where residuals are correlated: one error that lasts counts in
every sample. The share has one: its standard error, from the scores' sums over half-second spans and their own
autocorrelation, however long that lasts; and the spans that are as good as independent are its degrees of freedom.

Sources: Davidson and MacKinnon, Econometrica 49 (1981) 781 (J test); Harvey, Leybourne, Newbold, J. Business and
Economic Statistics 16 (1998) 254 (its use on forecasts, with Student's t); Newey and West, Econometrica 55 (1987) 703;
Geyer, Statistical Science 7 (1992) 473 (autocovariances summed while they are positive).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from gecar.reality.noise.excess_energy import SPAN_S
from gecar.reality.optimisation.least_squares import curvatures, weights
from gecar.reality.replay.channels import ResidualIndex
from gecar.reality.selection.thresholds import SIGNIFICANCE

Array = npt.NDArray[np.float64]

AS_GOOD_WITHOUT = 0.5  # the share at which half squares are as large with an effect as without
LEAST_CHANGE = 1.0  # squared standard deviations: recordings in which an effect does not show
LEAST_SHOWN = 25.0  # the same: what shows an effect by itself
WHOLLY = 0.25  # by which the bounds of a share may differ from 1 where all of an effect is asked for
ROUNDS, LARGEST_MOVE, CLOSE = 50, 0.5, 1e-6  # of Newton's iteration


@dataclass(frozen=True)
class Share:
    """A share with its two one-sided bounds, each at the level `SIGNIFICANCE`."""

    value: float
    low: float
    high: float

    @property
    def margin(self) -> float:
        """By how much it passes: surely more than none is asked for, and not surely so little that none is better."""
        return min(self.low, self.high - AS_GOOD_WITHOUT)

    @property
    def is_whole(self) -> bool:
        """Whether the recordings ask for the whole effect and no more: both bounds are within `WHOLLY` of 1."""
        return self.low > 1.0 - WHOLLY and self.high < 1.0 + WHOLLY


UNSEEN = Share(0.0, -np.inf, np.inf)  # recordings that do not show an effect ask for any share


def share_asked_for(index: ResidualIndex, without: Array, with_effect: Array) -> Share:
    """Return the share of an effect that recordings ask for; `UNSEEN` where it changes nothing in them.

    Parameters
    ----------
    index
        Where the residuals come from.
    without, with_effect
        Whitened residuals of the two models, shape (n,).
    """
    change = without - with_effect
    if float(change @ change) < LEAST_CHANGE:
        return UNSEEN
    value = 0.0
    for _ in range(ROUNDS):
        errors = without - value * change
        w = weights(errors)
        move = float(np.sum(w * errors * change) / np.sum(w * change * change))
        value += min(max(move, -LARGEST_MOVE), LARGEST_MOVE)
        if abs(move) < CLOSE:
            break
    _, reach = _uncertainty(index, without - value * change, change)
    return Share(value, value - reach, value + reach)


def least_share_expected(index: ResidualIndex, errors: Array, change: Array, sure: float) -> float:
    """Return the lower bound of `share_asked_for` to expect for an effect that is right; -inf where it does not show.

    Parameters
    ----------
    index
        Where the residuals come from.
    errors
        Whitened residuals of the right model, shape (n,).
    change
        What leaving the effect out changes in them, shape (n,).
    sure
        By how many standard deviations the estimate may come out too small.
    """
    if float(change @ change) < LEAST_CHANGE:
        return -np.inf
    deviation, reach = _uncertainty(index, errors, change)
    return 1.0 - reach - sure * deviation


def _uncertainty(index: ResidualIndex, errors: Array, change: Array) -> tuple[float, float]:
    """Return a share's standard deviation, and how far its one-sided bounds are from it."""
    variance, spans = _variance_of_sum(index, weights(errors) * errors * change)
    deviation = float(np.sqrt(variance) / np.sum(curvatures(errors) * change * change))
    return deviation, float(stdtrit(max(spans - 1.0, 1.0), 1.0 - SIGNIFICANCE) * deviation)


def spread_of_size(folds: npt.NDArray[np.int32], without: Array, with_effect: Array) -> float:
    """Return the standard deviation, over folds, of the share of an effect that each asks for; each by its weight.

    A cause has one size. What imitates another has the size, in each recording, that imitates best there.
    """
    shares, information = shares_of_groups(folds, without, with_effect)
    if not len(shares):
        return float("inf")
    mean = np.average(shares, weights=information)
    return float(np.sqrt(np.average((shares - mean) ** 2, weights=information)))


def shares_of_groups(
    groups: npt.NDArray[np.integer[Any]], without: Array, with_effect: Array
) -> tuple[Array, Array]:
    """Return the share of an effect that each group of residuals asks for, and the information on it.

    Parameters
    ----------
    groups
        Of each residual, shape (n,).
    without, with_effect
        Whitened residuals of the two models, shape (n,).

    Returns
    -------
    tuple
        Shares, and one over their variances, shape (groups,); groups in which the effect does not show are left out.
    """
    change, w = without - with_effect, weights(with_effect)
    information = np.bincount(groups, w * change * change).astype(float)
    asked = np.bincount(groups, w * without * change)
    known = information > 0.0
    return asked[known] / information[known], information[known]


def _sums_of_spans(index: ResidualIndex, values: Array) -> list[Array]:
    """Return the sums of values, one of each residual, over spans of `SPAN_S`, of each recording."""
    sums = []
    for number in np.unique(index.recording):
        own = index.recording == number
        span = (index.t_s[own] / SPAN_S).astype(int)
        sums.append(np.bincount(span, values[own]).astype(float))
    return sums


def _variance_of_sum(index: ResidualIndex, scores: Array) -> tuple[float, float]:
    """Return the variance of the scores' sum, and how many spans would have it were they independent."""
    series = _sums_of_spans(index, scores)
    alone = sum(float(s @ s) for s in series)
    variance = alone
    for lag in range(1, max(len(s) for s in series)):
        covariance = sum(float(s[:-lag] @ s[lag:]) for s in series if len(s) > lag)
        if covariance <= 0.0:
            break
        variance += 2.0 * covariance
    return variance, sum(map(len, series)) * alone / max(variance, 1e-300)
