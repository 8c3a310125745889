"""The gap: one program's simulated drive compared with recordings of it, in the paper's figures.

found = gap([read_recording("trial_1.csv"), ...], world, program)

Table 6 (arrival times), Fig. 9 (paths), Fig. 10 (displacement over time), Table 7 (correlation of coordinates), and
per channel the root mean square error in standard deviations of what was measured (NRMSE): of the closed loop, and of
the recorded commands replayed open loop. Without a program the replay serves as the simulation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely.geometry import Point

from gecar.language.program import Program
from gecar.reality.recordings.columns import COLUMNS, POSE_FIELDS
from gecar.reality.recordings.dead_reckoning import wheel_odometry
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.replay.replayer import Replay, replay
from gecar.world.course.course import Course
from gecar.world.robot import Robot
from gecar.world.rollout import Outcome, World, simulate

Array = npt.NDArray[np.float64]

AT_EDGE_M = 0.001  # a pose this near GOAL, at a log's end, is in it: no camera knows better
STEP_S = 0.01  # of displacements, as in the paper's Fig. 10
_QUIET_PCT = 0.5  # noise assumed in a replayed reading: only clipping at 0 and 100 feels it
CHANNELS = {f: c for c, (f, _) in COLUMNS.items() if f not in ("t_s", "left_duty", "right_duty")}


@dataclass(frozen=True)
class Path:
    """Where the axle's centre was.

    Attributes
    ----------
    t_s
        Time since the start [s], shape (samples,).
    x_m, y_m, heading_rad
        Pose [m, m, rad], shape (samples,).
    """

    t_s: Array
    x_m: Array
    y_m: Array
    heading_rad: Array

    def moved_to(self, x_m: float, y_m: float) -> Path:
        """Return the path moved so that it starts at a point [m]."""
        return replace(self, x_m=self.x_m - self.x_m[0] + x_m, y_m=self.y_m - self.y_m[0] + y_m)

    def at(self, t_s: Array) -> Array:
        """Return positions at times [m], shape (times, 2)."""
        return np.column_stack([np.interp(t_s, self.t_s, axis) for axis in (self.x_m, self.y_m)])


@dataclass(frozen=True)
class Trial:
    """One recording compared with the simulation.

    Attributes
    ----------
    name
        The recording's.
    path, simulated
        The way recorded, and the simulation's.
    by_odometry
        Whether no pose was recorded, and the path is reckoned from the wheels' angles.
    arrival_s
        When GOAL was reached [s]; where it was not, when the recording ends.
    arrived
        Whether GOAL was reached through all checkpoints in order.
    checkpoints
        How many were passed in order.
    error_pct
        By how much the arrival is later than the simulation's [%]; nan where either did not arrive.
    t_s, displacement_m
        Distance of recorded from simulated position over time, shape (times,).
    correlation
        Of recorded and simulated coordinates, x and y; nan where one stands still.
    closed_loop, open_loop
        NRMSE by column of the file: of the program's simulation, and of the recorded commands replayed.
    """

    name: str
    path: Path
    simulated: Path
    by_odometry: bool
    arrival_s: float
    arrived: bool
    checkpoints: int
    error_pct: float
    t_s: Array
    displacement_m: Array
    correlation: tuple[float, float]
    closed_loop: Mapping[str, float] = field(default_factory=dict)
    open_loop: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Gap:
    """Trials compared with a simulation.

    Attributes
    ----------
    trials
        One for each recording.
    simulated_s, outcome
        The program's time and outcome in simulation; None without a program.
    course, robot
        Where, and who in the simulation.
    in_course
        Whether positions are the course's; otherwise all paths start at one point, as in the paper.
    arrives
        How the program arrives under fresh conditions, as in result.json; None where that is not measured.
    """

    trials: tuple[Trial, ...]
    simulated_s: float | None
    outcome: Outcome | None
    course: Course | None
    robot: Robot
    in_course: bool
    arrives: Mapping[str, Any] | None = None

    @property
    def share(self) -> float | None:
        """Share of drives in which the program arrives, 0..1; None where that is not measured."""
        return self.arrives["share"] if self.arrives else None


def gap(
    recordings: Sequence[Recording],
    robot: Robot,
    course: Course | None,
    program: Program | None = None,
    in_course: bool = False,
) -> Gap:
    """Compare a program's simulation with recordings of it.

    Parameters
    ----------
    recordings
        One trial each.
    robot, course
        Of the simulation; a program needs a course.
    program
        The program that drove; None: the recorded commands are replayed open loop.
    in_course
        Whether to compare positions in the course's frame, instead of from a common start.
    """
    if program is None or course is None:
        trials = [_trial(r, robot, course, None, in_course) for r in recordings]
        return Gap(tuple(trials), None, None, course, robot, in_course)
    drive = simulate(World(robot, course), program.opcodes, trace=True)
    assert drive.trace is not None
    arrival = drive.time_s if drive.outcome == Outcome.GOAL else np.nan
    trials = [_trial(r, robot, course, (drive.trace, arrival), in_course) for r in recordings]
    return Gap(tuple(trials), drive.time_s, drive.outcome, course, robot, in_course)


def _trial(
    recording: Recording,
    robot: Robot,
    course: Course | None,
    driven: tuple[Mapping[str, Array], float] | None,
    in_course: bool,
) -> Trial:
    replayed = replay(recording, robot)
    path, by_odometry = recorded_path(recording, robot, course)
    arrival, arrived, checkpoints = arrival_of(path, course)
    since = recording.t_s - recording.t_s[0]
    trace = driven[0] if driven else {"t_s": since, **{f: getattr(replayed, f) for f in POSE_FIELDS}}
    simulated = Path(*(np.asarray(trace[f]) for f in ("t_s", *POSE_FIELDS)))
    if driven and not in_course:  # a replay's start is fitted to the poses seen
        path = path.moved_to(simulated.x_m[0], simulated.y_m[0])
    t = np.arange(0.0, min(path.t_s[-1], arrival, simulated.t_s[-1]) + 1e-9, STEP_S)
    measured, expected = path.at(t), simulated.at(t)
    return Trial(
        name=recording.name,
        path=path,
        simulated=simulated,
        by_odometry=by_odometry,
        arrival_s=arrival,
        arrived=arrived,
        checkpoints=checkpoints,
        error_pct=100.0 * (arrival / driven[1] - 1.0) if driven and arrived else np.nan,
        t_s=t,
        displacement_m=np.hypot(*(measured - expected).T),
        correlation=(_correlation(measured[:, 0], expected[:, 0]), _correlation(measured[:, 1], expected[:, 1])),
        closed_loop=_against_drive(recording, path, since, driven[0]) if driven else {},
        open_loop=_against_replay(recording, replayed, robot, course),
    )  # fmt: skip


def recorded_path(recording: Recording, robot: Robot, course: Course | None) -> tuple[Path, bool]:
    """Return the way a recording took, and whether it had to be reckoned from the wheels' angles."""
    r = recording
    seen = ~(np.isnan(r.x_m) | np.isnan(r.y_m))
    if seen.sum() > 1:
        heading = np.where(np.isnan(r.heading_rad), 0.0, r.heading_rad)
        return Path(r.t_s[seen] - r.t_s[0], r.x_m[seen], r.y_m[seen], heading[seen]), False
    return _reckoned(recording, robot, course), True


