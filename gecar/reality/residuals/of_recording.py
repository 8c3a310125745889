"""Whitened residuals of one recording under a physics record.

Each residual is one sample of one channel, measured minus simulated, in standard deviations of what noise alone
would do: wheel angles and pose as the following replay's innovations, battery and gyro as they are, reflection
along the measured path.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.sensor_noise import PATH_CAUTION, Noise
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.odometry import odometry
from gecar.reality.replay.reflectance import look_along
from gecar.reality.replay.replayer import Film
from gecar.reality.replay.smoothed_path import measured_path
from gecar.reality.start_pose.localise import Whereabouts, bare_floor, find_start, moved
from gecar.reality.start_pose.refine import settled
from gecar.world.course import Course

Array = npt.NDArray[np.float64]
NO_SHIFT = np.zeros(3)
SMOOTHED_BLOCKS = 2.8  # blocks a path is smoothed over: 3.5 x 0.12 s of 0.15 s each
DISC_SPREAD = 4.0  # a disc's diameter over its standard deviation along an axis
OFF_COURSE_M = -10.0  # there is bare floor
RECKONED_SD = PATH_CAUTION * np.array([0.00025, 0.00025, 0.001])  # of such a path, once its start is settled

CHANNELS = (
    "left_angle", "right_angle", "battery", "yaw_rate", "x", "y", "heading", "reflection",
)  # fmt: skip


@dataclass(frozen=True)
class Cells:
    """Where each residual of a comparison comes from, shape (n,) each: recording, channel and time [s]."""

    recording: npt.NDArray[np.int32]
    channel: npt.NDArray[np.int32]
    t_s: Array


class Strip:
    """One recording's residuals: the film that replays it, and the path its sensor was carried along."""

    def __init__(self, recording: Recording, noise: Noise, memory_s: float, course: Course | None) -> None:
        self.recording = recording
        self.film = Film(recording, noise.sd, noise.walk, memory_s, noise.offset(recording.name))
        self.noise = noise
        seen = ~np.isnan(recording.reflection_pct)
        read = bool(course is not None and seen.any() and recording.setup.rig == "floor")
        self.looks = read and len(self.film.reel.pose_t) > 3
        self.course = course if read else None
        self.began: Whereabouts | None = None
        self.bare = np.zeros(len(seen), bool)
        self.path, self.path_late = np.zeros((0, 3)), 0.0
        self.path_colour, self.blur_m = np.ones(3), 0.0
        self.reading_sd = np.full(len(seen), np.nan)

    def locate(self, physics: npt.NDArray[Any]) -> None:
        """Find where a recording no camera saw began; then it looks along its path by dead reckoning.

        Where that is not to be found, what it read on even bare floor is still compared.
        """
        encoders = self.recording.left_angle_rad, self.recording.right_angle_rad
        counted = not any(np.isnan(angles).all() for angles in encoders)
        if self.course is None or self.looks or len(self.film.reel.pose_t):
            return
        readings = self.recording.reflection_pct
        if counted:
            path = odometry(self.film, physics)
            self.began = find_start(self.film.t, path, readings, self.course, physics)
        if self.began is None:
            self.bare = bare_floor(self.film.t, readings, self.noise.reflection_sd)
        self.looks = self.began is not None or bool(self.bare.any())

    def set_path(self, physics: npt.NDArray[Any]) -> None:
        """Take the measured path, smoothed with a model's help, and how uncertain readings are along it."""
        if not self.looks:
            return
        if self.began is not None:
            self.path, self.path_late = moved(odometry(self.film, physics), self.began.start), 0.0
        elif self.bare.any():
            self.path, self.path_late = np.full((len(self.film.t), 3), OFF_COURSE_M), 0.0
        else:
            self.path = measured_path(self.film, physics)
            self.path_late = float(physics["pose_delay"][0]) + self.film.offset_s
        # What an uncertain path crosses is smeared: on the mean a spot that is larger by as much sees the same. Noise
        # that lingers is not smoothed away: over a block it stays, over the smoothing's blocks it adds up.
        lingering = 1.0 + SMOOTHED_BLOCKS * (self.path_colour**2 - 1.0)
        sd, smeared = self.noise.path_sd * self.path_colour, self.noise.path_sd * np.sqrt(lingering)
        if self.began is not None:
            sd, smeared = RECKONED_SD, RECKONED_SD
        self.blur_m = (
            float(np.hypot(smeared[0], float(physics["sensor_ahead"][0]) * smeared[2])) / PATH_CAUTION
        )
        middle = self._readings(physics, NO_SHIFT)
        variance = np.full(len(middle), self.noise.reflection_sd**2)
        for shift in np.diag(sd):
            variance += (0.5 * (self._readings(physics, shift) - self._readings(physics, -shift))) ** 2
        # One crossing of an edge is one event, however many samples it has.
        self.reading_sd = np.sqrt(variance)

    def _readings(self, physics: npt.NDArray[Any], shift: Array) -> Array:
        physics = physics.copy()
        physics["spot_diameter"] = np.hypot(physics["spot_diameter"], DISC_SPREAD * self.blur_m)
        if self.began is not None:
            path = settled(self.path, self.recording.reflection_pct, physics, self._along)
            return self._along(path, physics, shift)
        if self.bare.any():
            return np.where(self.bare, self._along(self.path, physics, shift), np.nan)
        # The path is kept on the camera's clock as the model had it; a later camera means an earlier robot.
        late = float(physics["pose_delay"][0]) + self.film.offset_s - self.path_late
        return self._along(self.path, physics, shift, late)

    def _along(
        self,
        path: Array,
        physics: npt.NDArray[Any],
        shift: Array = NO_SHIFT,
        late: float = 0.0,
        every: int = 1,
    ) -> Array:
        assert self.course is not None
        t, pitch = self.film.t[::every], self.course.pitch_m
        readings = np.empty(len(t))
        floor, sd = self.course.raster(pitch), self.noise.reflection_sd
        look_along(t, path, late, sd, floor, pitch, physics, shift, readings)
        return readings

    def readings(self, physics: npt.NDArray[Any], shift: Array = NO_SHIFT) -> Array:
        """Return the predicted reflection at every row [%]; nan where there is nothing to compare.

        A shift moves the whole path [m, m, rad], shape (3,).
        """
        if not self.looks:
            return np.full(len(self.film.t), np.nan)
        return self._readings(physics, shift)

    def errors(self, physics: npt.NDArray[Any], sight: bool) -> Array:
        """Return the residuals of motion, or of the colour sensor, shape (n,), channel by channel."""
        if sight:
            return (self.recording.reflection_pct - self.readings(physics)) / self.reading_sd
        _, rows, _, poses = self.film.play(physics)
        return np.concatenate([rows.T.ravel(), poses.T.ravel()])

    def cells(self, index: int, sight: bool) -> Cells:
        """Return where the residuals come from."""
        t, pose_t = self.film.t, self.film.reel.pose_t
        if sight:
            return Cells(np.full(len(t), index, np.int32), np.full(len(t), 7, np.int32), t)
        channel = np.r_[np.repeat(np.arange(4), len(t)), np.repeat(np.arange(4, 7), len(pose_t))]
        times = np.concatenate([np.tile(t, 4), np.tile(pose_t, 3)])
        return Cells(np.full(len(times), index, np.int32), channel.astype(np.int32), times)
