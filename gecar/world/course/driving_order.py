"""In which order a course's tiles are driven: followed along the line, or listed and checked."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from gecar.errors import InputError, expected
from gecar.world.course.layout import Layout
from gecar.world.course.tiles import Side

_ASK = "a list of checkpoints = [[column, row], ...], as the line alone does not say the way"


def first_side(heading_rad: float) -> Side:
    """Return the edge a heading points to, the nearest of the four."""
    return Side(round(heading_rad / (0.5 * math.pi)) % 4)


def follow_line(layout: Layout, start: int, goal: int, heading_rad: float, where: str) -> list[int]:
    """Follow the line from START to GOAL, straight on at crossings.

    Returns
    -------
    list
        Tiles after START in driving order, GOAL last; a crossing is there once for each time it is driven
        over.

    Raises
    ------
    InputError
        If the line ends, branches at a T, or runs round without reaching GOAL: then checkpoints must be
        listed.
    """
    leave = first_side(heading_rad)
    here, way, seen = start, [], set()
    while True:
        here = _next_tile(layout, here, leave, where)
        way.append(here)
        if here == goal:
            return way
        if (here, leave) in seen:
            raise expected(where, "a line that never reaches GOAL", _ASK)
        seen.add((here, leave))
        leave = _way_out(layout, here, leave, where)


def _next_tile(layout: Layout, here: int, leave: Side, where: str) -> int:
    for side, beyond in layout.line_neighbours(here):
        if side == leave:
            return beyond
    raise expected(where, f"no line onwards from tile {list(layout.place(here))}", _ASK)


def _way_out(layout: Layout, here: int, heading: Side, where: str) -> Side:
    """Return the edge the line leaves a tile by, entered with a heading."""
    others = layout.tile(here).sides - {heading.opposite}
    if layout.tile(here).kind == "crossing":
        return heading
    if len(others) == 1:
        return next(iter(others))
    found = "a branch" if others else "an end of the line"
    raise expected(where, f"{found} at tile {list(layout.place(here))}", _ASK)


def check_order(layout: Layout, start: int, sequence: Sequence[int], where: str) -> None:
    """Check that each tile of a driving order can be driven to from the one before, without crossing GOAL.

    Raises
    ------
    InputError
        If a tile is off the course, repeated on the spot, GOAL comes early, or there is no way.
    """
    goal = sequence[-1]
    if goal == start:
        raise expected(f"{where}, goal", "START's own tile", "another tile")
    for before, after in zip([start, *sequence], sequence, strict=False):
        fault = _fault(layout, before, after, goal)
        if fault:
            raise expected(
                f"{where}, tile {list(layout.place(after))}", fault, "a tile that can be driven to in order"
            )
    if goal in sequence[:-1]:
        raise expected(f"{where}, checkpoints", "GOAL's tile among the checkpoints", "GOAL only at the end")


def _fault(layout: Layout, before: int, after: int, goal: int) -> str:
    if not layout.drivable[after]:
        return "a blank tile"
    if before == after:
        return "the same tile twice running"
    if not tile_route(layout, before, after, avoid=goal):
        return f"no drivable way from tile {list(layout.place(before))}"
    return ""


def tile_route(layout: Layout, start: int, end: int, avoid: int = -1) -> list[int]:
    """Return a shortest way by tiles from one to another, both included; empty if there is none.

    ``avoid`` may only be the way's last tile.
    """
    came_from, waiting = {start: start}, deque([start])
    while waiting and end not in came_from:
        here = waiting.popleft()
        for beyond in layout.drivable_neighbours(here):
            if beyond not in came_from and (beyond != avoid or beyond == end):
                came_from[beyond] = here
                waiting.append(beyond)
    if end not in came_from:
        return []
    route = [end]
    while route[-1] != start:
        route.append(came_from[route[-1]])
    return route[::-1]


def named_tile(layout: Layout, place: Sequence[int], where: str) -> int:
    """Return the index of a tile named by column and row.

    Raises
    ------
    InputError
        If it is outside the map or off the course.
    """
    index = layout.index(place[0], place[1])
    if index < 0:
        raise _outside(layout, place, where)
    if not layout.drivable[index]:
        raise expected(where, f"{list(place)}, a blank tile", "a tile of the course")
    return index


def _outside(layout: Layout, place: Sequence[int], where: str) -> InputError:
    limits = (
        f"[column, row] from [0, 0] to [{layout.columns - 1}, {layout.rows - 1}], the lower left being [0, 0]"
    )
    return expected(where, list(place), limits)
