"""Several runs in one picture: best time to GOAL over evaluations, with the spread of runs that differ in seed only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from gecar.plots.runs.convergence import UNSOLVED, Reference, draw_references
from gecar.plots.style import CYCLE, headline, look, new_figure
from gecar.results.quantile import quantile

Series = npt.NDArray[np.float64]
History = Mapping[str, Series]


def compare_runs(
    groups: Mapping[str, Sequence[History]],
    references: Sequence[Reference] = (),
    title: str = "",
    detail: str = "",
    came_to: Mapping[str, str] = MappingProxyType({}),
) -> Figure:
    """Draw groups of runs: of one run its curve, of several the median and the middle half.

    Parameters
    ----------
    groups
        Histories by the name of what they share; columns evaluations and best [s], each (generations,).
    references
        Times to draw across the picture.
    title, detail
        What to write above it.
    came_to
        What to say of a group's end, by its name.
    """
    with look():
        figure = new_figure(9.0, 6.4)
        headline(figure, title, detail)
        top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
        draw_references(top, references)
        for k, (name, histories) in enumerate(groups.items()):
            words = name if len(histories) == 1 else f"{name}, {len(histories)} runs"
            words = ": ".join(filter(None, [words, came_to.get(name)]))
            _draw_group(top, bottom, words, histories, CYCLE[k % len(CYCLE)], "-" if k < len(CYCLE) else "--")
        top.set_ylabel("best time to GOAL [s]")
        top.legend(loc="upper right")
        _fit(top, [reference.time_s for reference in references])
        bottom.set(ylabel="runs at GOAL [%]", xlabel="evaluations", ylim=(-4, 108))
        bottom.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}"))
    return figure


def _draw_group(
    top: Axes, bottom: Axes, words: str, histories: Sequence[History], colour: str, dashes: str
) -> None:
    at = np.unique(np.concatenate([history["evaluations"] for history in histories]))
    best = np.array([_best_at(history, at) for history in histories])
    # A run without GOAL counts as infinitely slow, so its lack pulls the median up and does not drop out.
    low, middle, high = (_finite(quantile(best, q, axis=0)) for q in (0.25, 0.5, 0.75))
    top.plot(at, middle, color=colour, linestyle=dashes, label=words, drawstyle="steps-post")
    if len(histories) > 1:
        top.fill_between(
            at, low, np.where(np.isnan(high), middle, high), color=colour, alpha=0.18, step="post", lw=0
        )
    solved = 100 * np.mean(np.isfinite(best), axis=0)
    bottom.plot(at, solved, color=colour, linestyle=dashes, drawstyle="steps-post")


def _best_at(history: History, evaluations: Series) -> Series:
    """Return a run's best at each count of evaluations; inf before GOAL, and its last best after its end."""
    index = np.searchsorted(history["evaluations"], evaluations, side="right") - 1
    best = np.minimum.accumulate(np.where(history["best"] < UNSOLVED, history["best"], np.inf))
    return np.where(index >= 0, best[np.maximum(index, 0)], np.inf)


def _finite(values: Series) -> Series:
    return np.where(np.isfinite(values), values, np.nan)


def _fit(axes: Axes, references: list[float]) -> None:
    """Leave room above and below what is drawn."""
    drawn = [y for line in axes.get_lines() for y in np.asarray(line.get_ydata(), float) if np.isfinite(y)]
    seen = [*drawn, *references] or [0.0, 60.0]
    room = max(max(seen) - min(seen), 1.0)
    axes.set_ylim(max(min(seen) - 0.08 * room, 0.0), max(seen) + 0.16 * room)
