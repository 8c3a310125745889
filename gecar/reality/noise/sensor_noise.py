"""What noise alone does to a case's recordings, estimated from their fastest changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.replayer import USUAL_NOISE, Replayer, replayer_of
from gecar.reality.replay.smoothed_path import SMOOTH_S

Array = npt.NDArray[np.float64]
MAD = 1.4826  # standard deviation of a normal distribution per median absolute deviation

# What the simulation itself is trusted to, as a share of the motion over the memory: against the 3D engine, angles and
# distances agreed within 0.1 %, headings within 0.1 % (see docs on the dynamics).
TRUST = 0.0005
# A path's errors linger while the sensor crosses an edge: many samples, one event.
PATH_CAUTION = 2.0

# Fields of a recording that share one standard deviation.
_FIELDS = (
    ("left_angle_rad", "right_angle_rad"),
    ("battery_v",),
    ("yaw_rate_rad_s",),
    ("x_m", "y_m"),
    ("heading_rad",),
)


@dataclass(frozen=True)
class Noise:
    """Standard deviations of a case.

    Attributes
    ----------
    sd
        Encoder [rad], battery [V], yaw rate [rad/s], x and y [m], heading [rad], shape (5,).
    walk
        Process noise of the pose, a random walk: [m/sqrt(s)], [rad/sqrt(s)], shape (2,).
    reflection_sd
        Of a reading on an even floor [%].
    path_sd
        Of the smoothed path [m, m, rad], shape (3,).
    """

    sd: Array
    walk: Array
    reflection_sd: float
    path_sd: Array


def estimate_noise(recordings: Sequence[Recording], physics: npt.NDArray[Any], memory_s: float) -> Noise:
    """Estimate noise from second differences of a replay's residuals, in which errors of the motion hardly show.

    Parameters
    ----------
    recordings
        Of one robot.
    physics
        Record of the robot as far as it is known, shape (1,).
    memory_s
        The memory replays will have [s].
    """
    replayers = [replayer_of(r, memory_s=memory_s) for r in recordings]
    left: list[list[Array]] = [[] for _ in range(5)]
    speeds, turns, paces = [], [], []
    for replayer in replayers:
        rows, row_errors, poses, _ = replayer.play(physics)
        sd = replayer.inputs.sd
        for k, into in ((0, 0), (1, 0), (2, 1), (3, 2)):
            left[into].append(_second_differences(row_errors[:, k] * sd[into]))
        for k, into in ((0, 3), (1, 3), (2, 4)):
            left[into].append(_second_differences(replayer.inputs.pose[:, k] - poses[:, k]))
        speeds += [rows[:, 7], rows[:, 8]]
        paces.append(rows[:, 9])
        turns.append(rows[:, 3])
    sd = np.array([_spread(parts, usual) for parts, usual in zip(left, USUAL_NOISE, strict=True)])
    rounding = _rounding(recordings)
    motion = _rms(speeds) * memory_s * TRUST
    sd[0] = np.sqrt(max(sd[0], rounding[0]) ** 2 + motion**2)
    walk = np.array([2.0 * TRUST * _rms(paces) + 1e-4, TRUST * _rms(turns) + 2e-4])
    sd = np.maximum(_stated(recordings, sd), rounding)
    frames = max(_frames_per_smoothing(replayers), 1.0)
    path_sd = PATH_CAUTION * np.array([sd[3], sd[3], sd[4]]) / np.sqrt(frames)
    return Noise(sd, walk, _reflection_sd(recordings), path_sd)


def _second_differences(values: Array) -> Array:
    kept = values[~np.isnan(values)]
    return np.diff(kept, 2) / np.sqrt(6.0)


def _spread(parts: Sequence[Array], usual: float) -> float:
    values = np.concatenate(list(parts)) if parts else np.zeros(0)
    if len(values) < 20:
        return float(usual)
    spread = MAD * float(np.median(np.abs(values - np.median(values))))
    return spread if spread > 0.0 else 0.1 * float(usual)


def _rms(parts: Sequence[Array]) -> float:
    values = np.concatenate(list(parts))
    return float(np.sqrt(np.mean(values**2)))


def _rounding(recordings: Sequence[Recording]) -> Array:
    """Return the standard deviations that rounding alone leaves, shape (5,): a quantum over the root of 12.

    A quantum is the smallest change a channel reports, single outliers aside.
    """
    return np.array([_quantum(recordings, fields) for fields in _FIELDS]) / np.sqrt(12.0)


def _quantum(recordings: Sequence[Recording], fields: Sequence[str]) -> float:
    steps = []
    for values in (getattr(r, field) for r in recordings for field in fields):
        change = np.abs(np.diff(values[~np.isnan(values)]))
        change = change[change > 1e-9]
        if len(change):
            steps.append(np.quantile(change, 0.02))
    return float(min(steps)) if steps else 0.0


def _reflection_sd(recordings: Sequence[Recording]) -> float:
    """Return the noise of a reading where the floor is even; clipped readings show only half of it."""
    kept = []
    for r in recordings:
        readings = r.reflection_pct[~np.isnan(r.reflection_pct)]
        if len(readings) > 20:
            change = np.diff(readings, 2) / np.sqrt(6.0)
            even = np.abs(np.convolve(readings, np.ones(3) / 3, "valid") - readings[1:-1]) < 8.0
            kept.append(change[even])
    if not kept:
        return 1.0
    spread = np.concatenate(kept)
    near = spread[np.abs(spread) < 4.0]
    return max(1.25 * float(np.sqrt(np.mean(near**2))) if len(near) else 1.0, 0.5)


def _frames_per_smoothing(replayers: Sequence[Replayer]) -> float:
    gaps = [np.median(np.diff(r.inputs.pose_t)) for r in replayers if len(r.inputs.pose_t) > 2]
    return float(3.5 * SMOOTH_S / np.median(gaps)) if gaps else 1.0


def _stated(recordings: Sequence[Recording], sd: Array) -> Array:
    """Take what the files state about their noise, where they do."""
    out = sd.copy()
    for k, names in enumerate(_FIELDS):
        said = [r.setup.noise[n] for r in recordings for n in names if r.setup.noise.get(n, 0.0) > 0.0]
        if said:
            out[k] = max(float(np.median(said)), out[k]) if k == 0 else float(np.median(said))
    return out
