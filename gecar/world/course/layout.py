"""How tiles lie on a course: a grid of tiles, their neighbours, and whether their lines join."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon, box

from gecar.errors import InputError, expected
from gecar.world.course.tiles import BY_CHARACTER, MIRRORED, TILES, Side, Tile

MAX_TILES = 1024


class Pose(NamedTuple):
    """Pose of the axle's centre: metres, and heading [rad] counter-clockwise from +x."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True)
class Layout:
    """A grid of tiles.

    Tiles are numbered row by row from the lower left corner: row * columns + column, row 0 at the bottom.

    Attributes
    ----------
    characters
        One ASCII character for each tile, in that order.
    columns
        Tiles across.
    tile_size_m, line_width_m
        Edge of a tile and width of the line [m].
    """

    characters: str
    columns: int
    tile_size_m: float
    line_width_m: float

    @property
    def rows(self) -> int:
        """Tiles up."""
        return len(self.characters) // self.columns

    @property
    def width_m(self) -> float:
        """Width of the field [m]."""
        return self.columns * self.tile_size_m

    @property
    def height_m(self) -> float:
        """Height of the field [m]."""
        return self.rows * self.tile_size_m

    @cached_property
    def drivable(self) -> npt.NDArray[np.bool_]:
        """Whether a robot may be on a tile, shape (rows * columns,)."""
        return np.array([BY_CHARACTER[c].drivable for c in self.characters])

    def tile(self, index: int) -> Tile:
        """Return the tile at an index."""
        return BY_CHARACTER[self.characters[index]]

    def place(self, index: int) -> tuple[int, int]:
        """Return a tile's column and row."""
        return index % self.columns, index // self.columns

    def index(self, column: int, row: int) -> int:
        """Return a tile's index, -1 where there is none."""
        inside = 0 <= column < self.columns and 0 <= row < self.rows
        return row * self.columns + column if inside else -1

    def index_at(self, x_m: float, y_m: float) -> int:
        """Return the index of the tile a point [m] lies on, -1 outside the field."""
        return self.index(int(np.floor(x_m / self.tile_size_m)), int(np.floor(y_m / self.tile_size_m)))

    def neighbour(self, index: int, side: Side) -> int:
        """Return the index of the tile beyond an edge, -1 beyond the field."""
        column, row = self.place(index)
        columns, rows = side.step
        return self.index(column + columns, row + rows)

    def drivable_neighbours(self, index: int) -> list[int]:
        """Return the tiles a robot can drive to over an edge."""
        return self._drivable_neighbours[index]

    @cached_property
    def _drivable_neighbours(self) -> list[list[int]]:
        around = ([self.neighbour(k, side) for side in Side] for k in range(len(self.characters)))
        return [[n for n in beyond if n >= 0 and self.drivable[n]] for beyond in around]

    def line_neighbours(self, index: int) -> Iterator[tuple[Side, int]]:
        """Yield the sides over which the line goes on, and the tile there."""
        for side in sorted(self.tile(index).sides):
            beyond = self.neighbour(index, side)
            if beyond >= 0 and side.opposite in self.tile(beyond).sides:
                yield side, beyond

    def centre_m(self, index: int) -> tuple[float, float]:
        """Return the middle of a tile [m]."""
        column, row = self.place(index)
        return (column + 0.5) * self.tile_size_m, (row + 0.5) * self.tile_size_m

    def square(self, index: int) -> Polygon:
        """Return a tile's outline [m]."""
        column, row = self.place(index)
        size = self.tile_size_m
        return box(column * size, row * size, (column + 1) * size, (row + 1) * size)

    def lines(self, drawn: bool = False) -> list[str]:
        """Return the map as people read it, top row first, in ASCII or drawn with box characters."""
        shown = (BY_CHARACTER[c].drawn for c in self.characters) if drawn else iter(self.characters)
        text = "".join(shown)
        return [text[k : k + self.columns] for k in range(0, len(text), self.columns)][::-1]

    def mirrored(self) -> Layout:
        """Return the layout with left and right exchanged."""
        flipped = "".join(MIRRORED[c] for line in self.lines()[::-1] for c in line[::-1])
        return Layout(flipped, self.columns, self.tile_size_m, self.line_width_m)

    def mirrored_index(self, index: int) -> int:
        """Return where a tile lies in the mirrored layout."""
        column, row = self.place(index)
        return row * self.columns + self.columns - 1 - column


def read_map(text: str, where: str) -> tuple[str, int]:
    """Read a course's map: lines of tile characters, the top row first.

    Parameters
    ----------
    text
        The map.
    where
        File and field, for errors.

    Returns
    -------
    tuple
        (one ASCII character for each tile, lower left first and row by row; tiles across).

    Raises
    ------
    InputError
        If there are no or too many tiles, a line's length differs from the first's, or a character is no
        tile.
    """
    lines = [line.strip() for line in text.strip().splitlines()]
    columns = len(lines[0]) if lines else 0
    if columns == 0:
        raise expected(where, "no tiles", "lines of tile characters such as 'F--7'")
    if columns * len(lines) > MAX_TILES:
        raise expected(where, f"{columns} x {len(lines)} tiles", f"at most {MAX_TILES} tiles")
    for number, line in enumerate(lines, start=1):
        if len(line) != columns:
            raise expected(f"{where} line {number}", f"{len(line)} tiles", f"{columns}, as in line 1")
        for column, character in enumerate(line, start=1):
            if character not in BY_CHARACTER:
                known = " ".join(tile.character for tile in TILES)
                raise expected(
                    f"{where} line {number}, column {column}",
                    f"unknown tile {character!r}",
                    f"one of {known}",
                )
    return "".join(BY_CHARACTER[c].character for line in lines[::-1] for c in line), columns


def check_lines_join(layout: Layout, start: int, goal: int, where: str) -> None:
    """Check that every line end meets another, and that there is one line.

    On the START and GOAL tiles the line may end at an edge: a course need not be a loop.

    Raises
    ------
    InputError
        If a line stops short, or has a part that hangs together with nothing.
    """
    for index in range(len(layout.characters)):
        joined = {side for side, _ in layout.line_neighbours(index)}
        for side in sorted(layout.tile(index).sides - joined):
            if index not in (start, goal):
                raise _loose_end(layout, index, side, where)
    with_line = {k for k in range(len(layout.characters)) if layout.tile(k).strokes}
    apart = with_line - line_tiles_from(
        layout, start if start in with_line else min(with_line, default=start)
    )
    if apart:
        place = list(layout.place(min(apart)))
        raise expected(
            where, f"a line at tile {place} that START's line does not reach", "one connected line"
        )


def _loose_end(layout: Layout, index: int, side: Side, where: str) -> InputError:
    beyond = layout.neighbour(index, side)
    there = f"tile '{layout.characters[beyond]}'" if beyond >= 0 else "the field's edge"
    place = f"{where}, tile {list(layout.place(index))} '{layout.characters[index]}'"
    return expected(
        place, f"a line that leaves {_TOWARDS[side]} and stops at {there}", "a tile whose line meets it"
    )


_TOWARDS = {Side.RIGHT: "to the right", Side.UP: "upwards", Side.LEFT: "to the left", Side.DOWN: "downwards"}


def line_tiles_from(layout: Layout, start: int) -> set[int]:
    """Return the tiles the line reaches from a tile."""
    seen, waiting = {start}, [start]
    while waiting:
        for _, beyond in layout.line_neighbours(waiting.pop()):
            if beyond not in seen:
                seen.add(beyond)
                waiting.append(beyond)
    return seen
