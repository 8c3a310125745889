"""Mirror images of courses: what a mirrored program drives on."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gecar.world.course import Course, Pose
from gecar.world.raster import WHITE, FloorImage


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
