"""Tables out of whatever text holds them: CSV, DataLog, Tracker's tabs, ROS exports, a terminal's capture."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np

from gecar.errors import InputError, expected
from gecar.reality.recordings.importing.meaning import is_unit
from gecar.reality.recordings.importing.table import ForeignTable

SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "space"}
_BLANKS = frozenset(("", "nan", "none", "null", "n/a", "na", "-", "--", "?", "inf", "-inf"))
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_NUMBER = re.compile(r"(?<![\w.])[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w])")
_TIME_OF_DAY = re.compile(r"(\d{1,2}):(\d\d):(\d\d(?:\.\d+)?)")
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
_ARDUINO_STAMP = re.compile(r"^\d\d:\d\d:\d\d(?:\.\d+)? -> ")
_LABELLED = re.compile(r"\s*([A-Za-z_]\w*)\s*[:=]\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(?:[,;\t ]|$)")


@dataclass(frozen=True)
class _Layout:
    separator: str
    decimal_comma: bool
    width: int
    text: frozenset[int] = frozenset()  # columns that hold words, such as a frame's name in a ROS export


@dataclass
class _Sorted:
    """The file's lines, sorted out."""

    runs: list[tuple[tuple[str, ...], list[int], list[list[float]]]]  # names, line numbers, rows
    cut: list[int]
    other: list[int]


def tables_in_lines(path: Path, lines: list[str], names: tuple[str, ...] = ()) -> list[ForeignTable]:
    """Find the tables in a file's lines: one a run, where the line of names stands anew before each.

    Parameters
    ----------
    path
        The file, for messages.
    lines
        Text with rows of numbers in it.
    names
        Column names, for a file that has none.

    Raises
    ------
    InputError
        If there is no table, no line that names its columns, or most lines with numbers are no rows of it.
    """
    lines, labels = _plain_rows(lines)
    names = names or labels
    layout = _find_layout(path, lines, len(names))
    found = _sort_out(lines, layout, names)
    if not found.runs:
        raise expected(
            path, "no line of column names above the numbers", "one, or --names t_s,left_duty_pct,..."
        )
    columns = found.runs[0][0]
    if len(columns) != layout.width:
        raise expected(path, f"{layout.width} columns of numbers", f"{len(columns)}: {', '.join(columns)}")
    _refuse_most(path, lines, layout, found)
    table = ForeignTable(
        source=path,
        kind=_kind(lines, layout, columns, found.runs[0][1][0], bool(found.other)),
        names=_with_tracks(lines, columns),
        values=np.empty((0, len(columns))),
        remarks=tuple(line.lstrip("#; ").strip() for line in lines if line.startswith("#")),
        repairs=_left_out(path, layout, found),
    )
    return [replace(table, values=np.array(rows)) for _, _, rows in found.runs]


def _plain_rows(lines: list[str]) -> tuple[list[str], tuple[str, ...]]:
    """Take the Arduino monitor's time stamps off, and labels (``left:12,right:34``) off values; return labels too."""
    written = [line for line in lines if line.strip()]
    if 2 * sum(bool(_ARDUINO_STAMP.match(line)) for line in written) > len(written):
        lines = [_ARDUINO_STAMP.sub("", line) for line in lines]
        written = [line for line in lines if line.strip()]
    found = [_labelled(line) for line in written[:200]]
    labels, times = Counter(found).most_common(1)[0] if found else ((), 0)
    if len(labels) < 2 or 2 * times <= len(found):
        return lines, ()
    return [
        ",".join(value for _, value in _LABELLED.findall(line)) if _labelled(line) == labels else line
        for line in lines
    ], labels


def _labelled(line: str) -> tuple[str, ...]:
    """Return the labels of a line that is made of labels and values; none of another."""
    found = _LABELLED.findall(line)
    return tuple(name for name, _ in found) if found and not _LABELLED.sub("", line).strip() else ()


