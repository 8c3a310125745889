"""Time series of a drive: sensor reading, motor commands, wheel speeds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from gecar.language import opcodes as op
from gecar.plots.drives.path import Colouring, Trace
from gecar.plots.style import INK, PALE, SOFT

HEIGHT_RATIOS = (0.22, 1.0, 1.0, 1.0)


def draw_traces(axes: list[Axes], trace: Trace, colouring: Colouring, opcodes: npt.NDArray[np.int32]) -> None:
    """Draw a drive's traces on four axes, top to bottom: colours as on the map, sensor, duty, wheel speed."""
    strip, sensor, duty, speed = axes
    t = trace["t_s"]
    _strip(strip, t, colouring)
    sensor.plot(t, trace["reflection_pct"], color=INK, linewidth=1.0)
    for threshold in _thresholds(opcodes):
        sensor.axhline(threshold, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
    sensor.set(ylabel="sensor [%]", ylim=(-6, 106), yticks=(0, 50, 100))
    _pair(duty, t, 100 * trace["left_duty"], 100 * trace["right_duty"], "steps-post")
    duty.set(ylabel="duty [%]", ylim=(-112, 112), yticks=(-100, 0, 100))
    _pair(speed, t, _rate(t, trace["left_angle_rad"]), _rate(t, trace["right_angle_rad"]))
    speed.set(ylabel="wheel [°/s]", xlabel="time [s]")
    duty.legend(loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.18), borderaxespad=0.0)
    for each in axes:
        each.set_xlim(0.0, max(float(t[-1]), 0.01))
        each.tick_params(labelbottom=each is speed)


def _strip(axes: Axes, t: npt.NDArray[np.float64], colouring: Colouring) -> None:
    axes.imshow(
        colouring.rgb[None],
        extent=(0.0, max(float(t[-1]), 0.01), 0.0, 1.0),
        aspect="auto",
        interpolation="nearest",
    )
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.tick_params(bottom=False)
    axes.set_ylabel("line" if colouring.lines else "speed", rotation=0, ha="right", va="center")
    axes.spines[:].set_visible(False)


def _pair(
    axes: Axes,
    t: npt.NDArray[np.float64],
    left: npt.NDArray[np.float64],
    right: npt.NDArray[np.float64],
    drawn: str = "default",
) -> None:
    """Draw both sides in black and grey: colours stand for the program's lines."""
    axes.plot(t, left, color=INK, linewidth=1.2, drawstyle=drawn, label="left")
    axes.plot(t, right, color=PALE, linewidth=1.2, drawstyle=drawn, label="right")


def _rate(t: npt.NDArray[np.float64], angle: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the rate of an angle [rad] in degrees per second."""
    return np.degrees(np.gradient(angle, t)) if len(t) > 1 else np.zeros(len(t))


def _thresholds(opcodes: npt.NDArray[np.int32]) -> list[float]:
    """Return the readings a program compares with [%], each once."""
    tests = opcodes[opcodes[:, op.OP] == op.TEST]
    return [float(c) / op.THRESHOLDS_PER_PCT for c in np.unique(tests[:, op.C])]
