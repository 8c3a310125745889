"""Simulation and recordings in one picture: paths, arrival times, displacement over time, misfit of each channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle, islice, takewhile
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from gecar.plots.courses.course import draw_course
from gecar.plots.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PAPER,
    PURPLE,
    SKY,
    SOFT,
    VERMILION,
    headline,
    log_ticks,
    look,
    new_figure,
)
from gecar.reality.compare.gap import CHANNELS, Gap, Path, Trial
from gecar.results.arrival import with_share
from gecar.world.rollout import Outcome

TRIAL_COLOURS = (VERMILION, BLUE, GREEN, ORANGE, PURPLE, SKY)
DASHES = ((0, (4, 1.6)), (0, (1.4, 1.2)), (0, (6, 1.4, 1.4, 1.4)), (0, (3, 1)))
WIDTH_IN = 11.0
MAP_IN = 7.4
LONGEST_NAME = 14  # characters
MOST_NAMED = 12  # recordings in a legend
ROW_IN = 0.22  # of an arrival time


def gap_figure(found: Gap, title: str = "", detail: str = "") -> Figure:
    """Draw trials and their simulation.

    Parameters
    ----------
    found
        What to draw.
    title, detail
        What to write above and below.
    """
    course = found.course
    height = min(max(MAP_IN * (course.height_m / course.width_m if course else 0.6), 2.8), 6.5)
    with look():
        below = max(2.6, ROW_IN * len(found.trials))
        figure = new_figure(WIDTH_IN, height + below + 1.1)
        headline(figure, title, detail)
        grid = figure.add_gridspec(2, 12, height_ratios=(height, below))
        _paths(figure.add_subplot(grid[0, :9]), found)
        _misfits(figure.add_subplot(grid[0, 9:]), found.trials)
        _displacements(figure.add_subplot(grid[1, :8]), found)
        _times(figure.add_subplot(grid[1, 9:]), found)
    return figure


def _styles(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """Give each trial a colour, and beyond six also another dash."""
    colours = islice(cycle(TRIAL_COLOURS), len(trials))
    return [
        {"color": colour, "linestyle": DASHES[(k // len(TRIAL_COLOURS)) % len(DASHES)]}
        for k, colour in enumerate(colours)
    ]


def short_names(names: Sequence[str]) -> list[str]:
    """Shorten names of recordings to the words that tell them apart, or to their ends; numbers where that fails."""
    if max(map(len, names)) <= LONGEST_NAME:
        return list(names)
    words = [name.split("_") for name in names]
    shared = sum(1 for _ in takewhile(lambda each: len(set(each)) == 1, zip(*words, strict=False)))
    apart = ["_".join(each[shared if len(names) > 1 else 0 :]) for each in words]
    short = [name if len(name) <= LONGEST_NAME else f"…{name[1 - LONGEST_NAME :]}" for name in apart]
    return short if len(set(short)) == len(short) else [f"{k}" for k in range(1, len(names) + 1)]


def _paths(axes: Axes, found: Gap) -> None:
    """Draw the ways over the course, as in the paper's Fig. 9: simulation solid, recordings broken."""
    _floor(axes, found)
    whole, many = slice(None), len(found.trials) > MOST_NAMED
    names = short_names([trial.name for trial in found.trials])
    if many:
        names = [f"{len(names)} recordings", *("_nolegend_" for _ in names[1:])]
    for trial, style, name in zip(found.trials, _styles(found.trials), names, strict=True):
        end = np.searchsorted(trial.path.t_s, trial.arrival_s, side="right")
        until = slice(None, max(int(end), 2))
        _way(axes, trial.path, until, linewidth=1.5, zorder=4, label=name, **style)
        if found.simulated_s is None:
            thin = {"linewidth": 1.2, "zorder": 3.9, "alpha": 0.6}
            _way(axes, trial.simulated, whole, color=style["color"], **thin)
    if found.simulated_s is not None:
        bold = {"linewidth": 2.0, "zorder": 5, "label": "simulation"}
        _way(axes, found.trials[0].simulated, whole, color=INK, **bold)
    else:
        axes.plot([], [], color=SOFT, linewidth=1.2, label="thin: its commands replayed")
    axes.legend(
        loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=min(5, len(found.trials) + 1), handlelength=2.6
    )


