"""The runs of a file: its tables, parted where a column counts runs, or where the clock starts again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.reality.recordings.csv_reader import MOST_BYTES
from gecar.reality.recordings.importing.containers import read_mat, read_xlsx
from gecar.reality.recordings.importing.meaning import Said, counts_runs, guess_meanings
from gecar.reality.recordings.importing.repair import clock_restarts
from gecar.reality.recordings.importing.ros import with_plain_names
from gecar.reality.recordings.importing.table import ForeignTable
from gecar.reality.recordings.importing.text_tables import tables_in_lines

_STUB_ROWS, _STUB_SHARE = 10, 0.05  # a stretch below both is what was left of a run before, or a false start


def read_runs(path: Path, names: tuple[str, ...], said: Mapping[str, Said]) -> list[ForeignTable]:
    """Read a file and return a table for each run in it.

    Parameters
    ----------
    path
        Text, .mat or .xlsx.
    names
        Column names, for a file that has none.
    said
        What the user said of its columns, to know which one is the time.

    Raises
    ------
    InputError
        If the file is none, empty, too large, or holds no table.
    """
    tables = [with_plain_names(table) for table in _read_tables(path, names)]
    runs = [run for table in tables for run in _parted(table, said)]
    longest = max(len(run.values) for run in runs)
    least = max(2, min(_STUB_ROWS, _STUB_SHARE * longest))
    kept = [run for run in runs if len(run.values) >= least]
    short = [str(len(run.values)) for run in runs if len(run.values) < least]
    if short:
        rows = f"{', '.join(short)} row{'s' if short != ['1'] else ''}"
        line = f"{path.name}: left out {'a run' if len(short) == 1 else 'runs'} of {rows}"
        kept[0] = replace(kept[0], repairs=(*kept[0].repairs, line))
    if len(kept) == 1:
        return kept
    return [replace(run, number=k, repairs=run.repairs * (k == 1)) for k, run in enumerate(kept, 1)]


def _read_tables(path: Path, names: tuple[str, ...]) -> list[ForeignTable]:
    if not path.is_file():
        raise expected(path, "no such file" if not path.exists() else "no regular file", "a log to import")
    if path.stat().st_size > MOST_BYTES:
        raise expected(
            path, f"{path.stat().st_size / 1e6:.0f} MB", f"at most {MOST_BYTES / 1e6:.0f} MB: cut it"
        )
    kind = path.suffix.lower()
    if kind == ".mat":
        return read_mat(path)
    if kind in (".xlsx", ".xlsm"):
        return read_xlsx(path, names)
    if kind in (".bag", ".db3", ".mcap"):
        raise expected(path, "a ROS bag", "its topics as CSV: rostopic echo -b FILE -p /TOPIC > TOPIC.csv")
    return tables_in_lines(path, _lines(path), names)


def _lines(path: Path) -> list[str]:
    raw = path.read_bytes()
    if not raw.strip():
        raise expected(path, "an empty file", "a log to import")
    for encoding in ("utf-16",) if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "latin-1"):
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        return [line.replace("\0", "").strip("\r") for line in text.split("\n")]
    raise expected(path, "bytes that are no text", "a log to import")


def _parted(table: ForeignTable, said: Mapping[str, Said]) -> list[ForeignTable]:
    """Part a table where a column that counts runs changes, and where the clock starts again."""
    edges = {0, len(table.values)}
    for k, name in enumerate(table.names):
        if name not in said and counts_runs(name):
            edges |= set(_changes(table.values[:, k]))
    most = np.nanmax(np.abs(table.values), axis=0, initial=0.0)
    meanings = guess_meanings(table.names, most.tolist(), said)
    time = next((k for k, meaning in enumerate(meanings) if meaning.column == "t_s"), None)
    if time is not None:
        edges |= set(clock_restarts(table.values[:, time]))
    return [replace(table, values=table.values[a:b]) for a, b in pairwise(sorted(edges))]


def _changes(counted: npt.NDArray[np.float64]) -> list[int]:
    """Return the rows where a count of runs changes; none if it changes too often to count runs."""
    rows = (np.flatnonzero(np.diff(np.nan_to_num(counted))) + 1).tolist()
    return rows if len(rows) <= len(counted) / _STUB_ROWS else []
