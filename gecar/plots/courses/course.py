"""A course seen from above: floor, line, tiles, START, GOAL, checkpoints, walls and obstacles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from shapely.geometry import LineString, Polygon, box
from shapely.geometry.base import BaseGeometry

from gecar.plots.courses.robot import RobotArtist, placed, shape_of
from gecar.plots.style import FAINT, GREEN, INK, PALE, PAPER, SOFT, headline, look, new_figure
from gecar.world.course.course import Course, Obstacle
from gecar.world.course.lower_bound.fastest_time import bound_words
from gecar.world.course.tiles import Side
from gecar.world.robot import Robot

# Orders of drawing; paths and robots come at 3 and above.
_BEYOND, _TINT, _GRID, _LINE, _MARKS, _SHADOW, _THINGS = 0.1, 0.2, 0.3, 1.0, 1.2, 1.5, 1.6
OFF_COURSE, SEAM = "#E9EDF1", "#EDF0F3"
FIXED, WALL = "#8C96A0", "#6B5B4B"
WALL_HALF_WIDTH_M = 0.005  # as the walls that robots touch
_CHEQUER = 1.0 / 12.0  # of a tile
_ARROW = np.array([[-0.5, -0.38], [0.6, 0.0], [-0.5, 0.38], [-0.25, 0.0]])
_CHEVRON = np.array([[-0.45, -0.5], [0.05, -0.5], [0.45, 0.0], [0.05, 0.5], [-0.45, 0.5], [0.05, 0.0]])


def draw_course(axes: Axes, course: Course, marks: bool = True) -> None:
    """Draw a course into axes, in metres, and set their limits.

    Parameters
    ----------
    axes
        Where.
    course
        What.
    marks
        Whether to mark START, GOAL, checkpoints and the driving direction, or draw only what lies on the floor.
    """
    _draw_floor(axes, course)
    if marks:
        _mark_ends(axes, course)
        _mark_checkpoints(axes, course)
        _mark_direction(axes, course)
    _draw_things(axes, course)
    _set_frame(axes, course)


def show_whole(axes: Axes, path: npt.NDArray[np.float64], margin_m: float = 0.03) -> None:
    """Widen the limits of axes to hold a path that may leave the course; x and y [m], shape (samples, 2)."""
    if axes.get_autoscale_on():  # no course has set limits
        axes.update_datalim(path)
        axes.autoscale_view()
        return
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    (x, y), (last_x, last_y) = path.min(axis=0) - margin_m, path.max(axis=0) + margin_m
    axes.set(xlim=(min(left, x), max(right, last_x)), ylim=(min(bottom, y), max(top, last_y)))


def course_figure(course: Course, robot: Robot | None = None) -> Figure:
    """Draw a course by itself, with the robot at START and the shortest way where a robot is given."""
    width = 9.0
    height = min(max(0.92 * width * course.height_m / course.width_m, 2.2), 9.0) + 1.2
    with look():
        figure = new_figure(width, height)
        headline(figure, course.title or course.name, describe(course, robot))
        axes = figure.add_subplot()
        draw_course(axes, course)
        if robot is not None:
            x, y = course.shortest.path.xy
            axes.plot(x, y, color=GREEN, linewidth=1.4, linestyle=(0, (4, 2)), zorder=3.0)
            RobotArtist(axes, shape_of(robot), 1.0, 6.0).move(*course.start)
        figure.draw_without_rendering()  # axes of fixed aspect need a pass more to find their place
    return figure


def describe(course: Course, robot: Robot | None = None) -> str:
    """Say in a line what a course is like, and with a robot, the lower bound on its time to GOAL."""
    words = [
        f"{course.width_m:g} × {course.height_m:g} m",
        f"{len(course.checkpoints)} checkpoints",
        *([f"line {course.length_m:.2f} m"] if course.length_m > 0.0 else []),
        f"shortest way {course.shortest.length_m:.2f} m" + (" (dashed)" if robot else ""),
    ]
    if robot is not None:
        words.append(bound_words(course.lower_bound_s(robot)))
    return " · ".join(words)


def outline_patch(shape: BaseGeometry, **style: Any) -> PathPatch:
    """Return a patch of an area, holes left open."""
    polygons = [p for p in getattr(shape, "geoms", [shape]) if isinstance(p, Polygon)]
    rings = [ring.coords for p in polygons for ring in (p.exterior, *p.interiors) if not ring.is_empty]
    paths = [Outline(np.asarray(ring)[:, :2], closed=True) for ring in rings]
    whole = Outline.make_compound_path(*paths) if paths else Outline(np.zeros((0, 2)))
    return PathPatch(whole, **style)


def _draw_floor(axes: Axes, course: Course) -> None:
    squares = [course.layout.square(int(k)) for k in np.flatnonzero(course.drivable)]
    tiles = shapely.union_all(squares, grid_size=1e-9)
    beyond = box(0, 0, course.width_m, course.height_m).difference(tiles)
    axes.add_patch(outline_patch(tiles, facecolor=PAPER, edgecolor="none", zorder=0))
    if course.image:
        extent = (0, course.width_m, 0, course.height_m)
        picture = course.raster(max(0.001, course.width_m / 2000))
        axes.imshow(picture, extent=extent, origin="lower", cmap="gray", vmin=0, vmax=255, zorder=0)
    else:
        seams = LineCollection(_seams(course), colors=SEAM, linewidths=0.7, zorder=_GRID)
        axes.add_collection(seams, autolim=False)
    shade = 0.7 if course.image else 1.0
    axes.add_patch(outline_patch(beyond, facecolor=OFF_COURSE, edgecolor="none", alpha=shade, zorder=_BEYOND))
    axes.add_patch(outline_patch(tiles, facecolor="none", edgecolor=FAINT, linewidth=0.9, zorder=_GRID))
    axes.add_patch(outline_patch(course.line_area, facecolor=INK, edgecolor="none", zorder=_LINE))


def _seams(course: Course) -> list[npt.NDArray[np.float64]]:
    """Return the edges between drivable tiles, shape (2, 2) each [m]."""
    layout, size = course.layout, course.tile_size_m
    seams = []
    for k in np.flatnonzero(course.drivable):
        column, row = layout.place(int(k))
        right, above = layout.index(column + 1, row), layout.index(column, row + 1)
        if right >= 0 and course.drivable[right]:
            seams.append(np.array([[column + 1, row], [column + 1, row + 1]]) * size)
        if above >= 0 and course.drivable[above]:
            seams.append(np.array([[column, row + 1], [column + 1, row + 1]]) * size)
    return seams


def _mark_ends(axes: Axes, course: Course) -> None:
    """Tint START's and GOAL's tiles; draw an arrow where the robot starts, a chequered band where it arrives."""
    for tile in (course.start_tile, course.goal):
        square = course.layout.square(tile)
        axes.add_patch(outline_patch(square, facecolor=SOFT, alpha=0.16, edgecolor="none", zorder=_TINT))
    arrow = PolyCollection([placed(_ARROW * 0.22 * course.tile_size_m, *course.start)], facecolors=PAPER)
    arrow.set(edgecolor=INK, linewidth=0.9, zorder=_MARKS + 0.1)
    axes.add_collection(arrow, autolim=False)
    _label(axes, course, course.start_tile, "START", color=INK, weight="bold")
    side = _entry(course)
    if side is not None:
        band = PolyCollection(_chequers(course, side), facecolors=INK, zorder=_MARKS)
        axes.add_collection(band, autolim=False)
    # The label keeps clear of the band.
    aside, down = (2 * _CHEQUER if side == over else 0.0 for over in (Side.LEFT, Side.UP))
    _label(axes, course, course.goal, "GOAL", aside, down, color=INK, weight="bold")


def _entry(course: Course) -> Side | None:
    """Return the edge GOAL's tile is entered by, None where that is open."""
    before = int(course.sequence[-2]) if len(course.sequence) > 1 else course.start_tile
    return next((side for side in Side if course.layout.neighbour(course.goal, side) == before), None)


