"""Motors on a bench beside their simulation: angles apart over time, and speeds by duty."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.style import BLUE, INK, SOFT, SPEED_COLOURS, headline, look, new_figure
from gecar.reality.compare.bench import BenchGap, Shaft

MOST_NAMED = 6  # curves that carry their recording's name


def bench_figure(found: BenchGap, title: str = "", detail: str = "") -> Figure:
    """Draw shafts beside their simulation.

    Parameters
    ----------
    found
        What to draw.
    title, detail
        What to write above and below.
    """
    with look():
        figure = new_figure(11.0, 4.4)
        headline(figure, title, detail)
        held = [shaft for shaft in found.shafts if shaft.held_pct is not None]
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        _errors(left, found.shafts)
        if held:
            _speeds(right, held)
        else:
            _angles(right, max(found.shafts, key=lambda shaft: shaft.rms_deg))
    return figure


def _errors(axes: Axes, shafts: tuple[Shaft, ...]) -> None:
    """Draw how far simulated shafts are ahead, by colour of the largest command; names at the ends of the worst."""
    axes.set_title("Simulated less measured angle")
    colours = colormaps[SPEED_COLOURS]
    for shaft in shafts:
        most = float(np.max(np.abs(shaft.duty_pct))) / 100.0
        axes.plot(shaft.t_s, shaft.error_deg, color=colours(0.9 * (1.0 - most)), linewidth=1.3)
    worst = sorted(shafts, key=lambda shaft: -abs(shaft.end_deg))[:MOST_NAMED]
    room = max(float(np.ptp([shaft.end_deg for shaft in shafts])), 1e-9) / 14.0
    taken: list[float] = []
    for shaft in worst:
        if all(abs(shaft.end_deg - other) > room for other in taken):
            taken.append(shaft.end_deg)
            at, words = (shaft.t_s[-1], shaft.end_deg), f"{shaft.trial} {shaft.end_deg:+.0f}"
            axes.annotate(words, at, (4, 0), textcoords="offset points", size=7, va="center", color=SOFT)
    axes.axhline(0.0, color=INK, linewidth=0.8)
    axes.set(xlabel="time [s]   (dark: full duty, light: low duty)", ylabel="[deg]")
    axes.set_xlim(left=0.0)
    axes.margins(x=0.16)
    axes.set_xlim(left=0.0)


def _speeds(axes: Axes, shafts: list[Shaft]) -> None:
    """Draw settled speeds against the duty held."""
    axes.set_title("Speed over the second half")
    ordered = sorted(shafts, key=lambda shaft: shaft.held_pct or 0.0)
    duty = [shaft.held_pct or 0.0 for shaft in ordered]
    measured, simulated = np.array([shaft.speeds_dps for shaft in ordered]).T
    axes.plot(duty, simulated, "-", color=BLUE, linewidth=1.2, label="simulated")
    axes.plot(duty, simulated, "o", color=BLUE, markersize=3)
    axes.plot(duty, measured, "o", color=INK, markersize=6, markerfacecolor="none", label="measured")
    axes.set(xlabel="duty [%]", ylabel="[deg/s]")
    axes.legend(loc="upper left")


def _angles(axes: Axes, shaft: Shaft) -> None:
    """Draw one shaft's angle, measured and simulated."""
    axes.set_title(f"Angle, {shaft.trial}")
    axes.plot(shaft.t_s, shaft.measured_deg, color=INK, label="measured")
    axes.plot(shaft.t_s, shaft.simulated_deg, color=BLUE, linewidth=1.1, label="simulated")
    axes.set(xlabel="time [s]", ylabel="[deg]")
    axes.legend()
