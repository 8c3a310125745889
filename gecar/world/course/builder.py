"""From a course file's table to a course's parts, checked against each other."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Point, box
from shapely.geometry.base import BaseGeometry

from gecar.errors import InputError, expected
from gecar.world.course import driving_order, raster
from gecar.world.course.layout import Layout, Pose, check_lines_join, read_map
from gecar.world.course.obstacle import Obstacle
from gecar.world.course.photograph import straightened
from gecar.world.course.raster import PITCH_M, FloorImage
from gecar.world.course.schema import CourseTable, ObstacleTable


class Parts(NamedTuple):
    """What a course is made of; see `gecar.world.course.course.Course`."""

    layout: Layout
    start: Pose
    start_tile: int
    sequence: npt.NDArray[np.int32]
    walls: npt.NDArray[np.float64]
    obstacles: tuple[Obstacle, ...]
    image: FloorImage | None
    title: str
    notes: str


def parts_from(table: CourseTable, source: str) -> Parts:
    """Make a course's parts from its table.

    Raises
    ------
    InputError
        If fields contradict each other; one line that names the field.
    """
    return _Builder(table, source).parts()


class _Builder:
    """Checks a course table's fields against each other on the way."""

    def __init__(self, table: CourseTable, source: str) -> None:
        self.table, self.source = table, source
        characters, columns = read_map(table.map, f"{source}, map")
        edge = table.tile_edge_m(columns, len(characters) // columns, f"{source}, field_m")
        self.layout = Layout(characters, columns, edge, table.line_width_m)
        if table.line_width_m > 0.5 * edge:
            raise expected(
                f"{source}, line_width_m", table.line_width_m, f"at most half a tile, {0.5 * edge:g} m"
            )
        try:
            raster.raster_shape(self.layout.width_m, self.layout.height_m, PITCH_M)
        except InputError:
            size = f"a field of {self.layout.width_m:g} x {self.layout.height_m:g} m"
            raise expected(f"{source}, map", size, "at most 50 square metres") from None

    def parts(self) -> Parts:
        table, layout, where = self.table, self.layout, self.source
        start_tile = driving_order.named_tile(layout, table.start.tile, f"{where}, start.tile")
        goal = driving_order.named_tile(layout, table.goal, f"{where}, goal")
        start = self._start(start_tile)
        check_lines_join(layout, start_tile, goal, f"{where}, map")
        sequence = self._sequence(start_tile, goal)
        driving_order.check_order(layout, start_tile, sequence, where)
        return Parts(
            layout,
            start,
            start_tile,
            np.array(sequence, np.int32),
            self._walls(),
            self._obstacles(start),
            self._image(),
            table.title,
            table.notes.strip(),
        )

    def _start(self, tile: int) -> Pose:
        given, (x, y) = self.table.start, self.layout.centre_m(tile)
        cos, sin = math.cos(given.heading_rad), math.sin(given.heading_rad)
        x += given.ahead_m * cos - given.left_m * sin
        y += given.ahead_m * sin + given.left_m * cos
        if self.layout.index_at(x, y) != tile:
            raise expected(
                f"{self.source}, start", f"({x:g}, {y:g}) m, outside its tile", "ahead_m, left_m within it"
            )
        return Pose(x, y, given.heading_rad + math.radians(given.turn_deg))

    def _sequence(self, start: int, goal: int) -> list[int]:
        where = f"{self.source}, checkpoints"
        if self.table.checkpoints is None:
            if start == goal:
                raise expected(f"{self.source}, goal", "START's own tile", "another tile")
            return driving_order.follow_line(self.layout, start, goal, self.table.start.heading_rad, where)
        named = enumerate(self.table.checkpoints)
        return [driving_order.named_tile(self.layout, place, f"{where}[{k}]") for k, place in named] + [goal]

    def _walls(self) -> npt.NDArray[np.float64]:
        walls = [(*wall.from_m, *wall.to_m) for wall in self.table.walls]
        for k, (x0, y0, x1, y1) in enumerate(walls):
            self._check_inside(LineString([(x0, y0), (x1, y1)]), f"walls[{k}]", "a wall")
        return np.array(walls, np.float64).reshape(-1, 4)

    def _obstacles(self, start: Pose) -> tuple[Obstacle, ...]:
        obstacles = tuple(_obstacle(given) for given in self.table.obstacles)
        for k, obstacle in enumerate(obstacles):
            self._check_inside(obstacle.outline, f"obstacles[{k}]", f"a {obstacle.kind}")
            if obstacle.outline.covers(Point(start.x_m, start.y_m)):
                raise expected(
                    f"{self.source}, obstacles[{k}]", f"a {obstacle.kind} on START", "a place beside it"
                )
        return obstacles

    def _check_inside(self, shape: BaseGeometry, place: str, what: str) -> None:
        if not box(0, 0, self.layout.width_m, self.layout.height_m).buffer(1e-6).covers(shape):
            size = f"{self.layout.width_m:g} x {self.layout.height_m:g} m"
            raise expected(
                f"{self.source}, {place}", f"{what} that reaches outside the field", f"it within {size}"
            )

    def _image(self) -> FloorImage | None:
        given, where = self.table.image, f"{self.source}, image"
        if given is None:
            return None
        grey = raster.read_image(Path(self.source).parent / given.file, where)
        width, height = self.layout.width_m, self.layout.height_m
        if given.pixels_per_metre is None:
            per_metre = 1.0 / PITCH_M
            corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
            marks = given.marks_px or [], given.marks_m or corners
            grey = straightened(grey, *marks, (width, height), per_metre, where)
        else:
            per_metre = given.pixels_per_metre
            _check_size(grey, per_metre, (width, height), where)
        level = (grey - given.black) * (255.0 / (given.white - given.black))
        return FloorImage(np.clip(level + 0.5, 0, 255).astype(np.uint8), per_metre)


def _check_size(
    grey: npt.NDArray[np.uint8], per_metre: float, wanted: tuple[float, float], where: str
) -> None:
    size = [n / per_metre for n in grey.shape[::-1]]
    if any(abs(a - b) > 0.02 * b for a, b in zip(size, wanted, strict=True)):
        found = f"{size[0]:.3g} x {size[1]:.3g} m at {per_metre:g} pixels per metre"
        raise expected(where, found, f"the field's {wanted[0]:g} x {wanted[1]:g} m, within 2 %")


def _obstacle(given: ObstacleTable) -> Obstacle:
    disc = given.diameter_m or 0.0
    length, width = given.size_m or (disc, disc)
    heading = math.radians(given.heading_deg)
    return Obstacle(
        given.kind, *given.at_m, heading, length, width, given.mass_kg, given.friction, given.movable
    )
