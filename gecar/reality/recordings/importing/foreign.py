"""Tables out of whatever text holds them: CSV, DataLog, Tracker's tabs, a terminal's capture."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.csv_reader import MOST_BYTES

SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "space"}
_BLANKS = frozenset(("", "nan", "none", "null", "n/a", "na", "-", "--", "?", "inf", "-inf"))
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class ForeignTable:
    """A table found in a text file, as numbers in whatever units they have.

    Attributes
    ----------
    source
        The file.
    kind
        What it looks like, in words.
    names
        Column names as the file has them.
    values
        Shape (rows, columns); NaN where a cell is blank.
    lines
        The file's line of each row, shape (rows,).
    remarks
        The file's lines that start with ``#``, without it.
    repairs
        What was left out, a line each.
    """

    source: Path
    kind: str
    names: tuple[str, ...]
    values: Series
    lines: npt.NDArray[np.int64]
    remarks: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Layout:
    separator: str
    decimal_comma: bool
    width: int


@dataclass
class _Sorted:
    """The file's lines, sorted out."""

    runs: list[tuple[tuple[str, ...], list[int], list[list[float]]]]  # names, line numbers, rows
    cut: list[int]
    other: list[int]


def read_foreign(path: Path, names: tuple[str, ...] = (), run: int | None = None) -> ForeignTable:
    """Find the table in a file.

    Parameters
    ----------
    path
        Any text file with rows of numbers in it.
    names
        Column names, for a file that has none.
    run
        Which run to take, from 1, where a file holds several; the longest if not given.

    Raises
    ------
    InputError
        If there is no table, or no line that names its columns.
    """
    lines = [line.replace("\0", "").strip("\r") for line in _decoded(path).split("\n")]
    layout = _find_layout(path, lines, len(names))
    found = _sort_out(lines, layout, names)
    if not found.runs:
        raise expected(
            path, "no line of column names above the numbers", "one, or --names t_s,left_duty_pct,..."
        )
    chosen = _choose(path, found, run)
    columns, numbers, rows = found.runs[chosen]
    if len(columns) != layout.width:
        raise expected(path, f"{layout.width} columns of numbers", f"{len(columns)}: {', '.join(columns)}")
    return ForeignTable(
        source=path,
        kind=_kind(lines, layout, columns, numbers[0], bool(found.other)),
        names=_with_tracks(lines, columns),
        values=np.array(rows),
        lines=np.array(numbers),
        remarks=tuple(line.lstrip("#; ").strip() for line in lines if line.startswith("#")),
        repairs=_left_out(path, layout, found, chosen),
    )


def _left_out(path: Path, layout: _Layout, found: _Sorted, chosen: int) -> tuple[str, ...]:
    """Say what of the file was not taken."""
    repairs = []
    if len(found.runs) > 1:
        sizes = ", ".join(str(len(rows)) for _, _, rows in found.runs)
        took = f"took run {chosen + 1} (--run takes another)"
        repairs.append(f"{path.name}: holds {len(found.runs)} runs of {sizes} rows: {took}")
    if found.cut:
        repairs.append(f"{path.name}: left out {_lines(found.cut)}: not {layout.width} fields")
    if found.other and not (layout.separator == "\t" and found.other == [1]):  # Tracker's title
        repairs.append(f"{path.name}: passed over {_lines(found.other)}: other text")
    return tuple(repairs)


def _lines(numbers: list[int]) -> str:
    shown = ", ".join(str(n) for n in numbers[:5])
    more = f" and {len(numbers) - 5} more" if len(numbers) > 5 else ""
    return f"line{'s' if len(numbers) > 1 else ''} {shown}{more}"


def _decoded(path: Path) -> str:
    if not path.is_file():
        raise expected(path, "no such file" if not path.exists() else "no regular file", "a log to import")
    if path.stat().st_size > MOST_BYTES:
        raise expected(
            path, f"{path.stat().st_size / 1e6:.0f} MB", f"at most {MOST_BYTES / 1e6:.0f} MB: cut it"
        )
    raw = path.read_bytes()
    if not raw.strip():
        raise expected(path, "an empty file", "a log to import")
    for encoding in ("utf-16",) if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "latin-1"):
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise expected(path, "bytes that are no text", "a log to import")


def _split(line: str, layout: _Layout) -> list[str]:
    """Return a line's cells, stripped; a separator at its end adds none (Tracker writes one)."""
    if layout.separator == " ":
        return line.split()
    cells = [cell.strip().strip('"') for cell in line.split(layout.separator)]
    return cells[:-1] if len(cells) == layout.width + 1 and not cells[-1] else cells


