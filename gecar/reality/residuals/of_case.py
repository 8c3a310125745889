"""Recordings side by side with their replays: the residuals every later stage works on."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.residuals.of_recording import Cells, Strip

Array = npt.NDArray[np.float64]


class Comparison:
    """Recordings side by side with their replays, in motion or in what the colour sensor saw.

    Sight is compared along the measured path, so that what moves the robot and what blinds it come apart: neither
    kind of effect changes the other's residuals.

    Parameters
    ----------
    strips
        The recordings.
    sight
        Whether to compare what the colour sensor saw, or the motion.
    pool
        Threads that replay.
    """

    def __init__(self, strips: Sequence[Strip], sight: bool, pool: ThreadPoolExecutor) -> None:
        self.strips = tuple(s for s in strips if s.looks) if sight else tuple(strips)
        self.sight = sight
        self._pool = pool
        self._keep: npt.NDArray[np.bool_] = np.zeros(0, np.bool_)
        self.replays = 0

    def set_path(self, physics: npt.NDArray[Any], colour: Array | None = None) -> None:
        """Set the path sight is based on: as a model sees it, with noise of a colour."""
        for strip in self.strips:
            strip.path_colour = np.ones(3) if colour is None else np.sqrt(colour)
        list(self._pool.map(lambda strip: strip.set_path(physics), self.strips))
        self._keep = np.zeros(0, np.bool_)

    def errors(self, physics: npt.NDArray[Any]) -> Array:
        """Return the whitened residuals, shape (n,); samples that are not there are left out."""
        self.replays += len(self.strips)
        parts = list(self._pool.map(lambda strip: strip.errors(physics, self.sight), self.strips))
        everything = np.concatenate(parts) if parts else np.zeros(0)
        if len(self._keep) != len(everything):
            self._keep = ~np.isnan(everything)
        return np.clip(np.nan_to_num(everything[self._keep], nan=1e3), -1e3, 1e3)

    @property
    def reading_sd(self) -> Array:
        """How uncertain each residual of sight is, the path's part included [%], shape (n,); known after `errors`."""
        return np.concatenate([strip.reading_sd for strip in self.strips])[self._keep]

    @property
    def offsets(self) -> Array:
        """How late each recording's camera clock is taken to be [s], shape (recordings,)."""
        return np.array([strip.film.offset_s for strip in self.strips])

    def set_offsets(self, offsets: Array) -> None:
        """Take the camera clocks to be late by so much [s]."""
        for strip, offset in zip(self.strips, offsets, strict=True):
            strip.film.offset_s = float(offset)

    def set_mark(self, mark: Array) -> None:
        """Take the poses to be those of a camera's mark on the robot; see `axle_pose`."""
        for strip in self.strips:
            strip.film.set_mark(mark)

    @property
    def cells(self) -> Cells:
        """Where each residual comes from; known after the first `errors`."""
        parts = [strip.cells(i, self.sight) for i, strip in enumerate(self.strips)]
        return Cells(
            np.concatenate([c.recording for c in parts])[self._keep],
            np.concatenate([c.channel for c in parts])[self._keep],
            np.concatenate([c.t_s for c in parts])[self._keep],
        )
