"""Logs as people have them, made from a recording, and their import."""

import numpy as np

from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
from gecar.reality.recordings.setup import Setup
from gecar.world.robot import load_robot

BRICK = (
    "t_s",
    "left_duty_pct",
    "right_duty_pct",
    "left_angle_deg",
    "right_angle_deg",
    "reflection_pct",
    "battery_v",
)
POSE = ("t_s", "x_m", "y_m", "heading_deg")


def import_texts(folder, *texts, **options):
    """Write files and import them; return the one recording that came of it."""
    (imported,) = import_all(folder, *texts, **options)
    return imported


def import_all(folder, *texts, setup=None, robot="ev3", **options):
    """Write files and import them; return all recordings that came of it."""
    paths = []
    for k, text in enumerate(texts):
        paths.append(folder / f"file{k}.txt")
        paths[-1].write_bytes(text if isinstance(text, bytes) else text.encode())
    return import_logs(paths, load_robot(robot), setup or Setup(), ImportOptions(**options))


def table(recording, columns, *, names=None, separator=",", factors=None, rows=slice(None), shift=0.0):
    """Return a recording's columns as text, under other names and in other units."""
    factors = factors or {}
    series = []
    for column in columns:
        field, factor = COLUMNS[column]
        values = getattr(recording, field) / factor + (shift if column == "t_s" else 0.0)
        series.append(values[rows] * factors.get(column, 1.0))
    lines = [
        separator.join("" if np.isnan(v) else f"{v:.10g}" for v in row) for row in zip(*series, strict=True)
    ]
    return "\n".join([separator.join(names or columns), *lines]) + "\n"


def brick_log(recording, **how):
    return table(recording, BRICK, **how)


def camera_log(recording, **how):
    return table(recording, POSE, rows=~np.isnan(recording.x_m), **how)


def with_line(text, number, change):
    """Return text with one line (0 is the header) changed."""
    lines = text.split("\n")
    lines[number] = change(lines[number])
    return "\n".join(lines)


def assert_same(imported, recording, columns=BRICK, **tolerance):
    for column in columns:
        field = COLUMNS[column][0]
        np.testing.assert_allclose(getattr(imported.recording, field), getattr(recording, field), **tolerance)


def pose_errors(imported, recording):
    """Return the imported pose less the recorded one, at the imported times [m, m, rad]."""
    found, seen = imported.recording, ~np.isnan(recording.x_m)
    at = ~np.isnan(found.x_m)
    fields = ("x_m", "y_m", "heading_rad")
    track = [np.interp(found.t_s[at], recording.t_s[seen], getattr(recording, f)[seen]) for f in fields]
    return [getattr(found, f)[at] - t for f, t in zip(fields, track, strict=True)]
