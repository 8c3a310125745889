"""Whether energy gathers in a regime or at a place more than chance lets it: permutation tests by shifts in time.

What happened is shifted against when it happened, circularly and in each recording by another random length. Energy
that lasts stays together, so that its correlation is no surprise. The place that holds most energy is compared with the
place that would hold most after each shift: looking for it is part of the test.

Source: tests by random circular shifts, Harris, Cell Reports Methods 1 (2021); maxima over many places, Nichols and
Holmes, Human Brain Mapping 15 (2001) 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.selection.thresholds import DISC_SHARE

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Lengths = npt.NDArray[np.int64]

DRAWS = 499
PITCH_M = 0.1
RADII_M = (0.1, 0.2, 0.3)
COVERED = 1.5  # times its share of the time a disc's energy is counted above
FEWEST_BINS = 50


class Disc(NamedTuple):
    """A disc on the floor [m], which bins lie in it, and its p-value."""

    x_m: float
    y_m: float
    radius_m: float
    inside: Mask
    p: float


def regime_p(
    energy: Array, mask: Mask, lengths: Lengths, rng: np.random.Generator, draws: int = DRAWS
) -> float:
    """Return the p-value of the energy inside a regime.

    Parameters
    ----------
    energy
        By recording and bin of time, shape (recordings, bins).
    mask
        When the regime was, of the same shape.
    lengths
        How many bins each recording has, shape (recordings,); what lies beyond is padding.
    rng
        Random generator.
    draws
        Number of shifts.
    """
    sums = _shifted_sums(energy, mask[None], lengths, _shifts(lengths, rng, draws))[0]
    return _p(float(energy[mask].sum()), sums)


def best_disc(
    energy: Array, path: Array, lengths: Lengths, rng: np.random.Generator, draws: int = DRAWS
) -> Disc | None:
    """Return the disc on the floor that holds most energy beyond its share of the time; None: none holds much.

    Parameters
    ----------
    energy, lengths, rng, draws
        As for `regime_p`.
    path
        Positions, shape (recordings, bins, 2) [m]; nan where unknown.
    """
    seen = ~np.isnan(path[:, :, 0])
    whole = energy[seen].sum()
    if seen.sum() < FEWEST_BINS or whole <= 0.0:
        return None
    centres = np.unique(np.round(path[seen] / PITCH_M).astype(int), axis=0) * PITCH_M
    distance = np.hypot(*(path[None, :, :, k] - centres[:, None, None, k] for k in range(2)))
    discs = np.concatenate([seen & (distance < radius) for radius in RADII_M])
    share = COVERED * discs.sum(axis=(1, 2)) / seen.sum()
    gains = (discs * energy).sum(axis=(1, 2)) / whole - share
    best = int(np.argmax(gains))
    if gains[best] < DISC_SHARE:
        return None
    sums = _shifted_sums(energy, discs, lengths, _shifts(lengths, rng, draws))
    p = _p(float(gains[best]), (sums / whole - share[:, None]).max(axis=0))
    x, y = centres[best % len(centres)]
    radius = RADII_M[best // len(centres)]
    return Disc(round(float(x), 2), round(float(y), 2), radius, discs[best], p)


def _shifts(lengths: Lengths, rng: np.random.Generator, draws: int) -> npt.NDArray[np.int64]:
    """Return random shifts [bins], shape (draws, recordings)."""
    return rng.integers(0, np.maximum(lengths, 1), (draws, len(lengths)))


def _shifted_sums(energy: Array, masks: Mask, lengths: Lengths, shifts: npt.NDArray[np.int64]) -> Array:
    """Return the energy inside masks (k, recordings, bins) that are shifted in time, shape (k, draws).

    All shifts of a recording at once are a circular correlation, over the recording's own length.
    """
    total = np.zeros((len(masks), len(shifts)))
    for number, length in enumerate(lengths.tolist()):
        spectrum = np.conj(np.fft.rfft(masks[:, number, :length].astype(float), axis=1))
        inside = np.fft.irfft(np.fft.rfft(energy[number, :length]) * spectrum, length, axis=1)
        total += inside[:, shifts[:, number]]
    return total


def _p(observed: float, drawn: Array) -> float:
    return float((1 + np.sum(drawn >= observed - 1e-9)) / (1 + len(drawn)))
