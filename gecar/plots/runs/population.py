"""What a run's populations were like: size and depth of the derivations, and how much the programs differ."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gecar.plots.style import BLUE, GREEN, PURPLE, SOFT, headline, look, new_figure

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
        Columns of ``history.csv``, each (generations,): generation, size, depth, entropy.
    population
        Individuals in each; its logarithm bounds the entropy.
    title, detail
        What to write above.
    """
    with look():
        figure = new_figure(8.0, 5.6)
        headline(figure, title, detail)
        panels = figure.subplots(len(_PANELS), 1, sharex=True)
        for axes, (column, words, colour) in zip(panels, _PANELS, strict=True):
            axes.plot(
                history["generation"],
                history[column],
                color=colour,
                marker="." if len(history["size"]) < 3 else None,
            )
            axes.set_ylabel(words)
            axes.set_ylim(bottom=0.0)
        most = math.log2(population)
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
        axes.set_xlabel("generation")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=(1, 2, 5, 10)))
    return figure
