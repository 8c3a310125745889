"""Random courses: a line that turns at random over a field, never onto a tile it has passed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gecar.errors import expected
from gecar.world.course.layout import MAX_TILES
from gecar.world.course.tiles import TILES, Side

MOST_COLUMNS, MOST_ROWS = 8, 6
"""Largest field of a random course, unless another is asked for [tiles]."""
TILES_DRAWN, TURNS_DRAWN, TILE_SIZES_M = (12, 22), (0.2, 0.6), (0.25, 0.30, 0.35, 0.40)
"""What a seed draws a course's length [tiles], its share of corners and its tiles' edge [m] from."""
ZIGZAGS = 0.08
"""Share of straight tiles that swing to both sides."""
LINE_WIDTH_M = 0.025
_ATTEMPTS = 2_000

_Place = tuple[int, int]
_TEXT = '''\
title = "Random course {seed}"
notes = "{notes}"
tile_size_m = {edge:g}
line_width_m = {line:g}
map = """
{map}
"""
goal = [{goal[0]}, {goal[1]}]

[start]
tile = [{start[0]}, {start[1]}]
heading = "{heading}"
left_m = -{line:g}
'''


class Way(NamedTuple):
    """A way over tiles: the places [column, row] in order, and the edge each is left by, the last one's too."""

    places: list[_Place]
    leave: list[Side]


def random_text(
    seed: int,
    tiles: int | None = None,
    turns: float | None = None,
    tile_size_m: float | None = None,
    size: tuple[int, int] = (MOST_COLUMNS, MOST_ROWS),
) -> str:
    """Return the file of a random course: bends and corners to both sides, zigzags, no gap and no crossing.

    What is None is drawn: `TILES_DRAWN`, `TURNS_DRAWN`, `TILE_SIZES_M`. Each course also has its own share of sharp
    corners among the curved ones.

    Parameters
    ----------
    seed
        Random seed; equal seeds, equal courses.
    tiles
        Length of the line, START and GOAL included.
    turns
        Share of the tiles in which the line turns, as far as there is room; 0..1.
    tile_size_m
        Edge of a tile [m].
    size
        Columns and rows that the course may take up at most.

    Raises
    ------
    InputError
        If a value is out of range, or no such course was found on a field of that size.
    """
    if seed < 0:
        raise expected("random course, seed", seed, "a whole number from 0 up")
    rng = np.random.default_rng((seed, _STREAM))
    drawn = rng.random(4)
    low, high = TILES_DRAWN
    n = low + int(drawn[0] * (high - low + 1)) if tiles is None else tiles
    share = TURNS_DRAWN[0] + drawn[1] * (TURNS_DRAWN[1] - TURNS_DRAWN[0]) if turns is None else turns
    edge = TILE_SIZES_M[int(drawn[2] * len(TILE_SIZES_M))] if tile_size_m is None else tile_size_m
    _check(n, share, size)
    return _written(seed, _way(rng, n, share, size), edge, float(drawn[3]), rng)


_STREAM = 20_261_122


def _check(tiles: int, turns: float, size: tuple[int, int]) -> None:
    columns, rows = size
    if min(columns, rows) < 1 or columns * rows > MAX_TILES:
        raise expected("random course, size", f"{columns} x {rows} tiles", f"1 to {MAX_TILES} tiles")
    if not 3 <= tiles <= columns * rows // 2:
        most = f"3 to {columns * rows // 2}, half of the {columns} x {rows} tiles of the field"
        raise expected("random course, tiles", tiles, most)
    if not 0.0 <= turns <= 1.0:
        raise expected("random course, turns", f"{turns:g}", "a share of the tiles, 0 to 1")


def _way(rng: np.random.Generator, tiles: int, turns: float, size: tuple[int, int]) -> Way:
    """Walk at random until a walk is long enough; one that shuts itself in begins anew."""
    for _ in range(_ATTEMPTS):
        way = _walk(rng, tiles, turns, size)
        if len(way.places) == tiles:
            return way
    field = f"{size[0]} x {size[1]} tiles"
    raise expected("random course, tiles", f"no way over {tiles} tiles on {field}", "fewer, or a larger size")


