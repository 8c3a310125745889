"""The import as a whole: files in, a recording and an account of what was guessed and mended out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.columns import COLUMNS, Series
from gecar.reality.recordings.importing.clock import ClockOffset
from gecar.reality.recordings.importing.foreign import read_foreign
from gecar.reality.recordings.importing.frame import Frame
from gecar.reality.recordings.importing.join import join
from gecar.reality.recordings.importing.log import DUTIES, Log, understand
from gecar.reality.recordings.importing.meaning import Said
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.robot import Robot


@dataclass(frozen=True)
class ImportOptions:
    """What the user says about the files; everything has a default, and is then guessed.

    Attributes
    ----------
    said
        Column of a file to (recording column or ``None``, unit or ``None``).
    names
        Column names, for a file that has none.
    run
        Which run of a file that holds several, from 1.
    constant
        Recording columns that are constant and not in the file, in the recording's units.
    frame
        The camera's frame.
    offset_s
        What to add to the camera's times [s].
    """

    said: Mapping[str, Said] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    run: int | None = None
    constant: Mapping[str, float] = field(default_factory=dict)
    frame: Frame = field(default_factory=Frame)
    offset_s: float | None = None


@dataclass(frozen=True)
class Imported:
    """A recording out of foreign files.

    Attributes
    ----------
    recording
        The recording.
    guesses
        What each file and column was taken for, a line each.
    repairs
        What was mended or left out, a line each.
    offset
        How the clocks were aligned, if there were two and it was not said.
    """

    recording: Recording
    guesses: tuple[str, ...]
    repairs: tuple[str, ...]
    offset: ClockOffset | None


def import_logs(paths: Sequence[Path], robot: Robot, setup: Setup, options: ImportOptions) -> Imported:
    """Make a recording of one run from the files people have of it.

    Parameters
    ----------
    paths
        One file, or the brick's log and the camera's in any order.
    robot
        The robot, for its wheels and track.
    setup
        What goes into the recording's TOML.
    options
        What the user says about the files.

    Raises
    ------
    InputError
        If a file is no log, or damaged beyond safe repair, or the clocks can not be aligned.
    """
    tables = [read_foreign(path, options.names, options.run) for path in paths]
    logs = [understand(table, options.said, _expected_dps(robot)) for table in tables]
    brick, camera = _roles(logs, options.constant)
    joining = join(brick, camera, robot, options.frame, options.offset_s)
    repairs = [line for log in logs for line in log.repairs] + joining.lines
    columns = _with_commands(joining.columns, options.constant, repairs)
    if len(columns["t_s"]) < 2:
        raise expected(paths[0], f"{len(columns['t_s'])} rows from the first command on", "at least two")
    recording = make_recording(str(paths[0]), columns, _with_notes(setup, logs))
    return Imported(
        recording, tuple(line for log in logs for line in log.guesses), tuple(repairs), joining.offset
    )


def _expected_dps(robot: Robot) -> float:
    """Return how fast a robot's motors turn per percent of duty [deg/s]: a little below the no-load speed."""
    free = (
        robot.battery.voltage / 100.0 / robot.motor.back_emf_constant
        if robot.motor.back_emf_constant
        else np.inf
    )
    return 0.85 * float(np.rad2deg(free))


def _roles(logs: Sequence[Log], constant: Mapping[str, float]) -> tuple[Log, Log | None]:
    """Tell the brick's log from the camera's."""
    bricks = [log for log in logs if log.has_commands or any(side in constant for side in DUTIES)]
    names = " and ".join(log.name for log in logs)
    if len(logs) > 2:
        raise expected("import", f"{len(logs)} files", "one, or the brick's log and the camera's, of one run")
    if not any(log.has_commands for log in logs) and not bricks:
        raise InputError(
            f"{names}: no column looks like a command to a motor: --column NAME=left_duty_pct says which it "
            "is, --constant left_duty_pct=60 says one that is not logged"
        )
    if len(logs) == 1:
        return logs[0], None
    ordered = sorted(logs, key=lambda log: (log.has_commands, not log.has_pose), reverse=True)
    if not ordered[1].has_pose or ordered[1].has_commands:
        raise InputError(f"{names}: two files are joined only if one has the commands and the other x and y")
    return ordered[0], ordered[1]


def _with_commands(
    columns: dict[str, Series], constant: Mapping[str, float], repairs: list[str]
) -> dict[str, Series]:
    """Hold each command until the next, and leave out what comes before the first."""
    rows = len(columns["t_s"])
    columns = columns | {name: np.full(rows, value) for name, value in constant.items()}
    first = 0
    for side in DUTIES:
        if side in columns and not np.isnan(columns[side]).all():
            given = ~np.isnan(columns[side])
            first = max(first, int(given.argmax()))
            columns[side] = columns[side][np.maximum.accumulate(np.where(given, np.arange(rows), 0))]
    if first:
        repairs.append(f"left out {first} rows before the first command")
    return {name: columns[name][first:] for name in COLUMNS if name in columns}


def _with_notes(setup: Setup, logs: Sequence[Log]) -> Setup:
    """Add where the recording comes from, and the files' own remarks, to its notes."""
    notes = [setup.notes, "imported from " + " and ".join(log.name for log in logs)]
    notes += [remark for log in logs for remark in log.remarks if remark]
    return Setup(**{**setup.__dict__, "notes": "; ".join(note for note in notes if note)})
