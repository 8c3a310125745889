"""Blocks of residuals: what survives averaging over them is structure, not noise."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.reality.residuals.of_recording import CHANNELS, Cells

Array = npt.NDArray[np.float64]

BLOCK_S = 0.15  # structure is what survives averaging over this
SPAN_S = 0.5  # spans whose signs the null draws
STEADY = (0, 1, 7)  # channels whose noise is white: encoders, reflection
CHI_SQUARE_MEDIAN = 0.455
MOST_COLOUR = 6.0  # noise that lingers for longer than a block, wholly
CLIP = 30.0


class Blocks:
    """How residuals gather in recordings, spans and blocks.

    Attributes
    ----------
    folds
        What is left out together, shape (n,).
    spans
        Half-second spans, shape (n,).
    count
        Number of blocks.
    samples
        Samples in each, shape (count,).
    recording, t_s
        Where each lies, and its middle [s], shape (count,).
    """

    def __init__(self, cells: Cells) -> None:
        self.folds = _folds(cells)
        self.spans = _group(cells, SPAN_S)
        self._of = _group(cells, BLOCK_S)
        self.count = int(self._of.max()) + 1 if len(self._of) else 0
        self.samples = np.bincount(self._of, minlength=self.count)
        self._channel = np.zeros(self.count, np.int64)
        self._channel[self._of] = cells.channel
        self.recording = np.zeros(self.count, np.int64)
        self.recording[self._of] = cells.recording
        self.t_s = np.bincount(self._of, cells.t_s, self.count) / np.maximum(self.samples, 1)

    def structure(self, errors: Array, colour: Array | None = None) -> float:
        """Return the energy short averages keep, above what noise of a colour would leave.

        Parameters
        ----------
        errors
            Whitened residuals.
        colour
            As `colour` returns it; default: that of these residuals.
        """
        return float(np.sum(self._above(self._energy(self.sums(np.clip(errors, -CLIP, CLIP))), colour)))

    def excess(self, errors: Array) -> Array:
        """Return each block's structure, in variances of its mean, shape (blocks,); 0 on average for noise."""
        return self._above(self._energy(self.sums(np.clip(errors, -CLIP, CLIP))), None)

    def structure_of_sums(self, sums: Array) -> float:
        """Return the structure of residuals of which only each block's sum is known, shape (blocks,)."""
        return float(np.sum(self._above(self._energy(sums), None)))

    def sums(self, values: Array) -> Array:
        """Return each block's sum of values, shape (blocks,)."""
        return np.bincount(self._of, values, self.count).astype(float)

    def colour(self, errors: Array) -> Array:
        """Return by how much slow noise exceeds white noise in each channel, shape (channels,); 1 for white.

        Sensors' noise lingers everywhere, also where the robot does nothing; what physics is missing shows here and
        there. So the typical block tells the noise. Encoders round, they do not linger; the colour sensor mostly sees
        an even floor, whose noise is clipped.
        """
        return self._colour(self._energy(self.sums(np.clip(errors, -CLIP, CLIP))))

    def _above(self, energy: Array, colour: Array | None) -> Array:
        expected = (self._colour(energy) if colour is None else colour)[self._channel]
        above: Array = energy / expected - 1.0
        return above

    def _colour(self, energy: Array) -> Array:
        out = np.ones(len(CHANNELS))
        for channel in np.unique(self._channel):
            if channel not in STEADY:
                typical = np.median(energy[self._channel == channel]) / CHI_SQUARE_MEDIAN
                out[channel] = np.clip(typical, 1.0, MOST_COLOUR)
        return out

    def _energy(self, sums: Array) -> Array:
        return sums**2 / self.samples


def _folds(cells: Cells) -> npt.NDArray[np.int32]:
    """Return what is left out together: recordings, or thirds of the time where there are too few."""
    if len(cells.recording) and cells.recording.max() >= 2:
        return cells.recording
    if not len(cells.t_s):
        return np.zeros(0, np.int32)
    third = np.minimum((3.0 * cells.t_s / max(cells.t_s.max(), 1e-9)).astype(np.int32), 2)
    return (3 * cells.recording + third).astype(np.int32)


def _group(cells: Cells, length_s: float) -> npt.NDArray[np.int64]:
    """Return each residual's block of a length, by recording and channel."""
    if not len(cells.t_s):
        return np.zeros(0, np.int64)
    key = (cells.recording.astype(np.int64) * 16 + cells.channel) * 10_000_000 + (
        cells.t_s / length_s
    ).astype(np.int64)
    return np.unique(key, return_inverse=True)[1]
