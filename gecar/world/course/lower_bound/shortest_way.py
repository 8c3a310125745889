"""The shortest way the axle's centre can take through a course's tiles, in order, to GOAL.

Consecutive tiles share an edge, and the two squares make a convex rectangle: whatever way leads from a point
of one to a point of the other, the straight one is no longer and stays inside. So a shortest way goes over
the shared edges alone, and is the string pulled tight through that sleeve of edges. It bends only at their
ends; dynamic programming over those ends, each looking ahead as far as it sees, finds it exactly (Lee and
Preparata, Networks 14(3), 1984).

Where the next checkpoint is no neighbour, the tiles that every way there must pass are put in between. What
is left of such jumps, and turns back to the tile just left, cut the way into parts that start and end freely,
which can only shorten it: the length stays a lower bound.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from shapely.geometry import LineString, Point

from gecar.world.course.driving_order import tile_route
from gecar.world.course.layout import Layout
from gecar.world.course.lower_bound.outer_wheel import Leg, legs_of
from gecar.world.course.tiles import Side

Place = tuple[float, float]
_EPS = 1e-12


class Portal(NamedTuple):
    """A shared edge on the way: its ends as seen when driving over it, in tiles: corners are exact."""

    left: Place
    right: Place


class ShortestWay(NamedTuple):
    """The shortest way [m]: where it leads, straight over jumps; the length no way can undercut; its straight legs."""

    path: LineString
    length_m: float
    legs: tuple[Leg, ...]


def shortest_way(layout: Layout, start: int, sequence: Sequence[int], x_m: float, y_m: float) -> ShortestWay:
    """Return the shortest way from START's point through the tiles in order to the edge of the last one.

    Parameters
    ----------
    layout
        The course's tiles.
    start, sequence
        START's tile, and the tiles after it in driving order, GOAL last.
    x_m, y_m
        START, on its tile [m].
    """
    size = layout.tile_size_m
    parts = _parts(layout, _with_tiles_between(layout, start, sequence))
    portals = [[_portal(layout, a, b) for a, b in pairwise(part)] for part in parts]
    ways = [_pull_tight(portals[0], (x_m / size, y_m / size)), *map(_pull_tight, portals[1:])]
    jumps = [layout.square(a[-1]).distance(layout.square(b[0])) for a, b in pairwise(parts)]
    legs = [leg for part, way in zip(parts, ways, strict=True) for leg in legs_of(layout, part, way)]
    points = [(x * size, y * size) for way in ways for x, y in way]
    length = sum(jumps) + size * sum(math.dist(a, b) for way in ways for a, b in pairwise(way))
    return ShortestWay(LineString(points if len(points) > 1 else points * 2), length, tuple(legs))


def _with_tiles_between(layout: Layout, start: int, sequence: Sequence[int]) -> list[int]:
    """Return the driving order with every tile put in that cannot be avoided."""
    chain = [start]
    for after in sequence:
        if after in layout.drivable_neighbours(chain[-1]):
            chain.append(after)
        else:
            chain += _must_pass(layout, chain[-1], after, avoid=sequence[-1])[1:]
    return chain


def _must_pass(layout: Layout, start: int, end: int, avoid: int) -> list[int]:
    """Return the tiles every way from one tile to another passes, in order, both included.

    A tile of a shortest way can be avoided if some side way from an earlier tile comes back to a later one.
    """
    route = tile_route(layout, start, end, avoid)
    position = {tile: k for k, tile in enumerate(route)}
    seen, farthest, kept = set(route), 0, []
    for k, tile in enumerate(route):
        if farthest <= k:
            kept.append(tile)
        waiting = [tile]
        while waiting:
            for beyond in _beyond(layout, waiting.pop(), avoid):
                if beyond in position:
                    farthest = max(farthest, position[beyond])
                    if farthest == len(route) - 1 > k + 1:
                        return [*kept, end]
                elif beyond not in seen and beyond != avoid:
                    seen.add(beyond)
                    waiting.append(beyond)
    return kept


def _beyond(layout: Layout, index: int, avoid: int) -> list[int]:
    """Return the tiles a robot can get to from one: its neighbours, and some that touch it at a corner.

    Between two steps the robot's centre may slip over the point where two tiles touch. If a third tile they
    share can be driven on, that point is its corner as well, and the way counts as one through it.
    """
    beside = layout.drivable_neighbours(index)
    column, row = layout.place(index)
    corners = []
    for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        across = layout.index(column + i, row + j)
        shared = {layout.index(column + i, row), layout.index(column, row + j)} - {avoid}
        if across >= 0 and layout.drivable[across] and not shared & set(beside):
            corners.append(across)
    return beside + corners


def _parts(layout: Layout, chain: list[int]) -> list[list[int]]:
    """Cut a way at its jumps and where it turns back."""
    parts = [[chain[0]]]
    for tile in chain[1:]:
        part = parts[-1]
        if tile not in layout.drivable_neighbours(part[-1]):
            parts.append([tile])
        elif len(part) > 1 and part[-2] == tile:
            parts.append([part[-1], tile])
        else:
            part.append(tile)
    return parts


def _portal(layout: Layout, before: int, after: int) -> Portal:
    side = next(s for s in Side if layout.neighbour(before, s) == after)
    (column, row), (columns, rows) = layout.place(before), side.step
    corners = (1 + columns - rows, 1 + rows + columns), (1 + columns + rows, 1 + rows - columns)
    left, right = ((column + x // 2, row + y // 2) for x, y in corners)
    return Portal(left, right)


def _pull_tight(portals: list[Portal], origin: Place | None = None) -> list[Place]:
    """Return the shortest way from an origin, or from anywhere on the first portal, over all portals."""
    if not portals:
        return [origin] if origin else []
    portals = _without_straights(portals)
    stops: list[tuple[Place, ...]] = [tuple(portal) for portal in portals]
    if origin:  # a way that never bends meets the last edge at a right angle, if it can
        stops[-1] += (_nearest(portals[-1], origin),)
    places = [(0, origin)] if origin else [(1, place) for place in stops[0]]
    length = dict.fromkeys(places, 0.0)
    came_from: dict[tuple[int, Place], tuple[int, Place]] = {}
    places += [(k + 1, place) for k, on_portal in enumerate(stops) for place in on_portal]
    for node in places:
        for seen in _seen_from(*node, portals, stops) if node in length else ():
            reach = length[node] + math.dist(node[1], seen[1])
            if reach < length.get(seen, math.inf):
                length[seen], came_from[seen] = reach, node
    node = min(((len(portals), place) for place in stops[-1]), key=lambda n: length.get(n, math.inf))
    way = [node[1]]
    while node in came_from:
        node = came_from[node]
        way.append(node[1])
    return way[::-1]


def _without_straights(portals: list[Portal]) -> list[Portal]:
    """Leave out edges between two others, like rungs of a ladder: who passes those passes them too."""
    kept = portals[:1]
    for portal, following in pairwise(portals[1:]):
        if not all(_aligned(kept[-1][end], portal[end], following[end]) for end in (0, 1)):
            kept.append(portal)
    return kept + portals[1:][-1:]


def _aligned(a: Place, b: Place, c: Place) -> bool:
    return a != b != c and abs(_cross(_towards(a, b), _towards(a, c))) < _EPS


def _nearest(portal: Portal, place: Place) -> Place:
    near = LineString(portal).interpolate(LineString(portal).project(Point(place)))
    return near.x, near.y


def _towards(a: Place, b: Place) -> Place:
    return b[0] - a[0], b[1] - a[1]


def _cross(a: Place, b: Place) -> float:
    """Return a x b: positive where b points to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def _seen_from(
    passed: int, eye: Place, portals: list[Portal], stops: list[tuple[Place, ...]]
) -> Iterator[tuple[int, Place]]:
    """Yield the stops ahead to which the straight way passes every edge between."""
    left = right = None
    for k in range(passed, len(portals)):
        for place in stops[k]:
            sight = _towards(eye, place)
            if (
                left is None
                or right is None
                or (_cross(right, sight) > -_EPS and _cross(sight, left) > -_EPS)
            ):
                yield k + 1, place
        to_left, to_right = (_towards(eye, end) for end in portals[k])
        if (
            abs(_cross(to_left, to_right)) < _EPS
            and to_left[0] * to_right[0] + to_left[1] * to_right[1] <= 0.0
        ):
            continue  # the eye is on this edge
        left = to_left if left is None or _cross(left, to_left) < 0.0 else left
        right = to_right if right is None or _cross(right, to_right) > 0.0 else right
        if _cross(right, left) < -_EPS:
            return
