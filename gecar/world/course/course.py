"""A course: the floor with its line, the tiles in driving order, and what stands on it."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, MultiLineString, MultiPolygon

from gecar.displayed import Displayed
from gecar.errors import InputError, expected, one_of
from gecar.files import is_file, read_text, shipped
from gecar.world.course import line, raster
from gecar.world.course.builder import parts_from
from gecar.world.course.layout import Layout, Pose
from gecar.world.course.lower_bound.fastest_time import fastest_time
from gecar.world.course.lower_bound.shortest_way import ShortestWay, shortest_way
from gecar.world.course.obstacle import Obstacle
from gecar.world.course.random_course import random_text
from gecar.world.course.raster import PITCH_M, WHITE, FloorImage
from gecar.world.course.schema import validate
from gecar.world.kernel.sensing import Surface, spot_average, surface
from gecar.world.robot import Robot

__all__ = [
    "COURSES",
    "Course",
    "Obstacle",
    "Pose",
    "course_names",
    "course_parts",
    "list_courses",
    "load_course",
    "load_courses",
    "parse_course",
    "random_course",
]

COURSES = shipped("courses")
_LARGEST_FILE = 1_000_000
_RANDOM = re.compile(r"random:(\d{1,18})(?:-(\d{1,18}))?")
_MOST_COURSES = 1_000


@dataclass(frozen=True, eq=False)
class Course(Displayed):
    """A course; made by `load_course`, `parse_course` or `course_from`.

    Coordinates: metres, x right and y up from the field's lower left corner. Tiles are numbered
    row * columns + column, row 0 at the bottom.

    Attributes
    ----------
    name, title, notes
        Short name, and words for people.
    layout
        The tiles.
    start
        Pose of the axle's centre at the start.
    start_tile
        START's tile.
    sequence
        Tiles to pass in driving order: checkpoints, and GOAL last, shape (k,).
    walls
        Wall ends x0, y0, x1, y1 [m], shape (m, 4).
    obstacles
        What stands on the floor.
    image
        The floor as a picture, instead of the tiles' lines.
    """

    name: str
    layout: Layout
    start: Pose
    start_tile: int
    sequence: npt.NDArray[np.int32]
    walls: npt.NDArray[np.float64]
    obstacles: tuple[Obstacle, ...] = ()
    image: FloorImage | None = None
    title: str = ""
    notes: str = ""
    _rasters: dict[float, npt.NDArray[np.uint8]] = field(default_factory=dict, init=False, repr=False)
    _averages: dict[float, npt.NDArray[np.float32]] = field(default_factory=dict, init=False, repr=False)

    @property
    def tile_size_m(self) -> float:
        """Edge of a tile [m]."""
        return self.layout.tile_size_m

    @property
    def line_width_m(self) -> float:
        """Width of the line [m]."""
        return self.layout.line_width_m

    @property
    def columns(self) -> int:
        """Tiles across."""
        return self.layout.columns

    @property
    def rows(self) -> int:
        """Tiles up."""
        return self.layout.rows

    @property
    def width_m(self) -> float:
        """Width of the field [m]."""
        return self.layout.width_m

    @property
    def middle_m(self) -> tuple[float, float]:
        """The field's middle: x, y [m]."""
        return 0.5 * self.width_m, 0.5 * self.height_m

    @property
    def height_m(self) -> float:
        """Height of the field [m]."""
        return self.layout.height_m

    @property
    def pitch_m(self) -> float:
        """Edge of a raster cell that simulations use [m]."""
        return PITCH_M

    @property
    def goal(self) -> int:
        """GOAL's tile."""
        return int(self.sequence[-1])

    @property
    def checkpoints(self) -> npt.NDArray[np.int32]:
        """Tiles between START and GOAL in order, shape (k - 1,)."""
        return self.sequence[:-1]

    @property
    def drivable(self) -> npt.NDArray[np.bool_]:
        """Whether a tile belongs to the course, shape (rows * columns,)."""
        return self.layout.drivable

    @cached_property
    def line_area(self) -> MultiPolygon:
        """What the line covers [m]; empty where the floor is a picture."""
        return MultiPolygon() if self.image else line.line_area(self.layout)

    @cached_property
    def centreline(self) -> LineString | MultiLineString:
        """The middle of the line [m], from beside START to GOAL's edge; all of it if no order follows it."""
        way = line.route(self.layout, self.start, self.start_tile, [int(k) for k in self.sequence])
        return line.strokes(self.layout) if way.is_empty else way

    @property
    def length_m(self) -> float:
        """Length of the centreline [m]."""
        return float(self.centreline.length)

    @cached_property
    def shortest(self) -> ShortestWay:
        """The shortest way the axle's centre can take to GOAL."""
        sequence = [int(k) for k in self.sequence]
        return shortest_way(self.layout, self.start_tile, sequence, self.start.x_m, self.start.y_m)

    def lower_bound_s(self, robot: Robot) -> float:
        """Return a lower bound on a robot's time to GOAL [s], proven for tyres that hold (`fastest_time`)."""
        free_to_turn = len(self.walls) == 0 and not self.obstacles
        return fastest_time(self.shortest, self.start.heading_rad, robot, free_to_turn)

    def raster(self, pitch_m: float = PITCH_M) -> npt.NDArray[np.uint8]:
        """Return the floor's brightness; kept, so do not write into it.

        Parameters
        ----------
        pitch_m
            Edge of a cell [m].

        Returns
        -------
        numpy.ndarray
            255 bare floor to 0 line, by the share of the cell the line covers; shape (rows, columns), row 0
            at the bottom.

        Raises
        ------
        InputError
            If the pitch is no length, or asks for more than 50 million cells.
        """
        if pitch_m not in self._rasters:
            self._rasters[pitch_m] = self._draw(pitch_m)
        return self._rasters[pitch_m]

    @cached_property
    def surface(self) -> Surface:
        """The floor's cells, and where they are alike: what fits predict readings from."""
        return surface(self.raster(self.pitch_m), self.pitch_m)

    def averaged(self, spot_m: float) -> npt.NDArray[np.float32]:
        """Return the floor's brightness averaged over a sensor's spot [m]; see `spot_average`. Kept, as `raster`."""
        if spot_m not in self._averages:
            self._averages[spot_m] = spot_average(self.raster(), self.pitch_m, spot_m)
        return self._averages[spot_m]

    def starting(self, pose: Pose) -> Course:
        """Return the course with another start; it shares this one's rasters."""
        moved = replace(self, start=pose)
        object.__setattr__(moved, "_rasters", self._rasters)
        object.__setattr__(moved, "_averages", self._averages)
        return moved

    def _draw(self, pitch_m: float) -> npt.NDArray[np.uint8]:
        size = self.width_m, self.height_m, pitch_m
        if self.image:
            return raster.resample(self.image, *size)
        return raster.draw(self.line_area, *size)


