"""Recordings: one run of a real robot (or of a motor on a bench) as arrays, read from CSV and written back.

The file format is in `docs/files.md`; a file's units become SI here and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.displayed import Displayed
from gecar.errors import expected
from gecar.files import write_whole
from gecar.reality.recordings.columns import COLUMNS, Series
from gecar.reality.recordings.csv_reader import read_table
from gecar.reality.recordings.encoder_zero import encoder_zero
from gecar.reality.recordings.repeated_samples import without_repeats
from gecar.reality.recordings.setup import Setup, read_setup, setup_toml

LOGS = (".txt", ".log", ".dat", ".tsv", ".mat", ".xlsx")
ANGLES = ("left_angle_deg", "right_angle_deg")
GAP = 1.6  # times the usual time between rows from which on one is missing
LONGEST_S = 36_000.0  # a replay simulates every millisecond between two rows, however few there are


@dataclass(frozen=True)
class Recording(Displayed):
    """One run. Every series has shape (rows,); NaN where a column has no sample.

    Attributes
    ----------
    name
        The file's stem.
    t_s
        Time on the brick's clock, strictly increasing, not evenly spaced [s].
    left_duty, right_duty
        Commands issued at ``t_s`` and held until the next row, before any cap [fraction, -1..1]; all NaN for
        a motor that is not there.
    left_angle_rad, right_angle_rad
        Wheel encoders, forward positive [rad].
    reflection_pct
        Colour sensor, reflected light [%].
    x_m, y_m, heading_rad
        Pose of the axle centre in the course's frame; heading counter-clockwise from +x, unwrapped
        [m, m, rad].
    battery_v
        Terminal voltage [V].
    yaw_rate_rad_s
        Gyro [rad/s].
    setup
        What the TOML beside the file says.
    warnings
        Things passed over in reading, a line each.
    lost_t_s, lost_commands
        Commands at rows that the log misses, where something tells them: times [s], shape (k,), and left and right,
        shape (k, 2).
    """

    name: str
    t_s: Series
    left_duty: Series
    right_duty: Series
    left_angle_rad: Series
    right_angle_rad: Series
    reflection_pct: Series
    x_m: Series
    y_m: Series
    heading_rad: Series
    battery_v: Series
    yaw_rate_rad_s: Series
    setup: Setup = field(default_factory=Setup)
    warnings: tuple[str, ...] = ()
    lost_t_s: Series = field(default_factory=lambda: np.zeros(0))
    lost_commands: Series = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def duration_s(self) -> float:
        """Time from the first row to the last [s]."""
        return float(self.t_s[-1] - self.t_s[0])

    @property
    def gaps(self) -> npt.NDArray[np.intp]:
        """The rows after which the log misses at least one, shape (k,)."""
        apart = np.diff(self.t_s)
        return np.flatnonzero(apart > GAP * np.median(apart)) if len(apart) else np.zeros(0, np.intp)

    @property
    def measured(self) -> tuple[str, ...]:
        """The fields, time and commands apart, that hold at least one sample."""
        fields = [to for to, _ in COLUMNS.values()][3:]
        return tuple(name for name in fields if not np.isnan(getattr(self, name)).all())

    @property
    def commands(self) -> Series:
        """Commands held from row to row, shape (rows, 2): left and right; 0 for a motor not there."""
        return np.nan_to_num(np.column_stack([self.left_duty, self.right_duty]))

    @property
    def poses(self) -> Series:
        """Where the camera saw the robot [m, m, rad], shape (rows, 3); NaN where it did not."""
        return np.column_stack([self.x_m, self.y_m, self.heading_rad])


@dataclass(frozen=True)
class Case:
    """A folder of recordings of one robot."""

    name: str
    recordings: tuple[Recording, ...]


def make_recording(
    name: str, columns: dict[str, Series], setup: Setup | None = None, warnings: Sequence[str] = ()
) -> Recording:
    """Make a recording from columns in the file's own names and units; those missing become NaN.

    Wheels' angles are counted from where they stood when the recording began (`encoder_zero`).

    Raises
    ------
    InputError
        If what a recording must have is missing, or time does not increase.
    """
    setup = setup or Setup()
    _check_columns(name, columns, setup.rig)
    rows = len(columns["t_s"])
    series = {}
    for column, (to, factor) in COLUMNS.items():
        values = columns.get(column, np.full(rows, np.nan))
        zero = encoder_zero(columns["t_s"], values) if column in ANGLES else 0.0
        series[to] = (values - zero) * factor
        series[to].flags.writeable = False
    return Recording(name=name, **series, setup=setup, warnings=tuple(warnings))


def read_recording(csv_path: Path | str) -> Recording:
    """Read a recording and the TOML of the same stem beside it.

    Raises
    ------
    InputError
        Naming file, line and column, if anything is not as the format has it. Nothing is repaired here, which is for
        ``gecar import``, but that samples repeated until the next become blanks.
    """
    path = Path(csv_path)
    columns, warnings = read_table(path)
    for side in ("left_duty_pct", "right_duty_pct"):
        if side in columns:
            columns[side] = _held(path, side, columns[side])
    factors = dict(COLUMNS)
    columns, repeated = without_repeats(columns)
    warnings += [f"{path}: {line}" for line in repeated]
    recording = make_recording(str(path), columns, read_setup(path.with_suffix(".toml"), factors), warnings)
    return replace(recording, name=path.stem)


def read_case(place: Path | str) -> Case:
    """Read every CSV file of a folder, by name; or one recording alone.

    Raises
    ------
    InputError
        If there is none, if one cannot be read, or if they are of different robots.
    """
    place = Path(place)
    if place.is_file():
        return Case(place.stem, (read_recording(place),))
    if not place.is_dir():
        raise expected(place, "no such folder", "a folder of recordings")
    files = sorted(place.glob("*.csv"))
    if not files:
        raise expected(place, _found_instead(place), "recordings of one robot")
    recordings = tuple(read_recording(file) for file in files)
    robots = sorted({recording.setup.robot for recording in recordings})
    if len(robots) > 1:
        raise expected(place, f"recordings of the robots {' and '.join(robots)}", "recordings of one robot")
    return Case(place.resolve().name, recordings)


def _found_instead(folder: Path) -> str:
    """Say what a folder without recordings holds, and what to do with logs in it."""
    logs = sorted(file.name for file in folder.iterdir() if file.suffix.lower() in LOGS)
    if not logs:
        within = sorted({f"{file.parent.name}/" for file in folder.glob("*/*.csv")})
        return f"no .csv file, but some in {', '.join(within[:3])}" if within else "no .csv file"
    return (
        f"no .csv file but {', '.join(logs[:3])} (first gecar import {folder / ('*' + Path(logs[0]).suffix)})"
    )


def write_recording(recording: Recording, csv_path: Path | str) -> None:
    """Write a recording's CSV and TOML, each whole or not at all."""
    path = Path(csv_path)
    kept = [c for c, (to, _) in COLUMNS.items() if not np.isnan(getattr(recording, to)).all()]
    table = [_written(getattr(recording, COLUMNS[c][0]) / COLUMNS[c][1]) for c in kept]
    rows = "\n".join(",".join(row) for row in zip(*table, strict=True))
    write_whole(path, ",".join(kept) + "\n" + rows + "\n")
    write_whole(path.with_suffix(".toml"), setup_toml(recording.setup, path.parent.resolve(), dict(COLUMNS)))


