"""The genealogy of a run's best program: its ancestors in the population, and the operators that changed it."""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator, ScalarFormatter

from gecar.evolution.lineage import CREEP, CROSSOVER, DUPLICATION, MUTATION, Lineage, Member
from gecar.language.program import Program
from gecar.plots.runs.convergence import UNSOLVED
from gecar.plots.style import INK, PAPER, SOFT, VERMILION, headline, look, new_figure
from gecar.results.arrival import with_share

OPERATORS = {CROSSOVER: "crossover", DUPLICATION: "duplication", MUTATION: "mutation", CREEP: "creep"}
MAX_STEPS = 24
"""Most steps listed, the latest ones."""
_MARKS = {
    CROSSOVER: ("s", 10.0),
    DUPLICATION: ("D", 8.5),
    MUTATION: ("o", 7.0),
    CREEP: ("^", 4.5),
}  # so that all can be seen in one place
_COLOURS = "viridis_r"
_UNSOLVED_COLOUR = "#E9ECEF"
_WIDTH_IN, _MAP_IN, _ROW_IN = 11.0, 4.4, 0.215
_LETTERS, _PT = 82, 7.0

Ranks = list[npt.NDArray[np.int64]]
Share = Callable[[Member], float | None]


@dataclass(frozen=True)
class Step:
    """A generation in which the winner's ancestors got another program.

    Attributes
    ----------
    generation
        In which.
    by
        What changed it.
    fitness
        What came of it, in words.
    words
        The program in pieces, and whether each is new.
    """

    generation: int
    by: str
    fitness: str
    words: list[tuple[str, bool]]


def genealogy(
    lineage: Lineage,
    winner: Member,
    program: Callable[[Member], Program | None],
    share: Share,
    title: str = "",
    detail: str = "",
) -> Figure:
    """Draw who an individual descends from.

    Parameters
    ----------
    lineage
        The run's.
    winner
        Whose ancestors.
    program
        Gives an individual's program.
    share
        Gives the share of drives in which an individual's program arrives, 0..1; None where it is not known.
    title, detail
        What to write above it.
    """
    shown = steps_of(lineage, winner, program, share, MAX_STEPS)
    with look():
        below = _ROW_IN * (len(shown) + 2.2)
        figure = new_figure(_WIDTH_IN, _MAP_IN + below + 1.0)
        headline(figure, title, detail)
        top, bottom = figure.subplots(2, 1, height_ratios=(_MAP_IN, below))
        ranks = [_ranks(rows["merit"]) for rows in lineage.generations]
        _draw_population(figure, top, lineage)
        _draw_family(top, lineage, winner, ranks)
        _draw_line(top, lineage, winner, ranks)
        _list(bottom, shown, len(_changed(lineage, winner)) - len(shown))
    return figure


def steps_of(
    lineage: Lineage,
    winner: Member,
    program: Callable[[Member], Program | None],
    share: Share,
    most: int = sys.maxsize,
) -> list[Step]:
    """Return the latest steps, at most so many, in which an individual's line got another program."""
    members = _changed(lineage, winner)
    texts = [_tokens(program(member)) for member in members]
    words = [[("".join(texts[0]), False)], *(_compared(*pair) for pair in pairwise(texts))]
    return [
        Step(member[0], _operators(lineage, member, share), _came_to(lineage, member, share), pieces)
        for member, pieces in list(zip(members, words, strict=True))[-most:]
    ]


def _changed(lineage: Lineage, winner: Member) -> list[Member]:
    """Return those of an individual's line whose program differs from their parent's, and the first."""
    return [member for k, member in enumerate(lineage.line(winner)) if k == 0 or lineage.changed(member)]


def _came_to(lineage: Lineage, member: Member, share: Share) -> str:
    """Say how good an individual was."""
    merit = lineage.merit(member)
    return fitness_words(merit, share(member) if merit < UNSOLVED else None)


def fitness_words(merit: float, share: float | None) -> str:
    """Say how good a merit is (`gecar.evolution.lineage.INDIVIDUAL`), at GOAL with the share of drives that arrive."""
    if merit < UNSOLVED:
        return with_share(merit, share)
    far = UNSOLVED + 1.0 - merit
    return "no program" if far < -0.5 else f"{100 * max(far, 0.0):.0f} % of the way"


def _operators(lineage: Lineage, member: Member, share: Share) -> str:
    """Return what changed an individual's program, and its crossover partner."""
    parents, changed = lineage.parents(member), lineage.changed(member)
    if not parents:
        return "first population" if member[0] == 0 else "new"
    words = [name for bit, name in OPERATORS.items() if changed & bit]
    if changed & CROSSOVER:
        words[0] += f" with {_came_to(lineage, parents[1], share)}"
    return ", ".join(words)


def _tokens(program: Program | None) -> list[str]:
    source = " ".join(line.strip() for line in program.source.splitlines()) if program else "(no program)"
    return re.findall(r"-?\d+|\w+|\s+|.", source)


def _compared(before: list[str], after: list[str]) -> list[tuple[str, bool]]:
    """Return a program in pieces, and whether each differs from the program before."""
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    pieces = [(kind, "".join(after[a:b])) for kind, _, _, a, b in matcher.get_opcodes()]
    return [(text, kind != "equal") for kind, text in pieces if text]


def _ranks(merits: npt.NDArray[np.float32]) -> npt.NDArray[np.int64]:
    """Return ranks, 1 for the best; equals share theirs, so that what stays the best is a straight line."""
    return 1 + np.searchsorted(np.sort(merits), merits)


