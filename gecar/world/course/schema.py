"""The course file: what may stand in it, and errors that name the field.

A course is a TOML file::

    title = "The paper's course"
    map = '''
    F------7
    |######|
    |######|
    L------J
    '''
    goal = [0, 1]               # [column, row] from the lower left tile, [0, 0]

    [start]
    tile = [0, 2]
    heading = "up"              # up, down, left, right, or degrees counter-clockwise from +x
    left_m = -0.025             # from the tile's middle, as seen from the robot

The characters of the map are in `gecar.world.course.tiles`. Everything else is optional:

====================  ======================================================================================
``checkpoints``       ``[[column, row], ...]`` in order; without it, the tiles along the line
``tile_size_m``       edge of a tile (0.30)
``field_m``           ``[width, height]``, instead of ``tile_size_m`` or as a check on it
``line_width_m``      (0.025)
``title, notes``      words for people
``[start]``           also ``ahead_m`` and ``turn_deg`` (0)
``[[walls]]``         ``from_m`` and ``to_m``: ends ``[x, y]`` of a wall
``[[obstacles]]``     ``at_m``; ``kind = "box"`` with ``size_m = [length, width]`` and ``heading_deg``, or
                      ``kind = "disc"`` with ``diameter_m``; ``mass_kg`` (0.2); ``friction`` (0.4), against
                      the floor and whatever touches it; ``movable`` (true)
``[image]``           ``file`` beside the course file and ``pixels_per_metre``: the floor as scanned or
                      photographed, lower left corner on the field's, instead of the tiles' lines;
                      ``white`` (255), ``black`` (0): its grey levels on bare floor and on the line;
                      taken at a slant: ``marks_px`` instead of the scale, four or more ``[x, y]`` from the
                      picture's upper left corner, and ``marks_m``, where they are on the field (its corners,
                      counter-clockwise from the lower left)
====================  ======================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, model_validator

from gecar.errors import expected, first_fault

_Number = Annotated[float, Strict(), Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
_Positive = Annotated[float, Strict(), Field(gt=0, le=1e6, allow_inf_nan=False)]
_Level = Annotated[float, Strict(), Field(ge=0, le=255, allow_inf_nan=False)]
_Index = Annotated[int, Strict(), Field(ge=0, le=1_000_000)]
_Place = tuple[_Index, _Index]
_Point = tuple[_Number, _Number]
_Size = tuple[_Positive, _Positive]

TILE_SIZE_M = 0.30
HEADINGS = {"right": 0.0, "up": 90.0, "left": 180.0, "down": 270.0}


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class StartTable(_Table):
    """Where and which way the robot is put down."""

    tile: _Place
    heading: Literal["right", "up", "left", "down"] | _Number
    ahead_m: _Number = 0.0
    left_m: _Number = 0.0
    turn_deg: _Number = 0.0

    @property
    def heading_rad(self) -> float:
        """Heading before ``turn_deg`` [rad]."""
        degrees = HEADINGS[self.heading] if isinstance(self.heading, str) else self.heading
        return math.radians(degrees % 360.0)


class WallTable(_Table):
    """A wall from one point to another [m]."""

    from_m: _Point
    to_m: _Point

    @model_validator(mode="after")
    def _has_length(self) -> WallTable:
        if math.dist(self.from_m, self.to_m) < 1e-4:
            raise ValueError("found a wall from a point to itself, expected two points at least 0.1 mm apart")
        return self


class ObstacleTable(_Table):
    """A box or a disc on the floor."""

    kind: Literal["box", "disc"]
    at_m: _Point
    heading_deg: _Number = 0.0
    size_m: _Size | None = None
    diameter_m: _Positive | None = None
    mass_kg: _Positive = 0.2
    friction: Annotated[float, Strict(), Field(ge=0, le=10, allow_inf_nan=False)] = 0.4
    movable: Annotated[bool, Strict()] = True

    @model_validator(mode="after")
    def _has_its_size(self) -> ObstacleTable:
        if self.kind == "box" and (self.size_m is None or self.diameter_m is not None):
            raise ValueError(
                "found a box without size_m or with diameter_m, expected size_m = [length, width]"
            )
        if self.kind == "disc" and (self.diameter_m is None or self.size_m is not None):
            raise ValueError("found a disc without diameter_m or with size_m, expected diameter_m")
        return self


class ImageTable(_Table):
    """A picture of the floor."""

    file: Annotated[str, Field(min_length=1)]
    pixels_per_metre: _Positive | None = None
    marks_px: Annotated[list[_Point], Field(max_length=100)] | None = None
    marks_m: Annotated[list[_Point], Field(max_length=100)] | None = None
    white: _Level = 255.0
    black: _Level = 0.0

    @model_validator(mode="after")
    def _has_a_scale(self) -> ImageTable:
        if self.pixels_per_metre is None and self.marks_px is None:
            raise ValueError("found no scale, expected pixels_per_metre, or marks_px of a photograph")
        if self.pixels_per_metre is not None and self.marks_px is not None:
            raise ValueError("found both pixels_per_metre and marks_px, expected one of them")
        if self.marks_m is not None and self.marks_px is None:
            raise ValueError("found marks_m without marks_px, expected both")
        return self

    @model_validator(mode="after")
    def _has_contrast(self) -> ImageTable:
        if self.white - self.black < 1.0:
            raise ValueError(
                f"found white {self.white:g} and black {self.black:g}, expected white above black"
            )
        return self


class CourseTable(_Table):
    """A course file."""

    title: str = ""
    notes: str = ""
    map: str
    start: StartTable
    goal: _Place
    checkpoints: Annotated[list[_Place], Field(max_length=2048)] | None = None
    tile_size_m: Annotated[float, Strict(), Field(ge=0.02, le=5, allow_inf_nan=False)] | None = None
    field_m: _Size | None = None
    line_width_m: _Positive = 0.025
    walls: Annotated[list[WallTable], Field(max_length=1000)] = []
    obstacles: Annotated[list[ObstacleTable], Field(max_length=200)] = []
    image: ImageTable | None = None

    def tile_edge_m(self, columns: int, rows: int, where: str) -> float:
        """Return the edge of a tile [m], from the tile size or from the field's.

        Raises
        ------
        InputError
            If the two disagree, or tiles would not be square.
        """
        edge = self.tile_size_m or (self.field_m[0] / columns if self.field_m else TILE_SIZE_M)
        wanted = columns * edge, rows * edge
        if self.field_m and not all(
            math.isclose(a, b, rel_tol=1e-6) for a, b in zip(self.field_m, wanted, strict=True)
        ):
            size = f"{wanted[0]:g} x {wanted[1]:g} m: {columns} x {rows} square tiles of {edge:g} m"
            raise expected(where, f"{self.field_m[0]:g} x {self.field_m[1]:g} m", size)
        return edge


def validate(table: Mapping[str, Any], where: str) -> CourseTable:
    """Check a parsed TOML table.

    Raises
    ------
    InputError
        If a field is missing, unknown, of the wrong kind or out of range; names it.
    """
    try:
        return CourseTable.model_validate(table)
    except ValidationError as error:
        raise first_fault(error, where, "a field of course files (docs/courses.md)") from None
