"""A rehearsal: a simulated drive kept as a recording, to try what is done with recordings before there is a robot."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.language.program import Program
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.rollout import Drive, World

CAMERA_EVERY = 3  # rows of 10 ms: a camera at 33 Hz


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
    left, right = (np.clip(100.0 * trace[f"{side}_duty"], -100.0, 100.0) for side in ("left", "right"))
    columns: dict[str, npt.NDArray[np.float64]] = {
        "t_s": trace["t_s"],
        "left_duty_pct": left,
        "right_duty_pct": right,
        "left_angle_deg": np.round(_degrees(trace["left_angle_rad"])),
        "right_angle_deg": np.round(_degrees(trace["right_angle_rad"])),
        "reflection_pct": np.asarray(np.round(np.clip(trace["reflection_pct"], 0.0, 100.0)), np.float64),
        "x_m": _seen(np.round(trace["x_m"], 4)),
        "y_m": _seen(np.round(trace["y_m"], 4)),
        "heading_deg": _seen(np.round(_degrees(trace["heading_rad"]), 2)),
    }
    setup = Setup(course=course or world.course.name, program=program.source, notes="simulated, not measured")
    return make_recording(name, columns, setup)


def _degrees(angle: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.asarray(np.degrees(angle), np.float64)


def _seen(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Blank what falls between the camera's frames; the last row is a frame."""
    behind = len(values) - 1 - np.arange(len(values))
    return np.where(behind % CAMERA_EVERY == 0, values, np.nan)
