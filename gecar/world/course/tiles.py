"""The tiles a course is laid with: the character each has in a course's map, and the line drawn on it.

A tile is a unit square, x to the right and y up, from (0, 0) to (1, 1). Its line meets the tile's edges only
at their middles, so that any two neighbours whose lines end at the shared edge join.

========  ==========  =====================================================================
ASCII     drawn       tile
========  ==========  =====================================================================
``-``     ``─``       straight, left to right
``|``     ``│``       straight, up and down
``F``     ``┌``       sharp corner, right and down       (``7`` ``┐``, ``L`` ``└``, ``J`` ``┘``)
``f``     ``╭``       curved corner, right and down      (``?`` ``╮``, ``l`` ``╰``, ``j`` ``╯``)
``+``     ``┼``       crossing
``>``     ``├``       T, the stem to the right           (``<`` ``┤``, ``v`` ``┬``, ``^`` ``┴``)
``=``     ``╌``       straight with a gap, left to right
``:``     ``╎``       straight with a gap, up and down
``~``               zigzag, left to right: up, then down (``u``: down, then up)
``S``               zigzag, upwards: right, then left    (``Z``: left, then right)
``[``     ``╶``       the line ends here, and leaves to the right (``]`` ``╴``: to the left)
``i``     ``╷``       the line ends here, and leaves downwards    (``!`` ``╵``: upwards)
``.``     ``·``       bare floor the robot may drive on
``#``     ``░``       not part of the course: being here ends a run
========  ==========  =====================================================================

A map may use either column; both may be mixed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

Point = tuple[float, float]
Stroke = tuple[Point, ...]

# How much of a gap tile is gap: 6 cm of the default tile of 0.30 m, over twice the line's width.
GAP = 0.20
# Zigzag: stubs that meet the neighbours at a right angle, then swings to both sides of the middle.
_STUB, _SWING = 0.15, 0.10
# A quarter circle in this many chords leaves it by at most 0.011 mm on the default tile.
_ARC_CHORDS = 64


class Side(IntEnum):
    """An edge of a tile, counter-clockwise from the right, as headings are."""

    RIGHT = 0
    UP = 1
    LEFT = 2
    DOWN = 3

    @property
    def step(self) -> tuple[int, int]:
        """Columns and rows to the neighbour on this side."""
        return ((1, 0), (0, 1), (-1, 0), (0, -1))[self]

    @property
    def opposite(self) -> Side:
        """The side across the tile, which is also the neighbour's name for this edge."""
        return Side((self + 2) % 4)

    @property
    def middle(self) -> Point:
        """Middle of this edge in the unit tile."""
        columns, rows = self.step
        return 0.5 + 0.5 * columns, 0.5 + 0.5 * rows


CENTRE: Point = (0.5, 0.5)


@dataclass(frozen=True)
class Tile:
    """One kind of tile.

    Attributes
    ----------
    character
        ASCII character in a course's map.
    drawn
        Box-drawing character that means the same.
    kind
        What it is, in words.
    sides
        Edges at whose middle its line ends.
    strokes
        Its line, as polylines in the unit tile.
    drivable
        Whether a robot may be here.
    """

    character: str
    drawn: str
    kind: str
    sides: frozenset[Side] = frozenset()
    strokes: tuple[Stroke, ...] = ()
    drivable: bool = True

    def path(self, enter: Side, leave: Side) -> Stroke:
        """Return the way along the line from one side to another; over the middle where lines meet."""
        ends = (enter.middle, leave.middle)
        for stroke in self.strokes:
            if (stroke[0], stroke[-1]) == ends:
                return stroke
            if (stroke[-1], stroke[0]) == ends:
                return stroke[::-1]
        if enter == leave.opposite and self.strokes:
            return _through_gap(self.strokes, ends)
        return (ends[0], CENTRE, ends[1])


def _through_gap(strokes: tuple[Stroke, ...], ends: tuple[Point, Point]) -> Stroke:
    """Join strokes that lie along one straight way."""
    inner = {p for stroke in strokes for p in stroke if p not in ends}
    return (ends[0], *sorted(inner, key=lambda p: math.dist(p, ends[0])), ends[1])


def _straight(a: Side, b: Side) -> Stroke:
    return (a.middle, b.middle)


def _sharp(a: Side, b: Side) -> Stroke:
    return (a.middle, CENTRE, b.middle)


def _curved(a: Side, b: Side) -> Stroke:
    """Quarter circle about the tile's corner between two sides, from a to b."""
    corner = tuple(0.5 + 0.5 * (m + n) for m, n in zip(a.step, b.step, strict=True))
    first = math.atan2(a.middle[1] - corner[1], a.middle[0] - corner[0])
    last = math.atan2(b.middle[1] - corner[1], b.middle[0] - corner[0])
    sweep = math.remainder(last - first, 2 * math.pi)
    angles = (first + sweep * k / _ARC_CHORDS for k in range(1, _ARC_CHORDS))
    arc = tuple((corner[0] + 0.5 * math.cos(t), corner[1] + 0.5 * math.sin(t)) for t in angles)
    return (a.middle, *arc, b.middle)


