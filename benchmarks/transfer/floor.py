"""A course's floor from its file: where the line lies, which tiles may be driven on, and in what order."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import LineString, Point, box
from shapely.geometry.base import BaseGeometry

from gecar.errors import InputError, expected
from gecar.files import is_file, read_toml, shipped

Tile = tuple[int, int]
Spot = tuple[float, float]
Stroke = tuple[Spot, ...]

SPOT_DIAMETER = 0.008  # m, what the colour sensor averages over


def _arc(centre_x: float, centre_y: float) -> Stroke:
    """Quarter circle about a tile's corner, through the middles of the two sides that meet there."""
    turns = [math.radians(2.0 * k) for k in range(46)]
    towards_x, towards_y = 1.0 - 2.0 * centre_x, 1.0 - 2.0 * centre_y
    return tuple(
        (centre_x + 0.5 * towards_x * math.cos(a), centre_y + 0.5 * towards_y * math.sin(a)) for a in turns
    )


def _zigzag(first: float) -> Stroke:
    """From left to right with two points a tenth of a tile off the middle, the first up (1) or down (-1)."""
    offsets = ((0.0, 0.0), (0.15, 0.0), (0.325, first), (0.675, -first), (0.85, 0.0), (1.0, 0.0))
    return tuple((x, 0.5 + 0.1 * off) for x, off in offsets)


def _upright(stroke: Stroke) -> Stroke:
    return tuple((y, x) for x, y in stroke)


_L, _R, _D, _U, _M = (0.0, 0.5), (1.0, 0.5), (0.5, 0.0), (0.5, 1.0), (0.5, 0.5)
_DASHED: tuple[Stroke, ...] = ((_L, (0.4, 0.5)), ((0.6, 0.5), _R))

# docs/courses.md, in tiles from the lower left corner: character and box drawing, then the line's strokes.
STROKES: dict[str, tuple[Stroke, ...]] = {
    "-─": ((_L, _R),),
    "|│": ((_D, _U),),
    "F┌": ((_D, _M, _R),),
    "7┐": ((_L, _M, _D),),
    "L└": ((_U, _M, _R),),
    "J┘": ((_L, _M, _U),),
    "f╭": (_arc(1.0, 0.0),),
    "?╮": (_arc(0.0, 0.0),),
    "l╰": (_arc(1.0, 1.0),),
    "j╯": (_arc(0.0, 1.0),),
    "+┼": ((_L, _R), (_D, _U)),
    ">├": ((_D, _U), (_M, _R)),
    "<┤": ((_D, _U), (_M, _L)),
    "v┬": ((_L, _R), (_M, _D)),
    "^┴": ((_L, _R), (_M, _U)),
    "=╌": _DASHED,
    ":╎": tuple(_upright(stroke) for stroke in _DASHED),
    "~": (_zigzag(1.0),),
    "u": (_zigzag(-1.0),),
    "S": (_upright(_zigzag(1.0)),),
    "Z": (_upright(_zigzag(-1.0)),),
    "[╶": ((_M, _R),),
    "]╴": ((_L, _M),),
    "i╷": ((_D, _M),),
    "!╵": ((_M, _U),),
    ".·": (),
}
_OFF = "#░"
_SIDES = {(1, 0): _R, (0, 1): _U, (-1, 0): _L, (0, -1): _D}
_HEADINGS = {"right": 0.0, "up": 90.0, "left": 180.0, "down": 270.0}
_UNKNOWN = ("walls", "obstacles", "image")


@dataclass(frozen=True)
class Floor:
    """What lies on the floor, and the rules of the course.

    Attributes
    ----------
    name
        Of the course.
    tile_m
        Edge of a tile [m].
    size
        Columns and rows.
    tiles
        Those that may be driven on.
    line
        The printed line.
    start
        Pose of the axle's centre [m, m, rad].
    checkpoints, goal
        Tiles to be entered in order, and the last of all.
    """

    name: str
    tile_m: float
    size: Tile
    tiles: frozenset[Tile]
    line: BaseGeometry
    start: tuple[float, float, float]
    checkpoints: tuple[Tile, ...]
    goal: Tile
    _near: dict[Tile, BaseGeometry] = field(default_factory=dict, repr=False, compare=False)

    def tile(self, x: float, y: float) -> Tile:
        """Return the tile a place lies in."""
        return math.floor(x / self.tile_m), math.floor(y / self.tile_m)

    def line_share(self, x: float, y: float) -> float:
        """Return the share of the sensor's spot, its middle here [m], that lies on the line."""
        spot = Point(x, y).buffer(SPOT_DIAMETER / 2.0, quad_segs=16)
        return float(spot.intersection(self._line_near(self.tile(x, y))).area / spot.area)

    def _line_near(self, tile: Tile) -> BaseGeometry:
        """Return the part of the line that a spot whose middle lies in a tile can reach."""
        if tile not in self._near:
            x, y = tile[0] * self.tile_m, tile[1] * self.tile_m
            reach = box(x, y, x + self.tile_m, y + self.tile_m).buffer(SPOT_DIAMETER)
            self._near[tile] = self.line.intersection(reach)
            shapely.prepare(self._near[tile])
        return self._near[tile]


