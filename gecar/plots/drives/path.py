"""A drive's path on a course, coloured by the line of the program that drives, or by speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, to_rgb

from gecar.plots.style import CYCLE, PAPER, SOFT, SPEED_COLOURS

Series = npt.NDArray[np.float64]
Trace = Mapping[str, Series]


def speed_of(trace: Trace) -> Series:
    """Return the speed of the axle's centre [m/s], shape (samples,)."""
    if len(trace["t_s"]) < 2:
        return np.zeros(len(trace["t_s"]))
    return np.asarray(
        np.hypot(np.gradient(trace["x_m"], trace["t_s"]), np.gradient(trace["y_m"], trace["t_s"]))
    )


def line_colours(trace: Trace) -> dict[int, str]:
    """Give each line of the program a colour: up to seven distinct colours, beyond that a gradient."""
    lines = [int(line) for line in np.unique(trace["line"]) if line > 0]
    if len(lines) <= len(CYCLE):
        return dict(zip(lines, CYCLE, strict=False))
    gradient = mpl.colormaps[SPEED_COLOURS](np.linspace(0.0, 0.95, len(lines)))
    return {line: mpl.colors.to_hex(colour) for line, colour in zip(lines, gradient, strict=True)}


@dataclass(frozen=True)
class Colouring:
    """Colours of a drive's samples.

    Attributes
    ----------
    rgb
        Colour of each sample, shape (samples, 3).
    lines
        Colour of each line of the program, empty where speed gives the colours.
    """

    rgb: Series
    lines: Mapping[int, str]


def by_line(trace: Trace) -> Colouring:
    """Colour by the line of the program that drives."""
    lines = line_colours(trace)
    return Colouring(
        np.array([to_rgb(lines.get(int(line), SOFT)) for line in trace["line"]]).reshape(-1, 3), lines
    )


def by_speed(trace: Trace, top: float) -> Colouring:
    """Colour by speed, up to ``top`` [m/s]."""
    colours = mpl.colormaps[SPEED_COLOURS](Normalize(0.0, top)(speed_of(trace)))
    return Colouring(np.asarray(colours[:, :3]), {})


def draw_path(axes: Axes, trace: Trace, colouring: Colouring) -> LineCollection:
    """Draw the axle's way on a course's axes [m], with a white seam to stand out from the line below."""
    points = np.column_stack((trace["x_m"], trace["y_m"]))
    axes.plot(*points.T, color=PAPER, linewidth=3.6, alpha=0.85, zorder=4, solid_capstyle="round")
    pieces = np.stack((points[:-1], points[1:]), axis=1)
    path = LineCollection(list(pieces), colors=colouring.rgb[:-1], linewidths=2.2, zorder=5, capstyle="round")
    axes.add_collection(path, autolim=False)
    return path


def every_distance(trace: Trace, spacing: float) -> npt.NDArray[np.int64]:
    """Return samples a distance apart along the way [m], the last one included."""
    steps = np.hypot(np.diff(trace["x_m"]), np.diff(trace["y_m"]))
    way = np.concatenate(([0.0], np.cumsum(steps)))
    at = np.searchsorted(way, np.arange(0.0, way[-1], spacing))
    last = len(way) - 1
    return np.unique(np.append(at[at < last], last))
