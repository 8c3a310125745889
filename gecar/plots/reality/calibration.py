"""A calibration in one picture: the constants with their intervals, and the misfit before and after."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from gecar.plots.style import (
    BLUE,
    FAINT,
    INK,
    LIGHT,
    SOFT,
    VERMILION,
    headline,
    log_ticks,
    look,
    new_figure,
)
from gecar.reality.calibrate.calibration import Calibration, FittedConstant, UnknownConstant
from gecar.reality.calibrate.identifiability import BLIND

ROW_IN = 0.27
_POSE = ("x_m", "y_m", "heading_deg")
_ANGLES = ("left_angle_deg", "right_angle_deg")


def calibration_figure(result: Calibration) -> Figure:
    """Draw a calibration."""
    rows = max(len(result.fitted) + len(_doubtful(result)), len(result.recordings), 4)
    with look():
        figure = new_figure(11.0, ROW_IN * rows + 1.7)
        held = "the last part" if result.by_time else ", ".join(result.held)
        headline(
            figure,
            f"Calibrated on {result.case}",
            f"fitted on {len(result.fitted_on)} recordings, judged on {held}",
        )
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
        _constants(left, result)
        _misfits(right, result)
        figure.draw_without_rendering()  # names beside axes need a pass more to find their place
    return figure


def _doubtful(result: Calibration) -> list[UnknownConstant]:
    """Return the constants that affect these recordings but cannot be determined from them."""
    return [unknown for unknown in result.unknown if unknown.why != BLIND]


def _constants(axes: Axes, result: Calibration) -> None:
    """Draw each constant's interval, as a change from nominal in steps worth a name."""
    axes.set_title("Constants, 95 % intervals")
    names = []
    for row, fitted in enumerate(result.fitted):
        at, low, high = (_steps(fitted, v) for v in (fitted.value, fitted.low, fitted.high))
        axes.plot([low, high], [row, row], color=BLUE, linewidth=4.0, alpha=0.45)
        axes.plot(at, row, "o", color=BLUE, markersize=5)
        names.append(
            f"{fitted.constant.words}  {fitted.rounded(fitted.value)} {fitted.constant.unit}".removesuffix(
                " -"
            )
        )
    count = len(names)
    for row, unknown in enumerate(_doubtful(result), start=count):
        names.append(f"{unknown.constant.words}")
        axes.text(0.02, row, unknown.why, color=SOFT, size=7.5, va="center",
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.axvline(0.0, color=SOFT, linewidth=0.9)
    axes.set_xscale("symlog", linthresh=1.0)
    reach = 1.3 * max([abs(_steps(f, v)) for f in result.fitted for v in (f.low, f.high)], default=1.0)
    axes.set_xlim(-max(reach, 2.0), max(reach, 2.0))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:+g}" if value else "0"))
    axes.set_xlabel("change from nominal [smallest change worth naming]")
    _rows(axes, names, [INK] * count + [SOFT] * len(_doubtful(result)))


def _misfits(axes: Axes, result: Calibration) -> None:
    """Draw the misfit of each recording before and after."""
    axes.set_title("Misfit of whole replays")
    pairs = {name: _mean(columns) for name, columns in result.recordings.items()}
    shown = {name: pair for name, pair in pairs.items() if pair is not None}
    for row, (name, (before, after)) in enumerate(shown.items()):
        if name in result.held:
            axes.axhspan(row - 0.5, row + 0.5, color=LIGHT, zorder=0, linewidth=0)
        axes.plot([before, after], [row, row], color=FAINT, linewidth=3.0, zorder=1)
        axes.plot(before, row, "o", color=VERMILION, markersize=5, label="before" if row == 0 else None)
        axes.plot(after, row, "o", color=BLUE, markersize=5, label="after" if row == 0 else None)
    axes.set_xscale("log")
    log_ticks(axes.xaxis)
    axes.set_xlabel("NRMSE of angles and pose   (yellow: held out)")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2, handletextpad=0.1)
    _rows(axes, list(shown), [INK] * len(shown))


def _mean(columns: object) -> tuple[float, float] | None:
    """Return the root mean square misfit over angles and pose, None where neither moved."""
    assert isinstance(columns, dict)
    kept = [m for name, m in columns.items() if name in _ANGLES + _POSE]
    if not kept:
        return None
    before, after = (
        float(np.sqrt(np.mean([getattr(m, when) ** 2 for m in kept]))) for when in ("before", "after")
    )
    return max(before, 1e-5), max(after, 1e-5)


def _steps(fitted: FittedConstant, value: float) -> float:
    return (value - fitted.nominal) / fitted.constant.step


def _rows(axes: Axes, names: list[str], colours: list[str]) -> None:
    axes.set_yticks(range(len(names)), names)
    for label, colour in zip(axes.get_yticklabels(), colours, strict=True):
        label.set_color(colour)
    axes.set_ylim(max(len(names), 1) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
