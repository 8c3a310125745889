"""What a run's populations were like: size and depth of the derivations, how much the programs differ, and how many."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gecar.plots.style import BLUE, GREEN, ORANGE, PURPLE, SOFT, VERMILION, headline, look, new_figure

_PANELS = (
    ("size", "mean choices\nof a derivation", BLUE),
    ("depth", "mean depth\n[nonterminals]", GREEN),
    ("entropy", "entropy of the\nprograms [bits]", PURPLE),
)


def population_figure(
    history: Mapping[str, npt.NDArray[np.float64]], population: int, title: str = "", detail: str = ""
) -> Figure:
    """Draw a run's populations.

    Parameters
    ----------
    history
        Columns of ``history.csv``, each (generations,): generation, size, depth, entropy, valid, distinct.
    population
        Individuals in each; its logarithm bounds the entropy.
    title, detail
        What to write above.
    """
    marker = "." if len(history["size"]) < 3 else None
    with look():
        figure = new_figure(8.0, 7.0)
        headline(figure, title, detail)
        *panels, shares = figure.subplots(len(_PANELS) + 1, 1, sharex=True)
        for axes, (column, words, colour) in zip(panels, _PANELS, strict=True):
            axes.plot(history["generation"], history[column], color=colour, marker=marker)
            axes.set_ylabel(words)
            axes.set_ylim(bottom=0.0)
        _bound(panels[-1], math.log2(population))
        for column, colour in (("valid", ORANGE), ("distinct", VERMILION)):
            shares.plot(
                history["generation"], 100.0 * history[column], color=colour, marker=marker, label=column
            )
        shares.legend(loc="lower right", ncols=2)
        shares.set(xlabel="generation", ylabel="share of the\npopulation [%]", ylim=(0.0, 108.0))
        shares.xaxis.set_major_locator(MaxNLocator(integer=True, steps=(1, 2, 5, 10)))
    return figure


def _bound(axes: Axes, most: float) -> None:
    """Mark the greatest entropy."""
    axes.axhline(most, color=SOFT, linewidth=0.8, linestyle=":")
    axes.annotate(
        "all programs differ",
        (1.0, most),
        (-2, 2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        va="bottom",
        size=7,
        color=SOFT,
    )
    axes.set_ylim(0.0, 1.15 * most + 0.1)
