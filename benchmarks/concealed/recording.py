"""From what happened to what a student's files say: sensors' noise, rates, rounding, missing columns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from benchmarks.concealed.colour_sensor import FIELD
from benchmarks.concealed.robot import Concealed
from benchmarks.concealed.truth import ROW_TICKS, Array, History

Ticks = npt.NDArray[np.intp]

# Standard deviations at noise level 1: pose as the practice cases state it, the others as estimated from them
# (reflection: 888, 274, 37 and 2 readings of 100, 99, 98 and 97 on bare floor); gyro: LEGO's resolution, halved.
NOISE = {
    "reflection_pct": 0.8,
    "x_m": 0.001,
    "y_m": 0.001,
    "heading_deg": 0.3,
    "battery_v": 0.0103,
    "yaw_rate_dps": 0.5,
}
POSE = ("x_m", "y_m", "heading_deg")
ANGLES = ("left_angle_deg", "right_angle_deg")
CHANNELS = (*ANGLES, *NOISE)
_FORMATS = {"x_m": ".4f", "y_m": ".4f", "heading_deg": ".2f", "battery_v": ".3f", "yaw_rate_dps": ".1f"}


@dataclass(frozen=True)
class Conditions:
    """How a case was recorded; nothing here is an effect.

    Parameters
    ----------
    columns
        Sensor columns the files hold.
    noise_level
        Times the standard deviations of ``NOISE``.
    coloured_share
        Share of each sensor's noise variance that lingers.
    coloured_time_s
        Time constant of the lingering part [s].
    camera_hz
        Poses per second.
    camera_offsets_s
        Camera clock minus brick clock, per recording [s]: the camera is started by hand.
    """

    columns: tuple[str, ...] = CHANNELS
    noise_level: float = 1.0
    coloured_share: float = 0.0
    coloured_time_s: float = 0.1
    camera_hz: float = 30.0
    camera_offsets_s: tuple[float, ...] = ()

    def camera_offset_s(self, run: int) -> float:
        """Give the camera's clock offset in one recording [s]."""
        return self.camera_offsets_s[run] if self.camera_offsets_s else 0.0


def even_ticks(history: History) -> Ticks:
    """Give the ticks at which a row is written: every 10 ms."""
    return np.arange(0, len(history.time_s), ROW_TICKS)


def channels(
    history: History, concealed: Concealed, camera_offset_s: float = 0.0, ticks: Ticks | None = None
) -> dict[str, Array]:
    """Give what every sensor would report without noise, rounding or gaps, at the recording's rows.

    Parameters
    ----------
    history
        The run.
    concealed
        For what happens between the robot and the pose's column.
    camera_offset_s
        Added to the pose's delay [s].
    ticks
        When rows are written; every 10 ms if not given.

    Returns
    -------
    dict[str, Array]
        One array per name in ``CHANNELS`` (rows,).
    """
    rows = even_ticks(history) if ticks is None else ticks
    angles = np.degrees(history.angles[rows])
    x, y, heading = _seen_pose(history, concealed, rows, concealed.pose_delay + camera_offset_s)
    columns = (
        angles[:, 0],
        angles[:, 1],
        history.light[rows],
        x,
        y,
        np.degrees(heading),
        history.terminal_v[rows],
        np.degrees(history.yaw_rate[rows]),
    )
    return dict(zip(CHANNELS, columns, strict=True))


def noise(name: str, rows: int, conditions: Conditions, rng: np.random.Generator) -> Array:
    """Draw one channel's noise.

    Parameters
    ----------
    name
        A key of ``NOISE``.
    rows
        How many samples, 10 ms apart.
    conditions
        Level and colour.
    rng
        Source of randomness.

    Returns
    -------
    Array
        White noise plus a first-order autoregression, in the channel's unit (rows,).
    """
    size = NOISE[name] * conditions.noise_level
    white, driven = rng.normal(size=rows), rng.normal(size=rows)
    share, keep = conditions.coloured_share, math.exp(-0.01 / conditions.coloured_time_s)
    driven[1:] *= math.sqrt(1.0 - keep**2)
    lingering = lfilter([1.0], [1.0, -keep], driven)
    total: Array = size * (math.sqrt(1.0 - share) * white + math.sqrt(share) * lingering)
    return total


def camera_rows(times_s: Array, camera_hz: float) -> Array:
    """Say in which rows, written at these times [s], a pose arrived (rows,), 0 or 1."""
    frames = np.floor(times_s * camera_hz + 1e-9)
    return np.concatenate([[1.0], (np.diff(frames) > 0.0).astype(np.float64)])


def write_recording(
    path: Path,
    history: History,
    clean: dict[str, Array],
    conditions: Conditions,
    rng: np.random.Generator,
    ticks: Ticks | None = None,
) -> None:
    """Write the CSV file and the TOML file beside it.

    Parameters
    ----------
    path
        Of the CSV file.
    history
        The run, for its commands and the sensor readings its controller saw.
    clean
        As :func:`channels` gives it.
    conditions
        Noise, camera rate, columns.
    rng
        Source of randomness.
    ticks
        The same as for ``clean``.
    """
    ticks = even_ticks(history) if ticks is None else ticks
    times, commands, readings = history.time_s[ticks], history.commands[ticks], history.readings[ticks]
    rows = len(times)
    frames = camera_rows(times, conditions.camera_hz)
    texts = {"t_s": [f"{time:.4f}" for time in times]}
    for side, name in enumerate(("left_duty_pct", "right_duty_pct")):
        texts[name] = [str(round(value)) for value in commands[:, side]]
    for name in CHANNELS:
        if name in ANGLES:
            values = [str(round(value)) for value in clean[name] + rng.uniform(-0.5, 0.5)]
        elif name == "reflection_pct":
            values = [str(round(value)) for value in readings]
        else:
            noisy = clean[name] + noise(name, rows, conditions, rng)
            values = [format(value, _FORMATS[name]) for value in noisy]
        if name in POSE:
            values = [value if frame else "" for value, frame in zip(values, frames, strict=True)]
        if name in conditions.columns:
            texts[name] = values
    lines = [",".join(texts), *map(",".join, zip(*texts.values(), strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    beside = 'robot = "ev3"\ncourse = "paper"\nrig = "floor"\n'
    path.with_suffix(".toml").write_text(beside, encoding="utf-8", newline="\n")


def _seen_pose(
    history: History, concealed: Concealed, ticks: Ticks, late_s: float
) -> tuple[Array, Array, Array]:
    """Pose as the camera has it: late, through its lens, from its slowly turning mount."""
    times = history.time_s[ticks]
    pose = np.stack([np.interp(times - late_s, history.time_s, column) for column in history.pose.T])
    away = pose[:2] - np.array(FIELD)[:, None] / 2.0
    away = away * (1.0 + concealed.lens * np.sum(away**2, axis=0))
    turn = math.radians(concealed.pose_drift_deg) * times
    x = FIELD[0] / 2.0 + np.cos(turn) * away[0] - np.sin(turn) * away[1]
    y = FIELD[1] / 2.0 + np.sin(turn) * away[0] + np.cos(turn) * away[1]
    return x, y, pose[2] + turn