def _walk(rng: np.random.Generator, tiles: int, turns: float, size: tuple[int, int]) -> Way:
    """Walk from a random tile to free ones; START and GOAL are straight."""
    here = int(rng.random() * size[0]), int(rng.random() * size[1])
    heading = Side(int(rng.random() * 4))
    places, leave = [here], [heading]
    while len(places) < tiles:
        here = _beyond(here, heading)
        if here in places or not (0 <= here[0] < size[0] and 0 <= here[1] < size[1]):
            break
        places.append(here)
        heading = _onwards(rng, here, heading, turns, places, size) if len(places) < tiles else heading
        leave.append(heading)
    return Way(places, leave)


def _onwards(
    rng: np.random.Generator,
    here: _Place,
    heading: Side,
    turns: float,
    places: list[_Place],
    size: tuple[int, int],
) -> Side:
    """Choose the edge to leave a tile by: a turn with the chance asked for, and what is free where that is not."""
    wants_turn, to_left = rng.random(2) < (turns, 0.5)
    left, right = Side((heading + 1) % 4), Side((heading + 3) % 4)
    sides = [left, right] if to_left else [right, left]
    for side in [*sides, heading] if wants_turn else [heading, *sides]:
        column, row = _beyond(here, side)
        if 0 <= column < size[0] and 0 <= row < size[1] and (column, row) not in places:
            return side
    return heading


def _beyond(place: _Place, side: Side) -> _Place:
    return place[0] + side.step[0], place[1] + side.step[1]


def _written(seed: int, way: Way, edge_m: float, sharp: float, rng: np.random.Generator) -> str:
    """Write a way as a course file, cut to the tiles it takes up."""
    enter = [way.leave[0].opposite, *(side.opposite for side in way.leave[:-1])]
    kinds = [_kind(a, b, sharp, rng) for a, b in zip(enter, way.leave, strict=True)]
    kinds[0] = kinds[-1] = "straight"
    left, low = (min(place[axis] for place in way.places) for axis in (0, 1))
    tiles = {
        (column - left, row - low): _character(kind, {a, b}, rng)
        for (column, row), kind, a, b in zip(way.places, kinds, enter, way.leave, strict=True)
    }
    columns, rows = (1 + max(place[axis] for place in tiles) for axis in (0, 1))
    lines = ["".join(tiles.get((c, r), "#") for c in range(columns)) for r in range(rows - 1, -1, -1)]
    ends = [(c - left, r - low) for c, r in (way.places[0], way.places[-1])]
    return _TEXT.format(
        seed=seed, notes=_notes(way, kinds), edge=edge_m, line=LINE_WIDTH_M, map="\n".join(lines),
        start=ends[0], goal=ends[1], heading=way.leave[0].name.lower(),
    )  # fmt: skip


def _kind(enter: Side, leave: Side, sharp: float, rng: np.random.Generator) -> str:
    chance = rng.random()
    if leave == enter.opposite:
        return "zigzag" if chance < ZIGZAGS else "straight"
    return "sharp corner" if chance < sharp else "curved corner"


def _character(kind: str, sides: set[Side], rng: np.random.Generator) -> str:
    fitting = [tile.character for tile in TILES if tile.kind == kind and tile.sides == sides]
    return fitting[int(rng.random() * len(fitting))]


def _notes(way: Way, kinds: list[str]) -> str:
    turned = [
        math.remainder(b - a, 4) for a, b in zip(way.leave, way.leave[1:], strict=False) if a != b
    ]  # in quarters, counter-clockwise
    sharp, zigzags = kinds.count("sharp corner"), kinds.count("zigzag")
    left, right = turned.count(1.0), turned.count(-1.0)
    return f"Tiles: {len(kinds)}. Turns to the left: {left}, to the right: {right}, sharp: {sharp}. Zigzags: {zigzags}."
