"""A rehearsal: a simulated drive kept as a recording, to try what is done with recordings before there is a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gecar.errors import expected
from gecar.language.program import Program
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.rollout import Drive, World
from gecar.world.stepped_robot import SteppedRobot

ROW_S = 0.01
CAMERA_EVERY = 3  # rows: a camera at 33 Hz
NOTE = "simulated, not measured"
_TRACED = (
    "t_s", "left_duty", "right_duty", "left_angle_rad", "right_angle_rad", "reflection_pct",
    "x_m", "y_m", "heading_rad",
)  # fmt: skip


def rehearsal(world: World, program: Program, drive: Drive, name: str, course: str = "") -> Recording:
    """Return a drive as a brick and an overhead camera would have logged it: whole degrees, whole percent, blanks.

    Parameters
    ----------
    world, program, drive
        Who drove where, with what program, and what came of it; the drive holds its trace.
    name
        The recording's.
    course
        Where its course is found, if that is a file.

    Raises
    ------
    InputError
        If the drive holds no trace.
    """
    trace = drive.trace
    if trace is None:
        raise expected("drive", "no trace", "one simulated with trace=True")
    setup = Setup(course=course or world.course.name, program=program.source, notes=NOTE)
    return _logged(name, trace, setup)


def exercise(
    world: World, commands: Sequence[tuple[float, float, float]], name: str, seed: int = 0
) -> Recording:
    """Return a robot's drive under a list of commands, open loop from START, as brick and camera would have logged it.

    Parameters
    ----------
    world
        Robot and course.
    commands
        Time [s], left and right duty [%], held until the next; the last row ends the drive half a second later.
    name
        The recording's.
    seed
        Seed of the noise, where the world has any.
    """
    robot, table = SteppedRobot(world, seed), np.array(commands)
    t = np.arange(0.0, table[-1, 0] + 0.5, ROW_S)
    duties = 0.01 * table[np.searchsorted(table[:, 0], t + 0.5 * ROW_S) - 1, 1:]
    rows = []
    for now, (left, right) in zip(t, duties, strict=True):
        robot.set_duty(left, right)
        rows.append((now, left, right, *np.radians(robot.angles_deg), robot.reflection_pct, *robot.pose))
        robot.advance(1000.0 * ROW_S)
    series = dict(zip(_TRACED, np.array(rows).T, strict=True))
    return _logged(name, series, Setup(course=world.course.name, notes=NOTE))


def _logged(name: str, trace: Mapping[str, Series], setup: Setup) -> Recording:
    """Return a trace as the brick's rows, with the camera's frames in some of them."""
    columns: dict[str, Series] = {
        "t_s": trace["t_s"],
        "left_duty_pct": np.clip(100.0 * trace["left_duty"], -100.0, 100.0),
        "right_duty_pct": np.clip(100.0 * trace["right_duty"], -100.0, 100.0),
        "left_angle_deg": np.round(_degrees(trace["left_angle_rad"])),
        "right_angle_deg": np.round(_degrees(trace["right_angle_rad"])),
        "reflection_pct": np.asarray(np.round(np.clip(trace["reflection_pct"], 0.0, 100.0)), np.float64),
        "x_m": _seen(np.round(trace["x_m"], 4)),
        "y_m": _seen(np.round(trace["y_m"], 4)),
        "heading_deg": _seen(np.round(_degrees(trace["heading_rad"]), 2)),
    }
    return make_recording(name, columns, setup)


def _degrees(angle: Series) -> Series:
    return np.asarray(np.degrees(angle), np.float64)


def _seen(values: Series) -> Series:
    """Blank what falls between the camera's frames; the last row is a frame."""
    behind = len(values) - 1 - np.arange(len(values))
    return np.where(behind % CAMERA_EVERY == 0, values, np.nan)
