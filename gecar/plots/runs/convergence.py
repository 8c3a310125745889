"""A run's convergence: the best time to GOAL, and how much of the population is at GOAL, valid and distinct."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gecar.plots.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    SOFT,
    headline,
    look,
    new_figure,
)

UNSOLVED = 1e4
"""Fitness of a program that does not reach GOAL, eq. 1."""

Series = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """A time to compare with, drawn as a line across [s]."""

    words: str
    time_s: float


def convergence(
    history: Mapping[str, Series],
    references: Sequence[Reference] = (),
    title: str = "",
    detail: str = "",
    winner: Reference | None = None,
) -> Figure:
    """Draw a run's history.

    Parameters
    ----------
    history
        Columns of ``history.csv``, each (generations,): generation, best [s], valid, distinct [shares]; if there,
        also solved [share] and mean_solved [s].
    references
        Times to draw across the picture.
    title, detail
        What to write above it.
    winner
        The run's best program: its time, and what to write below that. None: the last generation's best.
    """
    generation, best = history["generation"], np.minimum.accumulate(history["best"])
    with look():
        figure = new_figure(8.0, 5.6)
        headline(figure, title, detail)
        top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.2))
        draw_best(top, generation, best, references, winner)
        _draw_begun_anew(top, history, best)
        if "mean_solved" in history:
            top.plot(
                generation, history["mean_solved"], color=ORANGE, linewidth=1.2, label="mean of those at GOAL"
            )
        if top.get_legend_handles_labels()[0]:
            top.legend(loc="upper right")
        _draw_shares(bottom, history)
        bottom.set_xlabel("generation")
        bottom.xaxis.set_major_locator(MaxNLocator(integer=True, steps=(1, 2, 5, 10)))
        bottom.set_xlim(generation[0] - 0.25, max(generation[-1], generation[0] + 1) + 0.25)
    return figure


def draw_best(
    axes: Axes,
    generation: Series,
    best: Series,
    references: Sequence[Reference],
    winner: Reference | None = None,
) -> None:
    """Draw the best time of each generation; generations in which no program reaches GOAL are shaded."""
    solved = best < UNSOLVED
    times = np.where(solved, best, np.nan)
    draw_references(axes, references)
    axes.step(generation, times, where="post", color=BLUE, linewidth=2.2, zorder=3, label="best")
    axes.plot(generation[solved], best[solved], "o", color=BLUE, markersize=3, zorder=3)
    axes.set_ylabel("best time to GOAL [s]")
    _frame(axes, [*best[solved], *([winner.time_s] if winner else [])], references)
    if not solved.all():
        _shade_unsolved(axes, generation, int(solved.argmax()) if solved.any() else len(solved))
    if winner or solved.any():
        _mark_winner(axes, winner or Reference("", best[-1]))


def _mark_winner(axes: Axes, winner: Reference) -> None:
    """Write a time and words beside the axes, where no reference's words are, however near its time."""
    # Where drawn conditions judge, the winner is chosen on fresh draws, and seldom is the curve's last point.
    edge = axes.get_yaxis_transform()
    axes.plot(
        1.0, winner.time_s, "<", color=BLUE, markersize=5, transform=edge, clip_on=False, label="winner"
    )
    axes.annotate(
        "\n".join(filter(None, [f"{winner.time_s:.2f} s", winner.words])), (1.0, winner.time_s), (7, 0),
        xycoords=("axes fraction", "data"), textcoords="offset points", va="center", weight="bold", color=BLUE,
    )  # fmt: skip


def _draw_begun_anew(axes: Axes, history: Mapping[str, Series], best: Series) -> None:
    """Draw the generations' own bests where they fall behind the run's: a new population began."""
    behind = np.flatnonzero(history["best"] > best)
    if behind.size:
        drawn = history["best"] < UNSOLVED
        drawn[: behind[0]] = False
        times = np.where(drawn, history["best"], np.nan)
        axes.step(
            history["generation"],
            times,
            where="post",
            color=BLUE,
            linewidth=1.0,
            linestyle=":",
            label="best of a new population",
        )


def _shade_unsolved(axes: Axes, generation: Series, first_solved: int) -> None:
    """Shade generations without a program that reaches GOAL."""
    begin, last = generation[0] - 0.25, max(generation[-1], generation[0] + 1) + 0.25
    end = generation[first_solved] if first_solved < len(generation) else last
    shade: dict[str, Any] = {
        "facecolor": "#F3F4F6",
        "edgecolor": "#DDE1E6",
        "hatch": "////",
        "linewidth": 0,
        "zorder": 0,
    }
    axes.axvspan(begin, end, **shade)
    wide = (end - begin) > 0.3 * (last - begin)
    axes.annotate(
        "no program reaches GOAL yet",
        (0.5 * (begin + end), 0.5),
        xycoords=("data", "axes fraction"),
        ha="center",
        va="center",
        rotation=0 if wide else 90,
        size=8,
        color=SOFT,
        bbox={"facecolor": "#F3F4F6", "edgecolor": "none", "pad": 1.5},
    )


def draw_references(axes: Axes, references: Sequence[Reference]) -> None:
    """Draw reference times as horizontal lines, with labels for the legend."""
    dashes = ((0, (5, 3)), (0, (1, 2)), (0, (5, 2, 1, 2)))
    for dash, reference in zip(dashes, references, strict=False):
        words = f"{reference.words}, {reference.time_s:.2f} s"
        axes.axhline(reference.time_s, color=INK, linewidth=1.2, linestyle=dash, zorder=2, label=words)


def _frame(axes: Axes, times: Sequence[float], references: Sequence[Reference]) -> None:
    """Choose limits that hold the times and the references."""
    seen = [*times, *(reference.time_s for reference in references)] or [0.0, 60.0]
    low, high = min(seen), max(seen)
    room = max(high - low, 1.0)
    axes.set_ylim(max(low - 0.13 * room, 0.0), high + 0.16 * room)


def _draw_shares(axes: Axes, history: Mapping[str, Series]) -> None:
    generation = history["generation"]
    marker = _marker(generation)
    axes.plot(generation, 100 * history["valid"], color=GREEN, marker=marker, label="valid")
    axes.plot(generation, 100 * history["distinct"], color=PURPLE, marker=marker, label="distinct programs")
    if "solved" in history:
        axes.plot(generation, 100 * history["solved"], color=SKY, marker=marker, label="at GOAL")
    axes.set(ylabel="population [%]", ylim=(-4, 108))
    axes.legend(ncols=3, loc="upper right", bbox_to_anchor=(1.0, 1.2), borderaxespad=0.0)


def _marker(generation: Series) -> str | None:
    """Return a marker where there are too few points for a line to show."""
    return "o" if len(generation) < 2 else None
