"""A study's pictures: convergence in every cell of its grid (the paper's Fig. 5), and the grid as a heat map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.runs.convergence import UNSOLVED
from gecar.plots.style import BLUE, FAINT, INK, SOFT, VERMILION, headline, look, new_figure
from gecar.results.arrival import arriving
from gecar.results.cells import Cell
from gecar.results.quantile import quantile

Floats = npt.NDArray[np.float64]
Paper = Mapping[tuple[Any, Any], float]
_MOST_PANELS = 12  # beside or below each other; more could not be read


def convergences(
    cells: Sequence[Cell], names: tuple[str, str], paper: Paper, title: str, detail: str
) -> Figure:
    """Draw the best time to GOAL over the generations, a panel for each cell: runs, median and middle half.

    Parameters
    ----------
    cells
        Row by row.
    names
        What rows and columns vary, in words.
    paper
        The paper's figure by row and column [s], drawn across; inf and what is missing is not.
    title, detail
        What to write above it.
    """
    rows, columns = _places(cells)
    rows, columns = rows[:_MOST_PANELS], columns[:_MOST_PANELS]
    limits = _limits(cells, paper)
    with look():
        figure = new_figure(max(2.7 * len(columns) + 0.6, 6.0), 2.15 * len(rows) + 1.3)
        headline(figure, title, detail)
        panels = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
        for cell in cells:
            if str(cell.row) in rows and str(cell.column) in columns:
                axes = panels[rows.index(str(cell.row)), columns.index(str(cell.column))]
                _draw_cell(axes, cell, paper.get((cell.row, cell.column), np.inf))
                axes.set_ylim(*limits)
        _label(panels, rows, columns, names)
        _explain(panels[0, -1], bool(paper))
    return figure


def heat_map(cells: Sequence[Cell], names: tuple[str, str], paper: Paper, title: str, detail: str) -> Figure:
    """Draw mean times as a heat map, with how many runs reached GOAL, beside the paper's where it has one.

    Parameters
    ----------
    cells, names, paper, title, detail
        As in `convergences`.
    """
    rows, columns = _places(cells)
    ours = np.full((len(rows), len(columns)), np.nan)
    words = np.full(ours.shape, "", object)
    theirs, their_words = ours.copy(), words.copy()
    for cell in cells:
        at = rows.index(str(cell.row)), columns.index(str(cell.column))
        ours[at], words[at] = _typical(cell)
        value = paper.get((cell.row, cell.column))
        if value is not None:
            theirs[at], their_words[at] = (value, f"{value:.2f}") if np.isfinite(value) else (np.nan, "–")
    sides = [("gecar", ours, words)] + ([("the paper, Table 5", theirs, their_words)] if paper else [])
    with look():
        width = len(sides) * max(1.25 * len(columns) + 1.0, 3.0) + 0.8
        figure = new_figure(max(width, 6.0), max(0.85 * len(rows), 1.7) + 1.7)
        headline(figure, title, detail)
        panels = figure.subplots(1, len(sides), squeeze=False)[0]
        values = np.concatenate([side[1].ravel() for side in sides])
        seen = values[np.isfinite(values)]
        scale = mpl.colors.Normalize(
            *(seen.min(), max(seen.max(), seen.min() + 1.0)) if len(seen) else (0.0, 60.0)
        )
        for axes, (name, times, each) in zip(panels, sides, strict=True):
            _draw_heat(axes, times, each, scale)
            axes.set_title(name if paper else "")
            axes.set(xlabel=names[1], ylabel=names[0] if axes is panels[0] else "")
            axes.set_xticks(range(len(columns)), columns)
            axes.set_yticks(range(len(rows)), rows)
        colours = mpl.cm.ScalarMappable(scale, _COLOURS)
        figure.colorbar(colours, ax=list(panels), label="mean of those at GOAL [s]", shrink=0.9)
    return figure


_COLOURS = mpl.colormaps["viridis_r"]


def _places(cells: Sequence[Cell]) -> tuple[list[str], list[str]]:
    rows = list(dict.fromkeys(str(cell.row) for cell in cells))
    return rows, list(dict.fromkeys(str(cell.column) for cell in cells))


def _typical(cell: Cell) -> tuple[float, str]:
    """Return what a cell's colour stands for [s], and what is written in it."""
    if not cell.records:
        return float("nan"), ""
    figures = cell.figures()
    time = f"{figures['mean_solved_s']:.2f}" if cell.solved else "–"
    spread = f" ± {figures['sd_solved_s']:.2f}" if cell.solved > 1 else ""
    words = f"{time}{spread}\n{cell.solved} of {len(cell.records)} at GOAL\n{arriving(cell.share)}"
    return figures["mean_solved_s"], words


