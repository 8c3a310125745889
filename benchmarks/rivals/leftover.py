"""What the nominal equations leave over in recordings, and the variables it may depend on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter1d

from benchmarks.concealed.comparators.sparse import RESTING, even, leftover_torques, slope
from gecar.reality.replay.kernel import (
    AHEAD,
    HEADING,
    LEFT_ANGLE,
    LEFT_SPEED,
    RIGHT_ANGLE,
    RIGHT_SPEED,
    YAW_RATE,
    X,
    Y,
)
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]

EVERY = 3  # rows: what is differentiated is smoothed over more than that
EDGE = 16  # rows at either end of a recording, where smoothing has no neighbours


def lessons(
    fitted: Sequence[RecordingResiduals], robot: Robot
) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """Return variables and what is left over there of every recording: of shafts, speed ahead, and turning rate."""
    shafts, ahead, turn = [], [], []
    for run in fitted:
        recording = run.recording
        angles = np.column_stack([recording.left_angle_rad, recording.right_angle_rad])
        if np.isnan(angles).all(axis=0).any():
            continue
        t, at = even(recording.t_s, recording.t_s), recording.t_s
        rows = run.replayer.play(robot.physics).rows  # drawn to what was measured: where the robot was
        told = np.column_stack([even(at, column) for column in rows.T])
        path = told.copy()
        angles = np.column_stack([even(at, a) for a in angles.T])
        speeds = slope(angles)
        path[:, [LEFT_ANGLE, RIGHT_ANGLE, LEFT_SPEED, RIGHT_SPEED]] = np.column_stack([angles, speeds])
        duty = np.column_stack([np.interp(t, at, u) for u in recording.commands.T])
        left, inner = leftover_torques(angles, duty, robot), np.arange(EDGE, len(t) - EDGE, EVERY)
        slowest = minimum_filter1d(
            np.abs(speeds), EDGE, axis=0
        )  # friction turns about where smoothing reaches
        kept = [inner[slowest[inner, wheel] > RESTING] for wheel in (0, 1)]
        both = [seen[kept[wheel]] for wheel, seen in enumerate(of_wheels(path, duty, t))]
        shafts.append((np.concatenate(both), np.concatenate([left[kept[k], k] for k in (0, 1)])))
        if run.replayer.has_poses:
            x, y, heading = (even(at, c) for c in (recording.x_m, recording.y_m, recording.heading_rad))
            measured = slope(x) * np.cos(heading) + slope(y) * np.sin(heading), slope(heading)
            slipped = _slip(
                slope(told[:, [AHEAD, YAW_RATE]], 0).T, slope(told[:, [LEFT_SPEED, RIGHT_SPEED]], 0), robot
            )
            more = _slip(measured, speeds, robot) - slipped
            seen = of_body(path, t)[inner]
            ahead.append((seen, more[0, inner]))
            turn.append((seen, more[1, inner]))
    return shafts, ahead, turn


def _slip(body: Sequence[Array] | Array, shafts: Array, robot: Robot) -> Array:
    """Return by how much speed ahead and turning rate exceed those of wheels that roll, shape (2, n)."""
    p = robot.physics[0]
    rolled = p["wheel_radius"] * shafts
    out: Array = np.array([
        body[0] - rolled.mean(axis=1), body[1] - (rolled[:, 1] - rolled[:, 0]) / p["track_width"],
    ])  # fmt: skip
    return out


def of_wheels(path: Array, duty: Array, t: Array) -> list[Array]:
    """Return what a law at a wheel may look at, of the left and the right one, shape (n, variables) each."""
    out = []
    for own, other, side in ((0, 1, -1.0), (1, 0, 1.0)):
        angle, speed = path[:, (LEFT_ANGLE, RIGHT_ANGLE)[own]], path[:, (LEFT_SPEED, RIGHT_SPEED)[own]]
        u, elsewhere = duty[:, own], path[:, (LEFT_SPEED, RIGHT_SPEED)[other]]
        out.append(np.column_stack([
            u, np.abs(u), speed, np.abs(speed), np.sign(speed), elsewhere, np.full(len(t), side), side * u,
            np.sin(angle), np.cos(angle), np.sin(2.0 * angle), np.cos(2.0 * angle), *_place(path, t),
        ]))  # fmt: skip
    return out


def of_body(path: Array, t: Array) -> Array:
    """Return what a law at the body may look at, shape (n, variables)."""
    left, right, v, rate = (path[:, k] for k in (LEFT_ANGLE, RIGHT_ANGLE, AHEAD, YAW_RATE))
    turning = np.column_stack([f(n * a) for a in (left, right) for n in (1.0, 2.0) for f in (np.sin, np.cos)])
    return np.column_stack([v, np.abs(v), rate, np.abs(rate), turning, *_place(path, t)])


def _place(path: Array, t: Array) -> list[Array]:
    heading = path[:, HEADING]
    return [t, path[:, X], path[:, Y], np.sin(heading), np.cos(heading)]
