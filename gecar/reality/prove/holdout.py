"""Recordings set aside before anything else, and what a robot is worth on them: whole replays, open loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.reality.invent.corrected_replay import Change
from gecar.reality.noise.sensor_noise import Noise
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.replay.replayer import Film
from gecar.reality.residuals.of_recording import Strip
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]

EVERY = 4  # one recording in so many is set aside
FIRST_SHARE = 0.7  # of a single recording's time is fitted on
_FIELDS = tuple(
    (field, column)
    for column, (field, _) in COLUMNS.items()
    if field not in ("t_s", "left_duty", "right_duty")
)
_ROW = {"left_angle_rad": 0, "right_angle_rad": 1, "battery_v": 2, "yaw_rate_rad_s": 3}
_POSE = {"x_m": 0, "y_m": 1, "heading_rad": 2}


@dataclass(frozen=True)
class Split:
    """What is fitted on, and what is set aside.

    Attributes
    ----------
    fitted, held
        Recordings.
    by_time
        Whether the last part of the only recording is set aside.
    """

    fitted: tuple[Recording, ...]
    held: tuple[Recording, ...]
    by_time: bool = False


def split(case: Case, names: Sequence[str] = ()) -> Split:
    """Set recordings aside: those named, or every fourth counted from the last, or the end of the only one.

    Raises
    ------
    InputError
        If a name is no recording of the case, or nothing is left to fit on.
    """
    wanted = {name.removesuffix(".csv") for name in names if name}
    known = [r.name for r in case.recordings]
    for name in sorted(wanted):
        if name not in known:
            raise expected("--holdout", f"'{name}'", f"one of {', '.join(known)}")
    if not wanted and len(known) == 1:
        return _by_time(case.recordings[0])
    if not wanted:
        wanted = set(known[::-1][::EVERY]) if len(known) >= EVERY else {known[-1]}
    fitted = tuple(r for r in case.recordings if r.name not in wanted)
    if not fitted:
        raise expected("--holdout", "all recordings", "at least one left to fit on")
    return Split(fitted, tuple(r for r in case.recordings if r.name in wanted))


def _by_time(recording: Recording) -> Split:
    cut = recording.t_s[0] + FIRST_SHARE * recording.duration_s
    first = recording.t_s <= cut
    early, late = recording, recording
    for field, _ in COLUMNS.values():
        values = getattr(recording, field)
        kept: dict[str, Any] = {field: values[first]}
        early = replace(early, **kept)
        if field not in ("t_s", "left_duty", "right_duty"):
            blanked: dict[str, Any] = {field: np.where(first, np.nan, values)}
            late = replace(late, **blanked)
    return Split((early,), (late,), by_time=True)


@dataclass(frozen=True)
class Misfit:
    """NRMSE of a channel over the recordings set aside: RMSE over the standard deviation of what was measured."""

    before: float
    after: float
    floor: float


def judge(
    held: Sequence[Recording],
    strips: Sequence[Strip],
    noise: Noise,
    before: Robot,
    after: Robot,
    change: Change | None = None,
) -> dict[str, Misfit]:
    """Compare two robots on recordings neither was fitted to, whole and open loop, by column of the file.

    Parameters
    ----------
    held, strips
        The recordings, and their strips, whose sight follows the measured path.
    noise
        Gives the floor.
    before, after
        The robots.
    change
        What is made of the second one's replays: a formula added, for instance.
    """
    errors: dict[str, list[Array]] = {}
    spread: dict[str, list[Array]] = {}
    for recording, strip in zip(held, strips, strict=True):
        both = [
            _errors(recording, strip, noise, before, None),
            _errors(recording, strip, noise, after, change),
        ]
        for field, _ in _FIELDS:
            values = getattr(recording, field)
            if not np.isnan(values).all() and field in both[0]:
                errors.setdefault(field, []).append(np.stack([each[field] for each in both]))
                spread.setdefault(field, []).append(values - np.nanmean(values))
    floors = _floors(noise, strips)
    out = {}
    for field, column in _FIELDS:
        if field in errors:
            deviation = _rms(np.concatenate(spread[field]))
            pair = np.concatenate(errors[field], axis=1)
            sizes = [_rms(pair[k]) / max(deviation, 1e-12) for k in range(2)]
            # What a robot reaches, noise allows: the floor's estimate is cautious.
            floor = min(float(floors[field]) / max(deviation, 1e-12), *sizes)
            out[column] = Misfit(sizes[0], sizes[1], floor)
    return out


def _errors(
    recording: Recording, strip: Strip, noise: Noise, robot: Robot, change: Change | None
) -> dict[str, Array]:
    film = Film(recording, noise.sd, offset_s=strip.film.offset_s)
    physics = robot.physics
    rows, _, poses, _ = film.play(physics, film.aligned_start(physics))
    if change is not None:
        rows, poses = change(film, rows, poses)
    out = {f: getattr(recording, f) - rows[:, k] for f, k in _ROW.items()}
    for field, k in _POSE.items():
        out[field] = film.reel.pose[:, k] - poses[:, k]
    if strip.looks:
        out["reflection_pct"] = recording.reflection_pct - strip.readings(physics)
    return out


def _floors(noise: Noise, strips: Sequence[Strip]) -> dict[str, float]:
    """Return what noise leaves by field; of a reading also what the path's own uncertainty leaves."""
    angle, battery, rate, place, heading = noise.sd
    looks = [strip.reading_sd for strip in strips if strip.looks]
    reading = _rms(np.concatenate(looks)) if looks else noise.reflection_sd
    return {
        "left_angle_rad": angle, "right_angle_rad": angle, "battery_v": battery, "yaw_rate_rad_s": rate,
        "x_m": place, "y_m": place, "heading_rad": heading, "reflection_pct": reading,
    }  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
