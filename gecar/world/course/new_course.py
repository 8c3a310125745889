"""A new course to start from: a loop along the rim, with every field explained."""

from __future__ import annotations

from pathlib import Path

from gecar.errors import expected
from gecar.files import write_whole
from gecar.world.course.course import parse_course
from gecar.world.course.layout import MAX_TILES
from gecar.world.course.schema import TILE_SIZE_M

_TEMPLATE = '''\
# A course for gecar. Look at it with `gecar course show {file}`.
title = "{title}"
notes = "A loop, as a template."

tile_size_m = {tile:g}
line_width_m = {line:g}

# One character a tile, the top row first:
#   - |      straight           F 7 L J   sharp corners       f ? l j   curved corners
#   +        crossing           > < v ^   T, stem that way    [ ] i !   the line ends here
#   = :      gap in the line    ~ u S Z   zigzags             .         bare floor
#   #        not part of the course: a robot that gets there has failed
map = """
{map}
"""

# Tiles are [column, row], counted from [0, 0] at the lower left.
goal = [0, {goal}]
# checkpoints = [[0, 2], [1, 2]]    # only where the line branches; otherwise all tiles along the line

[start]
tile = [0, {start}]
heading = "up"      # up, down, left, right, or degrees counter-clockwise from +x
left_m = {left:g}     # the robot stands beside the line, so that the colour sensor sees white
# ahead_m = 0.0
# turn_deg = 0.0

# [[walls]]
# from_m = [0.5, 0.5]     # metres, x right and y up from the field's lower left corner
# to_m = [0.9, 0.5]

# [[obstacles]]
# kind = "box"            # or "disc", with diameter_m
# at_m = [0.6, 0.45]
# size_m = [0.10, 0.05]
# heading_deg = 0
# mass_kg = 0.1
# friction = 0.4
# movable = true

# [image]                 # a scan or photograph of the floor, instead of the line drawn from the tiles
# file = "scan.png"
# pixels_per_metre = 1000
# marks_px = [[210, 1490], [1890, 1510], [1620, 420], [430, 400]]    # instead of the scale: the field's corners in a
#                                                                   # photograph, counter-clockwise from the lower left
'''


def new_course(path: Path, columns: int = 8, rows: int = 4, tile_size_m: float = TILE_SIZE_M) -> None:
    """Write a course file to start from.

    Parameters
    ----------
    path
        Where to; its name becomes the course's.
    columns, rows
        Tiles across (2 or more) and up (3 or more).
    tile_size_m
        Edge of a tile [m].

    Raises
    ------
    InputError
        If the file exists or cannot be written, or the course would be too small or too large.
    """
    if columns < 2 or rows < 3:
        raise expected("--size", f"{columns} x {rows} tiles", "at least 2 x 3")
    if columns * rows > MAX_TILES:
        raise expected("--size", f"{columns} x {rows} tiles", f"at most {MAX_TILES} tiles")
    write_course(path, _filled(path, columns, rows, tile_size_m))


def write_course(path: Path, text: str) -> None:
    """Write a course's text to a new file.

    Raises
    ------
    InputError
        If the file exists or cannot be written, its name does not end in .toml, or the course has a fault.
    """
    if path.suffix != ".toml":
        raise expected(path, f"a name ending in '{path.suffix}'", "a course file's name, ending in .toml")
    if path.exists():
        raise expected(path, "a file that exists", "a new name")
    parse_course(text, str(path))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text)
    except OSError as error:
        raise expected(
            path, error.strerror or "no way to write there", "a folder that can be written"
        ) from None


def _filled(path: Path, columns: int, rows: int, tile_size_m: float) -> str:
    across = columns - 2
    lines = ["f" + "-" * across + "?", *["|" + "#" * across + "|"] * (rows - 2), "l" + "-" * across + "j"]
    start = rows // 2
    return _TEMPLATE.format(
        file=path.name,
        title=path.stem.replace("_", " ").replace("\\", "").replace('"', ""),
        map="\n".join(lines),
        tile=tile_size_m,
        line=tile_size_m / 12,
        left=-tile_size_m / 12,
        start=start,
        goal=start - 1,
    )
