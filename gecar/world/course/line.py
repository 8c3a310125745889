"""The line as geometry: the area it covers, and the way along it from START to GOAL."""

from __future__ import annotations

import shapely
from shapely.geometry import LineString, MultiLineString, MultiPolygon, Point, Polygon
from shapely.ops import substring

from gecar.world.course.driving_order import first_side
from gecar.world.course.layout import Layout, Pose
from gecar.world.course.tiles import Side, Stroke

# Coordinates are snapped to a nanometre, so that neighbouring tiles' pieces share their corners exactly.
_GRID_M = 1e-9
_MIDDLES = {side.middle for side in Side}


def _on_field(layout: Layout, index: int, stroke: Stroke) -> LineString:
    column, row = layout.place(index)
    return LineString(
        [((column + x) * layout.tile_size_m, (row + y) * layout.tile_size_m) for x, y in stroke]
    )


def strokes(layout: Layout) -> MultiLineString:
    """Return the middle of the line as drawn, every tile's strokes."""
    return MultiLineString(
        [_on_field(layout, k, s) for k in range(len(layout.characters)) for s in layout.tile(k).strokes]
    )


def line_area(layout: Layout) -> MultiPolygon:
    """Return the area the line covers [m]: its strokes, one line width wide, with sharp corners."""
    half = 0.5 * layout.line_width_m
    pieces = [
        _on_field(layout, k, _past_edges(stroke))
        .buffer(half, cap_style="flat", join_style="mitre")
        .intersection(layout.square(k))
        for k in range(len(layout.characters))
        for stroke in layout.tile(k).strokes
    ]
    joints = [Point(layout.centre_m(k)).buffer(half, cap_style="square") for k in _with_joint(layout)]
    whole = shapely.union_all([*pieces, *joints], grid_size=_GRID_M)
    parts = [part for part in getattr(whole, "geoms", [whole]) if isinstance(part, Polygon)]
    return MultiPolygon([part for part in parts if not part.is_empty])


def _past_edges(stroke: Stroke) -> Stroke:
    """Lengthen a stroke past the edges it ends at, at right angles to them, so that neighbours meet flush."""
    before = [(2.0 * x - 0.5, 2.0 * y - 0.5) for x, y in stroke[:1] if (x, y) in _MIDDLES]
    after = [(2.0 * x - 0.5, 2.0 * y - 0.5) for x, y in stroke[-1:] if (x, y) in _MIDDLES]
    return (*before, *stroke, *after)


def _with_joint(layout: Layout) -> list[int]:
    """Return the T tiles: their stem ends on the bar's middle, where rounding must not leave a seam."""
    return [k for k in range(len(layout.characters)) if layout.tile(k).kind == "T"]


def route(layout: Layout, pose: Pose, start: int, sequence: list[int]) -> LineString:
    """Return the way along the line from beside START's pose to GOAL's edge.

    Returns
    -------
    shapely.LineString
        Empty where the driving order leaves the line.
    """
    sides = _sides_crossed(layout, start, sequence)
    if sides is None:
        return LineString()
    pieces = [_first_piece(layout, pose, start, sides[0])]
    for index, came, leave in zip(sequence, sides, sides[1:], strict=False):
        pieces.append(_on_field(layout, index, layout.tile(index).path(came.opposite, leave)))
    points = [pieces[0].coords[0]] + [p for piece in pieces for p in list(piece.coords)[1:]]
    return LineString(points)


def _sides_crossed(layout: Layout, start: int, sequence: list[int]) -> list[Side] | None:
    """Return the edge over which the line leaves each tile for the next one, or None where it does not."""
    sides: list[Side] = []
    for before, after in zip([start, *sequence], sequence, strict=False):
        over = [side for side, beyond in layout.line_neighbours(before) if beyond == after]
        if not over or (sides and over[0] == sides[-1].opposite):
            return None
        sides.append(over[0])
    return sides


def _first_piece(layout: Layout, pose: Pose, start: int, leave: Side) -> LineString:
    """Return START's tile's line from the point beside the pose to where it leaves the tile."""
    others = layout.tile(start).sides - {leave}
    behind = first_side(pose.heading_rad).opposite
    if others:
        whole = _on_field(
            layout, start, layout.tile(start).path(behind if behind in others else min(others), leave)
        )
    else:
        whole = _on_field(layout, start, layout.tile(start).strokes[0][::-1])
    beside = min(whole.project(Point(pose.x_m, pose.y_m)), whole.length - _GRID_M)
    return LineString(substring(whole, beside, whole.length).coords)
