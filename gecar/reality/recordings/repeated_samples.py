"""Samples that a log repeats until the sensor is read again: the repeats become blanks.

A sensor that is asked less often than rows are written leaves blanks, as `docs/files.md` has it, or its last value. A
wheel that seems to stand for a tenth of a second and then to jump by forty degrees would look like physics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.recordings.columns import Series

# Columns that are sampled together, and what they are called. Readings, rates and voltages may well stay the same.
TOGETHER = {
    "the wheels' angles": ("left_angle_deg", "right_angle_deg"),
    "the poses": ("x_m", "y_m", "heading_deg"),
}
LEAP = 2.5  # times a column's resolution: more than a step of it, in a moving robot
FEWEST_LEAPS = 20
MOSTLY = 0.8  # share of leaps that follow repeats: of a log without any only those from rest do


def without_repeats(columns: Mapping[str, Series]) -> tuple[dict[str, Series], list[str]]:
    """Return columns with blanks in place of repeated samples, and a warning for each sensor that has any.

    Parameters
    ----------
    columns
        By the file's column name and in its units, each of shape (rows,), with ``t_s``.
    """
    out, told = dict(columns), list[str]()
    for sensor, names in TOGETHER.items():
        there = [name for name in names if name in columns]
        blank = np.isnan([columns[name] for name in there])
        sampled = np.flatnonzero(~np.any(blank, axis=0)) if there else np.zeros(0, int)
        repeats = _repeats([columns[name][sampled] for name in there])
        if not repeats.any():
            continue
        for name in there:
            out[name] = columns[name].copy()
            out[name][sampled[1:][repeats]] = np.nan
        every = float(np.median(np.diff(columns["t_s"][sampled[np.r_[True, ~repeats]]])))
        told.append(
            f"{sensor} are repeated between samples {every:.3g} s apart: repeats are taken for blanks"
        )
    return out, told


def _repeats(samples: Sequence[Series]) -> npt.NDArray[np.bool_]:
    """Return which samples after the first repeat the one before, shape (samples - 1,).

    None do where few leaps follow a repeat.
    """
    if not samples or len(samples[0]) < FEWEST_LEAPS:
        return np.zeros(0, bool)
    steps = np.abs(np.diff(np.stack(samples), axis=1))
    repeats: npt.NDArray[np.bool_] = ~np.any(steps > 0.0, axis=0)
    finest = np.array([of_one[of_one > 0.0].min(initial=np.inf) for of_one in steps])
    leaps = np.flatnonzero(np.any(steps > LEAP * finest[:, None], axis=0)[1:]) + 1
    repeated = len(leaps) >= FEWEST_LEAPS and np.mean(repeats[leaps - 1]) >= MOSTLY
    return repeats if repeated else np.zeros(len(repeats), bool)
