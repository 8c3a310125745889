"""Drive a program closed loop on a robot in any engine, and judge the drive by the course's rules."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from benchmarks.transfer.floor import Floor
from benchmarks.transfer.variations import Variation

Pose = tuple[float, float, float]
Row = tuple[int, ...]

TICK_S = 0.001  # commands, sensor and referee act at 1 kHz
TIME_LIMIT_S = 60.0
SENSOR_AHEAD = 0.081  # m, of the axle's centre
PATH_TICKS = 20  # a path has a row every 20 ms

MOTOR, MOTOR_UNTIL, TEST, JUMP = range(4)
_COMPARE: tuple[Callable[[float, float], bool], ...] = (
    operator.gt,
    operator.lt,
    operator.ge,
    operator.le,
    operator.eq,
    operator.ne,
)


class Robot(Protocol):
    """A robot in somebody's engine."""

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest."""

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""

    def advance(self, duties_pct: Sequence[float]) -> None:
        """Drive for a millisecond with a left and a right duty [%]."""

    def close(self) -> None:
        """Take the engine's world down."""


@dataclass(frozen=True)
class Drive:
    """What became of a program on a robot.

    Attributes
    ----------
    outcome
        ``goal``, ``missed_checkpoint``, ``off_course``, ``out_of_time`` or ``stuck``.
    time_s
        When it ended [s].
    path
        ``t_s, x_m, y_m, heading_rad`` every 20 ms, and at the end (rows, 4).
    """

    outcome: str
    time_s: float
    path: list[list[float]]

    @property
    def at_goal(self) -> bool:
        """Whether it ended well."""
        return self.outcome == "goal"


class Interpreter:
    """A program's rows, a millisecond at a time; after the last row it starts again.

    Parameters
    ----------
    rows
        Opcode rows ``[op, a, b, c, target, ...]``: motors left [%], right [%], time [ms]; tests of sensor 0,
        comparison and threshold [%/1000], going to `target` where they fail.
    """

    def __init__(self, rows: Sequence[Sequence[int]]) -> None:
        self._rows: list[Row] = [tuple(row) for row in rows]
        self._at, self._until, self._duties = 0, 0, (0, 0)
        self._ends: Row | None = None

    def turn(self, tick: int, read: Callable[[], int]) -> tuple[int, int] | None:
        """Return the duties [%] of one millisecond.

        Parameters
        ----------
        tick
            Time [ms].
        read
            Reads the colour sensor [%]; called only if the program does.

        Returns
        -------
        tuple[int, int] | None
            None if there is no statement. Where a whole pass takes no time, the program goes on a millisecond later.
        """
        passes = 0
        while self._rows and passes < 2:
            if tick < self._until and not (self._ends and _holds(self._ends, read())):
                return self._duties
            self._run_row(tick, read)
            passes += self._at >= len(self._rows)
        return self._duties if self._rows else None

    def _run_row(self, tick: int, read: Callable[[], int]) -> None:
        row = self._rows[self._at % len(self._rows)]
        self._at, self._until, self._ends = self._at % len(self._rows) + 1, tick, None
        if row[0] in (MOTOR, MOTOR_UNTIL):
            self._duties, self._until = (row[1], row[2]), tick + row[3]
            if row[0] == MOTOR_UNTIL:
                self._ends = self._rows[self._at]
                self._at += 1
        elif row[0] == JUMP or not _holds(row, read()):
            self._at = row[4]


def _holds(test: Row, reading: int) -> bool:
    return _COMPARE[test[2]](reading, test[3] / 1000.0)


class Eye:
    """The colour sensor: an integer percent, averaged over the spot."""

    def __init__(self, floor: Floor, variation: Variation) -> None:
        self._floor, self._variation = floor, variation
        self._rng = np.random.default_rng(variation.seed)
        self._read_at, self._reading = -1, 0

    def read(self, tick: int, pose: Pose) -> int:
        """Read the floor at a time [ms] from where the robot stands; at one time it reads but once."""
        if tick != self._read_at:
            self._read_at, self._reading = tick, self._look(*pose)
        return self._reading

    def _look(self, x: float, y: float, heading: float) -> int:
        seen = self._variation
        light = 1.0 - self._floor.line_share(
            x + SENSOR_AHEAD * math.cos(heading), y + SENSOR_AHEAD * math.sin(heading)
        )
        level = seen.black_pct + (seen.white_pct - seen.black_pct) * light
        if seen.noise_pct > 0.0:
            level += seen.noise_pct * self._rng.standard_normal()
        return min(max(round(level), 0), 100)


class Referee:
    """Who says when a drive is over."""

    def __init__(self, floor: Floor) -> None:
        self._floor, self._passed = floor, 0
        self._tile = floor.tile(*floor.start[:2])

    def watch(self, pose: Pose) -> str | None:
        """Return the outcome if the drive is over now that the axle's centre is here."""
        tile, floor = self._floor.tile(pose[0], pose[1]), self._floor
        if tile == self._tile:
            return None
        self._tile = tile
        if tile == floor.goal:
            return "goal" if self._passed == len(floor.checkpoints) else "missed_checkpoint"
        if tile not in floor.tiles:
            return "off_course"
        if self._passed < len(floor.checkpoints) and tile == floor.checkpoints[self._passed]:
            self._passed += 1
        return None


def drive(
    robot: Robot,
    rows: Sequence[Sequence[int]],
    floor: Floor,
    variation: Variation,
    limit_s: float = TIME_LIMIT_S,
) -> Drive:
    """Let a program drive a robot from START until its end.

    Parameters
    ----------
    robot
        Built with the same variation.
    rows
        The program, as :class:`Interpreter` takes it.
    floor
        The course.
    variation
        Whose sensor and start these are.
    limit_s
        When it ends at the latest [s].
    """
    robot.place(*_shifted(floor.start, variation.start))
    program, eye, referee = Interpreter(rows), Eye(floor, variation), Referee(floor)
    path: list[list[float]] = []
    for tick in range(round(limit_s / TICK_S)):
        pose = robot.pose()
        ended = referee.watch(pose)
        duties = None if ended else program.turn(tick, partial(eye.read, tick, pose))
        if duties is None or tick % PATH_TICKS == 0:
            path.append([round(value, 5) for value in (tick * TICK_S, *pose)])
        if duties is None:
            return Drive(ended or "stuck", tick * TICK_S, path)
        robot.advance(duties)
    return Drive("out_of_time", limit_s, path)


def _shifted(pose: Pose, by: Pose) -> Pose:
    """Move a pose ahead, to the left, and turn it."""
    x, y, heading = pose
    cos, sin = math.cos(heading), math.sin(heading)
    return x + by[0] * cos - by[1] * sin, y + by[0] * sin + by[1] * cos, heading + by[2]
