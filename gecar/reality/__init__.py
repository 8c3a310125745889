"""Recordings of a real robot: what the simulation makes of them, and what it lacks.

For a notebook:

from gecar.reality import discover, read_case
verdict = discover(read_case("recordings/monday"))
verdict                # words, tables and the gap; print(verdict) for words alone
verdict.plot("map")    # or "gap", "where", "traces", "tried"
verdict.robot          # the robot with what was found
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gecar.reality.discovery import discover
    from gecar.reality.recordings.recording import Case, Recording, make_recording, read_case, read_recording
    from gecar.reality.verdict import Verdict

_HOMES = {
    "discover": "discovery", "Verdict": "verdict",
    "Case": "recordings.recording", "Recording": "recordings.recording", "make_recording": "recordings.recording",
    "read_case": "recordings.recording", "read_recording": "recordings.recording",
}  # fmt: skip

__all__ = [
    "Case",
    "Recording",
    "Verdict",
    "discover",
    "make_recording",
    "read_case",
    "read_recording",
]


def __getattr__(name: str) -> Any:
    """Load a name when it is first asked for: commands that need little stay quick."""
    if name not in _HOMES:
        raise AttributeError(name)
    return getattr(import_module(f"gecar.reality.{_HOMES[name]}"), name)
