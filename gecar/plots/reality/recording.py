"""A recording in one picture: the way on the floor, and every channel over time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.courses.course import draw_course
from gecar.plots.style import BLUE, ORANGE, VERMILION, headline, look, new_figure
from gecar.reality.recordings.recording import Recording
from gecar.world.course.course import load_course

Array = npt.NDArray[np.float64]
_PANELS = (
    ("commands [%]", (("left_duty", 100.0), ("right_duty", 100.0))),
    ("wheels [deg]", (("left_angle_rad", 180.0 / np.pi), ("right_angle_rad", 180.0 / np.pi))),
    ("light [%]", (("reflection_pct", 1.0),)),
    ("heading [deg]", (("heading_rad", 180.0 / np.pi),)),
    ("turning [deg/s]", (("yaw_rate_rad_s", 180.0 / np.pi),)),
    ("battery [V]", (("battery_v", 1.0),)),
)


def recording_figure(recording: Recording) -> Figure:
    """Draw a recording: what was measured, and where the robot was if a camera saw it."""
    shown = [
        (title, kept)
        for title, columns in _PANELS
        if (kept := [(c, f) for c, f in columns if not np.isnan(getattr(recording, c)).all()])
    ]
    mapped = {"x_m", "y_m"} <= set(recording.measured)
    with look():
        figure = new_figure(9.0, 0.9 + (3.4 if mapped else 0.0) + 1.1 * len(shown))
        headline(figure, recording.name, _detail(recording))
        ratios = [3.4] * mapped + [1.1] * len(shown)
        rows = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)[:, 0]
        if mapped:
            _map(rows[0], recording)
        for axes, (title, columns) in zip(rows[mapped:], shown, strict=True):
            for column, factor in columns:
                colour = ORANGE if column.startswith("right") else BLUE
                _line(axes, recording.t_s, factor * getattr(recording, column), colour, column)
            axes.set_ylabel(title)
            axes.set_xlim(recording.t_s[0], recording.t_s[-1])
            if len(columns) > 1:
                axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        rows[-1].set_xlabel("time [s]")
    return figure


def _detail(recording: Recording) -> str:
    setup = recording.setup
    where = "on a bench" if setup.rig == "bench" else f"course {setup.course}"
    return f"{recording.duration_s:.1f} s · {len(recording.t_s)} rows · robot {setup.robot} · {where}"


def _line(axes: Axes, t_s: Array, values: Array, colour: str, column: str) -> None:
    """Draw a series where it has samples; commands are held until the next."""
    seen = ~np.isnan(values)
    style = "steps-post" if column.endswith("duty") else "default"
    axes.plot(
        t_s[seen], values[seen], color=colour, linewidth=1.2, drawstyle=style, label=column.partition("_")[0]
    )


def _map(axes: Axes, recording: Recording) -> None:
    course = recording.setup.course
    if course != "none" and recording.setup.rig == "floor":
        draw_course(axes, load_course(course))
    else:
        axes.set_aspect("equal")
    seen = ~np.isnan(recording.x_m) & ~np.isnan(recording.y_m)
    axes.plot(recording.x_m[seen], recording.y_m[seen], color=VERMILION, linewidth=1.8, zorder=4.0)
