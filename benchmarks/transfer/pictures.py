"""Pictures of drives: where robots went on the course, and when they arrived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path as Outline
from shapely.geometry.base import BaseGeometry

from benchmarks.transfer.drives import ENGINES, Key
from benchmarks.transfer.driving import Drive
from benchmarks.transfer.floor import Floor, load_floor
from benchmarks.transfer.sealing import Winner
from benchmarks.transfer.table import NEAR, score, varied_drives
from gecar.plots.style import BLUE, FAINT, INK, LIGHT, SOFT, VERMILION, headline, look, new_figure, save

Path2D = npt.NDArray[np.float64]
GECAR = INK
COLOURS = {"mujoco": BLUE, "pybullet": VERMILION}


def paths_of(winner: Winner, drives: Mapping[Key, Drive], engines: Sequence[str]) -> dict[str, Path2D]:
    """Return the nominal drives' paths by name, ``t_s, x_m, y_m, heading_rad`` (rows, 4)."""
    trace = winner.in_gecar().trace or {}
    ours = np.column_stack([trace[name] for name in ("t_s", "x_m", "y_m", "heading_rad")])
    return {"gecar": ours} | {
        ENGINES[engine]: np.array(drives[winner.name, engine, 0].path) for engine in engines
    }


def draw_transfer(
    winners: Sequence[Winner],
    drives: Mapping[Key, Drive],
    engines: Sequence[str],
    shown: Winner,
    path: Path,
) -> Path:
    """Draw one winner's paths over its course, and all winners' times, and save the picture."""
    floor = load_floor(shown.course)
    columns, rows = floor.size
    width = 9.0
    above = min(width * rows / columns, 6.0)
    below = 1.4 + 0.24 * len(winners)
    with look():
        figure = new_figure(width, above + below + 0.8)
        course, times = figure.subplots(2, 1, height_ratios=[above, below])
        draw_floor(course, floor)
        colours = {"gecar": GECAR} | {ENGINES[engine]: COLOURS[engine] for engine in engines}
        for name, line in paths_of(shown, drives, engines).items():
            style = {"linestyle": (0, (4, 2)), "linewidth": 1.2} if name == "gecar" else {"linewidth": 1.4}
            course.plot(line[:, 1], line[:, 2], color=colours[name], label=name, **style)
        course.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderpad=0.0, ncols=3)
        course.set_title(f"{shown.name}: the nominal robot's way")
        _draw_times(times, winners, drives, engines)
        parts = [f"{score(winners, drives, engine).at_goal} in {ENGINES[engine]}" for engine in engines]
        headline(
            figure,
            f"Of {len(winners)} winners, at GOAL: {', '.join(parts)}",
            _detail(winners, drives, engines),
        )
    return save(figure, path)


def draw_floor(axes: Axes, floor: Floor) -> None:
    """Draw tiles and line."""
    edge = floor.tile_m
    for column, row in floor.tiles:
        colour = LIGHT if (column, row) == floor.goal else "none"
        axes.add_patch(
            Rectangle(
                (column * edge, row * edge), edge, edge, facecolor=colour, edgecolor=FAINT, linewidth=0.6
            )
        )
    axes.add_patch(PathPatch(_outline(floor.line), facecolor="#C3CBD3", linewidth=0, zorder=1))
    margin = 0.03
    axes.set_xlim(-margin, floor.size[0] * edge + margin)
    axes.set_ylim(-margin, floor.size[1] * edge + margin)
    axes.set_aspect("equal")
    axes.axis("off")
    goal_x, goal_y = ((place + 0.08) * edge for place in floor.goal)
    axes.text(goal_x, goal_y, "GOAL", size=7, color=SOFT)


def _outline(line: BaseGeometry) -> Outline:
    """Turn the line into a path whose inner rings are holes."""
    shapes = [shapely.orient_polygons(shape) for shape in getattr(line, "geoms", [line])]
    rings = [ring for shape in shapes for ring in (shape.exterior, *shape.interiors)]
    return Outline.make_compound_path(*(Outline(np.array(ring.coords), closed=True) for ring in rings))


def _draw_times(
    axes: Axes, winners: Sequence[Winner], drives: Mapping[Key, Drive], engines: Sequence[str]
) -> None:
    """Draw each winner's promise with its 3 % as a bar, drives at GOAL as marks, and how many others were not."""
    for k, winner in enumerate(winners):
        low, high = ((1.0 + sign * NEAR) * winner.promised_s for sign in (-1, 1))
        axes.add_patch(Rectangle((low, k - 0.4), high - low, 0.8, facecolor=FAINT, linewidth=0))
        axes.plot([winner.promised_s] * 2, [k - 0.4, k + 0.4], color=GECAR, linewidth=1.6)
        for engine, offset in zip(engines, np.linspace(-0.18, 0.18, len(engines)), strict=True):
            _draw_engine(axes, winner, drives, engine, k + offset)
    axes.set_yticks(range(len(winners)), [winner.name for winner in winners])
    axes.set_ylim(len(winners) - 0.4, -0.6)
    axes.set_xlabel(
        "time to GOAL [s]: gecar's promise and 3 % about it; large: nominal robot, small: varied ones"
    )
    axes.grid(visible=False, axis="y")


def _draw_engine(axes: Axes, winner: Winner, drives: Mapping[Key, Drive], engine: str, height: float) -> None:
    colour, made = COLOURS[engine], drives[winner.name, engine, 0]
    times = [each.time_s for each in varied_drives(winner, drives, engine) if each.at_goal]
    axes.plot(times, [height] * len(times), "o", color=colour, markersize=3, alpha=0.5, markeredgewidth=0)
    lost = len(varied_drives(winner, drives, engine)) - len(times)
    if made.at_goal:
        axes.plot([made.time_s], [height], "o", color=colour, markersize=6.5)
    words = ([] if made.at_goal else ["nominal robot lost"]) + ([f"{lost} varied lost"] if lost else [])
    axes.annotate(
        f"{ENGINES[engine]}: {', '.join(words) or 'none lost'}",
        (1.01, height),
        xycoords=("axes fraction", "data"),
        size=6.5,
        color=colour,
        va="center",
        annotation_clip=False,
    )


def _detail(winners: Sequence[Winner], drives: Mapping[Key, Drive], engines: Sequence[str]) -> str:
    counts = [score(winners, drives, engine) for engine in engines]
    near = " and ".join(str(counted.near) for counted in counts)
    text = f"within {100 * NEAR:.0f} % of the promised time: {near}"
    if any(counted.varied for counted in counts):
        varied = " and ".join(f"{counted.varied_at_goal} of {counted.varied}" for counted in counts)
        text += f"; varied robots at GOAL: {varied}"
    return text
