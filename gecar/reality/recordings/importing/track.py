"""Paths in time, from encoders or a camera, and those of their features that need no common frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gecar.reality.recordings.columns import Series


@dataclass(frozen=True)
class Track:
    """A path in time: brick odometry, or a camera's poses.

    Attributes
    ----------
    t_s
        Increasing times on its own clock, shape (n,) [s].
    x, y
        Positions in any frame and unit, shape (n,).
    heading
        Headings, unwrapped, in any unit, direction and zero, shape (n,); ``None`` if not seen.
    """

    t_s: Series
    x: Series
    y: Series
    heading: Series | None

    def part(self, rows: slice) -> Track:
        """Return some rows of the track."""
        heading = None if self.heading is None else self.heading[rows]
        return Track(self.t_s[rows], self.x[rows], self.y[rows], heading)


def windows(track: Track, at: Series, window_s: float) -> list[Series]:
    """Return the chord and, if headings are seen, the turn made in the window around each time.

    Parameters
    ----------
    track
        The path.
    at
        Middles of the windows, shape (m,) [s].
    window_s
        Length of the windows [s].

    Returns
    -------
    list
        One or two arrays of shape (m,), in the track's units. Neither depends on its origin, axes or zero of
        heading.
    """
    before, after = at - window_s / 2, at + window_s / 2

    def moved(values: Series) -> Series:
        return np.interp(after, track.t_s, values) - np.interp(before, track.t_s, values)

    chord = np.hypot(moved(track.x), moved(track.y))
    return [chord] if track.heading is None else [chord, moved(track.heading)]


def turning(track: Track, at: Series, window_s: float) -> Series:
    """Return how the path bends: the cross product of the moves before and after each time, shape (m,)."""
    x = [np.interp(at + d, track.t_s, track.x) for d in (-window_s, 0.0, window_s)]
    y = [np.interp(at + d, track.t_s, track.y) for d in (-window_s, 0.0, window_s)]
    return (x[1] - x[0]) * (y[2] - y[1]) - (y[1] - y[0]) * (x[2] - x[1])
