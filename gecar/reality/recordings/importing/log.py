"""A foreign table understood: columns named, units the recording's, damage mended, each with a line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.columns import COLUMNS, Series
from gecar.reality.recordings.importing.foreign import ForeignTable
from gecar.reality.recordings.importing.meaning import Meaning, Said, guess_meanings
from gecar.reality.recordings.importing.repair import increasing_rows, lost_poses, mend_encoder
from gecar.reality.recordings.importing.units import (
    QUANTITY,
    UNITS,
    duty_unit,
    encoder_unit,
    heading_unit,
    length_unit,
    share_unit,
    time_unit,
    voltage_unit,
)

DUTIES = ("left_duty_pct", "right_duty_pct")
POSE = ("x_m", "y_m", "heading_deg")
_EPOCH_S = 1e6  # a clock that shows more than eleven days counts from 1970 or from the machine's start


@dataclass(frozen=True)
class Log:
    """One file, understood.

    Attributes
    ----------
    name
        The file's name.
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
    """

    name: str
    columns: dict[str, Series]
    guesses: tuple[str, ...]
    repairs: tuple[str, ...]
    remarks: tuple[str, ...]
    length_unit: str
    heading_said: bool
    in_frame: bool

    @property
    def has_commands(self) -> bool:
        """Whether it holds commands to a motor."""
        return any(side in self.columns for side in DUTIES)

    @property
    def has_pose(self) -> bool:
        """Whether it holds positions."""
        return "x_m" in self.columns and "y_m" in self.columns


class _Reading:
    """The work of understanding one table; `Log` is what remains."""

    def __init__(self, table: ForeignTable, said: Mapping[str, Said]) -> None:
        self.name = table.source.name
        self.meanings: dict[str, Meaning] = {}
        self.units: dict[str, str] = {}
        self.guesses: list[str] = []
        self.repairs: list[str] = list(table.repairs)
        self.columns: dict[str, Series] = {}
        most = np.nanmax(np.abs(table.values), axis=0, initial=0.0)
        found = guess_meanings(table.names, most.tolist(), said)
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
        self.columns[column] = self.columns[column] * UNITS[QUANTITY[column]][unit]
        if meaning.unit and meaning.unit != unit:
            self.repairs.append(
                f"{self.name}: {meaning.name!r} is named {meaning.unit} but {reason}: read as {unit}"
            )
        self.guesses.append(f"{self.name}: {meaning.name!r} is {column}, in {unit} ({because})")

    def named_or(self, column: str, guess: tuple[str, str]) -> tuple[str, str]:
        """Return the unit said or named, or else the one guessed."""
        return self.meanings[column].unit or guess[0], guess[1]


def understand(table: ForeignTable, said: Mapping[str, Said], expected_dps: float) -> Log:
    """Name a table's columns, bring them into the recording's units and mend what is damaged.

    Parameters
    ----------
    table
        The file's table.
    said
        What the user said of its columns, by name.
    expected_dps
        Speed of the robot's motors per percent of duty [deg/s], to tell the encoders' unit by.

    Raises
    ------
    InputError
        If it has no time, or is damaged beyond safe repair.
    """
    reading = _Reading(table, said)
    _read_time(reading)
    _read_plain(reading)
    _read_encoders(reading, expected_dps)
    _read_pose(reading)
    if reading.passed_over:
        reading.guesses.append(
            f"{reading.name}: passed over {', '.join(repr(name) for name in reading.passed_over)}"
        )
    heading = reading.meanings.get("heading_deg")
    return Log(
        name=reading.name,
        columns={column: reading.columns[column] for column in COLUMNS if column in reading.columns},
        guesses=(f"{reading.name}: {table.kind}, {len(reading.columns['t_s'])} rows", *reading.guesses),
        repairs=tuple(reading.repairs),
        remarks=table.remarks,
        length_unit=reading.units.get("x_m", "m"),
        heading_said=bool(heading and heading.said and heading.unit),
        in_frame=all(
            meaning.name == column for column, meaning in reading.meanings.items() if column in POSE
        ),
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
        reading.columns["t_s"] = time - time[0]
    gaps = np.diff(time)
    if gaps.max() > max(1.0, 20.0 * np.median(gaps)):
        k = int(gaps.argmax())
        reading.repairs.append(
            f"{reading.name}: nothing between {time[k]:g} and {time[k + 1]:g} s: left as it is"
        )


def _read_plain(reading: _Reading) -> None:
    """Convert duties, reflected light, voltage and yaw rate."""
    columns = reading.columns
    sides = [side for side in DUTIES if side in columns]
    if sides:
        unit = reading.named_or(sides[0], ("", ""))[0]
        guess = (unit, "") if unit else duty_unit(np.array([columns[side] for side in sides]))
        for side in sides:
            reading.convert(side, *guess)
    if "reflection_pct" in columns:
        reading.convert(
            "reflection_pct", *reading.named_or("reflection_pct", share_unit(columns["reflection_pct"]))
        )
    if "battery_v" in columns:
        reading.convert("battery_v", *reading.named_or("battery_v", voltage_unit(columns["battery_v"])))
    if "yaw_rate_dps" in columns:
        reading.convert("yaw_rate_dps", *reading.named_or("yaw_rate_dps", ("dps", "unless said otherwise")))


def _read_encoders(reading: _Reading, expected_dps: float) -> None:
    for side in ("left", "right"):
        column = f"{side}_angle_deg"
        if column not in reading.columns:
            continue
        meaning = reading.meanings[column]
        duty = reading.columns.get(f"{side}_duty_pct", np.zeros_like(reading.columns["t_s"]))
        unit, reason = encoder_unit(reading.columns["t_s"], reading.columns[column], duty, expected_dps)
        if unit is None or (meaning.said and meaning.unit):
            unit = meaning.unit or "deg"
        reading.convert(column, unit, reason)
        where = f"{reading.name}, {meaning.name!r}"
        reading.columns[column], repairs = mend_encoder(
            where, reading.columns["t_s"], reading.columns[column]
        )
        reading.repairs += repairs


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
