"""From what happened to what a student's files say: sensors' noise, rates, rounding, missing columns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from benchmarks.concealed.colour_sensor import FIELD
from benchmarks.concealed.history import ROW_TICKS, TICK_S, Array, History
from benchmarks.concealed.robot import EV3, KNOT_S, NEUTRAL, Base, Concealed

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


ROBOT_FILE = "robot.toml"
ROBOT = """name = "{base.name}"

[body]
mass = {base.mass}
yaw_inertia = {base.yaw_inertia}
com_ahead = {nominal.com_ahead}
com_height = {nominal.com_height}
track_width = {base.track_width}
wheel_radius = {base.wheel_radius}
caster_ahead = {base.caster_ahead}
length = 0.180
width = 0.150

[motor]
torque_constant = {base.torque_constant}
back_emf_constant = {base.back_emf_constant}
resistance = {base.resistance}
inertia = {base.shaft_inertia}
coulomb_friction = {nominal.coulomb_friction}
backlash = 0.0

[battery]
voltage = {base.supply}
resistance = 0.0

[drive]
duty_cap = 0.80
mode = "duty"

[tyre]
friction = {nominal.tyre_friction}

[colour_sensor]
ahead = {nominal.sensor_ahead}
left = {nominal.sensor_left}
spot_diameter = {nominal.spot_diameter}
white = 100.0
black = 0.0
"""


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
    log_hz
        Rows, and turns of the controller, per second.
    encoder_step_deg
        What the encoders resolve [deg].
    jitter_s
        Largest error of a row's time stamp [s].
    dropped_share
        Share of rows that never reached the file.
    """

    columns: tuple[str, ...] = CHANNELS
    noise_level: float = 1.0
    coloured_share: float = 0.0
    coloured_time_s: float = 0.1
    camera_hz: float = 30.0
    camera_offsets_s: tuple[float, ...] = ()
    log_hz: float = 100.0
    encoder_step_deg: int = 1
    jitter_s: float = 0.0
    dropped_share: float = 0.0

    @property
    def row_ticks(self) -> int:
        """Ticks from row to row."""
        return round(1.0 / (self.log_hz * TICK_S))

    def camera_offset_s(self, run: int) -> float:
        """Give the camera's clock offset in one recording [s]."""
        return self.camera_offsets_s[run] if self.camera_offsets_s else 0.0


def even_ticks(history: History, row_ticks: int = ROW_TICKS) -> Ticks:
    """Give the ticks at which a row is written: every 10 ms, if not said otherwise."""
    return np.arange(0, len(history.time_s), row_ticks)


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
    if concealed.encoder_wave_deg is not None:
        wave, *phases = concealed.encoder_wave_deg
        angles = angles + wave * (np.sin(history.angles[rows] + phases) - np.sin(phases))
    x, y, heading = seen_pose(history, concealed, rows, concealed.pose_delay + camera_offset_s)
    columns = (
        angles[:, 0],
        angles[:, 1],
        history.light[rows],
        x,
        y,
        np.degrees(heading),
        history.terminal_v[rows],
        concealed.gyro_scale * np.degrees(history.yaw_rate[rows]) + concealed.gyro_bias_dps,
    )
    return dict(zip(CHANNELS, columns, strict=True))


def noise(
    name: str, rows: int, conditions: Conditions, rng: np.random.Generator, apart_s: float = 0.01
) -> Array:
    """Draw one channel's noise.

    Parameters
    ----------
    name
        A key of ``NOISE``.
    rows
        How many samples.
    conditions
        Level and colour.
    rng
        Source of randomness.
    apart_s
        Time from sample to sample [s].

    Returns
    -------
    Array
        White noise plus a first-order autoregression, in the channel's unit (rows,).
    """
    size = NOISE[name] * conditions.noise_level
    white, driven = rng.normal(size=rows), rng.normal(size=rows)
    share, keep = conditions.coloured_share, math.exp(-apart_s / conditions.coloured_time_s)
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
    base: Base = EV3,
) -> None:
    """Write the CSV file and the TOML file beside it, and for a robot other than the EV3 its file.

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
    base
        The robot as its file has it.
    """
    ticks = even_ticks(history, conditions.row_ticks) if ticks is None else ticks
    times, commands, readings = history.time_s[ticks], history.commands[ticks], history.readings[ticks]
    rows = len(times)
    frames = camera_rows(times, conditions.camera_hz)
    texts = {"t_s": [f"{time:.4f}" for time in times]}
    for side, name in enumerate(("left_duty_pct", "right_duty_pct")):
        texts[name] = [str(round(value)) for value in commands[:, side]]
    for name in CHANNELS:
        if name in ANGLES:
            step = conditions.encoder_step_deg
            values = [str(step * round(value)) for value in clean[name] / step + rng.uniform(-0.5, 0.5)]
        elif name == "reflection_pct":
            values = [str(round(value)) for value in readings]
        else:
            noisy = clean[name] + noise(name, rows, conditions, rng, 1.0 / conditions.log_hz)
            values = [format(value, _FORMATS[name]) for value in noisy]
        if name in POSE:
            values = [value if frame else "" for value, frame in zip(values, frames, strict=True)]
        if name in conditions.columns:
            texts[name] = values
    if conditions.jitter_s > 0.0:
        late = rng.uniform(0.0, conditions.jitter_s, rows)
        texts["t_s"] = [f"{time:.4f}" for time in times + late - late[0]]
    lines = list(map(",".join, zip(*texts.values(), strict=True)))
    if conditions.dropped_share > 0.0:
        kept = rng.random(rows) >= conditions.dropped_share
        kept[0] = True  # the recording begins with the robot at rest
        lines = [line for line, keep in zip(lines, kept, strict=True) if keep]
    path.write_text("\n".join([",".join(texts), *lines]) + "\n", encoding="utf-8", newline="\n")
    if base != EV3:
        write_robot(path.parent, base)
    robot = EV3.name if base == EV3 else ROBOT_FILE
    beside = f'robot = "{robot}"\ncourse = "paper"\nrig = "floor"\n'
    path.with_suffix(".toml").write_text(beside, encoding="utf-8", newline="\n")


