"""Display in notebooks: runs, drives, courses, recordings and verdicts, as pictures and text.

from gecar.notebook import discover, plot, read_case, show
verdict = discover(read_case("recordings/monday"))
verdict                # text, tables and the gap; print(show(verdict)): only the text
plot(verdict, "map")   # or "gap", "where", "traces", "tried": a matplotlib figure
verdict.robot          # the robot with the effects found
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from functools import singledispatch
from html import escape
from typing import Any

from matplotlib.figure import Figure

from gecar.api import Run, Simulation
from gecar.errors import expected
from gecar.evolution.scores import UNSOLVED
from gecar.evolution.state import Best
from gecar.plots.courses.course import course_figure
from gecar.plots.drives.trajectory import trajectory
from gecar.plots.reality.recording import recording_figure
from gecar.plots.reality.verdict import verdict_drawings
from gecar.plots.style import picture
from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import Case, Recording, make_recording, read_case, read_recording
from gecar.reality.verdict import Verdict
from gecar.report.drive import arrival_of, detail_of, sentence_of, title_of
from gecar.report.verdict import words
from gecar.report.verdict_page import verdict_html
from gecar.world.course.course import Course

__all__ = [
    "Case",
    "Recording",
    "Verdict",
    "discover",
    "html",
    "make_recording",
    "plot",
    "read_case",
    "read_recording",
    "show",
]


@dataclass(frozen=True)
class Shown:
    """A verdict as text for a terminal, and as HTML for a notebook."""

    text: str
    html: str

    def __str__(self) -> str:
        """Return the text."""
        return self.text

    def _repr_html_(self) -> str:
        """Return the HTML for a notebook."""
        return self.html


def show(verdict: Verdict) -> Shown:
    """Return a verdict's text, tables, and the picture of how much of the gap is closed."""
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


@singledispatch
def html(thing: object) -> str:
    """Return the HTML of a course, a recording, a verdict, a drive, a run, or a run's best.

    Raises
    ------
    TypeError
        If it is something else.
    """
    raise TypeError(f"found a {type(thing).__name__}, expected something that a notebook shows")


@html.register
def _(verdict: Verdict) -> str:
    return show(verdict).html


@html.register
def _(course: Course) -> str:
    return _image(course_figure(course), f"The course {course.title or course.name}")


@html.register
def _(recording: Recording) -> str:
    return _image(recording_figure(recording), f"The recording {recording.name}")


@html.register
def _(simulation: Simulation) -> str:
    world, drive = simulation.world, simulation.drive
    title = title_of(drive, world.course, simulation.arrives["share"])
    figure = trajectory(world, simulation.program, drive, title=title, detail=detail_of(world, drive))
    return (
        _image(figure, title)
        + f"<p>{escape(sentence_of(drive))} {escape(arrival_of(simulation.arrives))}</p>"
    )


@html.register
def _(run: Run) -> str:
    return html(run.best) if run.best.program is None else html(run.simulation)


@html.register(Best)
def _(best: Best[Any]) -> str:
    if best.program is None:
        return "<p>No genome mapped to a program.</p>"
    merit = f"{best.merit:.2f}" if best.merit < UNSOLVED else "GOAL not reached"
    found = f"<p>Found in generation {best.generation}; merit: {merit}.</p>"
    return f"<pre>{escape(str(best.program))}</pre>{found}"


def _image(figure: Figure, words: str) -> str:
    source = base64.b64encode(picture(figure)).decode()
    return f"<img alt='{escape(words)}' style='max-width:100%' src='data:image/png;base64,{source}'>"
