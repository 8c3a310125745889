"""Replay a recording: its commands, open loop, through the simulated robot.

replay(recording, robot)               # whole, open loop, from the recorded start
replay(recording, robot, memory_s=1)   # re-based on the measurement, over about a second
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from gecar.compiled import LANES
from gecar.reality.recordings.camera_frame import axle_pose
from gecar.reality.recordings.encoder_zero import LATEST_FIRST_ROW_S
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.kernel import ROW_COLUMNS, TIMING, replay_rows
from gecar.reality.replay.kernel_input import KernelInput
from gecar.reality.replay.rigid_alignment import moved_start
from gecar.world.kernel.dynamics import has_terms, is_light
from gecar.world.robot import Robot
from gecar.world.rollout import STEP_S
from gecar.world.terms import formulas_of, ports_of

Array = npt.NDArray[np.float64]
DEG = np.pi / 180.0
# What replays assume where a recording says nothing: whole degrees, 10 mV, 0.5 deg/s, 1 mm, 0.3 deg.
USUAL_NOISE = (0.29 * DEG, 0.01, 0.5 * DEG, 0.001, 0.3 * DEG)
USUAL_WALK = (3e-4, 0.1 * DEG)  # m/sqrt(s), rad/sqrt(s)
PATCH = ("patch_radius", "patch_x", "patch_y", "patch_friction")
X_Y = slice(4, 6)  # columns of predicted rows
MOST_ALIGNMENTS = 10
STILL = 1e-6  # m and rad, of a start pose
FEWEST_LANES = 4  # fewer robots are replayed faster one by one


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


class Prediction(NamedTuple):
    """What a replay predicts, and how far measurements are off.

    Attributes
    ----------
    rows
        One row of predictions for each of the recording's, columns as in `kernel`, shape (rows, ROW_COLUMNS).
    row_errors
        Normalised residuals of encoders, battery and gyro, shape (rows, 4).
    poses, pose_errors
        Predicted poses [m, m, rad] and their normalised residuals, shape (poses, 3).
    """

    rows: Array
    row_errors: Array
    poses: Array
    pose_errors: Array


@dataclass(frozen=True)
class Replayer:
    """A recording made ready to be replayed under any physics; make it with `replayer_of`.

    Attributes
    ----------
    recording
        What is replayed.
    inputs
        The recording as the kernel reads it.
    poses_seen
        Poses as recorded, before any correction of the camera's mark, shape (poses, 3) [m, m, rad].
    start
        First pose, shape (3,) [m, m, rad]; 0 where none was recorded.
    clock_offset_s
        How late the camera's clock is [s].
    """

    recording: Recording
    inputs: KernelInput
    poses_seen: Array
    start: Array
    clock_offset_s: float = 0.0

    @property
    def first_row(self) -> int:
        """The row of the kernel's input at which the recording begins."""
        return len(self.inputs.t) - len(self.recording.t_s)

    @property
    def t(self) -> Array:
        """Times of the rows from the start of the simulation [s], shape (rows,)."""
        return self.inputs.t[self.first_row :]

    @property
    def measured(self) -> Array:
        """Left angle, right angle [rad], battery [V], yaw rate [rad/s] at every row, shape (rows, 4)."""
        return self.inputs.measured[self.first_row :]

    @property
    def anew(self) -> npt.NDArray[np.bool_]:
        """At which rows it forgets what was measured before, shape (rows,)."""
        return self.inputs.anew[self.first_row :]

    @property
    def has_poses(self) -> bool:
        """Whether a camera saw the robot at all."""
        return len(self.inputs.pose_t) > 0

    def with_clock(self, offset_s: float) -> Replayer:
        """Return this with a camera clock that is late by so much [s]."""
        return replace(self, clock_offset_s=offset_s)

    def with_mark(self, mark: Sequence[float] | Array) -> Replayer:
        """Return this with the poses taken for those of a mark on the robot; see `axle_pose`."""
        pose = axle_pose(self.poses_seen, mark)
        return replace(self, inputs=self.inputs._replace(pose=pose), start=_first_pose(pose))

    def with_camera_over(self, place: tuple[float, float]) -> Replayer:
        """Return this with the camera above a point on the floor [m]."""
        return replace(self, inputs=self.inputs._replace(camera=np.array(place)))

    def later(self, seconds: float) -> Replayer:
        """Return this with all times later by so much [s]: part of a step moves where steps fall among the rows."""
        t, command_t, pose_t = (
            times + seconds for times in (self.inputs.t, self.inputs.command_t, self.inputs.pose_t)
        )
        return replace(self, inputs=self.inputs._replace(t=t, command_t=command_t, pose_t=pose_t))

    def open_loop(self) -> Replayer:
        """Return this to be replayed whole, never re-based on what was measured."""
        return replace(self, inputs=self.inputs._replace(memory=np.inf))

    def along_encoders(self, rolls: bool = True) -> Replayer:
        """Return this with wheels that turn as the encoders say; without ``rolls``, as the commands make them turn.

        Slip and the body's swing are simulated in any case.
        """
        return replace(self, inputs=self.inputs._replace(rolls=rolls))

    def with_memory(self, memory_s: float) -> Replayer:
        """Return this with another memory [s]: over how long it is drawn back to the measurement.

        A steady filter on a random walk forgets in inverse proportion to the walk.
        """
        walk = self.inputs.walk * (self.inputs.memory / memory_s)
        return replace(self, inputs=self.inputs._replace(memory=memory_s, walk=walk))

    def anew_at(self, rows: npt.NDArray[np.bool_]) -> Replayer:
        """Return this to forget at some rows, shape (rows,), and at their poses, what was measured before."""
        anew = np.r_[np.zeros(self.first_row, bool), rows]
        row = np.minimum(np.searchsorted(self.inputs.t, self.inputs.pose_t), len(anew) - 1)
        return replace(self, inputs=self.inputs._replace(anew=anew, pose_anew=anew[row]))

    def play(self, physics: npt.NDArray[Any], start: Array | None = None) -> Prediction:
        """Replay under a physics record of shape (1,), from the recorded start or another [m, m, rad]."""
        chosen = self.start if start is None else start
        kept = replay_rows(self.inputs, self._capped(physics), chosen, self.clock_offset_s, STEP_S, True)
        rows, row_errors, poses, pose_errors = (array[:, :, 0] for array in kept)
        return Prediction(rows[self.first_row :], row_errors[self.first_row :], poses, pose_errors)

    def errors(self, physics: npt.NDArray[Any]) -> Array:
        """Return the normalised residuals of replays under n physics records, shape (n, 4 rows + 3 poses).

        Those of encoders, battery and gyro, channel by channel, then those of the poses. Robots that differ by a
        slippery patch only, which none of them enters, are replayed once: up to a patch it changes nothing.
        """
        physics = self._capped(physics)
        rows, poses = len(self.t), len(self.inputs.pose_t)
        out = np.empty((len(physics), 4 * rows + 3 * poses))
        left = np.ones(len(physics), bool)
        for bare, numbers in _alike_but_for_a_patch(physics):
            found = self.play(bare)
            missed = numbers[~_enters(found.rows, physics[numbers])]
            out[missed] = np.r_[found.row_errors.T.ravel(), found.pose_errors.T.ravel()]
            left[missed] = False
        for some in _in_step(physics, np.flatnonzero(left), self.inputs.bench):
            robots = physics[np.resize(some, LANES if len(some) > 1 else 1)]
            kept = replay_rows(self.inputs, robots, self.start, self.clock_offset_s, STEP_S, False)
            for lane, number in enumerate(some):
                out[number, : 4 * rows].reshape(4, rows)[:] = kept.row_errors[self.first_row :, :, lane].T
                out[number, 4 * rows :].reshape(3, poses)[:] = kept.pose_errors[:, :, lane].T
        return out

    def _capped(self, physics: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return physics records with the recording's own cap on duty, where it has one."""
        cap = self.recording.setup.duty_cap
        if cap is not None:
            physics = physics.copy()
            physics["duty_cap"] = cap
        return physics

    def aligned_start(self, physics: npt.NDArray[Any], within_s: float = np.inf) -> Array:
        """Return the start pose whose open-loop replay fits the poses best, shape (3,) [m, m, rad].

        The start is a nuisance: one noisy camera frame would otherwise tilt the whole path. A path goes along with its
        start, but for what belongs to the floor (a slope, a patch): so it is replayed until it stays.
        """
        if not self.has_poses:
            return self.start
        early = self.inputs.pose_t <= within_s
        start = self.start
        for _ in range(MOST_ALIGNMENTS):
            poses = self.play(physics, start).poses[early]
            before, start = start, moved_start(self.inputs.pose[early], poses, self.inputs.sd[3:], start)
            if np.abs(start - before).max() < STILL:
                break
        return start


def replayer_of(
    recording: Recording,
    sd: npt.ArrayLike = USUAL_NOISE,
    walk: npt.ArrayLike = USUAL_WALK,
    memory_s: float = np.inf,
) -> Replayer:
    """Make a recording ready to be replayed.

    Parameters
    ----------
    recording
        What to replay.
    sd, walk
        Noise, as in `KernelInput`.
    memory_s
        Over how long a replay is drawn back to the measurement [s]; inf: whole and open loop.
    """
    first = float(recording.t_s[0])
    zero = 0.0 if 0.0 < first <= LATEST_FIRST_ROW_S else first
    t, commands = recording.t_s - zero, recording.commands
    pose = recording.poses
    posed = ~np.isnan(pose).all(axis=1)
    pose_t, pose = t[posed], pose[posed]
    r = recording
    measured = np.column_stack([r.left_angle_rad, r.right_angle_rad, r.battery_v, r.yaw_rate_rad_s])
    if zero < first:
        t, commands = np.r_[0.0, t], np.vstack([commands[:1], commands])
        measured = np.vstack([np.full((1, 4), np.nan), measured])
    command_t = np.r_[t, recording.lost_t_s - zero]
    order = np.argsort(command_t, kind="stable")
    command_t, commands = command_t[order], np.vstack([commands, recording.lost_commands])[order]
    inputs = KernelInput(
        t, command_t, commands, measured, pose_t, pose, np.array(sd, float), np.array(walk, float), memory_s,
        np.zeros(len(t), bool), np.zeros(len(pose_t), bool), r.setup.rig == "bench", np.zeros(2),
    )  # fmt: skip
    return Replayer(recording, inputs, pose, _first_pose(pose))


def _alike_but_for_a_patch(
    physics: npt.NDArray[Any],
) -> Iterator[tuple[npt.NDArray[Any], npt.NDArray[np.int_]]]:
    """Yield records without a slippery patch, shape (1,), and the numbers of those that are one of them with a patch.

    Few are left out.
    """
    patched = np.flatnonzero(physics["patch_radius"] > 0.0)
    if len(patched) < FEWEST_LANES:
        return
    bare = physics[patched]
    for field in PATCH:
        bare[field] = 0.0
    groups: dict[bytes, list[int]] = {}
    for k, record in enumerate(bare):
        groups.setdefault(record.tobytes(), []).append(k)
    for some in groups.values():
        if len(some) >= FEWEST_LANES:
            yield bare[some[:1]], patched[some]


def _enters(rows: Array, physics: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Return whether a path comes so close to each record's patch that it may enter between two rows, shape (n,)."""
    path = rows[:, X_Y]
    between = float(np.hypot(*np.diff(path, axis=0).T).max(initial=0.0))
    centres = np.column_stack([physics["patch_x"], physics["patch_y"]])
    nearest, _ = KDTree(path).query(centres)
    return np.asarray(nearest < physics["patch_radius"] + between)


def _in_step(physics: npt.NDArray[Any], numbers: npt.NDArray[np.int_], bench: bool) -> Iterator[list[int]]:
    """Yield which of some records to replay together: up to `LANES` that share `TIMING` and where their terms act.

    Light robots are kept apart from others, which take twice as long. Those whose laws differ in constants alone
    stand side by side. Few are replayed one by one, and so are motors with laws.
    """
    if len(numbers) < FEWEST_LANES:
        yield from ([int(number)] for number in numbers)
        return
    robots = physics[numbers]
    keys: list[Any] = list(zip(robots[list(TIMING)].tolist(), is_light(robots).tolist(), strict=True))
    laws = [b""] * len(robots)
    if has_terms(robots).any():
        keys = list(zip(keys, ports_of(robots), strict=True))
        laws = formulas_of(robots)
    together: dict[Any, list[int]] = {}
    for k in sorted(range(len(robots)), key=laws.__getitem__):
        together.setdefault(keys[k], []).append(int(numbers[k]))
    for shared in together.values():
        apart = bench and physics["n_terms"][shared[0]] > 0.0
        for first in range(0, len(shared), LANES):
            some = shared[first : first + LANES]
            yield from [[number] for number in some] if apart or len(some) < FEWEST_LANES else [some]


def _first_pose(pose: Array) -> Array:
    """Return each coordinate where it was first seen; 0 where it never was."""
    start = np.zeros(3)
    for k in range(3):
        seen = np.flatnonzero(~np.isnan(pose[:, k]))
        start[k] = pose[seen[0], k] if len(seen) else 0.0
    return start


def replay(
    recording: Recording,
    robot: Robot,
    memory_s: float = np.inf,
    align: bool = True,
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

    Returns
    -------
    Replay
        Series at the recording's rows.
    """
    replayer = replayer_of(recording, memory_s=memory_s)
    physics = robot.physics
    start = replayer.aligned_start(physics) if align and np.isinf(memory_s) else None
    rows = replayer.play(physics, start).rows
    return Replay(recording.t_s, *(rows[:, k].copy() for k in range(ROW_COLUMNS)))
