"""Whitened residuals of a set of recordings under a physics record: what every later stage works on.

Each residual is one sample of one channel, measured minus simulated, in standard deviations of what noise alone
would do: wheel angles and pose as the following replay's innovations, battery and gyro as they are, reflection
along the measured path.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.looking import look_along
from gecar.reality.noise import PATH_CAUTION, Noise
from gecar.reality.path import measured_path
from gecar.reality.recording import Recording
from gecar.reality.replay import Film
from gecar.world.course import Course

Array = npt.NDArray[np.float64]
NO_SHIFT = np.zeros(3)
SMOOTHED_BLOCKS = 2.8  # blocks a path is smoothed over: 3.5 x 0.12 s of 0.15 s each
DISC_SPREAD = 4.0  # a disc's diameter over its standard deviation along an axis

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
        self.looks = bool(course is not None and seen.any() and len(self.film.reel.pose_t) > 3)
        self.looks = self.looks and recording.setup.rig == "floor"
        self.raster = course.raster(course.pitch_m) if course is not None and self.looks else None
        self.pitch = course.pitch_m if course is not None else 1.0
        self.path, self.path_late = np.zeros((0, 3)), 0.0
        self.path_colour, self.blur_m = np.ones(3), 0.0
        self.reading_sd = np.full(len(seen), np.nan)

    def set_path(self, physics: npt.NDArray[Any]) -> None:
        """Take the measured path, smoothed with a model's help, and how uncertain readings are along it."""
        if not self.looks:
            return
        self.path = measured_path(self.film, physics)
        self.path_late = float(physics["pose_delay"][0]) + self.film.offset_s
        # What an uncertain path crosses is smeared: on the mean a spot that is larger by as much sees the same. Noise
        # that lingers is not smoothed away: over a block it stays, over the smoothing's blocks it adds up.
        lingering = 1.0 + SMOOTHED_BLOCKS * (self.path_colour**2 - 1.0)
        sd = self.noise.path_sd / PATH_CAUTION * np.sqrt(lingering)
        self.blur_m = float(np.hypot(sd[0], float(physics["sensor_ahead"][0]) * sd[2]))
        middle = self._readings(physics, NO_SHIFT)
        variance = np.full(len(middle), self.noise.reflection_sd**2)
        for shift in np.diag(self.noise.path_sd * self.path_colour):
            variance += (0.5 * (self._readings(physics, shift) - self._readings(physics, -shift))) ** 2
        # One crossing of an edge is one event, however many samples it has.
        self.reading_sd = np.sqrt(variance)

    def _readings(self, physics: npt.NDArray[Any], shift: Array) -> Array:
        readings = np.empty(len(self.film.t))
        # The path is kept on the camera's clock as the model had it; a later camera means an earlier robot.
        late = float(physics["pose_delay"][0]) + self.film.offset_s - self.path_late
        assert self.raster is not None
        physics = physics.copy()
        physics["spot_diameter"] = np.hypot(physics["spot_diameter"], DISC_SPREAD * self.blur_m)
        look_along(
            self.film.t,
            self.path,
            late,
            self.noise.reflection_sd,
            self.raster,
            self.pitch,
            physics,
            shift,
            readings,
        )
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


class Comparison:
    """Recordings side by side with their replays, in motion or in what the colour sensor saw.

    Sight is compared along the measured path, so that what moves the robot and what blinds it come apart: neither
    kind of effect changes the other's residuals.

    Parameters
    ----------
    strips
        The recordings.
    sight
        Whether to compare what the colour sensor saw, or the motion.
    pool
        Threads that replay.
    """

    def __init__(self, strips: Sequence[Strip], sight: bool, pool: ThreadPoolExecutor) -> None:
        self.strips = tuple(s for s in strips if s.looks) if sight else tuple(strips)
        self.sight = sight
        self._pool = pool
        self._keep: npt.NDArray[np.bool_] = np.zeros(0, np.bool_)
        self.replays = 0

    def set_path(self, physics: npt.NDArray[Any], colour: Array | None = None) -> None:
        """Set the path sight is based on: as a model sees it, with noise of a colour."""
        for strip in self.strips:
            strip.path_colour = np.ones(3) if colour is None else np.sqrt(colour)
        list(self._pool.map(lambda strip: strip.set_path(physics), self.strips))
        self._keep = np.zeros(0, np.bool_)

    def errors(self, physics: npt.NDArray[Any]) -> Array:
        """Return the whitened residuals, shape (n,); samples that are not there are left out."""
        self.replays += len(self.strips)
        parts = list(self._pool.map(lambda strip: strip.errors(physics, self.sight), self.strips))
        everything = np.concatenate(parts) if parts else np.zeros(0)
        if len(self._keep) != len(everything):
            self._keep = ~np.isnan(everything)
        return np.clip(np.nan_to_num(everything[self._keep], nan=1e3), -1e3, 1e3)

    @property
    def reading_sd(self) -> Array:
        """How uncertain each residual of sight is, the path's part included [%], shape (n,); known after `errors`."""
        return np.concatenate([strip.reading_sd for strip in self.strips])[self._keep]

    @property
    def offsets(self) -> Array:
        """How late each recording's camera clock is taken to be [s], shape (recordings,)."""
        return np.array([strip.film.offset_s for strip in self.strips])

    def set_offsets(self, offsets: Array) -> None:
        """Take the camera clocks to be late by so much [s]."""
        for strip, offset in zip(self.strips, offsets, strict=True):
            strip.film.offset_s = float(offset)

    def set_mark(self, mark: Array) -> None:
        """Take the poses to be those of a camera's mark on the robot; see `axle_pose`."""
        for strip in self.strips:
            strip.film.set_mark(mark)

    @property
    def cells(self) -> Cells:
        """Where each residual comes from; known after the first `errors`."""
        parts = [strip.cells(i, self.sight) for i, strip in enumerate(self.strips)]
        return Cells(
            np.concatenate([c.recording for c in parts])[self._keep],
            np.concatenate([c.channel for c in parts])[self._keep],
            np.concatenate([c.t_s for c in parts])[self._keep],
        )
