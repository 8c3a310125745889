"""The import as a whole: files in, recordings and an account of what was guessed and mended out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.columns import COLUMNS, Series
from gecar.reality.recordings.duty_cap import guess_cap
from gecar.reality.recordings.importing.clock import ClockOffset
from gecar.reality.recordings.importing.frame import Frame
from gecar.reality.recordings.importing.join import join
from gecar.reality.recordings.importing.log import DUTIES, Commands, Log, merged, understand
from gecar.reality.recordings.importing.meaning import Said
from gecar.reality.recordings.importing.runs import read_runs
from gecar.reality.recordings.importing.units import Machine
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
        Which run of a file that holds several, from 1; ``None``: all.
    commands
        Recording columns that are not in the file, in the recording's units, as functions of time [s].
    counts
        Counts of an encoder per turn of its wheel; ``None``: not known.
    one_clock
        Whether all files are of one run, timed by one clock: a ROS bag's topics.
    frame
        The camera's frame.
    offset_s
        What to add to the camera's times [s].
    """

    said: Mapping[str, Said] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    run: int | None = None
    commands: Commands = field(default_factory=dict)
    counts: float | None = None
    one_clock: bool = False
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


def import_logs(
    paths: Sequence[Path], robot: Robot, setup: Setup, options: ImportOptions
) -> tuple[Imported, ...]:
    """Make recordings from the files people have of one robot's runs.

    Every log with commands is a run, and so is every run that one file holds. Cameras' logs, which have places and no
    commands, are joined to them in the order given. With ``one_clock`` all files are of one run.

    Parameters
    ----------
    paths
        Files, in any order; those of several cameras in the order of their runs.
    robot
        The robot, for its motors, wheels and track.
    setup
        What goes into the recordings' TOML; without a cap on duty, one is guessed.
    options
        What the user says about the files.

    Returns
    -------
    tuple
        One or more recordings, in the order of the files and of the runs within.

    Raises
    ------
    InputError
        If a file is no log, or damaged beyond safe repair, or the clocks can not be aligned.
    """
    machine = Machine.of(robot, options.counts)
    tables = [read_runs(path, options.names, options.said) for path in paths]
    if options.run is not None:
        most = max(len(runs) for runs in tables)
        if not 1 <= options.run <= most:
            raise expected("--run", options.run, f"1 to {most}" if most > 1 else "none, for there is one run")
        tables = [runs if len(runs) == 1 else runs[options.run - 1 : options.run] for runs in tables]
    files = [
        [understand(table, options.said, machine, options.commands) for table in runs] for runs in tables
    ]
    pairs = _one_run(files, options) if options.one_clock else _pairs(files, options)
    imported = [_joined(brick, camera, robot, setup, options) for brick, camera in pairs]
    if setup.duty_cap is None:
        imported = _capped(imported, robot)
    return tuple(imported)


def _joined(brick: Log, camera: Log | None, robot: Robot, setup: Setup, options: ImportOptions) -> Imported:
    """Make one recording of a run's log, and of its camera's."""
    logs = [brick, camera] if camera else [brick]
    joining = join(brick, camera, robot, options.frame, options.offset_s)
    repairs = [line for log in logs for line in log.repairs] + joining.lines
    columns = _with_commands(joining.columns, options.commands, repairs)
    if len(columns["t_s"]) < 2:
        raise expected(brick.name, f"{len(columns['t_s'])} rows from the first command on", "at least two")
    recording = make_recording(brick.name, columns, _with_notes(setup, logs))
    guesses = tuple(line for log in logs for line in log.guesses)
    return Imported(replace(recording, name=brick.stem), guesses, tuple(repairs), joining.offset)


def _capped(imported: list[Imported], robot: Robot) -> list[Imported]:
    """Guess from all recordings together whether the robot's cap on duty held, and say so."""
    cap, reason = guess_cap([each.recording for each in imported], robot)
    if not reason:
        return imported
    line = f"{reason} (--duty-cap says otherwise)"
    return [
        replace(
            each,
            recording=replace(each.recording, setup=replace(each.recording.setup, duty_cap=cap)),
            guesses=(*each.guesses, line),
        )
        for each in imported
    ]


def _pairs(files: Sequence[Sequence[Log]], options: ImportOptions) -> list[tuple[Log, Log | None]]:
    """Tell the runs' logs from the cameras', and put each camera's to its run."""
    logs = [log for runs in files for log in runs]
    names = " and ".join(dict.fromkeys(log.name for log in logs))
    unlogged = any(side in options.commands for side in DUTIES)
    bricks = [log for log in logs if log.has_commands]
    if not bricks and unlogged:
        seen_only = [log.has_pose and not log.has_angles for log in logs]
        alone = all(seen_only)
        bricks = [log for log, camera in zip(logs, seen_only, strict=True) if alone or not camera]
    if not bricks:
        raise InputError(
            f"{names}: no column looks like a command to a motor: --column NAME=left_duty_pct says which it is, "
            "--constant left_duty_pct=60 or --command 'left_duty_pct=100*sin(2*pi*t)' one that is not logged"
        )
    others = [log for log in logs if not any(log is brick for brick in bricks)]
    for log in others:
        if not log.has_pose:
            raise InputError(
                f"{log.name}: neither commands nor x and y: another log's columns are joined by --one-clock, if one "
                "clock timed both; a camera's need x and y"
            )
    if not others:
        return [(brick, None) for brick in bricks]
    if len(others) != len(bricks):
        raise InputError(
            f"{names}: {len(bricks)} runs with commands and {len(others)} of cameras: expected a camera's log for each "
            "(--run takes one of a file's runs)"
        )
    return list(zip(bricks, others, strict=True))


def _one_run(files: Sequence[Sequence[Log]], options: ImportOptions) -> list[tuple[Log, Log | None]]:
    """Put logs that one clock timed into one."""
    logs = [log for runs in files for log in runs]
    if len(logs) != len(files):
        raise expected(
            "--one-clock", f"{len(logs)} runs in {len(files)} files", "files of one run (--run takes one)"
        )
    return _pairs([[merged(logs)]], options)


def _with_commands(columns: dict[str, Series], commands: Commands, repairs: list[str]) -> dict[str, Series]:
    """Hold each command until the next, and leave out what comes before the first."""
    rows = len(columns["t_s"])
    columns = columns | {name: at(columns["t_s"]) for name, at in commands.items()}
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
    return replace(setup, notes="; ".join(note for note in notes if note))
