"""Drive an evolved program on the paper's course, closed loop, on a concealed robot."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.concealed.colour_sensor import FIELD, TILE
from benchmarks.concealed.history import ROW_TICKS, Array, Controller, History, Pose
from benchmarks.concealed.recording import Conditions, channels, even_ticks, noise, write_recording
from benchmarks.concealed.robot import Concealed
from benchmarks.concealed.worlds import truth

# Opcode rows: operation, a, b, c, target, line.
MOTOR, MOTOR_UNTIL, TEST, JUMP = range(4)
_COMPARE: tuple[Callable[[float, float], bool], ...] = (
    operator.gt,
    operator.lt,
    operator.ge,
    operator.le,
    operator.eq,
    operator.ne,
)
_INTO_GOAL = 0.3  # of a tile
_MOST_JUMPS = 10_000  # within one moment: such a program waits for nothing

START: Pose = (0.175, 0.75, math.pi / 2)  # START tile, one line's width right of the line, heading up
TIME_LIMIT_S = 60.0
# Tiles (column, row from the bottom) from START clockwise round the rim to GOAL, the tile below START.
ROUND = (
    [(0, 2), (0, 3)]
    + [(column, 3) for column in range(1, 8)]
    + [(7, row) for row in (2, 1, 0)]
    + [(column, 0) for column in range(6, -1, -1)]
    + [(0, 1)]
)

# Lag, drag and a late sensor: white (50, 70), black (60, -50) takes 26.6 s round the course instead of 22.8 s, 17 %
# longer; the paper's robot took 15 % longer than its simulation (19.32 s for 16.74 s).
PAPER_LIKE = Concealed(inertia_scale=1.15, caster_friction=0.45, viscous_friction=0.0015, sensor_delay=0.015)


@dataclass(frozen=True)
class Round:
    """How a program fared.

    ``outcome``: ``goal``, ``missed_checkpoint``, ``off_course``, ``out_of_time`` or ``stuck``; ``time_s`` when it
    ended; ``arrivals_s`` when each tile of ``ROUND`` was entered in turn (20,), nan where it was not; ``history``
    up to the end, and a little way into GOAL.
    """

    outcome: str
    time_s: float
    arrivals_s: Array
    history: History


def interpret(rows: Sequence[Sequence[int]]) -> Controller:
    """Make a controller of a program; after its last row it starts again.

    Parameters
    ----------
    rows
        Opcode rows (n, 6): ``MOTOR`` left [%], right [%], time [ms]; ``MOTOR_UNTIL`` the same, ended early by the
        ``TEST`` in the next row; ``TEST`` sensor (0), comparison (0 to 5: > < >= <= == !=), threshold [%/1000], row
        to go to when false; ``JUMP`` to the target.

    Returns
    -------
    Controller
        To be asked every millisecond. A pass that takes no time goes on when it is asked next, as on the brick;
        ``None`` where no test could ever change that.

    Raises
    ------
    ValueError
        If a row tests a sensor other than the one this robot has.
    """
    table = [tuple(int(number) for number in row) for row in rows]
    if any(row[0] == TEST and row[1] != 0 for row in table):
        message = "this robot has one colour sensor (sensor 0)"
        raise ValueError(message)
    tests = any(row[0] in (TEST, MOTOR_UNTIL) for row in table)
    at, until, duties = 0, 0.0, (0, 0)

    def turn(time_s: float, reading: int) -> tuple[int, int] | None:
        nonlocal at, until, duties
        begun = False
        for _ in range(_MOST_JUMPS):
            if until > time_s + 1e-9:
                test = table[at - 1] if _waits_for(table, at) else None
                if test is None or not _holds(test, reading):
                    return duties
                until = time_s
            if not table or (begun and at % len(table) == 0):
                break
            begun = begun or at % len(table) == 0
            at, row = _advance(table, at)
            if row[0] in (MOTOR, MOTOR_UNTIL):
                duties, until = (row[1], row[2]), time_s + row[3] / 1000.0
            elif row[0] == JUMP or not _holds(row, reading):
                at = row[4]
        return duties if tests else None

    return turn


def _advance(table: list[tuple[int, ...]], at: int) -> tuple[int, tuple[int, ...]]:
    """Fetch a row, and step past it, and past the test that belongs to a ``MOTOR_UNTIL``."""
    at = at % len(table)
    row = table[at]
    return at + (2 if row[0] == MOTOR_UNTIL else 1), row


def _waits_for(table: list[tuple[int, ...]], at: int) -> bool:
    return at >= 2 and table[at - 2][0] == MOTOR_UNTIL


def _holds(test: tuple[int, ...], reading: int) -> bool:
    return _COMPARE[test[2]](reading, test[3] / 1000.0)


def drive(
    rows: Sequence[Sequence[int]],
    concealed: Concealed,
    start: Pose = START,
    seed: int = 0,
    path: Path | None = None,
    conditions: Conditions | None = None,
    world: str = "mujoco",
) -> Round:
    """Let a program drive a concealed robot round the paper's course.

    Parameters
    ----------
    rows
        Opcode rows, as :func:`interpret` takes them.
    concealed
        The robot.
    start
        Pose of the axle's centre [m, m, rad].
    seed
        Of the sensors' noise.
    path
        Where to write the recording (CSV, with a TOML file beside it), if anywhere. Rows every 10 ms, and one at
        every change of the command.
    conditions
        Noise and columns of the recording.
    world
        One of ``WORLDS``.

    Returns
    -------
    Round
    """
    conditions, rng = conditions or Conditions(), np.random.default_rng(seed)
    count = round(TIME_LIMIT_S * 1000) + 1
    reading_noise = np.repeat(noise("reflection_pct", count // ROW_TICKS + 1, conditions, rng), ROW_TICKS)[
        :count
    ]
    history = truth(world, concealed).run(start, interpret(rows), TIME_LIMIT_S, reading_noise, 1, _ended)
    result = referee(history)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        changed = 1 + np.flatnonzero(np.any(np.diff(result.history.commands, axis=0) != 0.0, axis=1))
        ticks = np.union1d(even_ticks(result.history), changed)
        clean = channels(result.history, concealed, conditions.camera_offset_s(0), ticks)
        write_recording(path, result.history, clean, conditions, rng, ticks)
    return result


def _ended(x: float, y: float) -> bool:
    """End off the course, or far enough inside GOAL for a camera to have seen it."""
    tile = (math.floor(x / TILE), math.floor(y / TILE))
    return tile not in ROUND or (tile == ROUND[-1] and y > (tile[1] + _INTO_GOAL) * TILE)


def referee(history: History) -> Round:
    """Judge a drive by the course's rules.

    Parameters
    ----------
    history
        The whole drive; whatever came after its end is cut off.

    Returns
    -------
    Round
    """
    tiles = np.floor(history.pose[:, :2] / TILE).astype(int)
    inside = np.all((history.pose[:, :2] >= 0.0) & (history.pose[:, :2] < FIELD), axis=1)
    arrivals, reached = np.full(len(ROUND), math.nan), 0
    arrivals[0] = 0.0
    changes = np.flatnonzero(np.any(np.diff(tiles, axis=0) != 0, axis=1)) + 1
    for tick in changes.tolist():
        tile, now = (int(tiles[tick, 0]), int(tiles[tick, 1])), float(history.time_s[tick])
        if not inside[tick] or tile not in ROUND:
            return Round("off_course", now, arrivals, history.until(tick + 1))
        if reached + 1 < len(ROUND) and tile == ROUND[reached + 1]:
            reached += 1
            arrivals[reached] = now
        if tile == ROUND[-1]:
            if reached == len(ROUND) - 1:
                return Round("goal", now, arrivals, history)
            return Round("missed_checkpoint", now, arrivals, history.until(tick + 1))
    end = float(history.time_s[-1])
    return Round("out_of_time" if end >= TIME_LIMIT_S else "stuck", end, arrivals, history)
