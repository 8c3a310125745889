"""Tables out of MATLAB's .mat files and Excel's .xlsx workbooks: one a run, a structure or a sheet each."""

from __future__ import annotations

import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.io import loadmat

from gecar.errors import InputError, expected
from gecar.reality.recordings.importing.meaning import names_time
from gecar.reality.recordings.importing.table import ForeignTable
from gecar.reality.recordings.importing.text_tables import tables_in_lines

MOST_UNPACKED = 256 * 1024 * 1024  # bytes; both kinds are packed, so that a small file may hold a large one
MOST_DEPTH = 20  # structures within each other
_TRY = "import sys; from scipy.io import loadmat; loadmat(sys.argv[1], simplify_cells=True)"
_LONGEST_TRY_S = 60.0
_MAT_HEADER, _MAT_COMPRESSED = 128, 15

Matrix = npt.NDArray[np.float64]


def read_mat(path: Path) -> list[ForeignTable]:
    """Read the tables of a MATLAB file of version 4 to 7: vectors of one length beside a vector of times.

    A structure with times of its own is a run of its own, and so is each element of an array of structures.
    Simulink's "structure with time", and matrices whose first row or column are times, are understood.

    Raises
    ------
    InputError
        If it is none, of version 7.3, too large, or holds no times.
    """
    raw = path.read_bytes()
    if raw[:8] == b"\x89HDF\r\n\x1a\n" or raw[512:520] == b"\x89HDF\r\n\x1a\n":
        raise expected(path, "a MATLAB file of version 7.3", "version 7: save(..., '-v7') in MATLAB")
    if _unpacked_bytes(raw) > MOST_UNPACKED:
        raise expected(path, "a MATLAB file that unpacks to more", f"at most {MOST_UNPACKED / 1e6:.0f} MB")
    tree = _loaded(path)
    wanted = {name: value for name, value in tree.items() if not name.startswith("__")}
    tables = [
        ForeignTable(path, "MATLAB file", names, values)
        for names, values in (_table(found) for found in _timed(wanted))
        if len(values) > 1
    ]
    if not tables:
        held = ", ".join(list(wanted)[:8]) or "nothing"
        raise expected(path, f"{held}", "a vector of times (t, time) and others as long")
    return tables


def _loaded(path: Path) -> dict[str, Any]:
    """Read a file with SciPy, first in a process apart: a damaged file can make its compiled reader crash."""
    try:
        command = [sys.executable, "-c", _TRY, str(path)]
        tried = subprocess.run(command, capture_output=True, timeout=_LONGEST_TRY_S, check=False)  # noqa: S603
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        raise expected(path, f"a file that cannot be read ({error})", "a .mat file") from None
    if tried.returncode != 0:
        raise expected(path, "no MATLAB file, or a damaged one", "a .mat file of version 7 or earlier")
    found: dict[str, Any] = loadmat(path, simplify_cells=True)
    return found


def _unpacked_bytes(raw: bytes) -> int:
    """Return how many bytes a version 5 file unpacks to; counting ends beyond the bound."""
    at, total = _MAT_HEADER, 0
    order = "<" if raw[126:128] == b"IM" else ">"
    while at + 8 <= len(raw) and total <= MOST_UNPACKED:
        kind, size = struct.unpack(f"{order}II", raw[at : at + 8])
        piece = raw[at + 8 : at + 8 + size]
        if kind == _MAT_COMPRESSED:
            unpacking = zlib.decompressobj()
            while piece and total <= MOST_UNPACKED and not unpacking.eof:
                try:
                    total += len(unpacking.decompress(piece, 1 << 20))
                except zlib.error:
                    break
                piece = unpacking.unconsumed_tail
        else:
            total += len(piece)
        at += 8 + size
    return total


def _timed(tree: Mapping[str, Any], depth: int = 0) -> Iterator[dict[str, Matrix]]:
    """Yield the vectors of each structure that has times of its own, by their names within it."""
    vectors = dict(_vectors(tree, "", depth))
    if any(names_time(name) for name in tree) or not any(isinstance(v, dict | list) for v in tree.values()):
        yield vectors
        return
    parts = [
        each
        for value in tree.values()
        for each in (value if isinstance(value, list) else [value])
        if isinstance(each, dict)
    ]
    for part in parts if depth < MOST_DEPTH else ():
        yield from _timed(part, depth + 1)