def _chequers(course: Course, side: Side) -> list[npt.NDArray[np.float64]]:
    """Return the dark squares of a finishing band inside GOAL's tile, along an edge."""
    squares = [(i, j) for i in range(2) for j in range(round(1 / _CHEQUER)) if (i + j) % 2 == 0]
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    band = [((corner + np.array(square)) * _CHEQUER - 0.5) * course.tile_size_m for square in squares]
    x, y = course.layout.centre_m(course.goal)
    return [placed(square, x, y, 0.5 * math.pi * side.opposite) for square in band]


def _mark_checkpoints(axes: Axes, course: Course) -> None:
    numbers: dict[int, list[str]] = {}
    for number, tile in enumerate(course.checkpoints, start=1):
        numbers.setdefault(int(tile), []).append(str(number))
    for tile, passes in numbers.items():
        if tile != course.start_tile:
            _label(axes, course, tile, " · ".join(passes), color=SOFT)


def _label(
    axes: Axes, course: Course, tile: int, word: str, aside: float = 0.0, down: float = 0.0, **style: Any
) -> None:
    """Write into a tile's upper left corner, or further aside and down [tiles]."""
    x, y = course.layout.centre_m(tile)
    size = course.tile_size_m
    halo = [withStroke(linewidth=1.6, foreground=PAPER)]
    place = x - (0.44 - aside) * size, y + (0.44 - down) * size
    axes.text(*place, word, ha="left", va="top", size=6.5, zorder=_MARKS, path_effects=halo, **style)


