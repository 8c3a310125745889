"""How genotypes relate to phenotypes: what a mutation changes, where in the genome, how many share a phenotype."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.evolution.representation import INVALID, Representation
from gecar.plots.style import BLUE, ORANGE, headline, log_ticks, look, new_figure

_BINS = ((0, 0), (1, 1), (2, 2), (3, 4), (5, 8), (9, 16), (17, 32), (33, 10**9))
_NAMES = ("0", "1", "2", "3-4", "5-8", "9-16", "17-32", "> 32", "invalid")
_PARTS = 10
_FEW = 20
"""Changes below which a part of the genome has no mean."""


def representation_figure(groups: Mapping[str, Representation], title: str = "", detail: str = "") -> Figure:
    """Draw locality and redundancy of one or two groups of genomes.

    Parameters
    ----------
    groups
        What was measured, by what the genomes are.
    title, detail
        What to write above it.
    """
    with look():
        figure = new_figure(9.0, 6.2)
        headline(figure, title, detail)
        parts = figure.add_gridspec(2, 2)
        left = figure.add_subplot(parts[0, :])
        middle, right = (figure.add_subplot(parts[1, k]) for k in range(2))
        for k, (name, each) in enumerate(groups.items()):
            colour = (BLUE, ORANGE)[k % 2]
            _draw_distances(left, each, k, len(groups), colour, name)
            _draw_places(middle, each, colour)
            _draw_counts(right, each, colour)
        left.set_xticks(range(len(_NAMES)), _NAMES)
        left.set(xlabel="words by which one changed codon changes the phenotype", ylabel="mutants [%]")
        left.grid(visible=False, axis="x")
        left.legend(loc="upper right")
        middle.set(
            xlabel="place of the changed codon among those used", ylabel="mean words, where any change"
        )
        middle.set(xlim=(0.0, 1.0), ylim=(0.0, None))
        right.set(xscale="log", yscale="log", xlabel="phenotype, by frequency", ylabel="genomes with it [%]")
        log_ticks(right.xaxis)
        log_ticks(right.yaxis)
    return figure


def representation_title(each: Representation) -> str:
    """Say in a line what was found."""
    if not len(each.distances):
        return "No genome maps to a phenotype"
    figures = each.figures()
    same, one_word = 100.0 * figures["neutral"], 100.0 * figures["one_word"]
    return f"One codon changed: {same:.0f} % the same phenotype, {one_word:.0f} % one word"


def _draw_distances(axes: Axes, each: Representation, k: int, of: int, colour: str, name: str) -> None:
    distances, n = each.distances, max(len(each.distances), 1)
    shares = [((distances >= low) & (distances <= high)).sum() / n for low, high in _BINS]
    shares.append((distances == INVALID).sum() / n)
    width = 0.8 / of
    places = np.arange(len(shares)) + (k - 0.5 * (of - 1)) * width
    bars = axes.bar(places, 100.0 * np.array(shares), width, color=colour, label=f"{name}: {_used(each)}")
    axes.bar_label(bars, [f"{100.0 * share:.1f}" for share in shares], size=7, padding=1)


def _used(each: Representation) -> str:
    used = f"{np.median(each.used):,.0f}" if each.used.size else "none"
    return f"{used} of {each.length:,} codons used"


def _draw_places(axes: Axes, each: Representation, colour: str) -> None:
    """Draw the mean distance of mutants that differ, by tenths of the codons used."""
    changed = each.distances > 0
    parts = np.minimum((each.places[changed] * _PARTS).astype(int), _PARTS - 1)
    means = np.array([_mean(each.distances[changed][parts == part]) for part in range(_PARTS)])
    axes.plot((np.arange(_PARTS) + 0.5) / _PARTS, means, marker=".", color=colour)


def _mean(distances: npt.NDArray[np.int32]) -> float:
    return float(distances.mean()) if distances.size >= _FEW else float("nan")


def _draw_counts(axes: Axes, each: Representation, colour: str) -> None:
    ranks = np.arange(1, len(each.counts) + 1)
    dots = "." if len(ranks) < 3 else ""
    axes.step(ranks, 100.0 * each.counts / each.genomes, where="mid", color=colour, marker=dots)
