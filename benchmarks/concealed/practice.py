"""Replay recordings of somebody else's 3D simulation, with the answers known, to see whether this world agrees."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.concealed.history import ROW_TICKS, Array, History, Pose, replayed
from benchmarks.concealed.robot import Concealed
from benchmarks.concealed.truth import Truth

# The twelve practice cases' answers.toml, in this world's terms. p10 gives no phases, so only its size is known.
ANSWERS = {
    "p01": Concealed(),
    "p02": Concealed(backlash_deg=5.73),
    "p03": Concealed(battery_resistance=1.2),
    "p04": Concealed(gain_difference=0.06),
    "p05": Concealed(tyre_friction=0.35),
    "p06": Concealed(sensor_lag=0.04),
    "p07": Concealed(actuation_delay=0.04),
    "p08": Concealed(tilt=(0.06, 0.0)),
    "p09": Concealed(track_scale=1.06, viscous_friction=0.003),
    "p10": Concealed(off_centre=(0.004, 0.0, 0.0)),
    "p11": Concealed(patch=(1.2, 0.6, 0.25, 0.10)),
    "p12": Concealed(caster_friction=0.5),
}
_POSE_NOISE = np.array([0.001, 0.001, math.radians(0.3)])  # what the practice cases' README states


@dataclass(frozen=True)
class Misfit:
    """Root mean square of measured minus replayed over one recording, in the recording's units."""

    angle_deg: float
    x_mm: float
    y_mm: float
    heading_deg: float
    reflection_pct: float


def read_columns(path: Path) -> dict[str, Array]:
    """Read a recording.

    Parameters
    ----------
    path
        A CSV file as ``recording_format.md`` describes it.

    Returns
    -------
    dict[str, Array]
        One array per column; blanks are nan.
    """
    with path.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name]) if row[name] else math.nan for row in rows]) for name in rows[0]}


def misfit(measured: dict[str, Array], concealed: Concealed) -> Misfit:
    """Replay a recording's commands open loop and compare.

    Parameters
    ----------
    measured
        As :func:`read_columns` gives it, a row every 10 ms.
    concealed
        The robot to replay with.

    Returns
    -------
    Misfit
        With the start pose fitted, the one thing a recording does not tell exactly.
    """
    truth = Truth(concealed)
    commands = np.column_stack([measured["left_duty_pct"], measured["right_duty_pct"]])
    seconds = (len(commands) - 1) * 0.01
    seen = np.column_stack([measured["x_m"], measured["y_m"], np.radians(measured["heading_deg"])])
    start: Pose = tuple(float(value) for value in seen[0])  # type: ignore[assignment]
    for _ in range(3):
        history = truth.run(start, replayed(commands), seconds)
        pose = _unturned(history, start[2])
        start = _moved(start, seen, pose)
    history = truth.run(start, replayed(commands), seconds)
    return _misfit(measured, seen, history)


def table(folder: Path) -> str:
    """Compare every practice case with its answer, beside the nominal robot.

    Parameters
    ----------
    folder
        Holds ``p01`` to ``p12``.

    Returns
    -------
    str
        A Markdown table; each number is the root mean square over the case's recordings.
    """
    head = "| case | robot | angle [deg] | x [mm] | y [mm] | heading [deg] | reflection [%] |\n"
    head += "|---|---|---|---|---|---|---|\n"
    lines = []
    for case, answer in ANSWERS.items():
        for label, concealed in (("nominal", Concealed()), ("answer", answer)):
            fits = [misfit(read_columns(path), concealed) for path in sorted((folder / case).glob("*.csv"))]
            means = [math.sqrt(np.mean([vars(fit)[name] ** 2 for fit in fits])) for name in vars(fits[0])]
            lines.append(f"| {case} | {label} | " + " | ".join(f"{mean:.2f}" for mean in means) + " |")
    return head + "\n".join(lines) + "\n"


def _unturned(history: History, heading: float) -> Array:
    """Give the pose per row, its heading counted from the same turn as the measured one."""
    pose = history.pose[::ROW_TICKS].copy()
    pose[:, 2] += 2.0 * math.pi * round((heading - pose[0, 2]) / (2.0 * math.pi))
    return pose


def _moved(start: Pose, seen: Array, pose: Array) -> Pose:
    """Least-squares shift and turn of the start that brings the replayed path onto the measured one."""
    rows = ~np.isnan(seen[:, 0])
    arm = pose[rows, :2] - pose[0, :2]
    one, none = np.ones(len(arm)), np.zeros(len(arm))
    columns = [[one, none, none], [none, one, none], [-arm[:, 1], arm[:, 0], one]]
    slopes = np.stack(
        [np.concatenate([part / s for part, s in zip(c, _POSE_NOISE, strict=True)]) for c in columns]
    )
    misses = ((seen[rows] - pose[rows]) / _POSE_NOISE).T.ravel()
    step = np.linalg.lstsq(slopes.T, misses, rcond=None)[0]
    return start[0] + step[0], start[1] + step[1], start[2] + step[2]


def _misfit(measured: dict[str, Array], seen: Array, history: History) -> Misfit:
    rows = slice(None, None, ROW_TICKS)
    pose = _unturned(history, float(seen[0, 2]))
    angles = np.degrees(history.angles[rows])
    turns = [measured["left_angle_deg"] - angles[:, 0], measured["right_angle_deg"] - angles[:, 1]]
    x, y, heading = (_rms(column) for column in (seen - pose).T)
    light = measured["reflection_pct"] - np.clip(history.light[rows], 0.0, 100.0)
    return Misfit(_rms(np.array(turns)), 1e3 * x, 1e3 * y, math.degrees(heading), _rms(light))


def _rms(values: Array) -> float:
    return math.sqrt(float(np.nanmean(values**2)))
