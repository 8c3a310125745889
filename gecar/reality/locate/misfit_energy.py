"""The energy of a mismatch by channel and time, over stretches that are each replayed from their own start.

Innovations tell where an error begins; how much of it there is, and in which channel, shows over a stretch, in which an
error of the heading has moved the position. Start angles and start pose of every stretch are nuisances.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.excess_energy import CHI_SQUARE_MEDIAN, LARGEST_INFLATION
from gecar.reality.noise.sensor_noise import PATH_CAUTION
from gecar.reality.replay.channels import CHANNELS, REFLECTION
from gecar.reality.replay.replayer import Replayer
from gecar.reality.replay.rigid_alignment import pose_errors
from gecar.reality.residuals.of_recording import RecordingResiduals

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

STRETCH_S = 2.0  # the longest that stays honest: over 12 s a fake friction closes what no effect explains
LEAST_SAMPLES = 5
CORRELATED = (2, 3, 4, 5, 6)  # channels whose noise is correlated: all but encoders and reflection
LARGEST_LASTING = 20.0  # noise that lasts longer than a bin


def misfit_energy(
    run: RecordingResiduals, before: Physics, moved: Physics, after: Physics, bins: int, bin_s: float
) -> tuple[Array, Array, Array, Array]:
    """Return summed squares of whitened errors before and after, samples, and sums after, shape (channels, bins) each.

    Parameters
    ----------
    run
        The recording; it has a path where its colour sensor read something.
    before, moved, after
        Physics records, shape (1,): of the robot as it was known, with what was found to move it, and with all that
        was found. Motion is compared under the first and the last; readings, along one path, under the last two.
    bins, bin_s
        How many bins, and their length [s].
    """
    out = np.zeros((4, len(CHANNELS), bins))
    for k, physics in enumerate((before, after)):
        for channel, times, errors in stretch_errors(run, physics):
            at = np.minimum((times / bin_s).astype(int), bins - 1)
            np.add.at(out[k, channel], at, errors**2)
            if k == 1:
                np.add.at(out[2, channel], at, 1.0)
                np.add.at(out[3, channel], at, errors)
    if run.reads:
        _add_readings(run, moved, after, out, bin_s)
    return out[0], out[1], out[2], out[3]


def stretch_errors(run: RecordingResiduals, physics: Physics) -> list[tuple[int, Array, Array]]:
    """Return, for each channel of motion, its number in `CHANNELS`, times [s] and whitened errors.

    Every stretch is replayed from its own start: start angles and start pose are taken out.
    """
    replayer = run.replayer.open_loop()
    rows, _, poses, _ = replayer.play(physics)
    return [*_of_rows(replayer, rows), *_of_poses(replayer, poses)]


def noise_inflation(sums: Array, samples: Array, explained: bool) -> Array:
    """Return how much more than white noise each channel's noise adds up to in a bin, shape (channels,).

    By the typical bin of what is left: correlated noise shows in all bins, missing physics in some. Where what is left
    is not explained, less of it can be noise.
    """
    out = np.ones(len(CHANNELS))
    for channel in CORRELATED:
        there = samples[channel] > 0
        if there.any():
            middle = np.median(sums[channel][there] ** 2 / samples[channel][there]) / CHI_SQUARE_MEDIAN
            out[channel] = np.clip(middle, 1.0, LARGEST_LASTING if explained else LARGEST_INFLATION)
    return out


def _stretches(times: Array) -> npt.NDArray[np.intp]:
    return (times / STRETCH_S).astype(int)


def _of_rows(replayer: Replayer, rows: Array) -> list[tuple[int, Array, Array]]:
    """Return channel, times and errors of what the brick measures."""
    measured = replayer.measured
    out = []
    for channel in range(4):
        seen = ~np.isnan(measured[:, channel])
        errors = (measured[seen, channel] - rows[seen, channel]) / replayer.inputs.sd[max(channel - 1, 0)]
        times = replayer.t[seen]
        if channel < 2:
            of = _stretches(times)
            count = np.bincount(of)
            errors = errors - (np.bincount(of, errors) / np.maximum(count, 1))[of]
        out.append((channel, times, errors))
    return out


def _of_poses(replayer: Replayer, poses: Array) -> list[tuple[int, Array, Array]]:
    """Return channel, times and errors of the pose, each stretch's start pose fitted."""
    seen = ~np.isnan(replayer.inputs.pose).any(axis=1)
    pose, times, sd = replayer.inputs.pose[seen], replayer.inputs.pose_t[seen], replayer.inputs.sd[3:5]
    errors, of = np.zeros((len(times), 3)), _stretches(times)
    for stretch in np.unique(of):
        at = of == stretch
        if at.sum() >= LEAST_SAMPLES:
            errors[at] = pose_errors(pose[at], poses[seen][at], sd)
    return [(4 + k, times, errors[:, k] / sd[k // 2]) for k in range(3)]


def _add_readings(run: RecordingResiduals, before: Physics, after: Physics, out: Array, bin_s: float) -> None:
    """Add what the colour sensor saw, in standard deviations of a reading; what the path leaves is expected."""
    read = run.recording.reflection_pct
    assert run.nuisances.path is not None
    reading_sd = run.nuisances.path.reading_sd
    seen = ~np.isnan(read - reading_sd)
    at = np.minimum((run.replayer.t[seen] / bin_s).astype(int), out.shape[2] - 1)
    sd = run.noise.reflection_sd
    surplus = ((reading_sd[seen] / sd) ** 2 - 1.0) / PATH_CAUTION**2
    for k, physics in enumerate((before, after)):
        errors = (read[seen] - run.readings(physics)[seen]) / sd
        np.add.at(out[k, REFLECTION], at, errors**2 - surplus)
    np.add.at(out[2, REFLECTION], at, 1.0)
