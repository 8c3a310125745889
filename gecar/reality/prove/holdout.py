"""What a robot is worth on recordings set aside: whole replays, open loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.sensor_noise import PATH_CAUTION, Noise
from gecar.reality.optimisation.least_squares import least_squares, row_by_row
from gecar.reality.recordings.columns import COLUMNS, POSE_FIELDS
from gecar.reality.replay.replayer import Prediction, Replayer, replayer_of
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.selection.thresholds import SMALL
from gecar.reality.verdict import Misfit
from gecar.world.effects import BY_ID
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]
Correction = Callable[[Replayer, Array, Array], tuple[Array, Array]]  # of a replay's rows and poses

_FIELDS = tuple(
    (field, column)
    for column, (field, _) in COLUMNS.items()
    if field not in ("t_s", "left_duty", "right_duty")
)
COURSE_REACH = 2.0 * SMALL  # of the size worth a name: how far the course may lie elsewhere
AT_AN_EDGE_PCT = 20.0  # a reading's error beside an edge, so that in a fit it counts by its square
_ROW = {"left_angle_rad": 0, "right_angle_rad": 1, "battery_v": 2, "yaw_rate_rad_s": 3}


@dataclass(frozen=True)
class Contender:
    """A robot, and the recordings set aside with the nuisances fitted under it.

    Attributes
    ----------
    robot
        Is judged.
    held
        The recordings beside their simulation: clocks and paths as this robot gives them.
    correction
        Applied to its replays: a formula added, for instance.
    """

    robot: Robot
    held: Residuals
    correction: Correction | None = None


class Replayed(NamedTuple):
    """A recording's replayer, and what it predicts."""

    replayer: Replayer
    prediction: Prediction


def judge(before: Contender, after: Contender) -> dict[str, Misfit]:
    """Compare two robots on recordings neither was fitted to, whole and open loop, by column of the file.

    Each is judged with its own nuisances: where its paths began, and where the course lies under the camera, to 3 mm
    and 3 mrad, for beside an edge a few mm turn white to black. The floor is what noise leaves, and on readings the
    uncertainty of the first robot's path: it is known before anything is fitted.
    """
    floors = _floors(before.held) if before.held.recordings else {}
    was, now = _errors_by_field(before), _errors_by_field(after)
    out = {}
    for field, column in _FIELDS:
        if field in was and field in now:
            deviation = max(_rms(_deviations(before.held, field)), 1e-12)
            sizes = (_rms(was[field]), _rms(now[field]), float(floors[field]))
            was_off, is_off, noise = (size / deviation for size in sizes)
            out[column] = Misfit(was_off, is_off, noise, deviation / COLUMNS[column][1])
    return out


def gaps(before: Contender, after: Contender) -> tuple[float, float]:
    """Return how far two robots' drives are from those set aside, beyond noise: summed over channels, in units of it.

    Where no path for the colour sensor is known yet, its readings are left out.
    """
    whole = judge(_without_readings(before), _without_readings(after)).values()
    was, now = np.maximum([misfit.gaps for misfit in whole], 0.0).reshape(-1, 2).sum(axis=0)
    return float(was), float(now)


def _without_readings(contender: Contender) -> Contender:
    """Return a contender whose recordings have no readings, unless they are what was fitted."""
    held = contender.held
    if held.sensor:
        return contender
    unread = tuple(replace(run, course=None) for run in held.recordings)
    return replace(contender, held=replace(held, recordings=unread))


def _errors_by_field(contender: Contender) -> dict[str, Array]:
    """Return measured less simulated over all recordings, by field of a recording."""
    errors: dict[str, list[Array]] = {}
    seen = _on_its_course(contender)
    for run in contender.held.recordings:
        for field, values in _errors(run, contender.robot, seen, contender.correction).items():
            if not np.isnan(getattr(run.recording, field)).all():
                errors.setdefault(field, []).append(values)
    return {field: np.concatenate(parts) for field, parts in errors.items()}