def _number(cell: str, decimal_comma: bool) -> float | None:
    """Return the number in a cell, NaN for a blank, ``None`` for anything else."""
    if cell.lower() in _BLANKS:
        return math.nan
    if decimal_comma:
        cell = cell.replace(",", ".")
    try:
        value = float(cell) if "_" not in cell else None
    except ValueError:
        return None
    return value if value is not None and math.isfinite(value) else None


def _numbers(line: str, layout: _Layout) -> list[float] | None:
    """Return the numbers of a row; ``None`` for a line that is no row of numbers."""
    values = [_number(cell, layout.decimal_comma) for cell in _split(line, layout)]
    if any(value is None for value in values) or all(math.isnan(value or 0.0) for value in values):
        return None
    return [math.nan if value is None else value for value in values]


def _find_layout(path: Path, lines: list[str], named: int) -> _Layout:
    """Choose separator, decimal sign and number of columns: under which most lines are rows of numbers."""
    best, most = _Layout(",", False, 0), 0
    for separator in SEPARATORS:
        sample = [line for line in lines if separator in line.strip()][:5000]
        commas = separator != "," and any(
            _DECIMAL_COMMA.fullmatch(c.strip()) for c in _cells(sample, separator)
        )
        trial = _Layout(separator, commas, 0)
        rows = [row for row in (_numbers(line.rstrip(separator), trial) for line in sample) if row]
        widths = Counter(len(row) for row in rows)
        width, count = max(widths.items(), key=lambda item: item[1], default=(0, 0))
        # Equal counts: " " also splits "1, 2" into "1," and "2", but "1," is no number; tabs with spaces are
        # tabs.
        if width > 1 and count > most:
            best, most = _Layout(separator, commas, named or _named_width(lines, trial, width)), count
    if most < 2:
        raise expected(path, "no two lines of numbers with the same number of columns", "a table")
    return best


def _cells(sample: list[str], separator: str) -> list[str]:
    return [cell for line in sample[:200] for cell in line.split(separator)]


def _named_width(lines: list[str], layout: _Layout, width: int) -> int:
    """Return the number of columns: the names' where blanks at the ends of rows hide some."""
    for line, following in pairwise(lines):
        cells = [cell for cell in _split(line, layout) if cell]
        if len(cells) >= width and _numbers(line, layout) is None and _numbers(following, layout):
            return len(cells)
    return width


def _sort_out(lines: list[str], layout: _Layout, names: tuple[str, ...]) -> _Sorted:
    """Sort lines into runs of rows, cut rows and other text. A run starts wherever the names stand."""
    found = _Sorted([(names, [], [])] if names else [], [], [])
    header = names
    for number, line in enumerate(lines, 1):
        cells, row = _split(line, layout), _numbers(line, layout)
        if row is not None and len(row) == layout.width:
            if not found.runs and header:
                found.runs.append((header, [], []))
            if found.runs:
                found.runs[-1][1].append(number)
                found.runs[-1][2].append(row)
        elif row is not None and found.runs and len(row) > 1:
            found.cut.append(number)
        elif found.runs and tuple(cells) == header:
            found.runs.append((header, [], []))
        elif not found.runs and len(cells) == layout.width and all(cells) and not line.startswith("#"):
            header = tuple(cells)
        elif line.strip() and not line.startswith("#"):
            found.other.append(number)
    found.runs = [run for run in found.runs if len(run[1]) > 1]
    return found


def _choose(path: Path, found: _Sorted, run: int | None) -> int:
    if run is None:
        return max(range(len(found.runs)), key=lambda k: len(found.runs[k][1]))
    if not 1 <= run <= len(found.runs):
        raise expected(f"{path}, --run", run, f"1 to {len(found.runs)}")
    return run - 1


def _with_tracks(lines: list[str], names: tuple[str, ...]) -> tuple[str, ...]:
    """Put the tracks' names before the columns', where Tracker exported several: ``t``, ``mass A x``, ..."""
    if not lines[0].startswith("#multi") or len(lines) < 2:
        return names
    tracks, named, track = lines[1].split("\t"), [], ""
    for k, name in enumerate(names):
        track = tracks[k].strip() or track if k < len(tracks) else track
        named.append(f"{track} {name}".strip())
    return tuple(named)


def _kind(lines: list[str], layout: _Layout, names: tuple[str, ...], first: int, mixed: bool) -> str:
    """Say what the file looks like."""
    title = lines[0].strip()
    if (
        layout.separator == "\t"
        and names[0].lower() == "t"
        and (title.startswith("#multi") or "\t" not in title)
    ):
        return "Tracker export" + ("" if title.startswith("#multi") else f" of {title.lstrip('# ')!r}")
    if mixed:
        return f"{SEPARATORS[layout.separator]}-separated rows among other text"
    if ", " in lines[first - 1]:
        return "Pybricks DataLog"
    return f"{SEPARATORS[layout.separator]}-separated table"
