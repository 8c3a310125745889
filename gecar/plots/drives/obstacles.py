"""Obstacles that a robot pushes about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from gecar.plots.courses.course import colour_of, draw_course
from gecar.plots.courses.robot import placed
from gecar.plots.style import INK, SOFT
from gecar.world.course.course import Course
from gecar.world.rollout import Drive

_MOVED_M = 0.002


class Obstacles:
    """A course's obstacles, drawn where they are and moved where they go."""

    def __init__(self, axes: Axes, course: Course) -> None:
        centred = (replace(obstacle, x=0.0, y=0.0, heading=0.0) for obstacle in course.obstacles)
        self.outlines = [np.array(obstacle.outline.exterior.coords) for obstacle in centred]
        self.patches = [
            Polygon(
                placed(outline, o.x, o.y, o.heading),
                facecolor=colour_of(o),
                edgecolor=INK,
                linewidth=0.8,
                zorder=2.5,
            )
            for outline, o in zip(self.outlines, course.obstacles, strict=True)
        ]
        for patch in self.patches:
            axes.add_patch(patch)

    def move(self, poses: npt.NDArray[np.float64]) -> None:
        """Put them at poses [m, m, rad], shape (obstacles, 3)."""
        for patch, outline, (x, y, heading) in zip(self.patches, self.outlines, poses, strict=True):
            patch.set_xy(placed(outline, x, y, heading))


def draw_floor(axes: Axes, course: Course) -> Obstacles:
    """Draw a course, and its obstacles so that they can be moved."""
    draw_course(axes, replace(course, obstacles=()))
    return Obstacles(axes, course)


def draw_moved(axes: Axes, course: Course, drive: Drive) -> None:
    """Draw obstacles where a drive left them, and dashed where they stood before."""
    obstacles = draw_floor(axes, course)
    if drive.obstacles is None or not len(drive.obstacles):
        return
    begin, end = drive.obstacles[0], drive.obstacles[-1]
    for outline, pose, moved in zip(
        obstacles.outlines, begin, np.hypot(*(end - begin)[:, :2].T), strict=True
    ):
        if moved > _MOVED_M:
            edge = placed(outline, *pose)
            axes.add_patch(
                Polygon(edge, fill=False, edgecolor=SOFT, linestyle=(0, (3, 2)), linewidth=1.0, zorder=2.4)
            )
    obstacles.move(end)
