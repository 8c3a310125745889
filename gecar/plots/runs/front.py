"""What a run with several goals ends with: its Pareto front, goal against goal, or the cells of its archive."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FormatStrFormatter, MaxNLocator

from gecar.plots.style import BLUE, FAINT, INK, SOFT, SPEED_COLOURS, headline, look, new_figure

Floats = npt.NDArray[np.float64]
Ranges = Sequence[tuple[float, float]]


def front_figure(
    values: Floats, on_front: Sequence[bool], labels: Sequence[str], title: str = "", detail: str = ""
) -> Figure:
    """Draw programs goal against goal, a panel for each pair of goals; numbers are those of the programs.

    Parameters
    ----------
    values
        What each program reaches, lower is better (programs, goals).
    on_front
        Whether none is as good in all goals and better in one (programs,).
    labels
        Of the goals.
    title, detail
        What to write above.
    """
    pairs = list(combinations(range(len(labels)), 2))
    rows, columns = (1, 1) if len(pairs) == 1 else (-(-len(pairs) // 3), 3)
    with look():
        figure = new_figure(8.0 if columns == 1 else 12.0, 5.2 if columns == 1 else 1.0 + 3.8 * rows)
        headline(figure, title, detail)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, (a, b) in zip(panels, pairs, strict=True):
            _panel(axes, values[:, [a, b]], np.asarray(on_front, bool), whole=len(pairs) == 1)
            axes.set(xlabel=labels[a], ylabel=labels[b])
            for side, k in ((axes.xaxis, a), (axes.yaxis, b)):
                whole = bool((values[:, k] % 1 == 0).all())
                side.set_major_locator(MaxNLocator(6, steps=(1, 2, 5, 10), integer=whole))
    return figure


def _panel(axes: Axes, values: Floats, on_front: npt.NDArray[np.bool_], whole: bool) -> None:
    """Draw a pair of goals; where there are no others, the steps that the front makes."""
    axes.scatter(
        values[~on_front, 0], values[~on_front, 1], s=16, color=FAINT, edgecolors=SOFT, linewidths=0.4
    )
    best = values[on_front]
    if whole and len(best):
        axes.step(*best[np.lexsort((-best[:, 1], best[:, 0]))].T, where="post", color=BLUE, linewidth=1.0)
    axes.scatter(best[:, 0], best[:, 1], s=26, color=BLUE, zorder=3)
    _number(axes, best, np.flatnonzero(on_front) + 1)
    axes.margins(0.08)
    for low, high, limit in ((*axes.get_xlim(), axes.set_xlim), (*axes.get_ylim(), axes.set_ylim)):
        if high - low < 2.0:  # all the same, or nearly
            limit(0.5 * (low + high) - 1.0, 0.5 * (low + high) + 1.0)


def _number(axes: Axes, places: Floats, numbers: npt.NDArray[np.intp]) -> None:
    """Write programs' numbers beside their points, but for those on top of one another."""
    spans = np.maximum(np.ptp(places, axis=0), 1e-9) if len(places) else np.ones(2)
    room = spans * (0.08, 0.035)  # a number is wider than it is high
    written: list[Floats] = []
    for place, number in zip(places, numbers.tolist(), strict=True):
        if all(np.abs((place - other) / room).max() > 1.0 for other in written):
            axes.annotate(f"{number}", place, (4, 4), textcoords="offset points", size=7, color=INK)
            written.append(place)


def archive_figure(
    values: Floats, ranges: Ranges, along: int, labels: Sequence[str], title: str = "", detail: str = ""
) -> Figure:
    """Draw an archive of two measures: the best program of each cell, coloured by its quality.

    Parameters
    ----------
    values
        Quality and both measures of each program (programs, 3).
    ranges, along
        Of the measures, and cells along each, as in `gecar.evolution.goals.MapElites`.
    labels
        Of the three goals.
    title, detail
        What to write above.
    """
    with look():
        figure = new_figure(8.0, 6.0)
        headline(figure, title, detail)
        axes = figure.subplots()
        ends = np.array(ranges, float)
        width = (ends[:, 1] - ends[:, 0]) / along
        cells = np.clip((values[:, 1:] - ends[:, 0]) // width, 0, along - 1)
        corners = ends[:, 0] + cells * width
        quality = axes.scatter([], [], c=[], cmap=SPEED_COLOURS)
        quality.set_clim(values[:, 0].min(), values[:, 0].max())
        for number, (corner, value) in enumerate(zip(corners, values[:, 0], strict=True), 1):
            colour = quality.to_rgba(value)
            axes.add_patch(
                Rectangle(tuple(corner), *width, facecolor=colour, edgecolor="white", linewidth=0.6)
            )
            ink = INK if sum(colour[:3]) > 1.6 else "white"
            axes.annotate(f"{number}", corner + 0.5 * width, size=7, color=ink, ha="center", va="center")
        figure.colorbar(quality, ax=axes, label=labels[0])
        axes.set(xlabel=labels[1], ylabel=labels[2], xlim=ends[0], ylim=ends[1])
        for side, low, each in zip((axes.xaxis, axes.yaxis), ends[:, 0], width, strict=True):
            side.set_ticks(low + each * np.arange(0, along + 1, max(1, along // 5)))
            side.set_major_formatter(FormatStrFormatter("%.3g"))
    return figure
