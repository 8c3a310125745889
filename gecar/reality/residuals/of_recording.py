"""Whitened residuals of one recording under a physics record.

Each residual is one sample of one channel, measured minus simulated, in standard deviations of what noise alone
would do: wheel angles and pose as the innovations of a re-based replay, battery and gyro as they are, reflection
along the measured path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.sensor_noise import PATH_CAUTION, Noise
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.channels import REFLECTION, ResidualIndex
from gecar.reality.replay.odometry import odometry
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.replay.replayer import Replayer, replayer_of
from gecar.reality.replay.rigid_alignment import starting_at
from gecar.reality.replay.smoothed_path import measured_path
from gecar.reality.residuals.nuisances import Nuisances, SensorPath
from gecar.reality.start_pose.localise import bare_floor, find_start
from gecar.reality.start_pose.refine import refined
from gecar.world.course.course import Course

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Physics = npt.NDArray[Any]

NO_SHIFT = np.zeros(3)
SMOOTHED_BLOCKS = 2.8  # blocks a path is smoothed over: 3.5 x 0.12 s of 0.15 s each
DISC_SPREAD = 4.0  # a disc's diameter over its standard deviation along an axis
PATH_LASTS_S = 0.3  # about how long a path is off by one place: camera poses are smoothed over 0.4 s
QUICK = 0.25  # share of a path's standard deviation that changes from row to row
OFF_COURSE_M = -10.0  # there is bare floor
# Standard deviations of a path by dead reckoning once its start is refined [m, m, rad].
ODOMETRY_SD = PATH_CAUTION * np.array([0.00025, 0.00025, 0.001])
FEWEST_POSES = 4  # that make a path
RECOVERS_S = 0.3  # after which what happened is over: a motor takes 0.1 s to its speed


@dataclass(frozen=True)
class RecordingResiduals:
    """A recording with its simulation; make it with `residuals_of`.

    Attributes
    ----------
    recording, noise
        What was measured, and how noisy it is.
    replayer
        Replays it, with its nuisances taken into account.
    course
        What its colour sensor read; None where it read none.
    nuisances
        What it has of its own.
    in_part
        Whether the motion is compared in part only: not at the rows at which its replay begins anew.
    """

    recording: Recording
    noise: Noise
    replayer: Replayer
    course: Course | None
    nuisances: Nuisances = field(default_factory=Nuisances)
    in_part: bool = False

    @property
    def reads(self) -> bool:
        """Whether readings can be predicted: on a course, along a path, or on floor known to be bare."""
        if self.course is None:
            return False
        bare = self.nuisances.bare_floor
        by_camera = len(self.replayer.inputs.pose_t) >= FEWEST_POSES
        return by_camera or self.nuisances.start is not None or bool(bare is not None and bare.any())

    def with_nuisances(self, nuisances: Nuisances) -> RecordingResiduals:
        """Return this with other nuisances."""
        replayer = self.replayer.with_clock(nuisances.clock_offset_s)
        if nuisances.mark != self.nuisances.mark:
            replayer = replayer.with_mark(nuisances.mark)
        return replace(self, replayer=replayer, nuisances=nuisances)

    def without(self, columns: Sequence[str]) -> RecordingResiduals:
        """Return this without what was measured in some columns of the recording, and without nuisances."""
        unseen: dict[str, Any] = dict.fromkeys(columns, np.full(len(self.recording.t_s), np.nan))
        recording = replace(self.recording, **unseen)
        return residuals_of(recording, self.noise, self.replayer.inputs.memory, self.course)

    @property
    def _placed(self) -> Mask:
        """Which of the poses tell where the robot was, shape (poses,)."""
        return np.asarray(~np.isnan(self.replayer.inputs.pose[:, :2]).any(axis=1))

    @property
    def tells_places(self) -> bool:
        """Whether a camera told where the robot was, and not only which way it headed."""
        return bool(self._placed.any())

    def away_from(self, place: tuple[float, float], radius_m: float) -> RecordingResiduals:
        """Return this with its motion not compared where the robot was near a place [m], nor just after."""
        t, inputs, seen = self.replayer.t, self.replayer.inputs, self._placed
        x, y = (np.interp(t, inputs.pose_t[seen], column) for column in inputs.pose[seen, :2].T)
        return self.except_at(np.hypot(x - place[0], y - place[1]) < radius_m)

    def except_at(self, rows: Mask) -> RecordingResiduals:
        """Return this with its motion not compared at some rows, shape (rows,), nor just after; then it begins anew."""
        t = self.replayer.t
        last = np.maximum.accumulate(np.where(rows, t, -np.inf))
        return replace(self, in_part=True, replayer=self.replayer.anew_at(t - last <= RECOVERS_S))

    def along_encoders(self) -> RecordingResiduals:
        """Return this with wheels that turn as the encoders say, so that the poses alone are compared."""
        return replace(self, replayer=self.replayer.along_encoders())

    def throughout(self) -> RecordingResiduals:
        """Return this with its motion compared at all rows again, and wheels that turn by their commands."""
        nowhere = np.zeros(len(self.replayer.t), bool)
        return replace(self, in_part=False, replayer=self.replayer.anew_at(nowhere).along_encoders(False))

    def localised(self, physics: Physics) -> RecordingResiduals:
        """Return this with the start pose its readings tell, where no camera looked; or else the bare floor it read."""
        encoders = self.recording.left_angle_rad, self.recording.right_angle_rad
        if self.course is None or self.reads or self.replayer.has_poses:
            return self
        start, readings = None, self.recording.reflection_pct
        if not any(np.isnan(angles).all() for angles in encoders):
            path = odometry(self.replayer, physics)
            start = find_start(self.replayer.t, path, readings, self.course, physics)
        bare = bare_floor(self.replayer.t, readings, self.noise.reflection_sd) if start is None else None
        return self.with_nuisances(replace(self.nuisances, start=start, bare_floor=bare))

    def with_path(self, physics: Physics, inflation: Array) -> RecordingResiduals:
        """Return this with the path its sensor was carried along, as measured and smoothed with a model's help.

        Parameters
        ----------
        physics
            The model, shape (1,).
        inflation
            By how much slow noise of x, y and heading exceeds white noise (variances), shape (3,).
        """
        if not self.reads:
            return self
        poses, late = self._sensor_poses(physics)
        # An uncertain path sees edges blurred: on the mean, a spot that is larger by as much sees the same. Slow noise
        # is not smoothed away: over a block it stays, over the smoothing's blocks it adds up.
        if self.nuisances.start is not None:
            sd = smeared = least = ODOMETRY_SD
        else:
            least = self.noise.path_sd
            sd = least * np.sqrt(inflation)
            smeared = self.smoothed_sd(inflation)
        ahead = float(physics["sensor_ahead"][0])
        blur, least_blur = (
            float(np.hypot(each[0], ahead * each[2])) / PATH_CAUTION for each in (smeared, least)
        )
        block = max(round(PATH_LASTS_S / float(np.median(np.diff(self.replayer.t)))), 1)
        path = SensorPath(poses, late, blur, least_blur, block=block, inflation=inflation)
        found = self.with_nuisances(replace(self.nuisances, path=path))
        return found.with_uncertain_path(physics, sd, QUICK)

    def smoothed_sd(self, inflation: Array) -> Array:
        """Return the standard deviations of the smoothed path, its slow noise included [m, m, rad], shape (3,).

        ``inflation`` is as in `with_path`.
        """
        return self.noise.path_sd * np.sqrt(1.0 + SMOOTHED_BLOCKS * (inflation - 1.0))

    def with_uncertain_path(self, physics: Physics, sd: Array, quick: float) -> RecordingResiduals:
        """Return this with readings as uncertain as its path makes them, under a model of shape (1,).

        Parameters
        ----------
        physics
            The model.
        sd
            Standard deviations of an error of the path that lasts for a block [m, m, rad], shape (3,).
        quick
            Share of them that changes from row to row.
        """
        path = self.nuisances.path
        assert path is not None
        slopes = self.reading_slopes(physics, sd)
        own_sd = np.sqrt(self.noise.reflection_sd**2 + quick**2 * np.sum(slopes**2, axis=1))
        return self.with_nuisances(replace(self.nuisances, path=replace(path, own_sd=own_sd, slopes=slopes)))

    def readings(self, physics: Physics, shift: Array = NO_SHIFT) -> Array:
        """Return the predicted reflection at every row [%]; nan where there is nothing to compare.

        A shift moves the whole path [m, m, rad], shape (3,).
        """
        path, bare = self.nuisances.path, self.nuisances.bare_floor
        if not self.reads or path is None:
            return np.full(len(self.replayer.t), np.nan)
        physics = physics.copy()
        physics["spot_diameter"] = np.hypot(physics["spot_diameter"], DISC_SPREAD * path.blur_m)
        if self.nuisances.start is not None:
            poses = refined(path.poses, self.recording.reflection_pct, physics, self._along)
            return self._along(poses, physics, shift)
        if bare is not None:
            return np.where(bare, self._along(path.poses, physics, shift), np.nan)
        # The path is on the camera's clock as the model had it; a later camera means an earlier robot.
        late = float(physics["pose_delay"][0]) + self.nuisances.clock_offset_s - path.late_s
        return self._along(path.poses, physics, shift, late)

    def motion_errors(self, physics: Physics) -> Array:
        """Return the residuals of motion under m physics records, shape (m, n), channel by channel."""
        return self.replayer.errors(physics)

    def sensor_errors(self, physics: Physics) -> Array:
        """Return the residuals of the colour sensor under m physics records, shape (m, rows)."""
        assert self.nuisances.path is not None
        readings = np.zeros((len(physics), len(self.recording.t_s)))
        for k in range(len(physics)):
            readings[k] = self.readings(physics[k : k + 1])
        return self.nuisances.path.whitened(self.recording.reflection_pct - readings)

    def motion_index(self, number: int) -> tuple[ResidualIndex, Mask]:
        """Return where residuals of motion come from, as that recording of a case, and which of them there are."""
        t, inputs = self.replayer.t, self.replayer.inputs
        channel = np.r_[np.repeat(np.arange(4), len(t)), np.repeat(np.arange(4, 7), len(inputs.pose_t))]
        times = np.concatenate([np.tile(t, 4), np.tile(inputs.pose_t, 3)])
        there = ~np.isnan(np.concatenate([self.replayer.measured.T.ravel(), inputs.pose.T.ravel()]))
        there &= ~np.r_[np.tile(self.replayer.anew, 4), np.tile(inputs.pose_anew, 3)]
        there[: 4 * len(t) * inputs.rolls] = False
        return _index(number, channel, times), there

    def sensor_index(self, number: int) -> tuple[ResidualIndex, Mask]:
        """Return where residuals of the colour sensor come from, and which of them there are."""
        assert self.nuisances.path is not None
        t, sd = self.replayer.t, self.nuisances.path.own_sd
        there = ~np.isnan(self.recording.reflection_pct) & ~np.isnan(sd)
        return _index(number, np.full(len(t), REFLECTION), t), there

    def _sensor_poses(self, physics: Physics) -> tuple[Array, float]:
        """Return the poses at every row, shape (rows, 3), and how late their clock is taken to be [s]."""
        if self.nuisances.start is not None:
            return starting_at(odometry(self.replayer, physics), self.nuisances.start), 0.0
        if self.nuisances.bare_floor is not None:
            return np.full((len(self.replayer.t), 3), OFF_COURSE_M), 0.0
        late = float(physics["pose_delay"][0]) + self.nuisances.clock_offset_s
        return measured_path(self.replayer, physics), late

    def predicted_reading_sd(self, physics: Physics, path_sd: Array) -> Array:
        """Return each reading's standard deviation [%], from the sensor's noise and a path's uncertainty (3,)."""
        variance = np.sum(self.reading_slopes(physics, path_sd) ** 2, axis=1)
        return np.sqrt(self.noise.reflection_sd**2 + variance)

    def reading_slopes(self, physics: Physics, path_sd: Array) -> Array:
        """Return what a path's uncertainty (3,) in x, y and heading changes in each reading [%], shape (rows, 3)."""
        shifts = np.diag(path_sd)
        return np.stack(
            [0.5 * (self.readings(physics, each) - self.readings(physics, -each)) for each in shifts], axis=1
        )

    def _along(
        self, path: Array, physics: Physics, shift: Array = NO_SHIFT, late: float = 0.0, every: int = 1
    ) -> Array:
        assert self.course is not None
        t, sd = self.replayer.t[::every], self.noise.reflection_sd
        readings: Array = readings_along(t, path, late, sd, self.course.surface, physics, shift)
        return readings


def residuals_of(
    recording: Recording, noise: Noise, memory_s: float, course: Course | None
) -> RecordingResiduals:
    """Put a recording and its simulation together.

    Parameters
    ----------
    recording, noise
        What was measured, and how noisy it is.
    memory_s
        Over how long replays are drawn back to the measurement [s].
    course
        What it drove on; None: nothing its sensor could read.
    """
    seen = ~np.isnan(recording.reflection_pct)
    read = course is not None and seen.any() and recording.setup.rig == "floor"
    replayer = replayer_of(recording, noise.sd, noise.walk, memory_s)
    if course is not None:
        replayer = replayer.with_camera_over(course.middle_m)
    return RecordingResiduals(recording, noise, replayer, course if read else None)


def _index(number: int, channel: npt.NDArray[np.int_], t_s: Array) -> ResidualIndex:
    return ResidualIndex(np.full(len(channel), number, np.int32), channel.astype(np.int32), t_s)
