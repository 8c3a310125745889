"""Excess energy: what the means of residuals over short blocks hold beyond what noise would leave."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gecar.reality.replay.channels import CHANNELS, ENCODERS, REFLECTION, ResidualIndex

Array = npt.NDArray[np.float64]

BLOCK_S = 0.15  # over which residuals are averaged
SPAN_S = 0.5  # spans whose signs the null distribution draws
WHITE = (*ENCODERS, REFLECTION)  # channels whose noise is white: encoders round, readings are mostly clipped
CHI_SQUARE_MEDIAN = 0.455  # of a chi-square with one degree of freedom
LARGEST_INFLATION = 6.0  # noise correlated over a whole block
LASTING_S = 1.0  # noise a channel has in common with itself so much later is none: a misfit lasts
CLIP = 30.0


class Blocks:
    """Residuals grouped by recordings, spans and blocks of time.

    Attributes
    ----------
    folds
        What is left out together, shape (n,): recordings, or thirds of the time of each where there are one or two.
    parts
        The same, but sixths of the only recording, shape (n,): three parts hardly tell how much they differ by.
    spans
        Half-second spans, shape (n,).
    count
        Number of blocks.
    samples
        Samples in each, shape (count,).
    recording, t_s
        Where each lies, and its middle [s], shape (count,).
    """

    def __init__(self, index: ResidualIndex) -> None:
        self.folds = _folds(index, 3)
        self.parts = self.folds if index.recording.any() else _folds(index, 6)
        self.spans = _group(index, SPAN_S)
        self._of = _group(index, BLOCK_S)
        self.count = int(self._of.max()) + 1 if len(self._of) else 0
        self.samples = np.bincount(self._of, minlength=self.count)
        self._channel = _first(self._of, index.channel)
        groups = (self.spans, self._of, _group(index, BLOCK_S / 3.0), np.arange(len(index.channel)))
        self._scales = [(of, _first(of, index.channel)) for of in groups]
        self.recording = np.zeros(self.count, np.int64)
        self.recording[self._of] = index.recording
        self.t_s = np.bincount(self._of, index.t_s, self.count) / np.maximum(self.samples, 1)
        self._later = self._blocks_later(round(LASTING_S / BLOCK_S))
        self._index = index

    @cached_property
    def moments(self) -> npt.NDArray[np.int64]:
        """Moments, shape (n,): a block's time, in all channels."""
        return _group(replace(self._index, channel=np.zeros_like(self._index.channel)), BLOCK_S)

    def excess_energy(self, errors: Array, inflation: Array | None = None) -> float:
        """Return the energy of block means above what noise would leave.

        Parameters
        ----------
        errors
            Whitened residuals.
        inflation
            As `inflation` returns it; default: that of these residuals.
        """
        return float(np.sum(self._above(self.sums(np.clip(errors, -CLIP, CLIP)), inflation)))

    def excess_by_block(self, errors: Array) -> Array:
        """Return each block's energy above that of its channel's typical (median) block, in units of that, (blocks,).

        Where a misfit is at one place, the typical block holds noise; where it is everywhere, none stands out. Encoders
        are left out: their own errors go with the shaft's angle, not with the place.
        """
        energy = self.sums(np.clip(errors, -CLIP, CLIP)) ** 2 / self.samples
        typical = self._typical_by_block(energy, np.ones(self.count, bool))
        out: Array = np.where(np.isin(self._channel, ENCODERS), 0.0, energy / typical - 1.0)
        return out

    def energy_by_moment(self, errors: Array, judged: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
        """Return each moment's energy over that of the typical (median) judged one, and what is typical.

        Parameters
        ----------
        errors
            Residuals in units of the sensors' noise, shape (n,).
        judged
            Which of them are judged, shape (n,).

        Returns
        -------
        tuple
            Energy, shape (moments,), the mean over channels; and the standard deviation that each residual typically
            has, shape (n,), no less than its sensor's noise.
        """
        energy = self.sums(errors) ** 2 / self.samples
        typical = self._typical_by_block(energy, self.sums(judged.astype(float)) > 0.0)
        of = np.zeros(self.count, np.int64)
        of[self._of] = self.moments
        return np.bincount(of, energy / typical) / np.bincount(of), np.sqrt(typical)[self._of]

    def excess_energy_of_sums(self, sums: Array) -> float:
        """Return the excess energy of residuals of which only each block's sum is known, shape (blocks,)."""
        return float(np.sum(self._above(sums, None)))

    def sums(self, values: Array) -> Array:
        """Return each block's sum of values, shape (blocks,)."""
        return np.bincount(self._of, values, self.count).astype(float)

    def variances(self, errors: Array) -> Array:
        """Return the variance of each channel's means over spans, shape (channels,); 1 for white noise.

        Spans last half a second, a block's time or a third of that, or a sample; that counts which shows most. What a
        model is off by may last, as where a wheel is too large, or pass, as where it answers a command too quickly.
        """
        out = np.ones(len(CHANNELS))
        for of, channel in self._scales:
            energy = np.bincount(of, errors) ** 2 / np.bincount(of)
            total, count = (np.bincount(channel, v, len(CHANNELS)) for v in (energy, np.ones(len(energy))))
            out = np.maximum(out, total / np.maximum(count, 1.0))
        return out

    def inflation(self, errors: Array) -> Array:
        """Return the variance inflation of each channel's block means, shape (channels,); 1 for white noise.

        Correlated noise of a sensor shows in every block, missing physics in some: the typical (median) block tells the
        noise. A misfit may show in every block, too, but it lasts. So the typical difference of two blocks `LASTING_S`
        apart tells the noise as well, and the smaller counts. Encoders round, and the colour sensor mostly reads even
        floor, clipped: theirs is taken for white.
        """
        return self._inflation(self.sums(np.clip(errors, -CLIP, CLIP)))

    def _above(self, sums: Array, inflation: Array | None) -> Array:
        expected = (self._inflation(sums) if inflation is None else inflation)[self._channel]
        above: Array = sums**2 / self.samples / expected - 1.0
        return above

    def _inflation(self, sums: Array) -> Array:
        energy, means = sums**2 / self.samples, sums / self.samples
        first, later = self._later
        changes = (means[later] - means[first]) ** 2 / (1.0 / self.samples[later] + 1.0 / self.samples[first])
        out = np.ones(len(CHANNELS))
        for channel in np.unique(self._channel):
            if channel not in WHITE:
                typical = _typical(energy[self._channel == channel])
                change = changes[self._channel[first] == channel]
                if len(change):
                    typical = min(typical, float(np.median(change)) / CHI_SQUARE_MEDIAN)
                out[channel] = np.clip(typical, 1.0, LARGEST_INFLATION)
        return out

    def _typical_by_block(self, energy: Array, counted: npt.NDArray[np.bool_]) -> Array:
        """Return the energy of the typical counted block of each block's channel, no less than noise, (blocks,)."""
        typical = np.ones(len(CHANNELS))
        for channel in np.unique(self._channel[counted]):
            typical[channel] = max(_typical(energy[counted & (self._channel == channel)]), 1.0)
        return typical[self._channel]

    def _blocks_later(self, lag: int) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Return pairs of blocks of one recording and channel that lie so many blocks apart."""
        place = (self.recording * len(CHANNELS) + self._channel) * 10_000_000 + (self.t_s / BLOCK_S).astype(
            int
        )
        _, first, later = np.intersect1d(place + lag, place, return_indices=True)
        return first, later


def _typical(energy: Array) -> float:
    """Return the energy of the typical (median) block, in variances of its mean, were it noise."""
    return float(np.median(energy)) / CHI_SQUARE_MEDIAN


def _first(of: npt.NDArray[np.int64], values: npt.NDArray[np.int32]) -> npt.NDArray[np.int64]:
    """Return the value that all members of each group have, shape (groups,)."""
    out = np.zeros(int(of.max(initial=-1)) + 1, np.int64)
    out[of] = values
    return out


def _folds(index: ResidualIndex, parts: int) -> npt.NDArray[np.int32]:
    """Return each residual's group, left out together: its recording, or, of one or two, its part of the time."""
    if len(index.recording) and index.recording.max() >= 2:
        return index.recording
    if not len(index.t_s):
        return np.zeros(0, np.int32)
    part = np.minimum((parts * index.t_s / max(index.t_s.max(), 1e-9)).astype(np.int32), parts - 1)
    return (parts * index.recording + part).astype(np.int32)


def _group(index: ResidualIndex, length_s: float) -> npt.NDArray[np.int64]:
    """Return each residual's block of a length, by recording and channel."""
    if not len(index.t_s):
        return np.zeros(0, np.int64)
    key = (index.recording.astype(np.int64) * 16 + index.channel) * 10_000_000 + (
        index.t_s / length_s
    ).astype(np.int64)
    return np.unique(key, return_inverse=True)[1]