def _deviations(held: Residuals, field: str) -> Array:
    """Return what was measured, less its mean, over all recordings that have it."""
    runs = (run for run in held.recordings if field != "reflection_pct" or run.reads)
    values = (getattr(run.recording, field) for run in runs)
    return np.concatenate([v - np.nanmean(v) for v in values if not np.isnan(v).all()])


def replayed(run: RecordingResiduals, physics: Physics, start_s: float = np.inf) -> Replayed:
    """Replay a recording whole and open loop, from the start that fits its poses best.

    Parameters
    ----------
    run
        The recording, with its camera's clock and mark as they were fitted.
    physics
        The robot, shape (1,).
    start_s
        Up to when poses tell the start [s]; without a pose by then, all of them do.
    """
    replayer = replayer_of(run.recording, run.noise.sd).with_clock(run.nuisances.clock_offset_s)
    replayer = replayer.with_mark(run.nuisances.mark)
    replayer = replayer.along_encoders() if run.replayer.inputs.rolls else replayer
    t = replayer.inputs.pose_t
    within = start_s if len(t) and t[0] <= start_s else np.inf
    return Replayed(replayer, replayer.play(physics, replayer.aligned_start(physics, within)))


def _on_its_course(contender: Contender) -> Physics:
    """Return a robot's physics with the course where its readings fit best, near the place that it is known to have."""
    physics = contender.robot.physics
    runs = [run for run in contender.held.recordings if run.reads and run.replayer.has_poses]
    if not runs:
        return physics
    shift = BY_ID["line_shift"].parameters

    def moved(z: Array) -> Physics:
        there = physics.copy()
        for parameter, share in zip(shift, z, strict=True):
            there[parameter.field] += COURSE_REACH * parameter.worthwhile * share
        return there

    def errors(z: Array) -> Array:
        there = moved(z)
        return np.concatenate([np.nan_to_num(_reading_errors(run, there)) for run in runs]) / AT_AN_EDGE_PCT

    ends = np.ones(len(shift))
    found = least_squares(row_by_row(errors), np.zeros(len(shift)), (-ends, ends), 0.1 * ends)
    return moved(found.z)


def _errors(
    run: RecordingResiduals, robot: Robot, seen: Physics, correction: Correction | None
) -> dict[str, Array]:
    """Return measured less simulated by field; ``seen`` is the robot's physics with the course where it lies."""
    recording, physics = run.recording, robot.physics
    replayer, (rows, _, poses, _) = replayed(run, physics)
    if correction is not None:
        rows, poses = correction(replayer, rows, poses)
    out = {f: getattr(recording, f) - rows[:, k] for f, k in _ROW.items()}
    for k, field in enumerate(POSE_FIELDS):
        out[field] = replayer.inputs.pose[:, k] - poses[:, k]
    if run.reads:
        out["reflection_pct"] = _reading_errors(run, seen)
    return out


def reading_error(held: Residuals, physics: Physics) -> float:
    """Return the root-mean-square error of a robot's simulated readings along the measured paths [%]."""
    return _rms(np.concatenate([_reading_errors(run, physics) for run in held.recordings]))


def _reading_errors(run: RecordingResiduals, physics: Physics) -> Array:
    return np.asarray(run.recording.reflection_pct - run.readings(physics))


def _floors(held: Residuals) -> dict[str, float]:
    """Return what noise leaves by field; of a reading also what the path's own uncertainty leaves."""
    noise: Noise = held.recordings[0].noise
    angle, battery, rate, place, heading = noise.sd
    paths = [run.nuisances.path for run in held.recordings if run.reads]
    deviations = [path.reading_sd for path in paths if path is not None]
    own = noise.reflection_sd
    # Fits take the path for less certain than it is; the floor is what it is.
    variances = [own**2 + (sd**2 - own**2) / PATH_CAUTION**2 for sd in deviations]
    reading = float(np.sqrt(np.nanmean(np.concatenate(variances)))) if variances else own
    return {
        "left_angle_rad": angle, "right_angle_rad": angle, "battery_v": battery, "yaw_rate_rad_s": rate,
        "x_m": place, "y_m": place, "heading_rad": heading, "reflection_pct": reading,
    }  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
