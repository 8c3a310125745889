"""Whether a misfit of readings points to the measured path, rather than to the sensor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.residuals.of_recording import RecordingResiduals

REACH_M = 0.03  # how far off a path is thought to be at most: a line and its edges are as wide
EVEN_PCT = 2.0  # what a reading may change by within that reach where the floor is even
AT_FAULT = 4.0  # variances of noise typically left on even floor: then the readings themselves are wrong
LEAST_SAMPLES = 50


def path_in_doubt(runs: Sequence[RecordingResiduals], physics: npt.NDArray[Any]) -> bool:
    """Return whether readings are right, on the median, where the floor should be even for some way around.

    Then what is wrong elsewhere is a matter of place. Where no place of the sensor or the line explains it either, the
    path is left: the camera's.
    """
    left = []
    for run in runs:
        if run.reads:
            middle = run.readings(physics)
            errors = (run.recording.reflection_pct - middle) / run.noise.reflection_sd
            shifts = (np.array([x, y, 0.0]) * REACH_M for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)))
            change = np.max([np.abs(run.readings(physics, shift) - middle) for shift in shifts], axis=0)
            left.append(errors[(change < EVEN_PCT) & ~np.isnan(errors)])
    even = np.concatenate(left) if left else np.zeros(0)
    return len(even) >= LEAST_SAMPLES and float(np.median(even**2)) < AT_FAULT