def _draw_heat(axes: Axes, times: Floats, words: npt.NDArray[np.object_], scale: Any) -> None:
    axes.imshow(np.ma.masked_invalid(times), cmap=_COLOURS, norm=scale, aspect="auto")
    axes.set_facecolor(FAINT)
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    for (row, column), each in np.ndenumerate(words):
        dark = np.isfinite(times[row, column]) and scale(times[row, column]) > 0.45
        axes.text(column, row, each, ha="center", va="center", size=8.5, color="white" if dark else INK)


def _draw_cell(axes: Axes, cell: Cell, paper_s: float) -> None:
    axes.set_title(
        f"{cell.solved} of {len(cell.records)} at GOAL", size=8, weight="normal", color=SOFT, loc="right"
    )
    if np.isfinite(paper_s):
        axes.axhline(paper_s, color=VERMILION, linewidth=1.2, linestyle=(0, (5, 3)), zorder=4)
    if not cell.records:
        return
    times = np.where(cell.bests_s < UNSOLVED, cell.bests_s, np.inf)
    for run in times:
        axes.step(cell.generation, _finite(run), where="post", color=SOFT, linewidth=0.7, alpha=0.55)
    # A run without GOAL counts as infinitely slow, so its lack pulls the median up and does not drop out.
    low, middle, high = (_finite(quantile(times, q, axis=0)) for q in (0.25, 0.5, 0.75))
    top = np.where(np.isnan(high), 1e3, high)
    axes.fill_between(cell.generation, low, top, color=BLUE, alpha=0.15, step="post", lw=0)
    axes.step(cell.generation, middle, where="post", color=BLUE, linewidth=2.2, zorder=3)
    median_s = cell.quantile_s(0.5)
    if np.isfinite(median_s):
        words = f"{median_s:.2f} s\n{arriving(cell.share)}"
        above = axes.annotate(
            words, (cell.generation[-1], median_s), (0, 5), textcoords="offset points",
            ha="right", size=8, weight="bold", color=BLUE, zorder=5,
        )  # fmt: skip
        above.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5})


def _label(panels: npt.NDArray[Any], rows: list[str], columns: list[str], names: tuple[str, str]) -> None:
    for axes, column in zip(panels[0], columns, strict=True):
        axes.set_title(f"{names[1]} {column}", size=9)
    for axes, row in zip(panels[:, 0], rows, strict=True):
        axes.set_ylabel(f"{names[0]} {row}", weight="bold")
    for axes in panels[-1]:
        axes.set_xlabel("generation")


def _explain(axes: Axes, paper: bool) -> None:
    lines = [
        mpl.lines.Line2D([], [], color=BLUE, linewidth=2.2, label="median"),
        mpl.patches.Patch(color=BLUE, alpha=0.15, label="interquartile range"),
        mpl.lines.Line2D([], [], color=SOFT, linewidth=0.7, label="each run"),
    ]
    if paper:
        dashes: Any = (0, (5, 3))
        lines.append(
            mpl.lines.Line2D([], [], color=VERMILION, linewidth=1.2, linestyle=dashes, label="paper's mean")
        )
    axes.legend(handles=lines, loc="upper right", fontsize=7, handlelength=1.6)


def _limits(cells: Sequence[Cell], paper: Paper) -> tuple[float, float]:
    """Choose limits that hold the final times, the paper's, and most of the way there."""
    seen = [value for value in paper.values() if np.isfinite(value)]
    for cell in cells:
        if cell.records:
            best = cell.bests_s
            seen += list(best[best < UNSOLVED])
    if not seen:
        return 0.0, 60.0
    low, high = min(seen), float(np.quantile(seen, 0.995))
    room = max(high - low, 1.0)
    return max(low - 0.08 * room, 0.0), high + 0.12 * room


def _finite(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, np.nan)
