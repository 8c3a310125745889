"""Where a program still arrives: a panel for each condition, the share of drives at GOAL over how far it is off."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.style import BLUE, LIGHT, SOFT, headline, look, new_figure
from gecar.search.robustness import ENOUGH, Sweep

COLUMNS = 3


def robustness_figure(sweeps: Sequence[Sweep], title: str = "", detail: str = "") -> Figure:
    """Draw sweeps.

    Parameters
    ----------
    sweeps
        What to draw, a panel each.
    title, detail
        What to write above and below.
    """
    rows = -(-len(sweeps) // COLUMNS)
    figure = new_figure(9.6, 1.1 + 2.3 * rows)
    with look():
        headline(figure, title, detail)
        for number, sweep in enumerate(sweeps):
            axes = figure.add_subplot(rows, COLUMNS, number + 1)
            _panel(axes, sweep)
            if number % COLUMNS == 0:
                axes.set_ylabel("drives at GOAL [%]")
    return figure


def _panel(axes: Axes, sweep: Sweep) -> None:
    condition = sweep.condition
    if sweep.range is not None:
        axes.axvspan(*sweep.range, color=LIGHT, linewidth=0)
    axes.axhline(100.0 * ENOUGH, color=SOFT, linewidth=0.6, linestyle=(0, (4, 3)))
    axes.axvline(sweep.nominal, color=SOFT, linewidth=1.0)
    axes.plot(condition.levels, 100.0 * sweep.shares, "o-", color=BLUE, markersize=3.5)
    axes.set_xlabel(f"{condition.title}{f' [{condition.unit}]' if condition.unit else ''}")
    axes.set_ylim(-4.0, 104.0)
    axes.margins(x=0.03)
