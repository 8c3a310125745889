"""How loud a mismatch is, by channel and time, over stretches short enough to be re-based at their own start.

Innovations tell where an error begins; how much of it there is, and in which channel, shows over a stretch: there a
heading that is off has carried the position away. Start angles and start pose of every stretch are nuisances.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.excess_energy import CHI_SQUARE_MEDIAN, MOST_COLOUR
from gecar.reality.noise.sensor_noise import PATH_CAUTION
from gecar.reality.replay.replayer import Film
from gecar.reality.residuals.of_recording import CHANNELS, Strip

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

STRETCH_S = 2.0  # the longest that stays honest: over 12 s a fake friction closes what no effect explains
LEAST_SAMPLES = 5
LINGERING = (2, 3, 4, 5, 6)  # channels whose noise lingers: all but encoders and reflection
MOST_LINGERING = 20.0  # noise that lasts longer than a bin
TURNS = 3  # Gauss-Newton's, for a start heading


def loudness(
    strip: Strip, before: Physics, moved: Physics, after: Physics, bins: int, bin_s: float
) -> tuple[Array, Array, Array, Array]:
    """Return summed squares of whitened errors before and after, samples, and sums after, shape (channels, bins) each.

    Parameters
    ----------
    strip
        The recording; its path is set where its colour sensor looks.
    before, moved, after
        Physics records, shape (1,): of the robot as it was known, with what was found to move it, and with all that
        was found. Motion is compared under the first and the last, sight, whose path the last two share, under these.
    bins, bin_s
        How many bins, and their length [s].
    """
    out = np.zeros((4, len(CHANNELS), bins))
    for k, physics in enumerate((before, after)):
        for channel, times, errors in stretch_errors(strip, physics):
            at = np.minimum((times / bin_s).astype(int), bins - 1)
            np.add.at(out[k, channel], at, errors**2)
            if k == 1:
                np.add.at(out[2, channel], at, 1.0)
                np.add.at(out[3, channel], at, errors)
    if strip.looks:
        _add_sight(strip, moved, after, out, bin_s)
    return out[0], out[1], out[2], out[3]


def stretch_errors(strip: Strip, physics: Physics) -> list[tuple[int, Array, Array]]:
    """Return, for each channel of motion, its number in `CHANNELS`, times [s] and whitened errors.

    Every stretch is replayed from its own start: start angles and start pose are taken out.
    """
    film = strip.film.open_loop()
    rows, _, poses, _ = film.play(physics)
    return [*_of_rows(film, rows), *_of_poses(film, poses)]


def typical(sums: Array, samples: Array, explained: bool) -> Array:
    """Return how much more than white noise each channel's noise adds up to in a bin, shape (channels,).

    By the typical bin of what is left: what lingers shows everywhere, what physics is missing here and there. Where
    that is not explained, less of it can be noise.
    """
    out = np.ones(len(CHANNELS))
    for channel in LINGERING:
        there = samples[channel] > 0
        if there.any():
            middle = np.median(sums[channel][there] ** 2 / samples[channel][there]) / CHI_SQUARE_MEDIAN
            out[channel] = np.clip(middle, 1.0, MOST_LINGERING if explained else MOST_COLOUR)
    return out


def _stretches(times: Array) -> npt.NDArray[np.intp]:
    return (times / STRETCH_S).astype(int)


def _of_rows(film: Film, rows: Array) -> list[tuple[int, Array, Array]]:
    """Return channel, times and errors of what the brick measures."""
    measured = film.reel.measured[len(film.reel.t) - len(film.t) :]
    out = []
    for channel in range(4):
        seen = ~np.isnan(measured[:, channel])
        errors = (measured[seen, channel] - rows[seen, channel]) / film.reel.sd[max(channel - 1, 0)]
        times = film.t[seen]
        if channel < 2:
            of = _stretches(times)
            count = np.bincount(of)
            errors = errors - (np.bincount(of, errors) / np.maximum(count, 1))[of]
        out.append((channel, times, errors))
    return out


def _of_poses(film: Film, poses: Array) -> list[tuple[int, Array, Array]]:
    """Return channel, times and errors of the pose, each stretch's start pose fitted."""
    seen = ~np.isnan(film.reel.pose).any(axis=1)
    pose, times, sd = film.reel.pose[seen], film.reel.pose_t[seen], film.reel.sd[3:5]
    errors, of = np.zeros((len(times), 3)), _stretches(times)
    for stretch in np.unique(of):
        at = of == stretch
        if at.sum() >= LEAST_SAMPLES:
            errors[at] = _aligned(pose[at], poses[seen][at], sd)
    return [(4 + k, times, errors[:, k] / sd[k // 2]) for k in range(3)]


def _aligned(pose: Array, simulated: Array, sd: Array) -> Array:
    """Return pose less simulated pose [m, m, rad], shape (n, 3), the latter moved and turned as a whole to fit best."""
    arm = simulated[:, :2] - simulated[:, :2].mean(axis=0)
    seen = pose[:, :2] - pose[:, :2].mean(axis=0)
    ahead = pose[:, 2] - simulated[:, 2]
    turn = float(ahead.mean())
    for _ in range(TURNS):
        cos, sin = np.cos(turn), np.sin(turn)
        turned = arm @ np.array([[cos, sin], [-sin, cos]])
        slope = np.column_stack([-turned[:, 1], turned[:, 0]])
        pull = np.sum((seen - turned) * slope) / sd[0] ** 2 + np.sum(ahead - turn) / sd[1] ** 2
        turn += pull / (np.sum(slope**2) / sd[0] ** 2 + len(ahead) / sd[1] ** 2)
    return np.column_stack([seen - turned, ahead - turn])


def _add_sight(strip: Strip, before: Physics, after: Physics, out: Array, bin_s: float) -> None:
    """Add what the colour sensor saw, in standard deviations of a reading; what the path leaves is no news."""
    read = strip.recording.reflection_pct
    seen = ~np.isnan(read - strip.reading_sd)
    at = np.minimum((strip.film.t[seen] / bin_s).astype(int), out.shape[2] - 1)
    sd = strip.noise.reflection_sd
    surplus = ((strip.reading_sd[seen] / sd) ** 2 - 1.0) / PATH_CAUTION**2
    for k, physics in enumerate((before, after)):
        errors = (read[seen] - strip.readings(physics)[seen]) / sd
        np.add.at(out[k, 7], at, errors**2 - surplus)
    np.add.at(out[2, 7], at, 1.0)
