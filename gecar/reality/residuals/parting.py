"""How far two robots part under the same commands, and how far a robot parts from what was measured."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.materiality import Material, Size, combined
from gecar.reality.noise.sensor_noise import PATH_CAUTION
from gecar.reality.recordings.dead_reckoning import wheel_odometry
from gecar.reality.replay.kernel import HEADING, X, Y
from gecar.reality.replay.odometry import smoothed_rows
from gecar.reality.replay.replayer import Prediction
from gecar.reality.replay.smoothed_path import camera_errors, measured_path
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.residuals.registration import beyond_any_path

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]
Rows = npt.NDArray[np.intp]

PLACE = [X, Y, HEADING]
METRE = 1.0
SPOT_M = 0.15  # about a spot on the floor
EVEN = math.sqrt(2.0)  # times a reading's noise: there the path adds no more than that
LEAST_ROWS = 50  # of even floor
APART_M = 0.25  # how far windows of a metre begin from each other


class _Noise(NamedTuple):
    """Standard deviations of a smoothed path [m, rad]."""

    place: float
    heading: float


class _Drive(NamedTuple):
    """A replay: its path as the camera reports it, and by dead reckoning, shapes (rows, 3); and the robot's track."""

    path: Array
    wheels: Array
    track_m: float


QUIET = _Noise(0.0, 0.0)
WHITE = np.ones(3)
PATH_KNOWN = np.array(
    [0.003, 0.003, 0.01]
)  # to which a camera, its lens and its mount tell a path [m, m, rad]