def _draw_population(figure: Figure, axes: Axes, lineage: Lineage) -> None:
    """Draw every generation's times as a column, the best above."""
    merits = np.sort([rows["merit"] for rows in lineage.generations], axis=1).T
    times = np.ma.masked_greater_equal(merits, UNSOLVED)
    population, generations = times.shape
    axes.set_facecolor(_UNSOLVED_COLOUR)
    known = times.compressed()
    low, high = (float(known.min()), float(np.quantile(known, 0.9))) if known.size else (10.0, 60.0)
    mesh = axes.pcolormesh(
        np.arange(generations + 1) - 0.5, np.arange(population + 1) + 0.5, times,
        cmap=_COLOURS, norm=Normalize(low, max(high, low + 0.1)), rasterized=True,
    )  # fmt: skip
    axes.set(yscale="log", ylim=(population + 0.5, 0.5), xlim=(-0.5, generations - 0.5))
    ticks = [
        tick for tick in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 10_000, 100_000) if tick <= population
    ]
    axes.yaxis.set_major_locator(FixedLocator(ticks))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=(1, 2, 5, 10)))
    axes.set(ylabel="rank in the population", xlabel="generation")
    axes.grid(visible=False)
    bar = figure.colorbar(mesh, ax=axes, pad=0.01, aspect=30, extend="max")
    bar.set_label("time to GOAL [s]; grey: not at GOAL", size=8)


def _draw_family(axes: Axes, lineage: Lineage, winner: Member, ranks: Ranks) -> None:
    """Join all ancestors with their parents."""
    pairs = [
        ((generation, place), parent)
        for generation, places in enumerate(lineage.family(winner))
        for place in sorted(places)
        for parent in lineage.parents((generation, place))
    ]
    lines = [[_at(one, ranks), _at(other, ranks)] for one, other in pairs]
    alpha = min(0.6, max(0.08, 350.0 / max(len(lines), 1)))  # many lines together must not hide the times
    axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.7, alpha=alpha), autolim=False)


def _draw_line(axes: Axes, lineage: Lineage, winner: Member, ranks: Ranks) -> None:
    """Draw the winner's own line, and what changed its program."""
    line = lineage.line(winner)
    x, y = zip(*(_at(member, ranks) for member in line), strict=True)
    axes.plot(x, y, color=PAPER, linewidth=4.2)
    axes.plot(x, y, color=VERMILION, linewidth=2.2, label="the winner's line of descent")
    for bit, name in OPERATORS.items():
        points = [_at(member, ranks) for member in line if lineage.changed(member) & bit]
        if points:
            mark, size = _MARKS[bit]
            style: dict[str, Any] = {"color": VERMILION, "markeredgecolor": PAPER, "linestyle": "none"}
            axes.plot(
                *zip(*points, strict=True),
                marker=mark,
                markersize=size,
                label=f"changed by {name}",
                **style,
            )
    if any(len(places) > 1 for places in lineage.family(winner)):
        axes.plot([], [], color=INK, linewidth=0.7, label="other ancestors")
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)


def _at(member: Member, ranks: Ranks) -> tuple[int, int]:
    return member[0], int(ranks[member[0]][member[1]])


def _list(axes: Axes, steps: Sequence[Step], earlier: int) -> None:
    """List the steps, with what is new in each program in bold."""
    axes.set_axis_off()
    axes.set(xlim=(0.0, 1.0), ylim=(len(steps) - 0.4, -1.6))
    names: dict[str, Any] = {"size": 8, "color": SOFT, "va": "center"}
    first = "program, what is new in bold" + (f" ({earlier} earlier steps are not shown)" if earlier else "")
    columns = (0.045, 0.06, 0.505, 0.52)
    for x, words, side in zip(
        columns, ("generation", "by", "came to", first), ("right", "left", "right", "left"), strict=True
    ):
        axes.text(x, -1.1, words, ha=side, **names)
    for row, step in enumerate(steps):
        size: dict[str, Any] = {"size": 8, "va": "center"}
        axes.text(columns[0], row, str(step.generation), ha="right", **size)
        axes.text(columns[1], row, step.by, **size)
        axes.text(columns[2], row, step.fitness, ha="right", **size)
        _write(axes, columns[3], row, step.words)


def _write(axes: Axes, x: float, row: float, words: list[tuple[str, bool]]) -> None:
    """Write a program with what is new in bold."""
    shown = _window(words)
    # Letters that do not belong to a text are spaces in it, so that both stand exactly where they should.
    for bold in (False, True):
        text = "".join(piece if fresh == bold else " " * len(piece) for piece, fresh in shown)
        style: dict[str, Any] = {"weight": "bold", "color": INK} if bold else {"color": SOFT}
        axes.text(x, row, text, size=_PT, va="center", family="DejaVu Sans Mono", **style)


def _window(words: list[tuple[str, bool]]) -> list[tuple[str, bool]]:
    """Cut a program that is too long, from shortly before what is new."""
    letters = [(letter, fresh) for text, fresh in words for letter in text]
    if len(letters) <= _LETTERS:
        return words
    new = next((k for k, (_, fresh) in enumerate(letters) if fresh), 0)
    begin = max(0, min(new - 20, len(letters) - _LETTERS))
    end = begin + _LETTERS
    shown = [("…" if begin else " ", False), *letters[begin:end], ("…" if end < len(letters) else "", False)]
    pieces = groupby(shown, key=itemgetter(1))
    return [("".join(letter for letter, _ in piece), fresh) for fresh, piece in pieces]
