"""How visible is what a case conceals? Computed from the sealed pairs of worlds, whatever any tool made of the case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from benchmarks.concealed.history import Array
from benchmarks.concealed.recording import ANGLES, CHANNELS, NOISE, POSE, Conditions, camera_rows

Rows = npt.NDArray[np.intp]

WINDOW_S = 2.0  # the longest windows that replays are re-based in
_STEP = {"reflection_pct": 1.0, "yaw_rate_dps": 0.1}  # of rounding; the encoders' is a case's own


@dataclass(frozen=True)
class Visibility:
    """Whitened difference between two worlds, under one case's noise, columns and camera rate.

    ``energy`` (runs, rows, channels) is its square, in the order of ``CHANNELS``; rows without a sample hold 0.
    """

    energy: Array

    @property
    def d_prime(self) -> float:
        """Size of the difference in standard deviations of the best linear detector."""
        return math.sqrt(float(self.energy.sum()))

    def by_channel(self) -> dict[str, float]:
        """Give the share of the energy in each channel."""
        total = max(float(self.energy.sum()), 1e-300)
        return {name: float(self.energy[:, :, k].sum()) / total for k, name in enumerate(CHANNELS)}


def visibility(
    worlds: Mapping[str, Array],
    with_it: str,
    without_it: str,
    conditions: Conditions,
    window_s: float = WINDOW_S,
) -> Visibility:
    """Compare two worlds that were given the same commands.

    Parameters
    ----------
    worlds
        The sealed arrays: ``runK_NAME`` (rows, channels), noise-free.
    with_it, without_it
        Names of the two worlds: ``on`` and ``off``, or ``on`` and ``without_ID``.
    conditions
        The case's noise, columns and camera rate.
    window_s
        The pose and the angles are re-based this often [s], so that a difference counts where it arises.

    Returns
    -------
    Visibility
        What remains after the nuisances of each window, start pose and start angles, are projected out.
    """
    return Visibility(whitened(pairs_of(worlds, with_it, without_it), conditions, window_s) ** 2)


def pairs_of(worlds: Mapping[str, Array], with_it: str, without_it: str) -> list[tuple[Array, Array]]:
    """Give every recording's channels in two worlds; a world that is not there is the first of them."""
    pairs = []
    for run in range(sum(1 for name in worlds if name.endswith("_on"))):
        there = np.asarray(worlds[f"run{run}_{with_it}"], dtype=np.float64)
        name = f"run{run}_{without_it}"
        pairs.append((there, np.asarray(worlds[name], dtype=np.float64) if name in worlds else there))
    return pairs


def whitened(
    pairs: Sequence[tuple[Array, Array]], conditions: Conditions, window_s: float = WINDOW_S
) -> Array:
    """Give the differences between pairs of channels in standard deviations of the noise, nuisances projected out.

    Parameters
    ----------
    pairs
        For every recording, noise-free channels (rows, channels) with and without something.
    conditions, window_s
        As :func:`visibility` takes them.

    Returns
    -------
    Array
        (runs, rows, channels); rows without a sample hold 0.
    """
    rows = round(window_s * conditions.log_hz)
    return np.stack([_run_difference(there, absent, conditions, rows) for there, absent in pairs])


def _run_difference(there: Array, absent: Array, conditions: Conditions, window_rows: int) -> Array:
    found = np.zeros_like(there)
    frames = (
        camera_rows(np.arange(len(there), dtype=np.float64) / conditions.log_hz, conditions.camera_hz) > 0.0
    )
    for first in range(0, len(there) - window_rows, window_rows):
        rows = np.arange(first, first + window_rows)
        for k, name in enumerate(CHANNELS):
            if name in POSE or name not in conditions.columns:
                continue
            difference = _clipped(name, there[rows, k]) - _clipped(name, absent[rows, k])
            nuisance = np.ones((window_rows, 1)) if name in ANGLES else np.zeros((window_rows, 0))
            white = _whitener(name, tuple(range(window_rows)), conditions)
            found[rows, k] = _remainder(white @ difference, white @ nuisance)
        if set(POSE) <= set(conditions.columns):
            seen = rows[frames[rows]]
            found[seen[:, None], _POSE_AT] = _pose_difference(
                there[rows], absent[rows], seen - first, conditions
            )
    return found


_POSE_AT = np.array([CHANNELS.index(name) for name in POSE])


def _pose_difference(there: Array, absent: Array, seen: Rows, conditions: Conditions) -> Array:
    """Move one path onto the other's start, then project out what a wrong start pose would do."""
    here, other = there[:, _POSE_AT], absent[:, _POSE_AT]
    turn = math.radians(here[0, 2] - other[0, 2])
    arm = other[:, :2] - other[0, :2]
    spun = np.column_stack(
        [
            math.cos(turn) * arm[:, 0] - math.sin(turn) * arm[:, 1],
            math.sin(turn) * arm[:, 0] + math.cos(turn) * arm[:, 1],
        ]
    )
    moved = np.column_stack([here[0, :2] + spun, here[0, 2] + other[:, 2] - other[0, 2]])
    difference, path = (here - moved)[seen], spun[seen]
    one, none = np.ones(len(seen)), np.zeros(len(seen))
    slopes = [[one, none, none], [none, one, none], [-path[:, 1], path[:, 0], math.degrees(1.0) * one]]
    whites = [_whitener(name, tuple(seen.tolist()), conditions) for name in POSE]
    signal = np.concatenate([white @ difference[:, k] for k, white in enumerate(whites)])
    nuisance = np.stack(
        [np.concatenate([white @ c[k] for k, white in enumerate(whites)]) for c in slopes], axis=1
    )
    return _remainder(signal, nuisance).reshape(3, -1).T


def _remainder(signal: Array, nuisance: Array) -> Array:
    if nuisance.shape[1] == 0:
        return signal
    fitted: Array = nuisance @ np.linalg.lstsq(nuisance, signal, rcond=None)[0]
    return signal - fitted


def _whitener(name: str, rows: tuple[int, ...], conditions: Conditions) -> Array:
    noise = (conditions.noise_level, conditions.coloured_share, conditions.coloured_time_s)
    step = float(conditions.encoder_step_deg) if name in ANGLES else _STEP.get(name, 0.0)
    return _inverse_root(name, rows, *noise, step, 1.0 / conditions.log_hz)


@cache
def _inverse_root(
    name: str, rows: tuple[int, ...], level: float, share: float, time_s: float, step: float, row_s: float
) -> Array:
    """Inverse Cholesky factor of the noise covariance over these rows: sensor noise and rounding."""
    variance = (NOISE.get(name, 0.0) * level) ** 2
    apart = np.abs(np.subtract.outer(rows, rows)) * row_s
    covariance = variance * share * np.exp(-apart / time_s)
    covariance += np.eye(len(rows)) * (variance * (1.0 - share) + step**2 / 12.0)
    inverse: Array = np.linalg.inv(np.linalg.cholesky(covariance))
    return inverse


def _clipped(name: str, column: Array) -> Array:
    return np.clip(column, 0.0, 100.0) if name == "reflection_pct" else column
