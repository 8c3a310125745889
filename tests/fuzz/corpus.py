"""The corpus: inputs kept because each reaches code that no smaller one does, and all that ever found something."""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

from .targets import TARGETS

FOLDER = Path(__file__).parent / "corpus"
GECAR = str(Path(__file__).parents[2] / "gecar")
Arc = tuple[str, int, int]


def kept(target: str) -> list[Path]:
    """Return a target's kept inputs."""
    return sorted((FOLDER / target).glob("*.fuzz"))


def arcs(target: str, raw: bytes, folder: Path) -> set[Arc]:
    """Return the steps from line to line that an input takes through gecar."""
    reached: set[Arc] = set()

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        if not frame.f_code.co_filename.startswith(GECAR):
            return None
        before = frame.f_lineno

        def line(frame: FrameType, event: str, argument: Any) -> Any:
            nonlocal before
            if event == "line":
                reached.add((frame.f_code.co_filename, before, frame.f_lineno))
                before = frame.f_lineno
            return line

        return line

    sys.settrace(trace)
    try:
        with suppress(Exception):
            TARGETS[target](raw, folder)
    finally:
        sys.settrace(None)
    return reached


def keep_smallest(target: str, more: Iterable[Path]) -> tuple[int, int]:
    """Keep the smallest inputs that reach all that the kept ones and these do; return how many, and their bytes."""
    found = {path.read_bytes() for path in kept(target) if path.name.startswith("found-")}
    rest = {path.read_bytes() for path in [*kept(target), *more]} - found
    reached: set[Arc] = set()
    chosen = []
    with tempfile.TemporaryDirectory() as name:
        for raw in sorted(found, key=_smallest) + sorted(rest, key=_smallest):
            new = arcs(target, raw, Path(name)) - reached
            if new and raw not in found:
                chosen.append(raw)
            reached |= new
    for path in kept(target):
        if not path.name.startswith("found-"):
            path.unlink()
    for raw in chosen:
        (FOLDER / target / f"{hashlib.sha256(raw).hexdigest()[:12]}.fuzz").write_bytes(raw)
    return len(chosen) + len(found), sum(map(len, [*chosen, *found]))


def _smallest(raw: bytes) -> tuple[int, bytes]:
    return len(raw), raw