def write_robot(folder: Path, base: Base) -> None:
    """Write the robot file that recordings of a robot other than the EV3 name."""
    text = ROBOT.format(nominal=NEUTRAL, base=base)
    (folder / ROBOT_FILE).write_text(text, encoding="utf-8", newline="\n")


def seen_pose(
    history: History, concealed: Concealed, ticks: Ticks, late_s: float
) -> tuple[Array, Array, Array]:
    """Pose as the camera has it: of its marker, late, from aslant, through its lens, from its slowly turning mount."""
    times = history.time_s[ticks]
    shown = times - late_s if concealed.frame_rate == 0.0 else times / (1.0 + concealed.frame_rate) - late_s
    if concealed.backlog is not None:
        most, period, gone = concealed.backlog
        shown = shown - most * ((times / period + gone) % 1.0)
    if concealed.predictor is None:
        pose = np.stack([np.interp(shown, history.time_s, column) for column in history.pose.T])
    else:
        pose = _predicted(history, shown, *concealed.predictor)
    ahead, left = concealed.marker
    if (ahead, left) != (0.0, 0.0):
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        pose[:2] += [cos * ahead - sin * left, sin * ahead + cos * left]
    away = pose[:2] - np.array(FIELD)[:, None] / 2.0
    if concealed.keystone != (0.0, 0.0):
        away, pose[2] = _askew(away, pose[2], np.array(concealed.keystone))
    if concealed.aspect != 0.0:
        away, pose[2] = _stretched(away, pose[2], concealed.aspect)
    if concealed.stitch is not None:
        away, pose[2] = _stitched(away, pose[2], *concealed.stitch)
    away = away * (1.0 + concealed.lens * np.sum(away**2, axis=0))
    turn = math.radians(concealed.pose_drift_deg) * times + math.radians(concealed.camera_turn_deg)
    if concealed.camera_bump is not None:
        since, shift_x, shift_y, bumped = concealed.camera_bump
        after = times >= since
        away = away + np.outer([shift_x, shift_y], after)
        turn = turn + bumped * after
    if concealed.shake:
        knots = KNOT_S * np.arange(len(concealed.shake))
        shift_x, shift_y, shaken = (
            np.interp(times, knots, column) for column in np.transpose(concealed.shake)
        )
        away, turn = away + np.stack([shift_x, shift_y]), turn + shaken
    x = FIELD[0] / 2.0 + np.cos(turn) * away[0] - np.sin(turn) * away[1]
    y = FIELD[1] / 2.0 + np.sin(turn) * away[0] + np.cos(turn) * away[1]
    if concealed.compass is not None:
        size, periods, phase = concealed.compass
        turn = turn + size * np.sin(periods * pose[2] + phase)
    return x, y, pose[2] + turn


def _predicted(history: History, shown: Array, ahead_s: float, mean_s: float) -> Array:
    """See poses (3, rows) that a tracker extrapolates from earlier ones by the mean velocity until then."""
    keep = math.exp(-TICK_S / mean_s)
    velocity = np.diff(history.pose, axis=0, prepend=history.pose[:1]) / TICK_S
    mean = lfilter([1.0 - keep], [1.0, -keep], velocity, axis=0)
    then = shown - ahead_s
    return np.stack(
        [
            np.interp(then, history.time_s, place) + ahead_s * np.interp(then, history.time_s, speed)
            for place, speed in zip(history.pose.T, mean.T, strict=True)
        ]
    )


def _stitched(
    away: Array, heading: Array, seam_x: float, shift_x: float, shift_y: float, turn: float, larger: float
) -> tuple[Array, Array]:
    """See places (2, rows) and headings beyond a seam by a second camera, whose picture is off."""
    from_seam = seam_x - FIELD[0] / 2.0
    beyond = (away[0] > from_seam).astype(np.float64)
    off_x, off_y, scale = away[0] - from_seam, away[1], 1.0 + larger
    cos, sin = scale * math.cos(turn) - 1.0, scale * math.sin(turn)
    moved = np.stack([cos * off_x - sin * off_y + shift_x, sin * off_x + cos * off_y + shift_y])
    return away + beyond * moved, heading + beyond * turn


def _stretched(away: Array, heading: Array, share: float) -> tuple[Array, Array]:
    """See places (2, rows) and headings by an image that is too wide and too low by a share."""
    wide, high = 1.0 + share, 1.0 - share
    cos, sin = np.cos(heading), np.sin(heading)
    across, along = (high - wide) * cos * sin, wide * cos**2 + high * sin**2
    return away * np.array([[wide], [high]]), heading + np.arctan2(across, along)


def _askew(away: Array, heading: Array, scale_falls: Array) -> tuple[Array, Array]:
    """See places (2, rows) and headings from aslant: a plane's perspective, right in the field's middle."""
    depth = 1.0 + scale_falls @ away
    seen = away / depth
    ahead = np.stack([np.cos(heading), np.sin(heading)])
    bent = ahead - seen * (scale_falls @ ahead)  # how the image moves as the robot moves ahead
    across = ahead[0] * bent[1] - ahead[1] * bent[0]
    return seen, heading + np.arctan2(across, np.sum(ahead * bent, axis=0))
