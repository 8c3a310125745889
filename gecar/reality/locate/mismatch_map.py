"""Where simulation and reality part: in which channel, in what motion, when, and at which place on the floor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from gecar.reality.locate.misfit_energy import misfit_energy, noise_inflation
from gecar.reality.locate.shift_test import DRAWS, best_disc, regime_p
from gecar.reality.replay.channels import CHANNELS, REFLECTION, ResidualIndex
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.residuals.regimes import regime_masks, spans_of
from gecar.reality.selection.thresholds import NEGLIGIBLE, SIGNIFICANCE
from gecar.reality.verdict import Place

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

ON_THE_FLOOR = "place on the floor"
BIN_S = 0.1
SPOT_M, SPOT_S = 0.15, 0.4  # how far from a spot, and how long after it, what happens there has an effect
MOST = 8
CLIP = 30.0
WORTH = 0.3  # excess energy a sample, in noise variances, below which a channel has nothing to show
SPAN_BINS = 2  # bins a span is made of
STRONGEST = 0.25  # of a channel's energy lies in the spans that are pointed at
GROUPS = (
    [0, 1],
    [2],
    [3],
    [4, 5, 6],
    [REFLECTION],
)  # channels that one sensor measures: they are strong together
POSE_GROUP, READING_GROUP = 3, 4
_GROUP = np.repeat(range(len(GROUPS)), [len(group) for group in GROUPS])


class MismatchMap:
    """Whitened energy of a case by channel, recording and time.

    Parameters
    ----------
    runs
        The recordings.
    errors, index
        Residuals of motion of the robot as it was known, and where they come from.
    before, after
        Physics records of the robot as it was known, and with what was found; of sight, both know what was found to
        move it, for its path is the same.
    moved
        Physics record with what was found to move the robot.
    explained
        Whether motion and sight are explained: then what an effect takes away is what it did; else all there is counts.
    doubted
        Whether what was seen speaks against the path, not the sensor: then the pose comes first.
    spot
        Where all that counts was left, if it is one place.

    Attributes
    ----------
    energy
        Summed squares of a bin's innovations, less noise, shape (channels, recordings, bins); 0 where nothing was
        measured: it is high where an error begins. Readings have no innovations: there it is energy over stretches.
    stretch_energy
        What a mismatch adds up to over a stretch (see `gecar.reality.locate.misfit_energy`), in variances of noise,
        shape (groups of channels, recordings, spans).
    lengths
        How many bins each recording has, shape (recordings,).
    masks
        Regimes by name, each of shape (recordings, bins).
    """

    def __init__(
        self,
        runs: Sequence[RecordingResiduals],
        errors: Array,
        index: ResidualIndex,
        before: Physics,
        moved: Physics,
        after: Physics,
        explained: tuple[bool, bool] = (True, True),
        doubted: bool = False,
        spot: tuple[float, float] | None = None,
    ) -> None:
        self.runs = tuple(runs)
        self.bins = SPAN_BINS * max(int(s.replayer.t[-1] / (SPAN_BINS * BIN_S)) + 1 for s in runs)
        self.lengths = np.array([int(run.replayer.t[-1] / BIN_S) + 1 for run in self.runs])
        shape = (len(CHANNELS), len(runs), self.bins)
        total, count = np.zeros(shape), np.zeros(shape)
        at = (index.channel, index.recording, np.minimum((index.t_s / BIN_S).astype(int), self.bins - 1))
        np.add.at(total, at, np.clip(errors, -CLIP, CLIP) ** 2 - 1.0)
        np.add.at(count, at, 1.0)
        strong, seen = self._stretch_energy(before, moved, after, explained)
        total[REFLECTION], count[REFLECTION] = strong[REFLECTION], seen[REFLECTION]
        self.masks, self.path = regime_masks(self.runs, before, self.bins, BIN_S)
        counts = np.ones(self.path.shape[:2], bool) if spot is None else _around(self.path, spot)
        strong = strong * counts
        self.energy = np.where((count > 0) & counts, total, 0.0)
        self.samples = count
        self._motion_explained, self.doubted, self.spot = explained[0], doubted, spot
        spans = strong.reshape(*strong.shape[:2], -1, SPAN_BINS).sum(axis=3)
        self.stretch_energy = np.stack([spans[group].sum(axis=0) for group in GROUPS])

    def _stretch_energy(
        self, before: Physics, moved: Physics, after: Physics, explained: tuple[bool, bool]
    ) -> tuple[Array, Array]:
        """Return what a mismatch adds up to over a stretch, and the samples, by channel, recording and bin."""
        sums = [misfit_energy(s, before, moved, after, self.bins, BIN_S) for s in self.runs]
        was, left, samples, added = (np.stack([one[k] for one in sums], axis=1) for k in range(4))
        noise = noise_inflation(added, samples, explained[0])[:, None, None]
        # Sight that needs no explanation is the path's noise; motion that needs none may still be told apart.
        known = np.array(
            [explained[0] and bool((was[:REFLECTION] != left[:REFLECTION]).any())] * REFLECTION
            + [explained[1]]
        )
        taken = np.where(known[:, None, None], (was - left) / noise, was / noise - samples)
        return np.where(samples > 0, taken, 0.0), samples

    def places(self, rng: np.random.Generator) -> tuple[Place, ...]:
        """Return where energy gathers more than chance lets it: the strongest sensor first, its most telling regime."""
        excess = np.maximum(self.energy.sum(axis=(1, 2)), 0.0)
        mean = excess / np.maximum(self.samples.sum(axis=(1, 2)), 1.0)
        order = self._order()
        found = []
        most = np.where(np.arange(len(CHANNELS)) < REFLECTION, excess[:REFLECTION].max(), excess[REFLECTION])
        for channel in np.flatnonzero((mean > WORTH) & (excess > NEGLIGIBLE * most)):
            entries = [self._regime(int(channel), name, mask, rng) for name, mask in self.masks.items()]
            entries.append(self._place(int(channel), rng))
            group = order.index(_GROUP[channel])
            found += [(group, excess[channel] * telling, place) for telling, place in filter(None, entries)]
        if order and not any(group == 0 for group, _, _ in found):
            last = self._throughout(max(GROUPS[order[0]], key=lambda k: excess[k]))
            found += [(0, 0.0, last)] if last.p <= SIGNIFICANCE else []
        found.sort(key=lambda entry: (entry[0], -entry[1]))
        return tuple(place for _, _, place in found[:MOST])

    def _order(self) -> list[int]:
        """Return the groups of channels that were measured, the strongest first.

        Where motion itself is not explained, nor is the path to be trusted: what was seen along it comes last.
        """
        strong = self.stretch_energy.sum(axis=(1, 2))
        if self.doubted or not self._motion_explained:
            strong[READING_GROUP] = strong.min() - 1.0
        if self.doubted:
            strong[POSE_GROUP] = strong.max() + 1.0
        if (strong <= 0.0).all():
            strong = np.array([self.energy[group].sum() for group in GROUPS])
        there = [k for k, group in enumerate(GROUPS) if self.samples[group].any()]
        return sorted(there, key=lambda k: -strong[k])

    def _regime(
        self, channel: int, name: str, mask: npt.NDArray[np.bool_], rng: np.random.Generator
    ) -> tuple[float, Place] | None:
        """Return how telling a regime is, and its entry; None where chance would do as well."""
        whole = self.energy[channel].sum()
        covered = self._covered(channel, mask)
        if whole <= 0.0 or not 0.01 < covered < 0.9:
            return None
        p = regime_p(self.energy[channel], mask, self.lengths, rng)
        return self._entry(channel, name, mask, p)

    def _covered(self, channel: int, mask: npt.NDArray[np.bool_]) -> float:
        """Return the share of a channel's bins that lie in a regime."""
        there = self.samples[channel] > 0
        return float((mask & there).sum() / max(there.sum(), 1))

    def _entry(
        self, channel: int, name: str, mask: npt.NDArray[np.bool_], p: float,
        place: tuple[float, float, float] | None = None,
    ) -> tuple[float, Place] | None:  # fmt: skip
        """Return how telling a regime or place is, and its entry; None where it is not significant."""
        covered = self._covered(channel, mask)
        share = float(self.energy[channel][mask].sum() / self.energy[channel].sum())
        if p > SIGNIFICANCE or share <= covered:
            return None
        strong, spans = self._spans(channel)
        name_of = self.runs[strong].recording.name
        entry = Place(CHANNELS[channel], name, round(min(share, 1.0), 3), p, spans, name_of, place)
        return float((share - covered) * np.sqrt(share)), entry

    def _spans(self, channel: int) -> tuple[int, tuple[tuple[float, float], ...]]:
        """Return the recording in which a channel's sensor is strongest, and its strongest spans there."""
        strong = np.maximum(self.stretch_energy[_GROUP[channel]], 0.0)
        order = np.argsort(-strong, axis=None)
        gathered = np.cumsum(strong.ravel()[order])
        kept = np.zeros(strong.size, bool)
        kept[order[: 1 + int(np.searchsorted(gathered, STRONGEST * gathered[-1]))]] = True
        kept = kept.reshape(strong.shape)
        strongest = int(np.argmax(np.where(kept, strong, 0.0).sum(axis=1)))
        span_s = SPAN_BINS * BIN_S
        pairs = spans_of(kept[strongest])
        return strongest, tuple((round(a * span_s, 2), round(b * span_s, 2)) for a, b in pairs)

    def _throughout(self, channel: int) -> Place:
        """Return the entry of a channel that is off whatever the motion: the last resort."""
        count = self.samples[channel].sum()
        p = max(float(ndtr(-self.energy[channel].sum() / np.sqrt(2.0 * count))), 1.0 / (1 + DRAWS))
        strong, spans = self._spans(channel)
        name = self.runs[strong].recording.name
        if self.spot is None:
            return Place(CHANNELS[channel], "throughout", 1.0, round(p, 3), spans, name, None)
        return Place(CHANNELS[channel], ON_THE_FLOOR, 1.0, round(p, 3), spans, name, (*self.spot, SPOT_M))

    def _place(self, channel: int, rng: np.random.Generator) -> tuple[float, Place] | None:
        """Return how telling the best place on the floor is, and its entry."""
        path = np.where((self.samples[channel] > 0)[:, :, None], self.path, np.nan)
        disc = best_disc(self.energy[channel], path, self.lengths, rng)
        if disc is None:
            return None
        place = (disc.x_m, disc.y_m, disc.radius_m)
        return self._entry(channel, ON_THE_FLOOR, disc.inside, disc.p, place)


def _around(path: Array, spot: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Return when a robot was near a spot or had just left it, shape (recordings, bins)."""
    near = np.hypot(path[:, :, 0] - spot[0], path[:, :, 1] - spot[1]) < SPOT_M
    lasting = np.ones(1 + round(SPOT_S / BIN_S))
    return np.stack([np.convolve(row, lasting)[: len(row)] > 0 for row in near])