def _end(a: Side) -> Stroke:
    return (a.middle, CENTRE)


def _gap(a: Side) -> tuple[Stroke, ...]:
    """Two strokes along one way with nothing between them."""
    half = 0.5 - 0.5 * GAP
    halves = []
    for side in (a, a.opposite):
        columns, rows = side.opposite.step
        x, y = side.middle
        halves.append(((x, y), (x + half * columns, y + half * rows)))
    return tuple(halves)


def _zigzag(first: float) -> Stroke:
    """Left to right, first to the side of the sign of ``first``."""
    quarter = (1.0 - 2.0 * _STUB) / 4.0
    return (
        (0.0, 0.5),
        (_STUB, 0.5),
        (_STUB + quarter, 0.5 + first * _SWING),
        (1.0 - _STUB - quarter, 0.5 - first * _SWING),
        (1.0 - _STUB, 0.5),
        (1.0, 0.5),
    )


def _upright(stroke: Stroke) -> Stroke:
    """Exchange x and y: a way to the right becomes a way up, its left its right."""
    return tuple((y, x) for x, y in stroke)


def _tile(character: str, drawn: str, kind: str, sides: str, *strokes: Stroke) -> Tile:
    named = {"r": Side.RIGHT, "u": Side.UP, "l": Side.LEFT, "d": Side.DOWN}
    return Tile(character, drawn, kind, frozenset(named[s] for s in sides), strokes)


_R, _U, _L, _D = Side.RIGHT, Side.UP, Side.LEFT, Side.DOWN

TILES: tuple[Tile, ...] = (
    _tile("-", "─", "straight", "rl", _straight(_L, _R)),
    _tile("|", "│", "straight", "ud", _straight(_D, _U)),
    _tile("F", "┌", "sharp corner", "rd", _sharp(_R, _D)),
    _tile("7", "┐", "sharp corner", "ld", _sharp(_L, _D)),
    _tile("L", "└", "sharp corner", "ru", _sharp(_R, _U)),
    _tile("J", "┘", "sharp corner", "lu", _sharp(_L, _U)),
    _tile("f", "╭", "curved corner", "rd", _curved(_R, _D)),
    _tile("?", "╮", "curved corner", "ld", _curved(_L, _D)),
    _tile("l", "╰", "curved corner", "ru", _curved(_R, _U)),
    _tile("j", "╯", "curved corner", "lu", _curved(_L, _U)),
    _tile("+", "┼", "crossing", "ruld", _straight(_L, _R), _straight(_D, _U)),
    _tile(">", "├", "T", "rud", _straight(_D, _U), _end(_R)),
    _tile("<", "┤", "T", "uld", _straight(_D, _U), _end(_L)),
    _tile("v", "┬", "T", "rld", _straight(_L, _R), _end(_D)),
    _tile("^", "┴", "T", "rul", _straight(_L, _R), _end(_U)),
    _tile("=", "╌", "gap", "rl", *_gap(_L)),
    _tile(":", "╎", "gap", "ud", *_gap(_D)),
    _tile("~", "~", "zigzag", "rl", _zigzag(1.0)),
    _tile("u", "u", "zigzag", "rl", _zigzag(-1.0)),
    _tile("S", "S", "zigzag", "ud", _upright(_zigzag(1.0))),
    _tile("Z", "Z", "zigzag", "ud", _upright(_zigzag(-1.0))),
    _tile("[", "╶", "line end", "r", _end(_R)),
    _tile("]", "╴", "line end", "l", _end(_L)),
    _tile("i", "╷", "line end", "d", _end(_D)),
    _tile("!", "╵", "line end", "u", _end(_U)),
    _tile(".", "·", "bare floor", ""),
    Tile("#", "░", "blank", drivable=False),
)

BY_CHARACTER = {key: tile for tile in TILES for key in (tile.character, tile.drawn)}


def _mirror(stroke: Stroke) -> frozenset[Point]:
    """Return a stroke's points flipped left to right, to compare as a set to within rounding."""
    return frozenset((round(1.0 - x, 9), round(y, 9)) for x, y in stroke)


def _same_mirrored(tile: Tile, other: Tile) -> bool:
    flipped = {_mirror(stroke) for stroke in tile.strokes}
    own = {frozenset((round(x, 9), round(y, 9)) for x, y in stroke) for stroke in other.strokes}
    return flipped == own and tile.kind == other.kind


MIRRORED = {tile.character: next(t.character for t in TILES if _same_mirrored(tile, t)) for tile in TILES}
"""The character of each tile's mirror image, left and right exchanged."""
