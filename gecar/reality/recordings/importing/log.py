"""A foreign table understood: columns named, units the recording's, damage mended, each with a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.columns import COLUMNS, Series
from gecar.reality.recordings.encoder_zero import encoder_zero
from gecar.reality.recordings.importing.meaning import SPEED_OF, Meaning, Said, guess_meanings
from gecar.reality.recordings.importing.repair import increasing_rows, lost_poses, mend_encoder
from gecar.reality.recordings.importing.table import ForeignTable
from gecar.reality.recordings.importing.units import (
    NO_DRIVE,
    QUANTITY,
    Machine,
    duty_unit,
    encoder_unit,
    heading_unit,
    length_unit,
    rate_unit,
    share_unit,
    time_unit,
    voltage_unit,
)

Commands = Mapping[str, Callable[[Series], Series]]
"""What was not logged: by column, its values [the recording's unit] at times [s], shape (rows,)."""

DUTIES = ("left_duty_pct", "right_duty_pct")
POSE = ("x_m", "y_m", "heading_deg")
_EPOCH_S = 1e6  # a clock that shows more than eleven days counts from 1970 or from the machine's start


@dataclass(frozen=True)
class Log:
    """One file, understood.

    Attributes
    ----------
    name, stem
        The file's name, and that of the recording it makes.
    columns
        Series by the recording's column, in its units, shape (rows,); NaN where there is no sample.
    guesses, repairs, remarks
        What was guessed, what was mended, and the file's own remarks, a line each.
    length_unit
        Unit that x and y were taken to be in.
    heading_said
        Whether the user said the unit of headings.
    in_frame
        Whether positions and headings go by the recording's own names, and so claim to be in its frame.
    starts_s
        What its clock showed at its zero: clocks that count from 1970 are counted from the first row [s].
    """

    name: str
    columns: dict[str, Series]
    guesses: tuple[str, ...]
    repairs: tuple[str, ...]
    remarks: tuple[str, ...]
    length_unit: str
    heading_said: bool
    in_frame: bool
    starts_s: float = 0.0
    stem: str = ""

    @property
    def has_commands(self) -> bool:
        """Whether it holds commands to a motor."""
        return any(side in self.columns for side in DUTIES)

    @property
    def has_angles(self) -> bool:
        """Whether it holds wheels' angles."""
        return any(f"{side}_angle_deg" in self.columns for side in ("left", "right"))

    @property
    def has_pose(self) -> bool:
        """Whether it holds positions."""
        return "x_m" in self.columns and "y_m" in self.columns


class _Reading:
    """The work of understanding one table; `Log` is what remains."""

    def __init__(self, table: ForeignTable, said: Mapping[str, Said], machine: Machine) -> None:
        self.name = table.name
        self.machine = machine
        self.meanings: dict[str, Meaning] = {}
        self.units: dict[str, str] = {}
        self.guesses: list[str] = []
        self.repairs: list[str] = list(table.repairs)
        self.columns: dict[str, Series] = {}
        self.starts_s = 0.0
        most = np.nanmax(np.abs(table.values), axis=0, initial=0.0)
        found = guess_meanings(table.names, most.tolist(), said)
        filled = [not np.isnan(table.values[:, k]).all() for k in range(len(found))]
        found = tuple(m if some else Meaning(m.name, None) for m, some in zip(found, filled, strict=True))
        for k, meaning in enumerate(found):
            if meaning.column:
                self.meanings[meaning.column] = meaning
                self.columns[meaning.column] = table.values[:, k].copy()
        self.passed_over = [meaning.name for meaning in found if not meaning.column]
        if "t_s" not in self.columns:
            raise expected(
                table.source, f"the columns {', '.join(table.names)}", "a time: --column NAME=t_s says which"
            )

    def convert(self, column: str, unit: str, reason: str) -> None:
        """Bring a column into the recording's unit, and say as what it was read."""
        meaning = self.meanings[column]
        because = (
            "as said"
            if meaning.said and meaning.unit == unit
            else "named so"
            if meaning.unit == unit
            else reason
        )
        self.units[column] = unit
        factor = self.machine.factor(f"{self.name}, {meaning.name!r}", QUANTITY[column], unit)
        self.columns[column] = self.columns[column] * factor
        if meaning.unit and meaning.unit != unit:
            self.repairs.append(
                f"{self.name}: {meaning.name!r} is named {meaning.unit} but {reason}: read as {unit}"
            )
        self.guesses.append(f"{self.name}: {meaning.name!r} is {column}, in {unit} ({because})")

    def named_or(self, column: str, guess: tuple[str, str]) -> tuple[str, str]:
        """Return the unit said or named, or else the one guessed; whole numbers beyond a turn are no radians."""
        meaning, values = self.meanings[column], np.nan_to_num(self.columns[column])
        if meaning.unit == "rad" and not meaning.said and np.abs(values).max() > 7.0:
            whole = bool((values == np.round(values)).all())
            return (guess[0], f"whole numbers, {guess[1]}") if whole else ("rad", guess[1])
        return meaning.unit or guess[0], guess[1]


def understand(table: ForeignTable, said: Mapping[str, Said], machine: Machine, commands: Commands) -> Log:
    """Name a table's columns, bring them into the recording's units and mend what is damaged.

    Parameters
    ----------
    table
        The file's table.
    said
        What the user said of its columns, by name.
    machine
        What of the robot tells the units.
    commands
        Commands that were not logged, to tell the encoders' unit by.

    Raises
    ------
    InputError
        If it has no time, or is damaged beyond safe repair.
    """
    reading = _Reading(table, said, machine)
    _read_time(reading)
    _read_plain(reading)
    _read_encoders(reading, commands)
    _read_speeds(reading)
    _read_yaw_rate(reading)
    _read_pose(reading)
    if reading.passed_over:
        reading.guesses.append(
            f"{reading.name}: passed over {', '.join(repr(name) for name in reading.passed_over)}"
        )
    heading = reading.meanings.get("heading_deg")
    return Log(
        name=reading.name,
        stem=table.stem,
        columns={column: reading.columns[column] for column in COLUMNS if column in reading.columns},
        guesses=(f"{reading.name}: {table.kind}, {len(reading.columns['t_s'])} rows", *reading.guesses),
        repairs=tuple(reading.repairs),
        remarks=table.remarks,
        length_unit=reading.units.get("x_m", "m"),
        heading_said=bool(heading and heading.said and heading.unit),
        in_frame=all(
            meaning.name == column for column, meaning in reading.meanings.items() if column in POSE
        ),
        starts_s=reading.starts_s,
    )


def merged(logs: Sequence[Log]) -> Log:
    """Put the logs of one run into one, by times of the clock they share; of two columns alike the first stays.

    Raises
    ------
    InputError
        If they do not overlap in time.
    """
    times = [log.columns["t_s"] + (log.starts_s - logs[0].starts_s) for log in logs]
    if max(t[0] for t in times) >= min(t[-1] for t in times):
        raise InputError(
            f"{' and '.join(log.name for log in logs)}: no time is in all: no one clock timed them"
        )
    shared = np.unique(np.round(np.concatenate(times), 9))
    columns: dict[str, Series] = {"t_s": shared - min(0.0, shared[0])}
    for log, t in zip(logs, times, strict=True):
        rows = np.searchsorted(shared, np.round(t, 9))
        for column, values in log.columns.items():
            if column not in columns:
                columns[column] = np.full(len(shared), np.nan)
                columns[column][rows] = values
    posed = next((log for log in logs if log.has_pose), logs[0])
    return replace(
        posed,
        name=" and ".join(log.name for log in logs),
        stem=logs[0].stem,
        columns=columns,
        guesses=tuple(line for log in logs for line in log.guesses),
        repairs=tuple(line for log in logs for line in log.repairs),
        remarks=tuple(line for log in logs for line in log.remarks),
    )


def _read_time(reading: _Reading) -> None:
    rows, repairs = increasing_rows(reading.name, reading.columns["t_s"])
    reading.repairs += repairs
    reading.columns = {column: values[rows] for column, values in reading.columns.items()}
    if rows.sum() < 2:
        raise InputError(
            f"{reading.name}: {int(rows.sum())} rows with increasing times, expected at least two"
        )
    meaning = reading.meanings["t_s"]
    if meaning.said and meaning.unit:
        unit, reason = meaning.unit, "as said"
    else:
        unit, reason = time_unit(reading.columns["t_s"], meaning.unit)
    reading.convert("t_s", unit, reason)
    time = reading.columns["t_s"]
    if abs(time[0]) > _EPOCH_S:
        reading.guesses.append(f"{reading.name}: its clock starts at {time[0]:.3f} s: counted from there")
        reading.columns["t_s"], reading.starts_s = time - time[0], float(time[0])
    gaps = np.diff(time)
    if gaps.max() > max(1.0, 20.0 * np.median(gaps)):
        k = int(gaps.argmax())
        reading.repairs.append(
            f"{reading.name}: nothing between {time[k]:g} and {time[k + 1]:g} s: left as it is"
        )


def _read_plain(reading: _Reading) -> None:
    """Convert duties, reflected light and voltage."""
    columns = reading.columns
    sides = [side for side in DUTIES if side in columns]
    if sides:
        known = [reading.meanings[side] for side in sides]
        unit = next((meaning.unit for meaning in known if meaning.unit), None)
        duties, names = np.array([columns[side] for side in sides]), [meaning.name for meaning in known]
        pwm, sure = any(meaning.pwm for meaning in known), all(meaning.surely_duty for meaning in known)
        guess = (unit, "") if unit else duty_unit(duties, names, pwm, sure)
        for side in sides:
            reading.convert(side, *guess)
    if "reflection_pct" in columns:
        reading.convert(
            "reflection_pct", *reading.named_or("reflection_pct", share_unit(columns["reflection_pct"]))
        )
    if "battery_v" in columns:
        reading.convert("battery_v", *reading.named_or("battery_v", voltage_unit(columns["battery_v"])))


def _read_encoders(reading: _Reading, commands: Commands) -> None:
    time = reading.columns["t_s"]
    for side in ("left", "right"):
        column, duty_column = f"{side}_angle_deg", f"{side}_duty_pct"
        if column not in reading.columns:
            continue
        meaning, duty = reading.meanings[column], reading.columns.get(duty_column)
        if duty is None:
            duty = commands[duty_column](time) if duty_column in commands else np.zeros_like(time)
        reading.convert(column, *_encoder_unit(reading, meaning, reading.columns[column], duty))
        where = f"{reading.name}, {meaning.name!r}"
        angle, repairs = mend_encoder(where, time, reading.columns[column])
        zero = encoder_zero(time, angle)
        reading.columns[column] = angle - zero
        reading.repairs += repairs
        if zero:
            reading.repairs.append(f"{where}: begins at {zero:g} deg: counted from there")


def _encoder_unit(reading: _Reading, meaning: Meaning, angle: Series, duty_pct: Series) -> tuple[str, str]:
    """Return an encoder's unit, as said, named, or by the speed at the duties given, and why.

    Raises
    ------
    InputError
        If it counts, and nothing says how many counts make a turn.
    """
    machine, named = reading.machine, meaning.unit
    if meaning.said and named:
        return named, "as said"
    if machine.counts is not None and named in (None, "count"):
        return "count", f"{machine.counts:g} a turn"
    if named in ("m", "cm", "mm"):
        return named, "named so"
    unit, reason = encoder_unit(reading.columns["t_s"], angle, duty_pct, machine)
    if unit is None and reason != NO_DRIVE and meaning.counts and named in (None, "count"):
        raise InputError(
            f"{reading.name}, {meaning.name!r}: turns {reason}, which is no angle of robot {machine.name}: --counts N "
            f"says how many counts make a turn, --column '{meaning.name}={meaning.column}:deg' that it is degrees"
        )
    return unit or ("deg" if named in (None, "count") else named), reason


def _read_speeds(reading: _Reading) -> None:
    """Add wheels' speeds up to angles, where these were not logged."""
    time = reading.columns["t_s"]
    for column, angle in SPEED_OF.items():
        if column not in reading.columns:
            continue
        meaning = reading.meanings[column]
        count = "count_s" if reading.machine.counts is not None and meaning.counts else None
        reading.convert(column, meaning.unit or count or "dps", "unless said otherwise")
        speed = reading.columns.pop(column)
        seen = ~np.isnan(speed)
        if angle in reading.columns or seen.sum() < 2:
            continue
        turned = np.full(len(time), np.nan)
        steps = 0.5 * (speed[seen][1:] + speed[seen][:-1]) * np.diff(time[seen])
        turned[seen] = np.r_[0.0, np.cumsum(steps)]
        reading.columns[angle] = turned
        reading.repairs.append(f"{reading.name}, {meaning.name!r}: speeds added up to {angle}")


def _read_yaw_rate(reading: _Reading) -> None:
    columns = reading.columns
    if "yaw_rate_dps" not in columns:
        return
    turning = None
    if {"left_angle_deg", "right_angle_deg"} <= columns.keys() and len(columns["t_s"]) > 2:
        share = reading.machine.wheel_radius_m / reading.machine.track_width_m
        turning = share * np.gradient(columns["right_angle_deg"] - columns["left_angle_deg"], columns["t_s"])
    reading.convert(
        "yaw_rate_dps", *reading.named_or("yaw_rate_dps", rate_unit(columns["yaw_rate_dps"], turning))
    )


def _read_pose(reading: _Reading) -> None:
    columns = reading.columns
    if "x_m" in columns and "y_m" in columns:
        lost, repairs = lost_poses(reading.name, columns["t_s"], columns["x_m"], columns["y_m"])
        reading.repairs += repairs
        for column in POSE:
            if column in columns:
                columns[column][lost] = np.nan
        unit = reading.named_or("x_m", length_unit(columns["x_m"], columns["y_m"]))
        reading.convert("x_m", *unit)
        reading.convert("y_m", *reading.named_or("y_m", unit))
    if "heading_deg" in columns:
        reading.convert("heading_deg", *reading.named_or("heading_deg", heading_unit(columns["heading_deg"])))
        columns["heading_deg"] = _unwrapped(columns["heading_deg"])


def _unwrapped(heading_deg: Series) -> Series:
    """Make headings continuous across full turns, leaving blanks."""
    unwrapped = heading_deg.copy()
    seen = ~np.isnan(heading_deg)
    unwrapped[seen] = np.unwrap(heading_deg[seen], period=360.0)
    return unwrapped