def _written(values: Series) -> list[str]:
    # Nine digits: a microsecond in a quarter of an hour, and 5 deg -> rad -> deg is "5" again.
    return ["" if math.isnan(value) else f"{value:.9g}" for value in values.tolist()]


def _held(path: Path, column: str, values: Series) -> Series:
    """Fill the blanks of a command: it holds until the next."""
    blank = np.isnan(values)
    if blank[0] and not blank.all():
        raise expected(f"{path}, line 2, column {column}", "a blank", "the command the recording starts with")
    return values[np.maximum.accumulate(np.where(blank, 0, np.arange(len(values))))]


def _check_columns(name: str, columns: dict[str, Series], rig: str) -> None:
    time = columns.get("t_s")
    if time is None:
        raise expected(name, f"the columns {', '.join(columns) or '(none)'}", "a column 't_s'")
    _check_time(name, time)
    sides = [
        s for s in ("left_duty_pct", "right_duty_pct") if s in columns and not np.isnan(columns[s]).all()
    ]
    if len(sides) < (2 if rig == "floor" else 1):
        wanted = 'both duties (one is enough with rig = "bench")' if rig == "floor" else "at least one duty"
        raise expected(name, f"the commands {', '.join(sides) or '(none)'}", wanted)
    for side in sides:
        beyond = np.flatnonzero(np.abs(columns[side]) > 100.0)
        if len(beyond):
            found = f"{columns[side][beyond[0]]:g}"
            raise expected(f"{name}, line {beyond[0] + 2}, column {side}", found, "a duty from -100 to 100")


def _check_time(name: str, time: Series) -> None:
    blank = np.flatnonzero(np.isnan(time))
    if len(blank):
        raise expected(f"{name}, line {blank[0] + 2}, column t_s", "a blank", "a time")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        k = int(back[0])
        raise expected(
            f"{name}, line {k + 3}, column t_s", f"{time[k + 1]:g} after {time[k]:g}", "an increasing time"
        )
    if len(time) and time[-1] - time[0] > LONGEST_S:
        found = f"{time[-1] - time[0]:g} s from first to last"
        raise expected(f"{name}, column t_s", found, f"at most {LONGEST_S:g} s, times being in seconds")