def _vectors(tree: Mapping[str, Any], prefix: str, depth: int) -> Iterator[tuple[str, Matrix]]:
    """Yield name and vector of all that a structure holds; a matrix gives one for each of its columns."""
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict) and depth < MOST_DEPTH:
            label = value.get("label")  # Simulink names its signals so
            if isinstance(label, str) and label and "values" in value:
                yield from _vectors({label: value["values"]}, "", depth + 1)
            else:
                yield from _vectors(value, f"{name}.", depth + 1)
        elif isinstance(value, list) and depth < MOST_DEPTH:
            numbered = {f"{key}{k}": each for k, each in enumerate(value, 1) if isinstance(each, dict)}
            yield from _vectors(numbered, prefix, depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim in (1, 2):
            yield from _columns(name, np.asarray(value, np.float64))


def _columns(name: str, values: Matrix) -> Iterator[tuple[str, Matrix]]:
    """Yield a vector, or a matrix's columns: time runs along its longer side."""
    if values.ndim == 1:
        yield name, values
        return
    along = values if values.shape[0] >= values.shape[1] else values.T
    first_is_time = along.shape[0] > 2 and bool((np.diff(along[:, 0]) > 0.0).all())
    for k in range(along.shape[1]):
        yield ("time" if k == 0 and first_is_time else f"{name}_{_letter(k)}"), along[:, k]


def _letter(number: int) -> str:
    """Return a, b, ..., z, aa, ...: words of a column's name hold no digits."""
    letters = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        letters = chr(ord("a") + rest) + letters
    return letters


def _table(vectors: Mapping[str, Matrix]) -> tuple[tuple[str, ...], Matrix]:
    """Put the vectors that are as long as the times side by side."""
    rows = next((len(values) for name, values in vectors.items() if names_time(name)), 0)
    beside = {name: values for name, values in vectors.items() if len(values) == rows}
    values = np.column_stack(list(beside.values())) if rows > 1 else np.empty((0, 0))
    values[~np.isfinite(values)] = np.nan
    return tuple(beside), values


def read_xlsx(path: Path, names: tuple[str, ...] = ()) -> list[ForeignTable]:
    """Read the tables of an Excel workbook, one or more a sheet; sheets without numbers are passed over.

    Raises
    ------
    InputError
        If it is none, too large, holds no table, or openpyxl is not installed.
    """
    try:
        load_workbook = import_module("openpyxl").load_workbook
    except ImportError:
        raise InputError(
            f"{path}: Excel files need openpyxl: pip install 'gecar[excel]', or save the sheet as CSV"
        ) from None
    _refuse_large(path)
    tables: list[ForeignTable] = []
    refusal = expected(path, "no sheet with rows of numbers", "a table")
    try:
        book = load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: _lines(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
    except Exception as error:  # noqa: BLE001  openpyxl raises whatever its parts do
        raise expected(path, f"no Excel workbook ({type(error).__name__})", "an .xlsx file") from None
    for lines in sheets.values():
        try:
            tables += tables_in_lines(path, lines, names)
        except InputError as error:
            refusal = error
    if not tables:
        raise refusal
    return [ForeignTable(t.source, "Excel sheet", t.names, t.values, t.remarks, t.repairs) for t in tables]


def _refuse_large(path: Path) -> None:
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(part.file_size for part in packed.infolist())
    except (OSError, zipfile.BadZipFile, NotImplementedError, ValueError):
        raise expected(path, "no Excel workbook", "an .xlsx file") from None
    if size > MOST_UNPACKED:
        raise expected(path, f"{size / 1e6:.0f} MB, unpacked", f"at most {MOST_UNPACKED / 1e6:.0f} MB")


def _lines(rows: Any) -> list[str]:
    """Write a sheet's rows as text with tabs, without the empty columns to the right."""
    table = [["" if cell is None else str(cell).replace("\t", " ") for cell in row] for row in rows]
    width = max((k + 1 for row in table for k, cell in enumerate(row) if cell.strip()), default=0)
    return ["\t".join(row[:width]) for row in table]
