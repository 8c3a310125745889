"""Replay a recording: its commands, open loop, through the simulated robot.

replay(recording, robot)               # whole, open loop, from the recorded start
replay(recording, robot, memory_s=1)   # re-based on the measurement, over about a second
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from gecar.reality.recordings.camera_frame import axle_pose
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.kernel import ROW_COLUMNS, Reel, follow
from gecar.world.robot import Robot
from gecar.world.rollout import STEP_S
from gecar.world.state import DERIVED, STATE

Array = npt.NDArray[np.float64]
DEG = np.pi / 180.0
# What replays assume where a recording says nothing: whole degrees, 10 mV, 0.5 deg/s, 1 mm, 0.3 deg.
USUAL_NOISE = (0.29 * DEG, 0.01, 0.5 * DEG, 0.001, 0.3 * DEG)
# A command acts from the log's zero where its first row comes at most this much later.
LATEST_FIRST_ROW_S = 0.1


@dataclass(frozen=True)
class Replay:
    """What the simulated robot did under a recording's commands; every series at the recording's rows.

    Attributes
    ----------
    t_s
        The recording's times [s], shape (rows,).
    left_angle_rad, right_angle_rad, battery_v, yaw_rate_rad_s
        What the sensors would have read, shape (rows,).
    x_m, y_m, heading_rad
        Pose of the axle's centre, shape (rows,).
    left_speed_rad_s, right_speed_rad_s, ahead_m_s, aside_m_s
        Speeds of the shafts, and of the axle's centre ahead and to the left, shape (rows,).
    """

    t_s: Array
    left_angle_rad: Array
    right_angle_rad: Array
    battery_v: Array
    yaw_rate_rad_s: Array
    x_m: Array
    y_m: Array
    heading_rad: Array
    left_speed_rad_s: Array
    right_speed_rad_s: Array
    ahead_m_s: Array
    aside_m_s: Array


class Film:
    """A recording made ready for the kernel, and the arrays its replays fill."""

    def __init__(
        self,
        recording: Recording,
        sd: npt.ArrayLike = USUAL_NOISE,
        walk: npt.ArrayLike = (3e-4, 0.1 * DEG),
        memory_s: float = np.inf,
        offset_s: float = 0.0,
    ) -> None:
        first = float(recording.t_s[0])
        zero = 0.0 if 0.0 < first <= LATEST_FIRST_ROW_S else first
        r = recording
        pose = np.column_stack([r.x_m, r.y_m, r.heading_rad])
        self.posed = ~np.isnan(pose).all(axis=1)
        self.recording = recording
        self.offset_s = offset_s
        t = r.t_s - zero
        commands = r.commands
        if zero < first:
            t, commands = np.r_[0.0, t], np.vstack([commands[:1], commands])
        self._seen = pose[self.posed]
        self._extra = len(t) - len(r.t_s)
        measured = np.column_stack([r.left_angle_rad, r.right_angle_rad, r.battery_v, r.yaw_rate_rad_s])
        measured = np.vstack([np.full((self._extra, 4), np.nan), measured])
        self.reel = Reel(
            t, commands, measured, t[self._extra :][self.posed], self._seen,
            np.array(sd, float), np.array(walk, float), memory_s, r.setup.rig == "bench",
        )  # fmt: skip
        self.start = self._recorded_start(self._seen)
        self._derived, self._state = np.zeros(1, DERIVED), np.zeros(1, STATE)

    def _recorded_start(self, pose: Array) -> Array:
        """Return the first pose seen; what no camera saw starts at 0."""
        start = np.zeros(3)
        for k in range(3):
            seen = np.flatnonzero(~np.isnan(pose[:, k]))
            start[k] = pose[seen[0], k] if len(seen) else 0.0
        return start

    def set_mark(self, mark: Array) -> None:
        """Take the poses to be those of a mark on the robot; see `axle_pose`."""
        pose = axle_pose(self._seen, mark)
        self.reel, self.start = self.reel._replace(pose=pose), self._recorded_start(pose)

    @property
    def t(self) -> Array:
        """Times of the rows from the start of the simulation [s], shape (rows,)."""
        return self.reel.t[self._extra :]

    def open_loop(self) -> Film:
        """Return the same recording to be replayed whole, never re-based on what was measured."""
        whole = copy.copy(self)
        whole.reel = self.reel._replace(memory=np.inf)
        return whole

    def play(
        self, physics: npt.NDArray[Any], start: Array | None = None
    ) -> tuple[Array, Array, Array, Array]:
        """Replay under a physics record.

        Returns
        -------
        tuple
            Rows as `following` lists their columns, their normalised residuals (rows, 4), predicted poses (poses, 3)
            and theirs (poses, 3).
        """
        rows, poses = len(self.reel.t), len(self.reel.pose_t)
        out = np.empty((rows, ROW_COLUMNS)), np.empty((rows, 4)), np.empty((poses, 3)), np.empty((poses, 3))
        chosen = self.start if start is None else start
        cap = self.recording.setup.duty_cap
        if cap is not None:
            physics = physics.copy()
            physics["duty_cap"] = cap
        follow(self.reel, physics, self._derived, self._state, chosen, self.offset_s, STEP_S, *out)
        return out[0][self._extra :], out[1][self._extra :], out[2], out[3]

    def aligned_start(self, physics: npt.NDArray[Any], within_s: float = np.inf) -> Array:
        """Return the start pose whose open-loop replay fits the poses best, shape (3,) [m, m, rad].

        The start is a nuisance: one noisy camera frame would otherwise tilt the whole path.
        """
        if not len(self.reel.pose_t):
            return self.start
        early = self.reel.pose_t <= within_s
        scale = np.array([0.01, 0.01, 0.05])

        def misfit(shift: Array) -> Array:
            errors = self.play(physics, self.start + shift * scale)[3][early]
            return np.tanh(np.nan_to_num(errors.ravel()) / 30.0)  # slides far off must not tilt the start

        found = least_squares(misfit, np.zeros(3), max_nfev=20).x
        return self.start + np.asarray(found) * scale


def replay(
    recording: Recording,
    robot: Robot,
    memory_s: float = np.inf,
    align: bool = True,
    noise: Mapping[str, float] | None = None,
) -> Replay:
    """Replay a recording's commands through a simulated robot.

    Parameters
    ----------
    recording
        Its commands are held from row to row; its rig says whether the wheels touch the floor.
    robot
        The robot, with whatever effects it has.
    memory_s
        Over how long the replay remembers its own drift before it is drawn back to the measurement [s]; inf: whole and
        open loop.
    align
        Whether an open-loop replay's start pose is fitted to the poses seen; otherwise the first one is taken.
    noise
        Not needed; standard deviations by the recording's fields, where known.

    Returns
    -------
    Replay
        Series at the recording's rows.
    """
    sd = list(USUAL_NOISE)
    for k, name in enumerate(("left_angle_rad", "battery_v", "yaw_rate_rad_s", "x_m", "heading_rad")):
        sd[k] = float((noise or {}).get(name, sd[k]))
    film = Film(recording, sd, memory_s=memory_s)
    physics = robot.physics
    start = film.aligned_start(physics) if align and np.isinf(memory_s) else None
    rows = film.play(physics, start)[0]
    return Replay(recording.t_s, *(rows[:, k].copy() for k in range(ROW_COLUMNS - 1)))