def _floor(axes: Axes, found: Gap) -> None:
    """Draw the course under a veil: the paths matter here, not the line."""
    if found.course is None:
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.set_aspect("equal", adjustable="datalim")
        return
    draw_course(axes, found.course)
    size = found.course.width_m, found.course.height_m
    axes.add_patch(Rectangle((0, 0), *size, facecolor=PAPER, alpha=0.6, zorder=2.5))


def _way(axes: Axes, path: Path, part: slice, **style: Any) -> None:
    x, y = path.x_m[part], path.y_m[part]
    axes.plot(x, y, color=PAPER, linewidth=3.4, alpha=0.5, zorder=3.5, scalex=False, scaley=False)
    axes.plot(x, y, **style)


def _displacements(axes: Axes, found: Gap) -> None:
    """Draw how far recorded and simulated positions are apart over time, as in Fig. 10."""
    axes.set_title("Displacement between simulation and recording")
    for trial, style in zip(found.trials, _styles(found.trials), strict=True):
        axes.plot(trial.t_s, trial.displacement_m, linewidth=1.3, **style)
    if len(found.trials) > 1:
        longest = max((t.t_s for t in found.trials), key=len)
        shortest = min(len(t.t_s) for t in found.trials)
        mean = np.mean([t.displacement_m[:shortest] for t in found.trials], axis=0)
        axes.plot(longest[:shortest], mean, color=INK, linewidth=2.0, label="mean")
        axes.legend(loc="upper left")
    axes.set(xlabel="time [s]", ylabel="[m]")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)


def _times(axes: Axes, found: Gap) -> None:
    """Draw arrival times and the simulation's, Table 6 as a picture."""
    axes.set_title("Arrival time [s]")
    names = short_names([trial.name for trial in found.trials])
    for row, (trial, style) in enumerate(zip(found.trials, _styles(found.trials), strict=True)):
        face = str(style["color"]) if trial.arrived else PAPER
        axes.plot(trial.arrival_s, row, "o", color=style["color"], markerfacecolor=face, markersize=6)
        words = f"{trial.arrival_s:.2f}" + (
            f"  {trial.error_pct:+.1f} %"
            if not np.isnan(trial.error_pct)
            else ""
            if trial.arrived
            else "  ended"
        )
        axes.annotate(words, (trial.arrival_s, row), (6, 0), textcoords="offset points", size=7, va="center")
    if found.simulated_s is not None:
        arrived = found.outcome == Outcome.GOAL
        words = f"line: simulation {with_share(found.simulated_s, found.share)}"
        words += "" if arrived else ", not at GOAL"
        axes.axvline(found.simulated_s, color=INK, linewidth=1.6, linestyle="-" if arrived else (0, (2, 2)))
        axes.set_xlabel(words, size=7.5, loc="right")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.7)
    axes.margins(x=0.5)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")


def _misfits(axes: Axes, trials: Sequence[Trial]) -> None:
    """Draw the NRMSE of each channel: every trial a dot, their mean a line."""
    axes.set_title("Misfit of each channel")
    columns = [c for c in CHANNELS.values() if any(c in t.closed_loop or c in t.open_loop for t in trials)]
    kinds = (("closed loop", INK, -0.16, "closed_loop"), ("commands replayed", SKY, 0.16, "open_loop"))
    for label, colour, shift, name in kinds:
        misfits: list[Mapping[str, float]] = [getattr(trial, name) for trial in trials]
        for row, column in enumerate(columns):
            values = [m[column] for m in misfits if column in m]
            if values:
                axes.plot(values, [row + shift] * len(values), "o", color=colour, markersize=3, alpha=0.6)
                axes.plot([np.mean(values)] * 2, [row + shift - 0.14, row + shift + 0.14], color=colour)
        if any(misfits):
            axes.plot([], [], "o", color=colour, label=label, markersize=4)
    axes.set_yticks(range(len(columns)), [c.replace("_", " ").rsplit(" ", 1)[0] for c in columns])
    axes.set_ylim(len(columns) - 0.4, -0.6)
    axes.set_xscale("log")
    log_ticks(axes.xaxis)
    axes.axvline(1.0, color=SOFT, linewidth=0.8)
    axes.set_xlabel("NRMSE  (1: as bad as a constant)")
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.legend(loc="upper left", bbox_to_anchor=(-0.02, -0.2), handletextpad=0.1)
