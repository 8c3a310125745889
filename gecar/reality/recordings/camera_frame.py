"""The camera that films a robot: its mark need not sit over the axle's centre, nor its frame lie on the course's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.recordings.recording import Recording

Array = npt.NDArray[np.float64]


def axle_pose(pose: Array, mark: Sequence[float] | Array) -> Array:
    """Return the axle's poses from those of a mark on the robot, shape (poses, 3) [m, m, rad].

    Parameters
    ----------
    pose
        Of the mark; nan where absent, shape (poses, 3). Where there is no heading, a place stays as it is.
    mark
        Ahead and left of the axle's centre [m], and turned counter-clockwise from the robot's own heading [rad].
    """
    ahead, left, turn = (float(part) for part in mark)
    heading = pose[:, 2] - turn
    cos, sin = np.nan_to_num(np.cos(heading)), np.nan_to_num(np.sin(heading))
    x = pose[:, 0] - ahead * cos + left * sin
    y = pose[:, 1] - ahead * sin - left * cos
    return np.column_stack([x, y, heading])


def course_pose(pose: Array, course: Sequence[float] | Array) -> Array:
    """Return poses in the course's frame from those in the camera's, shape (poses, 3) [m, m, rad].

    Parameters
    ----------
    pose
        In the camera's frame, shape (poses, 3).
    course
        Where the camera's frame has the course's lower left corner, x and y [m], and by how much it has the course
        turned counter-clockwise [rad].
    """
    dx, dy, angle = (float(part) for part in course)
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = pose[:, 0] - dx, pose[:, 1] - dy
    return np.column_stack([cos * x + sin * y, cos * y - sin * x, pose[:, 2] - angle])


def corrected(
    recording: Recording, mark: Sequence[float] | Array, course: Sequence[float] | Array
) -> Recording:
    """Return a recording whose poses are the axle's, in the course's frame."""
    pose = recording.poses
    x, y, heading = course_pose(axle_pose(pose, mark), course).T
    return replace(recording, x_m=x, y_m=y, heading_rad=heading)
