"""Files written whole or not at all, JSON text, and TOML read with errors that name the place."""

from __future__ import annotations

import json
import math
import os
import tempfile
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from gecar.errors import InputError, expected

R = TypeVar("R", bound=tuple[Any, ...])


def shipped(folder: str) -> Path:
    """Return a folder of files that come with gecar: inside the package if installed, else beside it."""
    package = Path(__file__).parent
    inside = package / folder
    return inside if inside.is_dir() else package.parent / folder


def write_whole(path: Path, content: str | bytes, durable: bool = True) -> None:
    """Write a file so that a reader, or a crash, sees either the old content or the new, never a part.

    Parameters
    ----------
    path
        The file.
    content
        All of it.
    durable
        Whether to wait until it would survive a power cut, which takes some milliseconds. Without, it still
        survives the end of this process, however sudden.

    Raises
    ------
    OSError
        If the folder cannot be written or the disk is full; the old file is then untouched.
    """
    raw = content.encode() if isinstance(content, str) else content
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(raw)
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def json_ready(value: Any) -> Any:
    """Return a value as JSON knows it: NumPy's numbers and arrays as Python's, nan and inf as null, others as text."""
    if isinstance(value, Mapping):
        return {str(key): json_ready(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_ready(each) for each in value]
    if hasattr(value, "tolist"):
        return json_ready(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, bool | int | float | str | None) else str(value)


def json_text(table: Mapping[str, Any]) -> str:
    """Write a table as JSON, by `json_ready`, indented."""
    return json.dumps(json_ready(table), indent=2, allow_nan=False) + "\n"


def json_lines(table: Mapping[str, Any]) -> str:
    """Write a table as JSON, by `json_ready`, a line a field: for tables with long lists."""
    fields = (f"  {json.dumps(k)}: {json.dumps(v, allow_nan=False)}" for k, v in json_ready(table).items())
    return "{\n" + ",\n".join(fields) + "\n}\n"


def is_file(path: Path) -> bool:
    """Return whether a file exists; False for names that no file can have (too long, a null in it)."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """Return whether a folder exists, as `is_file`."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def read_text(path: Path, what: str) -> str:
    """Read a text file.

    Raises
    ------
    InputError
        If it is missing, a folder, unreadable or not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")  # an editor on Windows may begin a file with a mark
    except UnicodeDecodeError as error:
        raise expected(path, f"bytes that are not UTF-8 at {error.start}", f"{what} as UTF-8 text") from None
    except FileNotFoundError:
        raise expected(path, "no such file", what) from None
    except OSError as error:
        raise expected(path, error.strerror or "an unreadable file", what) from None
    except ValueError:  # a null in its name
        raise expected(path, "a name that no file can have", what) from None


def read_rows(path: Path, what: str, kind: type[R]) -> list[R]:
    """Read a table whose columns are the fields of a named tuple of numbers and text without commas.

    Raises
    ------
    InputError
        If it cannot be read, has other columns, or a row has other values; names the line.
    """
    kinds = get_type_hints(kind)
    head, *rows = read_text(path, what).splitlines() or [""]
    if head != ",".join(kinds):
        raise expected(path, repr(head[:60]), f"the columns {', '.join(kinds)}")
    wanted = f"{len(kinds)} {'values' if str in kinds.values() else 'numbers'}"
    found = []
    for number, row in enumerate(rows, 2):
        try:
            found.append(
                kind(*(each(word) for each, word in zip(kinds.values(), row.split(","), strict=True)))
            )
        except ValueError:
            raise expected(f"{path}, line {number}", repr(row[:60]), wanted) from None
    return found


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    InputError
        As `read_text`, or if it is not TOML; the message names the line.
    """
    text = read_text(path, what)
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # very deep nesting and very long numbers among them
        raise InputError(f"{path}: not TOML: {error}") from None
