"""The command that starts gecar here, for messages with commands to type."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path


def command() -> str:
    """Return what to type for ``gecar``: that word where the shell would find it, else this one's path or module."""
    beside = shutil.which("gecar", path=str(Path(sys.executable).parent))  # on Windows it is gecar.exe
    found = shutil.which("gecar")
    if beside and found and Path(found).resolve() == Path(beside).resolve():
        return "gecar"
    if beside:
        return _short(Path(beside))
    return f"{_short(Path(sys.executable))} -m gecar"


def _short(path: Path) -> str:
    """Return the shorter of a path's absolute and relative forms."""
    try:
        return min(str(path), os.path.relpath(path), key=len)
    except ValueError:  # another drive
        return str(path)