def _mark_direction(axes: Axes, course: Course) -> None:
    """Put chevrons on the line, two a tile, that point the way."""
    way = course.centreline
    if not isinstance(way, LineString) or way.length == 0.0:
        return
    count = max(1, round(way.length / (0.5 * course.tile_size_m)))
    at = (np.arange(count) + 0.5) * way.length / count
    size = 0.6 * course.line_width_m
    points = [
        shapely.get_coordinates(way.interpolate([max(s - 0.2 * size, 0.0), s + 0.2 * size])) for s in at
    ]
    middles = [0.5 * (a + b) for a, b in points]
    headings = [math.atan2(*(b - a)[::-1]) for a, b in points]
    chevrons = [placed(_CHEVRON * size, m[0], m[1], h) for m, h in zip(middles, headings, strict=True)]
    on_line = [
        c for c, m in zip(chevrons, middles, strict=True) if course.line_area.contains(shapely.Point(m))
    ]
    axes.add_collection(PolyCollection(on_line, facecolors=PAPER, alpha=0.75, zorder=_MARKS), autolim=False)


def _draw_things(axes: Axes, course: Course) -> None:
    walls = [LineString([wall[:2], wall[2:]]).buffer(WALL_HALF_WIDTH_M) for wall in course.walls]
    for wall in walls:
        _draw_thing(axes, wall, WALL)
    for obstacle in course.obstacles:
        _draw_thing(axes, obstacle.outline, colour_of(obstacle))


def colour_of(obstacle: Obstacle) -> str:
    """Return the colour of an obstacle: pale if it can be pushed."""
    return PALE if obstacle.movable else FIXED


def _draw_thing(axes: Axes, shape: BaseGeometry, colour: str) -> None:
    shade = shapely.affinity.translate(shape, 0.006, -0.006)
    axes.add_patch(outline_patch(shade, facecolor=INK, alpha=0.18, edgecolor="none", zorder=_SHADOW))
    axes.add_patch(outline_patch(shape, facecolor=colour, edgecolor=INK, linewidth=0.7, zorder=_THINGS))


def _set_frame(axes: Axes, course: Course) -> None:
    """Show the whole field, to scale, with metres along two sides."""
    edge = 0.01 * max(course.width_m, course.height_m)
    axes.set_xlim(-edge, course.width_m + edge)
    axes.set_ylim(-edge, course.height_m + edge)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    step = course.tile_size_m * max(1, math.ceil(max(course.columns, course.rows) / 10))
    axes.set_xticks(np.arange(0.0, course.width_m + 1e-9, step))
    axes.set_yticks(np.arange(0.0, course.height_m + 1e-9, step))
    axes.tick_params(length=0, pad=3)
    axes.set_xlabel("x [m]", labelpad=1)
    axes.set_ylabel("y [m]", labelpad=2)
