"""A motor's speed against its command: the paper's Figs 7 and 8."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.style import BLUE, INK, ORANGE, PURPLE, SKY, SOFT, VERMILION, headline, look, new_figure

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """A motor's settled speed [deg/s] at each level [%], both of shape (levels,)."""

    level_pct: Floats
    speed_deg_s: Floats


def motor_speed(
    regulated: Curve,
    powered: Curve,
    uncapped: Curve,
    bench: Mapping[str, Curve],
    cap_pct: float,
    title: str,
    detail: str,
) -> Figure:
    """Draw speed against speed input (Fig. 7) and against power (Fig. 8).

    Parameters
    ----------
    regulated, powered, uncapped
        The simulated motor: under speed commands, duty commands, and duty commands without the cap.
    bench
        Real motors by name, by power.
    cap_pct
        The cap on commands [%].
    title, detail
        What to write above.
    """
    with look():
        figure = new_figure(10.0, 4.9)
        headline(figure, title, detail)
        left, right = figure.subplots(1, 2, sharey=True)
        _limit(left, cap_pct, float(regulated.speed_deg_s.max()))
        left.plot(*_xy(regulated), "o-", color=BLUE, markersize=5, label="simulated")
        left.set(
            xlabel="speed command [%]",
            ylabel="speed [deg/s]",
            title="Speed command: 10 deg/s per percent (Fig. 7)",
        )
        _limit(right, cap_pct, float(powered.speed_deg_s.max()))
        right.plot(*_xy(uncapped), color=SKY, linestyle=":", label="simulated, without the cap")
        right.plot(*_xy(powered), "o-", color=BLUE, markersize=5, label="simulated")
        for (name, curve), colour, marker in zip(bench.items(), _COLOURS, "s^Dvx*", strict=False):
            right.plot(*_xy(curve), linestyle="none", marker=marker, color=colour, markersize=5, label=name)
        right.set(xlabel="duty: share of the supply [%]", title="Duty command (Fig. 8)")
        right.tick_params(labelleft=True)
        for axes in (left, right):
            axes.legend(loc="upper left")
    return figure


_COLOURS = (ORANGE, PURPLE, INK, VERMILION, SOFT, SKY)


def _xy(curve: Curve) -> tuple[Floats, Floats]:
    return curve.level_pct, curve.speed_deg_s


def _limit(axes: Axes, cap_pct: float, speed: float) -> None:
    """Draw the cap on commands, and the speed it comes to."""
    dashes = (0, (5, 3))
    axes.axvline(cap_pct, color=VERMILION, linewidth=1.0, linestyle=dashes)
    axes.axhline(speed, color=VERMILION, linewidth=1.0, linestyle=dashes)
    axes.annotate(
        f"limit: {cap_pct:g} %, {speed:.0f} deg/s", (cap_pct, 0.0), (-5, 6), textcoords="offset points",
        xycoords=("data", "axes fraction"), ha="right", size=8, color=VERMILION,
    )  # fmt: skip
