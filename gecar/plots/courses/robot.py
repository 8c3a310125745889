"""The robot seen from above, for pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from gecar.plots.style import INK, PAPER
from gecar.world.robot import Robot

Points = npt.NDArray[np.float64]
WHEEL_WIDTH_M = 0.028


@dataclass(frozen=True)
class Shape:
    """A robot's outlines about its axle's centre, heading along +x [m].

    Attributes
    ----------
    body, left_wheel, right_wheel
        Corners, shape (n, 2).
    sensor
        Middle of the colour sensor's spot, shape (1, 2).
    """

    body: Points
    left_wheel: Points
    right_wheel: Points
    sensor: Points


def shape_of(robot: Robot) -> Shape:
    """Return a robot's outlines; the body is the box that touches walls (`gecar.world.pymunk_space`)."""
    rear = robot.body.caster_ahead - 0.015
    half_track, radius = 0.5 * robot.body.track_width, robot.body.wheel_radius
    sensor = np.array([[robot.colour_sensor.ahead, robot.colour_sensor.left]])
    return Shape(
        _box(rear + 0.5 * robot.body.length, 0.0, robot.body.length, robot.body.width),
        _box(0.0, half_track, 2 * radius, WHEEL_WIDTH_M),
        _box(0.0, -half_track, 2 * radius, WHEEL_WIDTH_M),
        sensor,
    )


def _box(x: float, y: float, length: float, width: float) -> Points:
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    return np.asarray(corners * [length, width] + [x, y])


def placed(points: Points, x: float, y: float, heading: float) -> Points:
    """Turn points about the origin by a heading [rad], then move them to (x, y)."""
    cos, sin = np.cos(heading), np.sin(heading)
    return np.asarray(points @ np.array([[cos, sin], [-sin, cos]]) + [x, y])


class RobotArtist:
    """A robot drawn at a pose, to be moved where the next one is."""

    def __init__(self, axes: Axes, shape: Shape, opacity: float = 1.0, order: float = 6.0) -> None:
        self.shape = shape
        look: dict[str, Any] = {"closed": True, "clip_on": False, "alpha": opacity, "linewidth": 0.9}
        self.body = Polygon(shape.body, facecolor=PAPER, edgecolor=INK, zorder=order, **look)
        self.wheels = [
            Polygon(wheel, facecolor=INK, edgecolor=INK, zorder=order + 0.1, **look)
            for wheel in (shape.left_wheel, shape.right_wheel)
        ]
        self.sensor = Circle(
            shape.sensor[0], 0.009, facecolor=INK, edgecolor=PAPER, zorder=order + 0.2, alpha=opacity
        )
        self.parts = [self.body, *self.wheels, self.sensor]
        for part in self.parts:
            axes.add_patch(part)

    def move(self, x: float, y: float, heading: float) -> None:
        """Put the robot at a pose [m, m, rad]."""
        outlines = (self.shape.body, self.shape.left_wheel, self.shape.right_wheel)
        for part, outline in zip((self.body, *self.wheels), outlines, strict=True):
            part.set_xy(placed(outline, x, y, heading))
        self.sensor.set_center(tuple(placed(self.shape.sensor, x, y, heading)[0]))
