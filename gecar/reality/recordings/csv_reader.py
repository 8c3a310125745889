"""The strict reader of a recording's CSV: names and numbers, or an error that names line and column."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.columns import COLUMNS, Series

# A million rows of ten columns: three hours at 100 Hz. Parsed a block of lines at a time, so that a file of
# this size takes under 400 MB.
MOST_BYTES = 64 * 1024 * 1024
_SEPARATORS = {";": "semicolons", "\t": "tabs"}
_BLOCK_LINES = 20_000
_NOT_A_NUMBER = re.compile(r"[^0-9eE+\-., \t\n]")


def read_table(path: Path) -> tuple[dict[str, Series], list[str]]:
    """Read the known columns of a recording's CSV, in the file's units; a blank is NaN.

    Returns
    -------
    columns
        By the file's column name, each of shape (rows,).
    warnings
        A line for each column that was passed over.

    Raises
    ------
    InputError
        Naming file, line and column, if anything is not as the format has it.
    """
    lines = _lines(path)
    names, warnings = _header(path, lines[0])
    table = np.concatenate(list(_blocks(path, lines, names)))
    return {name: table[:, k] for k, name in enumerate(names) if name in COLUMNS}, warnings


def _lines(path: Path) -> list[str]:
    """Return the file's lines, without line ends and without empty ones at its end."""
    if not path.is_file():
        raise expected(path, "no such file" if not path.exists() else "no regular file", "a recording (.csv)")
    if path.stat().st_size > MOST_BYTES:
        raise expected(
            path, f"{path.stat().st_size / 1e6:.0f} MB", f"at most {MOST_BYTES / 1e6:.0f} MB: cut it"
        )
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _no_recording(path, f"{path}: found bytes that are not UTF-8 at {error.start}") from None
    except OSError as error:
        raise expected(path, error.strerror or "an unreadable file", "a recording (.csv)") from None
    lines = text.replace("\r\n", "\n").rstrip("\n").split("\n")
    if not lines[0].strip():
        raise expected(
            path, "an empty file" if len(lines) == 1 else "an empty first line", "a line of column names"
        )
    return lines


def _header(path: Path, line: str) -> tuple[list[str], list[str]]:
    """Return the column names, and a warning for each column that means nothing here."""
    names = [name.strip() for name in line.split(",")]
    if "t_s" not in names and not difflib.get_close_matches("t_s", names, 1, 0.75):
        separator = next((word for sign, word in _SEPARATORS.items() if sign in line), "")
        between = f" with {separator} between columns" if separator else ""
        raise _no_recording(path, f"{path}, line 1: found {_short(line)}{between}")
    warnings = []
    for k, name in enumerate(names):
        where = f"{path}, line 1, column {k + 1}"
        if name in names[:k]:
            raise expected(where, f"{name!r} a second time", "each column once")
        if name not in COLUMNS:
            near = difflib.get_close_matches(name, COLUMNS, 1, 0.75)
            if near:
                raise expected(where, repr(name), repr(near[0]))
            warnings.append(f"{path}: the column {name!r} is not one of {', '.join(COLUMNS)}: passed over")
    return names, warnings


def _no_recording(path: Path, found: str) -> InputError:
    """Return the error for a file that is a log, but no recording: with what makes one of it."""
    return InputError(
        f"{found}, expected a recording's columns (t_s, left_duty_pct, ...): first gecar import {path}"
    )


def _short(line: str) -> str:
    return repr(line if len(line) <= 60 else f"{line[:57]}...")


def _blocks(path: Path, lines: list[str], names: list[str]) -> Iterator[Series]:
    """Yield the rows as numbers, a block of lines at a time, shape (lines, columns)."""
    if len(lines) < 3:
        raise expected(path, f"{len(lines) - 1} rows", "at least two")
    for first in range(1, len(lines), _BLOCK_LINES):
        yield _block(path, lines[first : first + _BLOCK_LINES], first + 1, names)


def _block(path: Path, lines: list[str], first: int, names: list[str]) -> Series:
    commas = len(names) - 1
    for k, line in enumerate(lines):
        if line.count(",") != commas:
            found = f"{line.count(',') + 1} fields" if line.strip() else "an empty line"
            raise expected(
                f"{path}, line {first + k}", found, f"{commas + 1} (`gecar import` repairs a truncated file)"
            )
    fields = [text.strip() or "nan" for text in ",".join(lines).split(",")]
    try:
        if _NOT_A_NUMBER.search("\n".join(lines)):
            raise ValueError  # what Python reads as a number but the format does not know: nan, inf, 1_000
        values = np.array(fields, dtype=np.float64).reshape(len(lines), len(names))
        if np.isinf(values).any():
            raise ValueError
    except ValueError:
        raise _bad_field(path, lines, first, names) from None
    return values


def _bad_field(path: Path, lines: list[str], first: int, names: list[str]) -> InputError:
    """Return the error for the first field that is not a number."""
    for k, line in enumerate(lines):
        for name, text in zip(names, line.split(","), strict=True):
            if not _is_number(text):
                return expected(
                    f"{path}, line {first + k}, column {name}", repr(text.strip(" \t")), "a number or nothing"
                )
    raise AssertionError("every field is a number after all")


def _is_number(text: str) -> bool:
    try:
        return not _NOT_A_NUMBER.search(text) and (not text.strip() or math.isfinite(float(text)))
    except ValueError:
        return False
