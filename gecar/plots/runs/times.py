"""A study's final times, run by run: a box and a point for each in every cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.style import BLUE, SOFT, VERMILION, headline, look, new_figure
from gecar.results.cells import Cell
from gecar.results.quantile import quantile

MOST_CELLS = 40
"""Cells that are drawn at most; more could not be read."""
_SPREAD = 0.28  # of a row's height, over which the points of a cell are laid out by seed


def times_figure(cells: Sequence[Cell], names: tuple[str, str], title: str = "", detail: str = "") -> Figure:
    """Draw the time to GOAL of every run, a row for each cell: quartiles, median and points.

    Parameters
    ----------
    cells
        Row by row.
    names
        What rows and columns vary, in words.
    title, detail
        What to write above it.
    """
    shown = [cell for cell in cells if cell.records][:MOST_CELLS]
    with look():
        figure = new_figure(7.0, 0.34 * len(shown) + 1.2)
        headline(figure, title, detail)
        axes = figure.subplots()
        seen = np.concatenate([cell.times_s[np.isfinite(cell.times_s)] for cell in shown])
        low, high = (seen.min(), seen.max()) if len(seen) else (0.0, 60.0)
        room = max(0.06 * (high - low), 0.2)
        for place, cell in enumerate(shown):
            _draw_cell(axes, place, cell, high + 2.0 * room)
        axes.set_xlim(
            low - room, high + (3.0 if any(c.solved < len(c.records) for c in shown) else 1.0) * room
        )
        axes.set_ylim(len(shown) - 0.5, -0.5)
        axes.set_yticks(range(len(shown)), [f"{cell.row}, {cell.column}" for cell in shown])
        axes.set(xlabel="time to GOAL [s]; cross: not at GOAL", ylabel=", ".join(names))
        axes.grid(visible=False, axis="y")
    return figure


def _draw_cell(axes: Axes, place: int, cell: Cell, failed_at_s: float) -> None:
    """Draw a cell's runs; of a box of which a part did not reach GOAL, that part is left out."""
    times = cell.times_s
    heights = place + np.linspace(-_SPREAD, _SPREAD, len(times)) if len(times) > 1 else np.array([place])
    solved = np.isfinite(times)
    low, middle, high = (float(quantile(times, share)) for share in (0.25, 0.5, 0.75))
    if np.isfinite(low):
        end = high if np.isfinite(high) else failed_at_s
        axes.barh(place, end - low, 0.66, low, color=BLUE, alpha=0.15, edgecolor=BLUE, linewidth=0.8)
    if np.isfinite(middle):
        axes.plot([middle, middle], [place - 0.33, place + 0.33], color=BLUE, linewidth=2.2)
    axes.plot(times[solved], heights[solved], ".", color=SOFT, markersize=4)
    axes.plot(np.full((~solved).sum(), failed_at_s), heights[~solved], "x", color=VERMILION, markersize=4)
