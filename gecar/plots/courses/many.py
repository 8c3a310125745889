"""Many courses side by side, each a line: those a program drives, and how far it comes on the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gecar.plots.style import BLUE, INK, ORANGE, SOFT, headline, look, new_figure
from gecar.world.course.course import Course

COLUMNS = 10
_ROOM = 1.25
"""Distance of the courses' middles, in the largest one's width and height."""


def courses_figure(courses: Sequence[Course], failures: Mapping[str, int], title: str, detail: str) -> Figure:
    """Draw courses, all to one scale.

    Parameters
    ----------
    courses
        What to draw.
    failures
        Checkpoints that were passed, by name of the courses that were not driven to GOAL.
    title, detail
        What to write above.
    """
    columns = min(COLUMNS, len(courses))
    rows = -(-len(courses) // columns)
    wide, high = (_ROOM * max(size) for size in zip(*((c.width_m, c.height_m) for c in courses), strict=True))
    width = 9.6 * max(columns, 4) / COLUMNS
    with look():
        figure = new_figure(width, 0.7 + rows * width / columns * high / wide)
        headline(figure, title, detail)
        axes = figure.add_subplot()
        axes.set_axis_off()
        axes.set_aspect("equal")
        for number, course in enumerate(courses):
            row, column = divmod(number, columns)
            middle = np.array([(column + 0.5) * wide, -(row + 0.5) * high])
            corner = middle - 0.5 * np.array([course.width_m, course.height_m])
            _draw_way(axes, course, corner, failures.get(course.name))
            name = course.name.removeprefix("random:")
            axes.text(
                middle[0], middle[1] - 0.46 * high, name, size=5.5, color=SOFT, ha="center", va="center"
            )
        axes.set_xlim(0.0, columns * wide)
        axes.set_ylim(-rows * high, 0.0)
    return figure


def _draw_way(axes: Axes, course: Course, corner: npt.NDArray[np.float64], passed: int | None) -> None:
    """Draw a course's line, from a dot at START; where it was not driven to GOAL, a cross on the last tile passed."""
    for line in getattr(course.centreline, "geoms", [course.centreline]):
        points = corner + shapely.get_coordinates(line)
        axes.plot(*points.T, color=BLUE if passed is None else ORANGE, linewidth=1.4)
    axes.plot(*(corner + course.start[:2]), "o", color=INK, markersize=2.2)
    if passed is not None:
        tile = int(course.sequence[passed - 1]) if passed else course.start_tile
        axes.plot(*(corner + course.layout.centre_m(tile)), "x", color=INK, markersize=5, markeredgewidth=1.2)