def _reckoned(recording: Recording, robot: Robot, course: Course | None) -> Path:
    """Add up the wheels' angles from START, or from 0: arcs of the mean heading, exact for straight and circle."""
    body, r = robot.body, recording
    seen = ~(np.isnan(r.left_angle_rad) | np.isnan(r.right_angle_rad))
    start = (course.start.x_m, course.start.y_m, course.start.heading_rad) if course else (0.0, 0.0, 0.0)
    left, right = r.left_angle_rad[seen], r.right_angle_rad[seen]
    path = wheel_odometry(left, right, body.wheel_radius, body.track_width, start)
    return Path(r.t_s[seen] - r.t_s[0], *path.T)


def arrival_of(path: Path, course: Course | None) -> tuple[float, bool, int]:
    """Return (time, whether GOAL was reached through all checkpoints in order, checkpoints passed).

    The time is GOAL's, or the path's last where that was not reached [s]. The last pose of a log that ends as GOAL is
    entered may be rounded to just outside.
    """
    end = float(path.t_s[-1])
    if course is None:
        return end, False, 0
    t = np.append(np.arange(0.0, end, 0.002), end)  # as fine as the simulation's own steps
    at = np.floor(path.at(t) / course.tile_size_m).astype(int)
    inside = (at >= 0).all(axis=1) & (at[:, 0] < course.columns) & (at[:, 1] < course.rows)
    tiles = np.where(inside, at[:, 1] * course.columns + at[:, 0], -1)
    passed = 0
    for k in np.flatnonzero(np.diff(tiles, prepend=-2)):
        if tiles[k] == course.sequence[passed]:
            passed += 1
            if passed == len(course.sequence):
                return float(t[k]), True, passed - 1
    if passed == len(course.sequence) - 1:
        last = Point(path.x_m[-1], path.y_m[-1])
        return end, bool(course.layout.square(course.goal).distance(last) < AT_EDGE_M), passed
    return end, False, passed


