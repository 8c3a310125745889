"""Whitened residuals of several recordings together: what effects are fitted to.

Readings of the colour sensor are compared along the measured path, so that what moves the robot and what the sensor
sees are separated: effects of one kind do not change residuals of the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.noise.sensor_noise import Noise
from gecar.reality.recordings.columns import POSE_FIELDS
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.channels import ResidualIndex
from gecar.reality.replay.kernel import YAW_RATE
from gecar.reality.replay.replayer import Replayer
from gecar.reality.residuals.of_recording import RecordingResiduals, residuals_of
from gecar.reality.residuals.regimes import motions
from gecar.reality.residuals.threads import Threads
from gecar.world.course.course import Course, load_course

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Physics = npt.NDArray[Any]

GYRO_SCALE, GYRO_BIAS_RAD_S, GYRO_LATE_S = 0.02, 0.01, 0.01  # a LEGO gyro: within 2 %, 0.6 deg/s, 10 ms
ENCODER_WAVE_RAD = math.radians(1.0)  # as much as such an encoder's resolution
# Each tells motion by itself; with their fields of a recording.
INSTRUMENTS = {"encoders": ("left_angle_rad", "right_angle_rad"), "poses": POSE_FIELDS}
ENCODED = frozenset(INSTRUMENTS["encoders"])
LARGEST = 1e3  # standard deviations at which residuals are cut


@dataclass(frozen=True)
class Residuals:
    """Residuals of motion, or of the colour sensor, of several recordings.

    Attributes
    ----------
    recordings
        Each with its simulation.
    sensor
        Whether they are the colour sensor's.
    threads
        Replay the recordings.
    """

    recordings: tuple[RecordingResiduals, ...]
    sensor: bool
    threads: Threads = field(default_factory=Threads, compare=False)

    def errors(self, physics: Physics) -> Array:
        """Return the whitened residuals, shape (n,); samples that were not measured are left out."""
        return self.errors_of_each(physics)[0]

    def errors_of_each(self, physics: Physics) -> Array:
        """Return the same under m physics records, shape (m, n)."""
        if not self.recordings:
            return np.zeros((len(physics), 0))
        parts = self.threads.map(
            lambda r: r.sensor_errors(physics) if self.sensor else r.motion_errors(physics), self.recordings
        )
        found = np.concatenate(parts, axis=1)[:, self._located[1]]
        found[np.isnan(found)] = LARGEST
        return np.clip(found, -LARGEST, LARGEST, out=found)

    @cached_property
    def _located(self) -> tuple[ResidualIndex, Mask]:
        """Where each residual comes from, and which of all samples they are."""
        parts = [
            r.sensor_index(k) if self.sensor else r.motion_index(k) for k, r in enumerate(self.recordings)
        ]
        if not parts:
            return ResidualIndex(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0)), np.zeros(0, bool)
        there = np.concatenate([mask for _, mask in parts])
        whole = ResidualIndex(
            *(np.concatenate([getattr(i, f) for i, _ in parts]) for f in ("recording", "channel", "t_s"))
        )
        return whole.kept(there), there

    def instrument_errors(self, physics: Physics) -> Array:
        """Return what a gyro and encoders with errors of their own add to residuals of motion, shape (n, 7).

        The gyro's scale, bias and delay, and a wave a turn, of any phase, of the left and the right encoder. Of a size
        that is not worth a name: `GYRO_SCALE`, `GYRO_BIAS_RAD_S`, `GYRO_LATE_S` and `ENCODER_WAVE_RAD`. The gyro's are
        those of the rates that a robot's physics, shape (1,), predicts. Measured rates hold its noise, which a scale of
        3 % would lessen by 3 %: with the wrong scale a robot would fit better than with the right one.
        """
        if self.sensor or not self.recordings:
            return np.zeros((len(self.index.t_s), 7))
        return np.concatenate([self._gyro_errors(physics), self._encoder_waves], axis=1)

    def _gyro_errors(self, physics: Physics) -> Array:
        parts = []
        for run in self.recordings:
            rows, poses = len(run.replayer.t), len(run.replayer.inputs.pose_t)
            part = np.zeros((4 * rows + 3 * poses, 3))
            if not np.isnan(run.replayer.measured[:, 3]).all():
                rate, t = run.replayer.play(physics).rows[:, YAW_RATE], run.replayer.t
                late = -GYRO_LATE_S * np.gradient(rate, t)
                added = np.column_stack([GYRO_SCALE * rate, np.full(rows, GYRO_BIAS_RAD_S), late])
                part[3 * rows : 4 * rows] = added / float(run.noise.sd[2])
            parts.append(part)
        return np.concatenate(parts)[self._located[1]]

    @cached_property
    def _encoder_waves(self) -> Array:
        parts = []
        for run in self.recordings:
            rows, poses = len(run.replayer.t), len(run.replayer.inputs.pose_t)
            part = np.zeros((4 * rows + 3 * poses, 4))
            for side in range(2):
                angle = run.replayer.measured[:, side]
                for k, wave in enumerate((np.sin, np.cos)):
                    left = _beyond_memory(run.replayer, ENCODER_WAVE_RAD * wave(angle))
                    part[side * rows : (side + 1) * rows, 2 * side + k] = left / float(run.noise.sd[0])
            parts.append(part)
        return np.concatenate(parts)[self._located[1]]

    @property
    def index(self) -> ResidualIndex:
        """Where each residual comes from."""
        return self._located[0]

    def regimes(self, physics: Physics) -> dict[str, Mask]:
        """Return in which regimes of a robot's motion each residual lies, by name, each of shape (n,)."""
        index, out = self.index, dict[str, Mask]()
        for number, run in enumerate(self.recordings):
            own = index.recording == number
            t = run.replayer.t - run.replayer.t[0]
            row = np.minimum(np.searchsorted(t, index.t_s[own]), len(t) - 1)
            for name, mask in motions(run, physics).items():
                out.setdefault(name, np.zeros(len(own), bool))[own] = mask[row]
        return out

    @property
    def reading_sd(self) -> Array:
        """Standard deviation of each reading, the path's uncertainty included, shape (n,) [%]; of sensor residuals."""
        paths = [r.nuisances.path for r in self.recordings]
        return np.concatenate([path.reading_sd for path in paths if path is not None])[self._located[1]]

    @property
    def clock_offsets_s(self) -> Array:
        """How late each recording's camera clock is taken to be [s], shape (recordings,)."""
        return np.array([r.nuisances.clock_offset_s for r in self.recordings])

    @property
    def mark(self) -> tuple[float, float, float]:
        """Where the camera's mark is taken to be on the robot: ahead, left [m], turned [rad]."""
        return self.recordings[0].nuisances.mark if self.recordings else (0.0, 0.0, 0.0)

    def part(self, numbers: Sequence[int] | npt.NDArray[np.int64]) -> Residuals:
        """Return the residuals of some of the recordings, by their numbers."""
        return replace(self, recordings=tuple(self.recordings[k] for k in numbers))

    def and_of(self, others: Residuals) -> Residuals:
        """Return the residuals of these recordings and of others."""
        return replace(self, recordings=self.recordings + others.recordings)

    def without(self, instrument: str) -> Residuals:
        """Return these without what one of `INSTRUMENTS` measured and without nuisances.

        Recordings without the other one are left out.
        """
        (others,) = (fields for name, fields in INSTRUMENTS.items() if name != instrument)
        there = [run for run in self.recordings if not set(others).isdisjoint(run.recording.measured)]
        return replace(self, recordings=tuple(run.without(INSTRUMENTS[instrument]) for run in there))

    def away_from(self, place: tuple[float, float], radius_m: float) -> Residuals:
        """Return these with motion not compared near a place [m]; recordings that tell no place are left out."""
        seen = [run for run in self.recordings if run.tells_places]
        return replace(self, recordings=tuple(run.away_from(place, radius_m) for run in seen))

    def along_encoders(self) -> Residuals:
        """Return these with wheels that turn as the encoders say; recordings without encoders or poses are left out."""
        seen = [
            run for run in self.recordings if run.tells_places and ENCODED.issubset(run.recording.measured)
        ]
        return replace(self, recordings=tuple(run.along_encoders() for run in seen))

    @property
    def follow_encoders(self) -> bool:
        """Whether wheels turn as the encoders say in their replays (`along_encoders`)."""
        return bool(self.recordings) and self.recordings[0].replayer.inputs.rolls

    def except_at(self, rows: Sequence[Mask]) -> Residuals:
        """Return these with motion not compared at some rows, of each recording (rows,), nor just after."""
        there = zip(self.recordings, rows, strict=True)
        return replace(self, recordings=tuple(run.except_at(mask) for run, mask in there))

    def everywhere(self) -> Residuals:
        """Return these with motion compared at all rows again, and wheels that turn by their commands."""
        return replace(self, recordings=tuple(run.throughout() for run in self.recordings))

    def with_memory(self, memory_s: float) -> Residuals:
        """Return these of replays with another memory [s], as `Replayer.with_memory`."""
        changed = [replace(run, replayer=run.replayer.with_memory(memory_s)) for run in self.recordings]
        return replace(self, recordings=tuple(changed))

    def with_clock_offsets(self, offsets_s: Array) -> Residuals:
        """Return these with other camera clocks, shape (recordings,) [s]."""
        changed = [
            r.with_nuisances(replace(r.nuisances, clock_offset_s=float(offset)))
            for r, offset in zip(self.recordings, offsets_s, strict=True)
        ]
        return replace(self, recordings=tuple(changed))

    def with_mark(self, mark: Sequence[float] | Array) -> Residuals:
        """Return these with the poses taken for those of a camera's mark on the robot; see `axle_pose`."""
        ahead, left, turn = (float(part) for part in mark)
        changed = [r.with_nuisances(replace(r.nuisances, mark=(ahead, left, turn))) for r in self.recordings]
        return replace(self, recordings=tuple(changed))

    def later(self, seconds: float) -> Residuals:
        """Return these with simulations that begin so much earlier than the recordings [s]."""
        changed = [replace(r, replayer=r.replayer.later(seconds)) for r in self.recordings]
        return replace(self, recordings=tuple(changed))

    def localised(self, physics: Physics) -> Residuals:
        """Return these with start poses found from readings where no camera looked."""
        return replace(
            self, recordings=tuple(self.threads.map(lambda r: r.localised(physics), self.recordings))
        )

    def with_paths(self, physics: Physics, inflation: Array | None = None) -> Residuals:
        """Return these with the paths along which readings are predicted, as a model of the motion gives them.

        Parameters
        ----------
        physics
            That model, shape (1,).
        inflation
            By how much slow noise of x, y and heading exceeds white noise (variances), shape (3,); default: 1.
        """
        slow = np.ones(3) if inflation is None else inflation
        along = self.threads.map(lambda r: r.with_path(physics, slow), self.recordings)
        return replace(self, recordings=tuple(along))

    def of_sensor(self) -> Residuals:
        """Return the colour sensor's residuals of the recordings that have any; they need paths."""
        return replace(self, recordings=tuple(r for r in self.recordings if r.reads), sensor=True)