@dataclass(frozen=True)
class Sizes:
    """How much it matters what robots differ by, under the commands of some recordings.

    Attributes
    ----------
    runs
        The recordings; their readings are compared along their paths, where they have any.
    sensor
        Whether the colour sensor counts, or else the motion.
    beside
        More recordings, of which only the commands count: how far two robots part under them.
    off
        How far the path that the sensor took may be off, over one metre: as far as nothing explains the motion.
    last
        What the last robot that others were compared with did in each recording, by its physics.
    """

    runs: tuple[RecordingResiduals, ...]
    sensor: bool
    beside: tuple[RecordingResiduals, ...] = ()
    off: Size = field(default_factory=Size)
    last: dict[bytes, list[Any]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def of(self, residuals: Residuals) -> Sizes:
        """Return the sizes under the commands of other recordings."""
        return replace(self, runs=residuals.recordings, sensor=residuals.sensor)

    def apart(self, one: Physics, other: Physics) -> Size:
        """Return how far two robots part, in the recording where that is most; physics records of shape (1,)."""
        return self.apart_of_each(one, [other])[0]

    def apart_of_each(self, one: Physics, others: Sequence[Physics]) -> list[Size]:
        """Return how far one robot parts from each of several others, as `apart` does from one."""
        return [combined([*self._apart_in_each(one, other)]) for other in others]

    def are_apart(self, one: Physics, other: Physics, material: Material) -> bool:
        """Whether two robots part by a size that is material, in any recording; physics records of shape (1,)."""
        return any(material.times(size) >= 1.0 for size in self._apart_in_each(one, other))

    def _apart_in_each(self, one: Physics, other: Physics) -> Iterator[Size]:
        """Yield how far two robots part in each recording."""
        runs, key = (*self.runs, *self.beside), one.tobytes()
        if key not in self.last:
            self.last.clear()
            self.last[key] = [self._did(run, one) for run in runs]
        apart = _readings_apart if self.sensor else _drives_apart
        for run, mine in zip(runs, self.last[key], strict=True):
            yield apart(mine, self._did(run, other))

    def _did(self, run: RecordingResiduals, physics: Physics) -> Any:
        """Return what a robot did under a recording's commands: what its sensor read, or how it drove."""
        return run.readings(physics) if self.sensor else _driven(run, physics)

    def left(self, physics: Physics, repeatedly: bool = False, inflation: Array = WHITE) -> Size:
        """Return how far a robot parts from what was measured, beyond the sensors' noise, in a typical recording.

        Or as far as it repeatedly does: in one of four, and in more than one if there are more. Where a motor hardly
        overcomes friction, nothing is known well: one such recording shall not decide. ``inflation`` is by how much the
        camera's slow noise exceeds white noise (variances), shape (3,).
        """
        each = [
            _reading_left(run, physics, self.off) if self.sensor else _left(run, physics, inflation)
            for run in self.runs
        ]
        judged = [size for size in each if size is not None]
        return combined(judged, _repeated if repeatedly else _typical)

    def left_about(self, physics: Physics, spot: tuple[float, float]) -> Size:
        """Return how far a robot parts from what was measured where it passes a spot on the floor [m], typically.

        What only one of several recordings shows there is that recording's, not the spot's. A recording without poses
        says nothing of a place.
        """
        seen = [run for run in self.runs if run.replayer.has_poses]
        passing = [size for run in seen if (size := _left_about(run, physics, spot)) is not None]
        return Size() if len(passing) < min(2, len(seen)) else combined(passing, statistics.median_low)


def logs_apart(one: Residuals, other: Residuals, physics: Physics) -> Size:
    """Return how far a robot's drives part under two repairs of the same logs, in the recording where that is most."""
    pairs = zip(one.recordings, other.recordings, strict=True)
    return combined([_drives_apart(*(_driven(run, physics) for run in pair)) for pair in pairs])


def _typical(sizes: list[float]) -> float:
    """Return the median; of two the smaller, as their mean would let one bad recording decide."""
    return min(sizes) if len(sizes) == 2 else statistics.median(sizes)


def _repeated(sizes: list[float]) -> float:
    """Return the largest size that a quarter of them reach, and at least two where there are two."""
    often = min(max(2, math.ceil(len(sizes) / 4)), len(sizes))
    return sorted(sizes)[-often]


def _drives_apart(one: _Drive, other: _Drive) -> Size:
    poses = _parting(one.path, other.path, one.wheels, one.track_m, QUIET)
    return poses.or_more(_parting(one.wheels, other.wheels, one.wheels, one.track_m, QUIET))


def _driven(run: RecordingResiduals, physics: Physics) -> _Drive:
    played = _replayed(run, physics)
    path, wheels = _seen(run, played, physics), _reckoned(run, physics, played.rows)
    return _Drive(path, wheels, float(physics["track_width"][0]))


def _left(run: RecordingResiduals, physics: Physics, inflation: Array) -> Size | None:
    """Return how far a robot parts from what was measured; None if no metre is judged."""
    out, track = Size(), float(physics["track_width"][0])
    rows = _replayed(run, physics).rows
    path, wheels = rows[:, PLACE], _reckoned(run, physics, rows)
    if run.in_part:
        return _left_elsewhere(run, physics, path, wheels, inflation)
    if run.replayer.has_poses:
        seen = measured_path(run.replayer, physics)
        out = out.or_more(_parting(path, seen, wheels, track, _path_noise(run, inflation)))
    measured = ~np.isnan(run.replayer.measured[:, :2]).all(axis=0)
    if run.recording.setup.rig == "bench":
        for side in np.flatnonzero(measured):
            way, counted = (_rolled(run, physics, a[:, side]) for a in (rows, run.replayer.measured))
            out = out.or_more(_parting(way, counted, way, track, QUIET))
    elif measured.all():
        counted = _reckoned(run, physics, run.replayer.measured)
        out = out.or_more(_parting(wheels, counted, wheels, track, QUIET))
    return out


def _left_about(run: RecordingResiduals, physics: Physics, spot: tuple[float, float]) -> Size | None:
    """Return how far a robot parts from the poses seen, over windows of a metre that pass a spot; None: none does."""
    rows = _replayed(run, physics).rows
    seen, wheels = measured_path(run.replayer, physics), _reckoned(run, physics, rows)
    near = np.hypot(seen[:, 0] - spot[0], seen[:, 1] - spot[1]) < SPOT_M
    passed = np.r_[0, np.cumsum(near)]
    first, last = _windows(wheels, float(physics["track_width"][0]))
    inside = passed[last] > passed[first]
    if not inside.any():
        return None
    return Size(*_beyond(rows[:, PLACE], seen, first[inside], last[inside], _path_noise(run, WHITE)))


def _left_elsewhere(
    run: RecordingResiduals, physics: Physics, path: Array, wheels: Array, inflation: Array
) -> Size | None:
    """Return how far a robot's path parts from the poses seen, over windows of a metre that are judged throughout."""
    passed = np.r_[0, np.cumsum(run.replayer.anew)]
    first, last = _windows(wheels, float(physics["track_width"][0]))
    judged = passed[last + 1] == passed[first]
    if not judged.any():
        return None
    seen = measured_path(run.replayer, physics)
    return Size(*_beyond(path, seen, first[judged], last[judged], _path_noise(run, inflation)))


def _path_noise(run: RecordingResiduals, inflation: Array) -> _Noise:
    x, y, heading = run.smoothed_sd(inflation) / PATH_CAUTION
    return _Noise(math.hypot(x, y) / math.sqrt(2.0), float(heading))


def _readings_apart(one: Array, other: Array) -> Size:
    return Size(reading_pct=_root_mean((one - other) ** 2))


def _reading_left(run: RecordingResiduals, physics: Physics, off: Size) -> Size:
    """Return the error of readings beyond what noise and an uncertain path explain: overall or on even floor, if more.

    Along a line a path that is known to 3 mm leaves 30 % of a reading uncertain; but it lasts (`beyond_any_path`).
    """
    path_sd = np.hypot(PATH_KNOWN, (1e-3 * off.mm_1m, 1e-3 * off.mm_1m, math.radians(off.deg_1m)))
    predicted_sd = run.predicted_reading_sd(physics, path_sd)
    beyond = (run.recording.reflection_pct - run.readings(physics)) ** 2 - predicted_sd**2
    even = beyond[(predicted_sd < EVEN * run.noise.reflection_sd) & ~np.isnan(beyond)]
    on_even = _root_mean(even) if len(even) >= LEAST_ROWS else 0.0
    # A start that was found from readings fits them already.
    overall = beyond if run.nuisances.start is not None else beyond_any_path(run, physics, path_sd)
    return Size(reading_pct=max(_root_mean(overall), on_even))


def _replayed(run: RecordingResiduals, physics: Physics) -> Prediction:
    """Return what an open-loop replay predicts."""
    return run.replayer.open_loop().play(physics)


def _seen(run: RecordingResiduals, played: Prediction, physics: Physics) -> Array:
    """Return a replay's path of the axle's centre as the camera reports it, late and with errors, shape (rows, 3)."""
    replayer = run.replayer
    late = replayer.t - float(physics["pose_delay"][0])
    path = np.stack([np.interp(late, replayer.t, played.rows[:, k]) for k in PLACE], axis=1)
    if replayer.has_poses:
        errors = camera_errors(replayer, physics, played)
        path += np.stack([np.interp(replayer.t, replayer.inputs.pose_t, each) for each in errors.T], axis=1)
    return path


def _reckoned(run: RecordingResiduals, physics: Physics, angles: Array) -> Array:
    """Return a path by dead reckoning from wheel angles [rad]: columns 0 and 1."""
    left, right = (smoothed_rows(angles[:, k], run.replayer.t) for k in range(2))
    return wheel_odometry(left, right, float(physics["wheel_radius"][0]), float(physics["track_width"][0]))


def _rolled(run: RecordingResiduals, physics: Physics, angle: Array) -> Array:
    """Return the way a wheel on a bench would roll, shape (rows, 3)."""
    way = smoothed_rows(angle, run.replayer.t) * float(physics["wheel_radius"][0])
    return np.column_stack([way, np.zeros((len(way), 2))])


def _windows(wheels: Array, track_m: float) -> tuple[Rows, Rows]:
    """Return the first and last rows of windows of a metre, of wheels that roll or turn on the spot."""
    moved = np.r_[0.0, np.cumsum(np.hypot(*np.diff(wheels[:, :2], axis=0).T))]
    turned = np.r_[0.0, np.cumsum(np.abs(np.diff(wheels[:, 2])))] * 0.5 * track_m
    way = np.maximum(moved, turned)
    begins = np.arange(0.0, max(way[-1] - METRE, 0.0) + 1e-9, APART_M)
    return np.searchsorted(way, begins), np.minimum(np.searchsorted(way, begins + METRE), len(way) - 1)


def _parting(one: Array, other: Array, wheels: Array, track_m: float, noise: _Noise) -> Size:
    """Return how far two paths part, over windows of a metre and as a whole."""
    whole = np.array([0]), np.array([len(wheels) - 1])
    mm_1m, deg_1m = _beyond(one, other, *_windows(wheels, track_m), noise)
    mm_drive, deg_drive = _beyond(one, other, *whole, noise)
    return Size(mm_1m, deg_1m, mm_drive, deg_drive)


def _beyond(one: Array, other: Array, first: Rows, last: Rows, noise: _Noise) -> tuple[float, float]:
    """Return the parting [mm, deg] from some rows to others, root mean square, less noise."""
    a, b = _relative(one, first, last), _relative(other, first, last)
    far = np.sum(a[:, :2] ** 2, axis=1)
    place = np.sum((a - b)[:, :2] ** 2, axis=1) - 4.0 * noise.place**2 - far * noise.heading**2
    turn = (a[:, 2] - b[:, 2]) ** 2 - 2.0 * noise.heading**2
    return 1e3 * _root_mean(place), float(np.degrees(_root_mean(turn)))


def _relative(path: Array, first: Rows, last: Rows) -> Array:
    """Return the pose at some rows as seen from the pose at others, shape (windows, 3)."""
    move, heading = path[last] - path[first], path[first, 2]
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack(
        [move[:, 0] * cos + move[:, 1] * sin, move[:, 1] * cos - move[:, 0] * sin, move[:, 2]], axis=1
    )


def _root_mean(squares: Array) -> float:
    there = squares[~np.isnan(squares)]
    return float(np.sqrt(max(float(np.mean(there)), 0.0))) if len(there) else 0.0