def _refuse_most(path: Path, lines: list[str], layout: _Layout, found: _Sorted) -> None:
    """Refuse a file most of whose lines with numbers are no rows of the table found."""
    rows = sum(len(numbers) for _, numbers, _ in found.runs)
    few = max(2, layout.width // 2)
    lost = [n for n in sorted(found.cut + found.other) if len(_NUMBER.findall(lines[n - 1])) >= few]
    if len(lost) > rows:
        raise InputError(
            f"{path}: only {rows} of {rows + len(lost)} lines with numbers are rows of {layout.width} columns "
            f"({_lines(lost)} are not): no safe reading. Cut the file to one table"
        )


def _left_out(path: Path, layout: _Layout, found: _Sorted) -> tuple[str, ...]:
    """Say what of the file was not taken."""
    repairs = []
    if found.cut:
        repairs.append(f"{path.name}: left out {_lines(found.cut)}: not {layout.width} fields")
    if found.other and not (layout.separator == "\t" and found.other == [1]):  # Tracker's title
        repairs.append(f"{path.name}: passed over {_lines(found.other)}: other text")
    return tuple(repairs)


def _lines(numbers: list[int]) -> str:
    shown = ", ".join(str(n) for n in numbers[:5])
    more = f" and {len(numbers) - 5} more" if len(numbers) > 5 else ""
    return f"line{'s' if len(numbers) > 1 else ''} {shown}{more}"


def _split(line: str, layout: _Layout) -> list[str]:
    """Return a line's cells, stripped; a separator at its end adds none (Tracker writes one)."""
    if layout.separator == " ":
        return line.split()
    quoted = '"' in line  # a separator within quotes is none
    cells = _unquoted(line, layout.separator) if quoted else line.split(layout.separator)
    cells = [cell.strip().strip('"') for cell in cells]
    return cells[:-1] if len(cells) == layout.width + 1 and not cells[-1] else cells


def _unquoted(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:
        return line.split(separator)


def _number(cell: str, decimal_comma: bool) -> float | None:
    """Return the number in a cell, NaN for a blank, ``None`` for anything else."""
    if cell.lower() in _BLANKS:
        return math.nan
    if decimal_comma:
        cell = cell.replace(",", ".")
    try:
        value = float(cell) if "_" not in cell else None
    except ValueError:
        return _clock_time(cell)
    return value if value is not None and math.isfinite(value) else None


def _clock_time(cell: str) -> float | None:
    """Return the seconds of a time of day (``12:34:56.7``) or of a date and time; ``None`` for anything else."""
    if found := _TIME_OF_DAY.fullmatch(cell):
        return 3600.0 * int(found[1]) + 60.0 * int(found[2]) + float(found[3])
    if not _DATE.match(cell):
        return None
    try:
        when = datetime.fromisoformat(cell)
        return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return None


def _numbers(line: str, layout: _Layout) -> list[float] | None:
    """Return the numbers of a row, NaN in columns of words; ``None`` for a line that is no row of numbers."""
    cells = enumerate(_split(line, layout))
    values = [math.nan if k in layout.text else _number(cell, layout.decimal_comma) for k, cell in cells]
    if any(value is None for value in values) or all(math.isnan(value or 0.0) for value in values):
        return None
    return [math.nan if value is None else value for value in values]


def _find_layout(path: Path, lines: list[str], named: int) -> _Layout:
    """Choose separator, decimal sign and number of columns: under which most lines are rows of numbers.

    Columns of words are looked for only where fewer than half the lines are rows without them.
    """
    trials = [_trial(lines, separator) for separator in SEPARATORS]
    rows, layout = max(((count, layout) for count, layout, _ in trials), key=lambda found: found[0])
    written = sum(bool(_NUMBER.search(line)) and not line.startswith("#") for line in lines[:5000])
    if 2 * rows < written:
        wordy = [_with_words(sample, layout) for _, layout, sample in trials]
        more, numbers, layout_with = max(wordy, key=lambda found: (found[1], -len(found[2].text)))
        if more > rows and numbers >= 2 * more:
            return layout_with
    if rows < 2:
        raise expected(path, "no two lines of numbers with the same number of columns", "a table")
    return replace(layout, width=named or _named_width(lines, replace(layout, width=0), layout.width))


def _trial(lines: list[str], separator: str) -> tuple[int, _Layout, list[str]]:
    """Return how many of the first lines are rows of one width under a separator, the layout, and those lines."""
    sample = [line for line in lines if separator in line.strip()][:5000]
    commas = separator != "," and any(_DECIMAL_COMMA.fullmatch(c.strip()) for c in _cells(sample, separator))
    trial = _Layout(separator, commas, 0)
    rows = [row for row in (_numbers(line.rstrip(separator), trial) for line in sample) if row]
    widths = Counter(len(row) for row in rows if len(row) > 1)
    width, count = max(widths.items(), key=lambda item: item[1], default=(0, 0))
    # Equal counts: " " also splits "1, 2" into "1," and "2", but "1," is no number; tabs with spaces are tabs.
    return count, replace(trial, width=width), sample


def _with_words(sample: Sequence[str], layout: _Layout) -> tuple[int, int, _Layout]:
    """Return rows and numbers found if columns that mostly hold words are let be, and that layout."""
    plain = replace(layout, width=0, text=frozenset())
    lines = [cells for cells in (_split(line, plain) for line in sample) if len(cells) > 1]
    width = Counter(map(len, lines)).most_common(1)[0][0] if lines else 0
    table = [
        [_number(cell, layout.decimal_comma) for cell in cells] for cells in lines if len(cells) == width
    ]
    text = frozenset(k for k in range(width) if 2 * sum(row[k] is None for row in table) > len(table))
    rows = [row for row in table if all(k in text or value is not None for k, value in enumerate(row))]
    return len(rows), len(rows) * (width - len(text)), replace(layout, width=width, text=text)


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
            header = header or _commented_names(lines[number - 2], layout)
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
            units = bool(header) and all(map(is_unit, cells))  # a line of units below that of names
            header = tuple(map("{} ({})".format, header, cells)) if units else tuple(cells)
        elif line.strip() and not line.startswith("#"):
            found.other.append(number)
    found.runs = [run for run in found.runs if len(run[1]) > 1]
    return found


def _commented_names(line: str, layout: _Layout) -> tuple[str, ...]:
    """Return the names that a line of remarks just above the first row holds, as NumPy writes them; else none."""
    cells = _split(line.lstrip("# "), layout) if line.startswith("#") else []
    return tuple(cells) if len(cells) == layout.width and all(cells) else ()


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