def motion_residuals(
    recordings: Sequence[Recording],
    noise: Noise,
    memory_s: float,
    threads: Threads,
    bench_memory_s: float | None = None,
) -> Residuals:
    """Return the residuals of motion of recordings, each on the course it names.

    Parameters
    ----------
    recordings, noise
        What was measured, and how noisy it is.
    memory_s
        Over how long replays are drawn back to the measurement [s].
    threads
        Replay the recordings.
    bench_memory_s
        The same for recordings made on a bench; default: the same.

    Raises
    ------
    InputError
        If a course file is missing or wrong.
    """
    courses: dict[str, Course | None] = {}
    for recording in recordings:
        name = recording.setup.course
        if name not in courses:
            needed = recording.setup.rig == "floor" and name != "none"
            courses[name] = load_course(name) if needed else None
    on_bench = memory_s if bench_memory_s is None else bench_memory_s
    beside = tuple(
        residuals_of(r, noise, on_bench if r.setup.rig == "bench" else memory_s, courses[r.setup.course])
        for r in recordings
    )
    return Residuals(beside, sensor=False, threads=threads)


def _beyond_memory(replayer: Replayer, errors: Array) -> Array:
    """Return what remains of an encoder's errors [rad] in a replay that is drawn towards them, shape (rows,).

    As `gecar.reality.replay.kernel` draws wheel angles: a young mean weighs all it has seen alike, an old one forgets.
    """
    memory_s, anew = replayer.inputs.memory, replayer.anew
    if math.isinf(memory_s):
        return errors
    left = np.zeros(len(errors))
    offset, weight, before = 0.0, 0.0, -math.inf
    for k, (now, error) in enumerate(zip(replayer.t.tolist(), errors.tolist(), strict=True)):
        weight = 0.0 if anew[k] else weight
        if not math.isnan(error):
            weight, before = 1.0 + weight * math.exp(-(now - before) / memory_s), now
            left[k] = error - offset
            offset += left[k] / weight
    return left