def load_floor(course: str) -> Floor:
    """Read a course's file.

    Parameters
    ----------
    course
        Name of a file that comes with gecar, or a path.

    Raises
    ------
    InputError
        If it is missing, or has walls, obstacles or an image: these are not built here.
    """
    path = Path(course) if is_file(Path(course)) else shipped("courses") / f"{course}.toml"
    table = read_toml(path, "a course")
    for name in _UNKNOWN:
        if name in table:
            raise expected(path, f"[{name}]", "a course of tiles alone: other engines get no walls here")
    try:
        return _floor(path, table)
    except (KeyError, TypeError, IndexError) as error:
        raise expected(path, f"no course ({error})", "what gecar course show accepts") from None


def _floor(path: Path, table: dict[str, Any]) -> Floor:
    characters = {
        (column, row): character
        for row, text in enumerate(reversed(table["map"].strip().splitlines()))
        for column, character in enumerate(text.strip())
    }
    columns, rows = (1 + max(tile[k] for tile in characters) for k in (0, 1))
    edge = table.get("tile_size_m") or table.get("field_m", [0.30 * columns])[0] / columns
    strokes = {
        tile: _strokes(path, character) for tile, character in characters.items() if character not in _OFF
    }
    goal: Tile = (table["goal"][0], table["goal"][1])
    start, heading = (table["start"]["tile"][0], table["start"]["tile"][1]), _heading(table["start"])
    listed = [(tile[0], tile[1]) for tile in table.get("checkpoints", [])]
    order = listed or _followed(path, strokes, start, heading, goal)
    line = _line(strokes, edge, table.get("line_width_m", 0.025))
    pose = _pose(table["start"], heading, edge)
    return Floor(path.stem, edge, (columns, rows), frozenset(strokes), line, pose, tuple(order), goal)


def _strokes(path: Path, character: str) -> tuple[Stroke, ...]:
    for names, strokes in STROKES.items():
        if character in names:
            return strokes
    raise expected(path, f"tile '{character}'", "a tile of docs/courses.md")


def _line(strokes: dict[Tile, tuple[Stroke, ...]], edge: float, width: float) -> BaseGeometry:
    """Draw all strokes with square corners and ends that are cut off."""
    return shapely.union_all(
        [
            LineString([((tile[0] + x) * edge, (tile[1] + y) * edge) for x, y in stroke]).buffer(
                width / 2.0, cap_style="flat", join_style="mitre"
            )
            for tile, several in strokes.items()
            for stroke in several
        ]
    )


def _heading(start: dict[str, Any]) -> float:
    """Return START's heading without ``turn_deg`` [rad]."""
    heading = start["heading"]
    return math.radians(_HEADINGS[heading] if isinstance(heading, str) else float(heading))


def _pose(start: dict[str, Any], heading: float, edge: float) -> tuple[float, float, float]:
    ahead, left = start.get("ahead_m", 0.0), start.get("left_m", 0.0)
    cos, sin = math.cos(heading), math.sin(heading)
    x, y = ((start["tile"][k] + 0.5) * edge for k in (0, 1))
    turned = heading + math.radians(start.get("turn_deg", 0.0))
    return x + ahead * cos - left * sin, y + ahead * sin + left * cos, turned


def _followed(
    path: Path, strokes: dict[Tile, tuple[Stroke, ...]], start: Tile, heading: float, goal: Tile
) -> list[Tile]:
    """Follow the line from START, the way the robot looks, to GOAL; straight on over crossings."""
    tile, way, order = start, (round(math.cos(heading)), round(math.sin(heading))), [start]
    while len(order) <= 4 * len(strokes):
        ends = {side for side, spot in _SIDES.items() for stroke in strokes[tile] if spot in _rounded(stroke)}
        back = (-way[0], -way[1])
        onward = [way] if way in ends else [side for side in ends if side != back]
        if len(onward) != 1:
            break
        way = onward[0]
        tile = (tile[0] + way[0], tile[1] + way[1])
        if tile == goal:
            return order[1:]
        if tile not in strokes:
            break
        order.append(tile)
    raise InputError(f"{path}: found no line from START to GOAL, expected one or a list of checkpoints")


def _rounded(stroke: Stroke) -> set[Spot]:
    return {(round(x, 6), round(y, 6)) for x, y in (stroke[0], stroke[-1])}
