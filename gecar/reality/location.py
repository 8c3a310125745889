"""Where simulation and reality part: in which channel, in what motion, when, and at which place on the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.comparison import CHANNELS, Cells, Strip
from gecar.reality.regimes import regime_masks
from gecar.reality.verdict import Place

Array = npt.NDArray[np.float64]

BIN_S = 0.1
SHIFTS = 499
MOST = 8
CLIP = 30.0
WORTH = 0.3  # excess energy a sample, in noise variances, below which a channel has nothing to show
PLACE_RADII_M = (0.1, 0.2, 0.3)


class Map:
    """Whitened energy of a case by channel, recording and time.

    Attributes
    ----------
    energy
        Mean square of a bin's residuals, less noise, shape (channels, recordings, bins); 0 where nothing was measured.
    masks
        Regimes by name, each of shape (recordings, bins).
    """

    def __init__(
        self, strips: Sequence[Strip], parts: Sequence[tuple[Array, Cells]], physics: npt.NDArray[np.void]
    ) -> None:
        self.strips = tuple(strips)
        self.bins = max(int(s.film.t[-1] / BIN_S) + 1 for s in strips)
        shape = (len(CHANNELS), len(strips), self.bins)
        total, count = np.zeros(shape), np.zeros(shape)
        for errors, cells in parts:
            at = (cells.channel, cells.recording, np.minimum((cells.t_s / BIN_S).astype(int), self.bins - 1))
            np.add.at(total, at, np.clip(errors, -CLIP, CLIP) ** 2 - 1.0)
            np.add.at(count, at, 1.0)
        self.energy = np.where(count > 0, total, 0.0)
        self.samples = count
        self.masks, self.path = regime_masks(self.strips, physics, self.bins, BIN_S)

    def places(self, rng: np.random.Generator) -> tuple[Place, ...]:
        """Return where energy gathers more than chance lets it, the most telling first."""
        excess = np.maximum(self.energy.sum(axis=(1, 2)), 0.0)
        mean = excess / np.maximum(self.samples.sum(axis=(1, 2)), 1.0)
        found = []
        for channel in np.flatnonzero((mean > WORTH) & (excess > 0.02 * excess.max())):
            for name, mask in self.masks.items():
                entry = self._judge(int(channel), name, mask, rng)
                if entry is not None:
                    found.append((excess[channel] * entry[0], entry[1]))
            spot = self._spot(int(channel), rng)
            if spot is not None:
                found.append((excess[channel] * spot[0], spot[1]))
        found.sort(key=lambda pair: -pair[0])
        return tuple(place for _, place in found[:MOST])

    def _judge(
        self, channel: int, name: str, mask: npt.NDArray[np.bool_], rng: np.random.Generator,
        spot: tuple[float, float, float] | None = None,
    ) -> tuple[float, Place] | None:  # fmt: skip
        """Return how telling a regime is, and its entry; None where chance would do as well."""
        energy = self.energy[channel]
        whole = energy.sum()
        there = mask & (self.samples[channel] > 0)
        covered = there.sum() / max((self.samples[channel] > 0).sum(), 1)
        if whole <= 0.0 or not 0.01 < covered < 0.9:
            return None
        inside = float(energy[mask].sum())
        share = inside / whole
        drawn = _shifted(energy, mask, rng)
        p = float((1 + np.sum(drawn >= inside)) / (1 + SHIFTS))
        if p > 0.05 or share <= covered:
            return None
        loud, spans = self._spans(channel, mask)
        place = Place(
            CHANNELS[channel],
            name,
            round(float(min(share, 1.0)), 3),
            p,
            spans,
            self.strips[loud].recording.name,
            spot,
        )
        return float((share - covered) * np.sqrt(share)), place

    def _spans(
        self, channel: int, mask: npt.NDArray[np.bool_]
    ) -> tuple[int, tuple[tuple[float, float], ...]]:
        """Return the loudest recording within a regime, and the spans that hold most of its energy."""
        group = _GROUPS[channel]
        energy = np.maximum(self.energy[list(group)].sum(axis=0), 0.0)
        chosen = np.where(mask, energy, 0.0)
        loud = int(np.argmax(chosen.sum(axis=1)))
        order = np.argsort(-chosen[loud])
        gathered = np.cumsum(chosen[loud][order])
        kept = np.zeros(self.bins, bool)
        kept[order[: 1 + int(np.searchsorted(gathered, 0.6 * gathered[-1]))]] = True
        edges = np.flatnonzero(np.diff(np.r_[0, kept.astype(int), 0]))
        spans = [
            (round(float(a) * BIN_S, 2), round(float(b) * BIN_S, 2))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]
        return loud, tuple(spans)

    def _spot(self, channel: int, rng: np.random.Generator) -> tuple[float, Place] | None:
        """Return the disc on the floor that holds most energy beyond its share of the time."""
        seen = ~np.isnan(self.path[:, :, 0]) & (self.samples[channel] > 0)
        energy = self.energy[channel]
        whole = energy[seen].sum()
        if seen.sum() < 50 or whole <= 0.0:
            return None
        best: tuple[float, tuple[float, float, float]] | None = None
        for x, y in np.unique(np.round(self.path[seen] / 0.1).astype(int), axis=0) * 0.1:
            distance = np.hypot(self.path[:, :, 0] - x, self.path[:, :, 1] - y)
            for radius in PLACE_RADII_M:
                inside = seen & (distance < radius)
                gain = energy[inside].sum() / whole - 1.5 * inside.sum() / seen.sum()
                if best is None or gain > best[0]:
                    best = (float(gain), (round(float(x), 2), round(float(y), 2), radius))
        if best is None or best[0] < 0.3:
            return None
        x, y, radius = best[1]
        mask = seen & (np.hypot(self.path[:, :, 0] - x, self.path[:, :, 1] - y) < radius)
        return self._judge(channel, "place on the floor", mask, rng, best[1])


def _shifted(energy: Array, mask: npt.NDArray[np.bool_], rng: np.random.Generator) -> Array:
    """Return the energy inside a mask that is shifted in time, in each recording by another random length.

    Blocks stay together, so that what lingers is no surprise; all shifts of a recording at once are a correlation.
    """
    bins = energy.shape[1]
    spectrum = np.fft.rfft(energy, axis=1) * np.conj(np.fft.rfft(mask.astype(float), axis=1))
    inside = np.fft.irfft(spectrum, bins, axis=1)
    shifts = rng.integers(0, bins, (SHIFTS, len(energy)))
    drawn: Array = inside[np.arange(len(energy)), shifts].sum(axis=1)
    return drawn


_GROUPS = {0: (0, 1), 1: (0, 1), 2: (2,), 3: (3,), 4: (4, 5, 6), 5: (4, 5, 6), 6: (4, 5, 6), 7: (7,)}
