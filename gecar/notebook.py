"""What a notebook needs: recordings, a verdict on them, and how it is shown.

from gecar.notebook import discover, plot, read_case, show
verdict = discover(read_case("recordings/monday"))
show(verdict)          # words, tables and the gap; print(show(verdict)): the words alone
plot(verdict, "map")   # or "gap", "where", "traces", "tried": a matplotlib figure
verdict.robot          # the robot with what was found
"""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.figure import Figure

from gecar.errors import expected
from gecar.plots.reality.verdict import verdict_drawings
from gecar.plots.style import picture
from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import Case, Recording, make_recording, read_case, read_recording
from gecar.reality.verdict import Verdict
from gecar.report.verdict import words
from gecar.report.verdict_page import verdict_html

__all__ = [
    "Case",
    "Recording",
    "Verdict",
    "discover",
    "make_recording",
    "plot",
    "read_case",
    "read_recording",
    "show",
]


@dataclass(frozen=True)
class Shown:
    """A verdict as words for a terminal, and as HTML for a notebook."""

    text: str
    html: str

    def __str__(self) -> str:
        """Return the words."""
        return self.text

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return self.html


def show(verdict: Verdict) -> Shown:
    """Return a verdict's words, tables, and the picture of how much of the gap is closed."""
    gap = {"gap": picture(plot(verdict, "gap"))}
    return Shown("\n\n".join(words(verdict)), verdict_html(verdict, gap))


def plot(verdict: Verdict, name: str = "gap") -> Figure:
    """Draw one of a verdict's pictures: ``gap``, ``where``, ``tried``, ``traces`` or, with poses, ``map``.

    Raises
    ------
    InputError
        If there is no such picture.
    """
    drawings = verdict_drawings(verdict)
    if name not in drawings:
        raise expected("picture", f"'{name}'", f"one of {', '.join(drawings)}")
    return drawings[name](verdict)
