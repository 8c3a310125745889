"""What a robot is worth on recordings set aside: whole replays, open loop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.sensor_noise import Noise
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.replay.replayer import Replayer, replayer_of
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.verdict import Misfit
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
Correction = Callable[[Replayer, Array, Array], tuple[Array, Array]]  # of a replay's rows and poses

_FIELDS = tuple(
    (field, column)
    for column, (field, _) in COLUMNS.items()
    if field not in ("t_s", "left_duty", "right_duty")
)
_ROW = {"left_angle_rad": 0, "right_angle_rad": 1, "battery_v": 2, "yaw_rate_rad_s": 3}
_POSE = {"x_m": 0, "y_m": 1, "heading_rad": 2}


def judge(
    held: Residuals, before: Robot, after: Robot, correction: Correction | None = None
) -> dict[str, Misfit]:
    """Compare two robots on recordings neither was fitted to, whole and open loop, by column of the file.

    Parameters
    ----------
    held
        The recordings beside their simulation, with paths where the colour sensor read something.
    before, after
        The robots.
    correction
        Applied to the second one's replays: a formula added, for instance.
    """
    errors: dict[str, list[Array]] = {}
    spread: dict[str, list[Array]] = {}
    for run in held.recordings:
        both = [_errors(run, before, None), _errors(run, after, correction)]
        for field, _ in _FIELDS:
            values = getattr(run.recording, field)
            if not np.isnan(values).all() and field in both[0]:
                errors.setdefault(field, []).append(np.stack([each[field] for each in both]))
                spread.setdefault(field, []).append(values - np.nanmean(values))
    floors = _floors(held) if held.recordings else {}
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


def _errors(run: RecordingResiduals, robot: Robot, correction: Correction | None) -> dict[str, Array]:
    recording, physics = run.recording, robot.physics
    replayer = replayer_of(recording, run.noise.sd).with_clock(run.nuisances.clock_offset_s)
    rows, _, poses, _ = replayer.play(physics, replayer.aligned_start(physics))
    if correction is not None:
        rows, poses = correction(replayer, rows, poses)
    out = {f: getattr(recording, f) - rows[:, k] for f, k in _ROW.items()}
    for field, k in _POSE.items():
        out[field] = replayer.inputs.pose[:, k] - poses[:, k]
    if run.reads:
        out["reflection_pct"] = recording.reflection_pct - run.readings(physics)
    return out


def _floors(held: Residuals) -> dict[str, float]:
    """Return what noise leaves by field; of a reading also what the path's own uncertainty leaves."""
    noise: Noise = held.recordings[0].noise
    angle, battery, rate, place, heading = noise.sd
    paths = [run.nuisances.path for run in held.recordings if run.reads]
    deviations = [path.reading_sd for path in paths if path is not None]
    reading = _rms(np.concatenate(deviations)) if deviations else noise.reflection_sd
    return {
        "left_angle_rad": angle, "right_angle_rad": angle, "battery_v": battery, "yaw_rate_rad_s": rate,
        "x_m": place, "y_m": place, "heading_rad": heading, "reflection_pct": reading,
    }  # fmt: skip


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
