"""The posterior as a picture: what each unknown may have been, before and after the paper's figures are known."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.paper_robot.prior import UNKNOWNS, Floats, Unknown, from_unit
from gecar.plots.style import BLUE, FAINT, INK, ORANGE, headline, look, new_figure

BINS = 16


def marginals(
    possible: Floats, posterior: Floats, shipped: dict[str, float], title: str, detail: str
) -> Figure:
    """Draw each unknown's prior, what reaches GOAL at all, and what does so in the paper's time.

    Parameters
    ----------
    possible, posterior
        Points of the unit cube, shape (n, unknowns).
    shipped
        The shipped robot's values by name, SI.
    title, detail
        What to write above.
    """
    with look():
        figure = new_figure(10.5, 7.4)
        headline(figure, title, detail)
        axes = figure.subplots(3, 4).ravel()
        for k, (unknown, each) in enumerate(zip(UNKNOWNS, axes, strict=False)):
            _marginal(each, unknown, from_unit(possible)[:, k], from_unit(posterior)[:, k])
            if unknown.name in shipped:
                each.axvline(shipped[unknown.name] * unknown.scale, color=INK, linewidth=1.4)
        _key(axes[-1])
    return figure


def _marginal(axes: Axes, unknown: Unknown, possible: Floats, posterior: Floats) -> None:
    ends = unknown.low * unknown.scale, unknown.high * unknown.scale
    bins = np.geomspace(*ends, BINS + 1) if unknown.logarithmic else np.linspace(*ends, BINS + 1)
    axes.set_title(f"{unknown.name.replace('_', ' ')} [{unknown.unit}]")
    if unknown.name == "regulated":
        axes.set_title("motors")
        shares = [
            [np.mean((values >= 0.5) == mode) for mode in (False, True)] for values in (possible, posterior)
        ]
        axes.bar([0, 1], [0.5, 0.5], 0.9, color=FAINT)
        axes.bar([-0.15, 0.85], shares[0], 0.28, color=BLUE)
        axes.bar([0.15, 1.15], shares[1], 0.28, color=ORANGE)
        axes.set_xticks([0, 1], ["share of duty", "regulated"])
    else:
        axes.fill_between(ends, 1.0 / BINS, color=FAINT)
        for values, colour in ((possible, BLUE), (posterior, ORANGE)):
            counts, _ = np.histogram(values * unknown.scale, bins)
            axes.stairs(counts / len(values), bins, color=colour, linewidth=1.6)
        if unknown.logarithmic:
            axes.set_xscale("log")
        axes.set_xlim(*ends)
    axes.set_yticks([])
    axes.grid(visible=False)


def _key(axes: Axes) -> None:
    axes.set_axis_off()
    axes.fill_between([], [], color=FAINT, label="prior")
    axes.plot([], color=BLUE, label="reaches GOAL in four turns")
    axes.plot([], color=ORANGE, label="and in 16.74 ± 0.05 s")
    axes.plot([], color=INK, linewidth=1.4, label="the robot that ships")
    axes.legend(loc="center left", fontsize=9)