def _against_drive(
    recording: Recording, path: Path, since: Array, trace: Mapping[str, Array]
) -> dict[str, float]:
    """Return the NRMSE of a program's drive by column, over the time both last."""
    both = since <= min(float(trace["t_s"][-1]), path.t_s[-1])
    out = {}
    for name in ("left_angle_rad", "right_angle_rad", "reflection_pct"):
        simulated = np.interp(since[both], trace["t_s"], trace[name])
        out[CHANNELS[name]] = nrmse(getattr(recording, name)[both], simulated)
    within = path.t_s <= trace["t_s"][-1]
    for name in POSE_FIELDS:
        simulated = np.interp(path.t_s[within], trace["t_s"], trace[name])
        out[CHANNELS[name]] = nrmse(getattr(path, name)[within], simulated)
    return {column: value for column, value in out.items() if not np.isnan(value)}


def _against_replay(
    recording: Recording, replayed: Replay, robot: Robot, course: Course | None
) -> dict[str, float]:
    """Return the NRMSE of a replay by column."""
    out = {
        column: nrmse(getattr(recording, name), getattr(replayed, name))
        for name, column in CHANNELS.items()
        if hasattr(replayed, name)
    }
    if course is not None and recording.setup.rig == "floor":
        out["reflection_pct"] = nrmse(recording.reflection_pct, _readings(replayed, robot, course))
    return {column: value for column, value in out.items() if not np.isnan(value)}


def _readings(replayed: Replay, robot: Robot, course: Course) -> Array:
    """Return what the colour sensor would read along a replay [%]."""
    path = np.column_stack([replayed.x_m, replayed.y_m, replayed.heading_rad])
    readings: Array = readings_along(
        replayed.t_s, path, 0.0, _QUIET_PCT, course.surface, robot.physics, np.zeros(3)
    )
    return readings


def nrmse(measured: Array, simulated: Array) -> float:
    """Return RMSE over the standard deviation of what was measured; nan where that is missing or stands still."""
    seen = ~np.isnan(measured)
    if seen.sum() < 2 or np.ptp(measured[seen]) < 1e-9:
        return float("nan")
    return float(np.sqrt(np.mean((measured[seen] - simulated[seen]) ** 2)) / np.std(measured[seen]))


def _correlation(one: Array, other: Array) -> float:
    if len(one) < 3 or np.std(one) < 1e-9 or np.std(other) < 1e-9:
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])
