"""What a recording's CSV cannot say: robot, course, rig, cap, program, noise. From the TOML beside it."""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import tomli_w

from gecar.errors import InputError, expected
from gecar.files import is_file, read_text, read_toml

RIGS = ("floor", "bench")


@dataclass(frozen=True)
class Setup:
    """The circumstances of a recording.

    Attributes
    ----------
    robot
        Name of a robot that ships (``"ev3"``), or the path of a robot file.
    course
        Name of a course that ships, the path of a course file, or ``"none"``: a blank floor.
    rig
        ``"floor"``, or ``"bench"``: wheels in the air, or one motor alone.
    duty_cap
        Cap on the duty of this recording [fraction of full duty]; ``None``: the robot's own.
    program
        Text of the control program that produced the commands; ``None`` if there was none.
    noise
        Standard deviation by field of `gecar.reality.recordings.recording.Recording`, in that field's unit.
    notes
        Anything else.
    """

    robot: str = "ev3"
    course: str = "paper"
    rig: str = "floor"
    duty_cap: float | None = None
    program: str | None = None
    noise: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    notes: str = ""

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to another process, as a mapping proxy cannot."""
        return _arrived, ({**vars(self), "noise": dict(self.noise)},)


def _arrived(fields: dict[str, Any]) -> Setup:
    return Setup(**{**fields, "noise": MappingProxyType(fields["noise"])})


def read_setup(path: Path, factors: Mapping[str, tuple[str, float]]) -> Setup:
    """Read the TOML file of a recording.

    Parameters
    ----------
    path
        The TOML file; it need not exist.
    factors
        File column to (field, factor to the field's unit), for ``noise``.

    Raises
    ------
    InputError
        If a key is unknown or a value is not what it must be; the message names both.
    """
    if not path.exists():
        return Setup()
    found = read_toml(path, "the TOML file of a recording")
    _refuse_unknown(path, found)
    return Setup(
        robot=_name_or_path(path, "robot", _text(path, found, "robot", "ev3")),
        course=_name_or_path(path, "course", _text(path, found, "course", "paper")),
        rig=_rig(path, _text(path, found, "rig", "floor")),
        duty_cap=_duty_cap(path, found.get("duty_cap")),
        program=_program(path, found),
        noise=_noise(path, found.get("noise", {}), factors),
        notes=_text(path, found, "notes", ""),
    )


def setup_toml(setup: Setup, folder: Path, factors: Mapping[str, tuple[str, float]]) -> str:
    """Return the TOML text of a setup, for a file in a folder: paths become relative to it."""
    table = {
        "robot": _relative(setup.robot, folder),
        "course": _relative(setup.course, folder),
        "rig": setup.rig,
        "duty_cap": setup.duty_cap,
        "program": setup.program,
        "notes": setup.notes,
        "noise": {c: setup.noise[f] / by for c, (f, by) in factors.items() if f in setup.noise},
    }
    return tomli_w.dumps({key: value for key, value in table.items() if value not in (None, "", {})})


def _relative(name: str, folder: Path) -> str:
    if not Path(name).is_absolute():
        return name
    try:
        return Path(os.path.relpath(name, folder)).as_posix()
    except ValueError:  # another drive
        return name


def _refuse_unknown(path: Path, found: Mapping[str, Any]) -> None:
    known = tuple(Setup.__dataclass_fields__)
    for key in found:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            raise expected(path, f"the key {key!r}", f"{near[0]!r}" if near else f"one of {', '.join(known)}")


def _text(path: Path, found: Mapping[str, Any], key: str, default: str) -> str:
    value = found.get(key, default)
    if not isinstance(value, str):
        raise expected(f"{path}, {key}", repr(value), "text in quotes")
    return value


def _name_or_path(path: Path, key: str, value: str) -> str:
    """Return a name as it stands, and a path absolute: relative ones are meant from the TOML's folder."""
    target = path.parent / value
    if is_file(target):
        return str(target.resolve())
    if value.endswith(".toml") or "/" in value or "\\" in value:
        raise expected(
            f"{path}, {key}", f"{value!r}, no such file", f"a {key} file, relative to this TOML, or a name"
        )
    return value


def _rig(path: Path, value: str) -> str:
    if value not in RIGS:
        raise expected(f"{path}, rig", repr(value), '"floor" or "bench"')
    return value


def _number(where: str, value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise expected(where, repr(value), f"a number from {low:g} to {high:g}")
    return float(value)


def _duty_cap(path: Path, value: object) -> float | None:
    return None if value is None else _number(f"{path}, duty_cap", value, 0.01, 1.0)


def _program(path: Path, found: Mapping[str, Any]) -> str | None:
    """Return the program's text: the key holds either the text itself, or a file's path."""
    value = _text(path, found, "program", "")
    if not value:
        return None
    if "(" in value or "\n" in value:
        return value
    try:
        return read_text(path.parent / value, "a control program")
    except InputError as error:
        raise InputError(f"{path}, program: {error}") from None


def _noise(path: Path, found: object, factors: Mapping[str, tuple[str, float]]) -> Mapping[str, float]:
    if not isinstance(found, dict):
        raise expected(f"{path}, noise", repr(found), "a table: column = standard deviation")
    noise = {}
    for column, value in found.items():
        if column not in factors:
            raise expected(f"{path}, noise", f"the column {column!r}", f"one of {', '.join(factors)}")
        to, factor = factors[column]
        noise[to] = _number(f"{path}, noise.{column}", value, 0.0, 1e9) * factor
    return MappingProxyType(noise)