def list_courses() -> list[str]:
    """Return the names of the courses that ship with gecar, the paper's first."""
    names = sorted(path.stem for path in COURSES.glob("*.toml"))
    return sorted(names, key=lambda name: name != "paper")


def load_course(name_or_path: str | Path) -> Course:
    """Load a course by file, or by the name of one that ships with gecar; ``random:7`` is `random_course` 7.

    Raises
    ------
    InputError
        If there is no such course, or its file is wrong; one line that names the field.
    """
    names = course_names(str(name_or_path))
    if len(names) > 1:
        raise expected("--course", f"{len(names)} courses, '{name_or_path}'", "one")
    seed = _RANDOM.fullmatch(names[0])
    if seed:
        return random_course(int(seed[1]))
    path = Path(name_or_path)
    if path.suffix != ".toml" and not is_file(path):
        if str(name_or_path) not in list_courses():
            raise one_of("--course", str(name_or_path), list_courses(), "a course file (.toml), random:SEED")
        path = COURSES / f"{name_or_path}.toml"
    if is_file(path) and path.stat().st_size > _LARGEST_FILE:
        raise expected(path, f"{path.stat().st_size} bytes", f"a course file of at most {_LARGEST_FILE}")
    return parse_course(read_text(path, "a course file"), str(path))


def course_parts(text: str) -> list[str]:
    """Cut a text that names courses at each ``+``; a file's name may hold some."""
    return [text] if is_file(Path(text)) else [part.strip() for part in text.split("+")]


def course_names(text: str) -> list[str]:
    """Return the names in a text that names courses: ``paper+mine.toml``, ``random:1-20`` for twenty random courses.

    Raises
    ------
    InputError
        If one is named twice, there are too many, or a range runs backwards.
    """
    names: list[str] = []
    for part in course_parts(text):
        seeds = _RANDOM.fullmatch(part)
        first, last = (int(seeds[1]), int(seeds[2] or seeds[1])) if seeds else (0, 0)
        if last < first:
            raise expected("--course", f"'{part}'", f"seeds in order, random:{last}-{first}")
        if last - first + len(names) >= _MOST_COURSES:
            raise expected("--course", f"'{text[:60]}'", f"at most {_MOST_COURSES} courses")
        names += [f"random:{seed}" for seed in range(first, last + 1)] if seeds else [part]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise expected("--course", f"'{twice[0]}' twice", "different courses")
    return names


def load_courses(names: str) -> tuple[Course, ...]:
    """Load one course or several, named as for `course_names`.

    Raises
    ------
    InputError
        As `course_names` and `load_course`.
    """
    return tuple(load_course(name) for name in course_names(names))


def random_course(
    seed: int, tiles: int | None = None, turns: float | None = None, tile_size_m: float | None = None
) -> Course:
    """Return a random course; see `gecar.world.course.random_course.random_text`."""
    return parse_course(random_text(seed, tiles, turns, tile_size_m), f"random:{seed}")


def parse_course(text: str, source: str = "<course>") -> Course:
    """Make a course from a course file's text; pictures are looked for beside ``source``.

    Raises
    ------
    InputError
        If it is not TOML, or a field is wrong; one line that names the field.
    """
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: not TOML: {error}") from None
    return Course(Path(source).stem, *parts_from(validate(table, source), source))


def mirrored(course: Course) -> Course:
    """Return a course with left and right exchanged: raster, driving order and everything on it.

    The raster is the flipped array exactly where the field's width is a whole number of cells.
    """
    width, layout = course.width_m, course.layout
    walls = course.walls.copy()
    walls[:, [0, 2]] = width - walls[:, [0, 2]]
    return replace(
        course,
        name=f"{course.name}_mirrored",
        layout=layout.mirrored(),
        start=Pose(width - course.start.x_m, course.start.y_m, math.pi - course.start.heading_rad),
        start_tile=layout.mirrored_index(course.start_tile),
        sequence=np.array([layout.mirrored_index(int(k)) for k in course.sequence], np.int32),
        walls=walls,
        obstacles=tuple(replace(o, x=width - o.x, heading=math.pi - o.heading) for o in course.obstacles),
        image=_mirrored_image(course.image, width) if course.image else None,
    )


def _mirrored_image(image: FloorImage, width_m: float) -> FloorImage:
    """Flip a picture about the field's middle, which need not be its own."""
    wide = round(width_m * image.pixels_per_metre)
    height, own = image.brightness.shape
    sheet = np.full((height, max(wide, own)), WHITE, np.uint8)
    sheet[:, :own] = image.brightness
    return FloorImage(np.ascontiguousarray(sheet[:, :wide][:, ::-1]), image.pixels_per_metre)
