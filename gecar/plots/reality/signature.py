"""An effect's signature: the same commands with it and without, in the channels where it shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from shapely.affinity import rotate, scale, translate

from gecar.plots.courses.course import draw_course, outline_patch
from gecar.plots.style import BLUE, INK, ORANGE, SKY, VERMILION, headline, look, new_figure
from gecar.reality.fitting.parameters import free
from gecar.reality.recordings.recording import make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.kernel import HEADING, LEFT_ANGLE, LEFT_SPEED, RIGHT_ANGLE, X, Y
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.replay.replayer import replayer_of
from gecar.world.course.course import Course
from gecar.world.effects import BY_ID, Effect
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]

ROW_S = 0.01
START = np.array([1.2, 0.62, 0.5 * np.pi])  # m, m, rad: the line of the paper's course lies ahead
QUIET_PCT = 0.5  # noise of a reading
LEAST_SPAN = 1.0  # of an axis [deg]: less is no signature
STEPS = 15.0  # sizes worth a name: large enough to see
# Held for 0.6 s each: from rest at small duty, reversals, full steps, spins, an arc and back.
DUTIES_PCT = (
    (8, 8),
    (0, 0),
    (40, 40),
    (-40, -40),
    (80, 80),
    (100, 100),
    (0, 0),
    (60, -60),
    (-60, 60),
    (70, 35),
    (-70, -35),
    (0, 0),
)
# Shapes and sizes that show what the neutral ones would hide; in each parameter's unit.
SHOWN: Mapping[str, Mapping[str, float]] = {
    "backlash": {"angle_deg": 12.0},
    "static_friction": {"extra_torque_nm": 0.04},
    "dead_band": {"duty_pct": 15.0},
    "torque_ripple": {"amplitude_nm": 0.04, "cycles_per_rev": 4.0},
    "slippery_patch": {"radius_m": 0.2, "x_m": 1.2, "y_m": 0.85, "coefficient": 0.03},
    "point_drag": {"force_n": 0.4, "left_m": 0.06, "off_axle_m": 0.02},
    "tyre_friction": {"coefficient": 0.1},
    "load_transfer": {"height_m": 0.12},
    "speed_limit": {"speed_rad_s": 7.0},
    "command_slew": {"rate_pct_s": 150.0},
    "spot_size": {"diameter_m": 0.04},
    "line_shift": {"dy_m": 0.03},
    "line_scale": {"scale": 0.95},
}  # fmt: skip


@dataclass(frozen=True)
class _Drive:
    """What robot and sensors did: times [s], rows as `gecar.reality.replay.kernel` lists them, and reflection [%]."""

    t: Array
    rows: Array
    reflection: Array


def shown_size(effect: Effect, robot: Robot) -> Mapping[str, float]:
    """Return parameters of an effect that are large enough to see."""
    if effect.id in SHOWN:
        return SHOWN[effect.id]
    c = free(robot, [effect.id]).coordinates[0]
    return {c.parameter.label: c.value(min(STEPS, 0.5 * c.bounds[1]) if c.bounds[1] > 1.0 else c.bounds[0])}


def signature_figure(effect_id: str, robot: Robot, course: Course) -> Figure:
    """Draw the same commands with an effect and without it.

    Parameters
    ----------
    effect_id
        Of the catalogue.
    robot, course
        Without the effect; its lines are what the colour sensor crosses.
    """
    effect = BY_ID[effect_id]
    values = shown_size(effect, robot)
    changed = robot.with_effects({effect_id: values})
    without, with_it = (_driven(r, course) for r in (robot, changed))
    sight = "sensor" in effect.channels
    figure = new_figure(10.0, 5.4)
    figure.set_layout_engine("constrained", w_pad=0.1)
    with look():
        grid = figure.add_gridspec(3, 2, width_ratios=(1.5, 1.0))
        traces = [figure.add_subplot(grid[k, 0]) for k in range(3)]
        _draw_traces(traces, without, with_it, sight)
        floor = figure.add_subplot(grid[:, 1])
        _draw_floor(floor, course, without, with_it)
        _draw_place(floor, course, changed)
        floor.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)
        sizes = ", ".join(f"{p.label} {values[p.label]:g}" for p in effect.parameters if p.label in values)
        headline(
            figure,
            f"{effect_id.replace('_', ' ')}: {effect.title}",
            f"{sizes}; it shows in {effect.signature}",
        )
    return figure


def _driven(robot: Robot, course: Course) -> _Drive:
    t = np.arange(0.0, 0.6 * len(DUTIES_PCT), ROW_S)
    duty = np.array(DUTIES_PCT, float)[np.minimum((t / 0.6 + 1e-9).astype(int), len(DUTIES_PCT) - 1)]
    frames = {"x_m": START[0], "y_m": START[1], "heading_deg": 90.0}
    columns = {"t_s": t, "left_duty_pct": duty[:, 0], "right_duty_pct": duty[:, 1]}
    columns |= {name: np.full(len(t), value) for name, value in frames.items()}
    replayer = replayer_of(make_recording("signature", columns, Setup(course="none", duty_cap=1.0)))
    rows, _, poses, _ = replayer.play(robot.physics, START)
    path = np.ascontiguousarray(rows[:, [X, Y, HEADING]])
    reflection = readings_along(replayer.t, path, 0.0, QUIET_PCT, course.surface, robot.physics, np.zeros(3))
    rows[:, [X, Y, HEADING]] = poses  # what a camera sees: late, where poses are
    return _Drive(replayer.t, rows, reflection)


def _draw_traces(traces: list[Axes], without: _Drive, with_it: _Drive, sight: bool) -> None:
    top, middle, bottom = traces
    for drive, colour, width, name in ((without, SKY, 3.5, "without"), (with_it, VERMILION, 1.2, "with it")):
        top.plot(drive.t, drive.rows[:, LEFT_SPEED], color=colour, linewidth=width, label=name)
        if sight:
            bottom.plot(drive.t, drive.reflection, color=colour, linewidth=width)
    change = with_it.rows - without.rows
    for column, colour, width, name in ((LEFT_ANGLE, BLUE, 3.0, "left"), (RIGHT_ANGLE, ORANGE, 1.2, "right")):
        middle.plot(without.t, np.degrees(change[:, column]), color=colour, linewidth=width, label=name)
    if not sight:
        bottom.plot(without.t, np.degrees(change[:, HEADING]), color=INK, linewidth=1.2)
    names = (
        "left shaft [rad/s]",
        "angles:\nchange [deg]",
        "reflection [%]" if sight else "heading:\nchange [deg]",
    )
    for axes, name in zip(traces, names, strict=True):
        axes.set(ylabel=name, xlim=(0.0, without.t[-1]))
        axes.tick_params(labelbottom=axes is bottom)
        low, high = axes.get_ylim()
        if high - low < LEAST_SPAN:
            axes.set_ylim(-0.5 * LEAST_SPAN, 0.5 * LEAST_SPAN)
    top.legend(loc="upper left", ncols=2)
    middle.legend(loc="upper left", ncols=2)
    bottom.set_xlabel("time [s]")


def _draw_place(axes: Axes, course: Course, robot: Robot) -> None:
    """Draw what an effect has on the floor: a slippery patch, or where the line lies."""
    own = robot.physics[0]
    if own["patch_radius"] > 0.0:
        centre = float(own["patch_x"]), float(own["patch_y"])
        patch = Circle(centre, float(own["patch_radius"]), color=VERMILION, alpha=0.2, linewidth=0)
        axes.add_patch(patch)
        patch.set_label("slippery")
    stretch = float(own["line_scale"])
    if own["line_dx"] or own["line_dy"] or own["line_angle"] or stretch != 1.0:
        printed = scale(course.line_area, stretch, stretch, origin=course.middle_m)
        turned = rotate(printed, float(own["line_angle"]), origin=(0, 0), use_radians=True)
        moved = translate(turned, float(own["line_dx"]), float(own["line_dy"]))
        line = outline_patch(moved, facecolor="none", edgecolor=VERMILION, linestyle="--", zorder=3.0)
        axes.add_patch(line)
        line.set_label("the line's place")


def _draw_floor(axes: Axes, course: Course, without: _Drive, with_it: _Drive) -> None:
    draw_course(axes, course, marks=False)
    # the wider one below stays in sight where both go the same way
    for drive, colour, width, name in ((without, SKY, 4.5, "without"), (with_it, VERMILION, 1.3, "with it")):
        axes.plot(drive.rows[:, X], drive.rows[:, Y], color=colour, linewidth=width, label=name)
        axes.plot(*drive.rows[-1, [X, Y]], "o", color=colour, markersize=4.0 + width)
    axes.plot(*START[:2], "s", color=INK, markersize=5)
    everywhere = np.vstack([without.rows[:, [X, Y]], with_it.rows[:, [X, Y]]])
    middle, half = (
        0.5 * (everywhere.min(axis=0) + everywhere.max(axis=0)),
        0.5 * np.ptp(everywhere, axis=0).max() + 0.08,
    )
    axes.set(
        xlim=middle[0] + np.array([-half, half]),
        ylim=middle[1] + np.array([-half, half]),
        aspect="equal",
        xlabel="x [m]",
        ylabel="y [m]",
        title="Path of the axle",
    )
