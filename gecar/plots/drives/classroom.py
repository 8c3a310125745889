"""A drive as a page for the classroom: one HTML file that plays it, with nothing to load from anywhere."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from gecar.errors import expected
from gecar.files import read_text, write_whole
from gecar.language import opcodes as op
from gecar.language.program import Program
from gecar.plots.courses.course import WALL_HALF_WIDTH_M
from gecar.plots.courses.robot import shape_of
from gecar.plots.drives.path import line_colours, speed_of
from gecar.world.course.course import Course, Obstacle
from gecar.world.robot import Robot
from gecar.world.rollout import Drive, World

TEMPLATE = Path(__file__).with_suffix(".html")
SCRIPTS = tuple(Path(__file__).with_name(name) for name in ("floor.js", "play.js"))
_PICTURE_PITCH_M = 0.002


def write_classroom_page(
    world: World, program: Program, drive: Drive, path: Path, title: str = "", detail: str = ""
) -> Path:
    """Write a page that plays a drive.

    Parameters
    ----------
    world, program, drive
        Who drove where, with what program, and what came of it; the drive holds its trace.
    path
        Where to write it.
    title, detail
        What to write above it.

    Raises
    ------
    InputError
        If the drive holds no trace.
    """
    words = {
        "@TITLE@": html.escape(title or world.course.title or world.course.name),
        "@DETAIL@": html.escape(detail),
        "@ALT@": html.escape(f"The robot's way round the course. {title}"),
        "@DRIVE@": script_json(drive_json(world, program, drive)),
    }
    write_whole(path, filled(TEMPLATE, words))
    return path


def filled(template: Path, words: Mapping[str, str]) -> str:
    """Return a page's template with words in their places, and with the scripts that pages which play drives share."""
    page = read_text(template, "the page's template")
    scripts = {f"@{path.stem.upper()}@": read_text(path, "the page's script").rstrip() for path in SCRIPTS}
    for place, text in (scripts | dict(words)).items():
        page = page.replace(place, text)
    return page


def script_json(table: Any) -> str:
    """Return JSON for inside a script, which no text in it can end."""
    return json.dumps(table, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def drive_json(world: World, program: Program, drive: Drive) -> dict[str, Any]:
    """Return all the page shows, as JSON has it; metres, seconds, degrees and percent."""
    trace = drive.trace
    if trace is None or not len(trace["t_s"]):
        raise expected("drive", "no trace", "one simulated with trace=True")
    t = trace["t_s"]
    tests = program.opcodes[program.opcodes[:, op.OP] == op.TEST]
    return {
        "course": course_json(world.course),
        "robot": robot_json(world.robot),
        "lines": program.source.splitlines(),
        "colours": line_colours(trace),
        "thresholds": [float(c) / op.THRESHOLDS_PER_PCT for c in np.unique(tests[:, op.C])],
        "arrivals": [round(float(at), 3) for at in drive.arrival_s[:-1] if not np.isnan(at)],
        "arrivals_of": len(drive.arrival_s) - 1,
        "obstacles": None if drive.obstacles is None else np.round(drive.obstacles, 4).tolist(),
        "trace": {
            "t": _rounded(t, 3),
            "x": _rounded(trace["x_m"], 4),
            "y": _rounded(trace["y_m"], 4),
            "heading": _rounded(trace["heading_rad"], 3),
            "left_duty": _rounded(100 * trace["left_duty"], 1),
            "right_duty": _rounded(100 * trace["right_duty"], 1),
            "left_speed": _rounded(_rate(t, trace["left_angle_rad"]), 0),
            "right_speed": _rounded(_rate(t, trace["right_angle_rad"]), 0),
            "reflection": _rounded(trace["reflection_pct"], 1),
            "speed": _rounded(speed_of(trace), 3),
            "line": trace["line"].astype(int).tolist(),
        },
    }


def _rate(t: npt.NDArray[np.float64], angle: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the rate of an angle [rad] in degrees per second."""
    return np.degrees(np.gradient(angle, t)) if len(t) > 1 else np.zeros(len(t))


def _rounded(values: npt.NDArray[np.float64], places: int) -> list[float]:
    return (np.round(np.nan_to_num(values), places) + 0.0).tolist()  # no -0.0


def course_json(course: Course) -> dict[str, Any]:
    """Return what a page draws of a course [m]."""
    square = course.layout.square
    return {
        "width": course.width_m,
        "height": course.height_m,
        "tiles": [_rings(square(int(k)))[0] for k in np.flatnonzero(course.drivable)],
        "start": _rings(square(course.start_tile))[0],
        "goal": _rings(square(course.goal))[0],
        "line": _rings(course.line_area),
        "labels": _labels(course),
        "walls": [_rings(LineString([w[:2], w[2:]]).buffer(WALL_HALF_WIDTH_M))[0] for w in course.walls],
        "obstacles": [_thing(obstacle) for obstacle in course.obstacles],
        "picture": _picture(course) if course.image else None,
    }


def _rings(area: BaseGeometry) -> list[list[list[float]]]:
    """Return an area's rings, holes as rings of their own [m]; drawn by the even-odd rule."""
    polygons = list(getattr(area, "geoms", [area]))
    rings = [ring for p in polygons if not p.is_empty for ring in (p.exterior, *p.interiors)]
    return [np.round(shapely.get_coordinates(ring), 4).tolist() for ring in rings]


def _labels(course: Course) -> list[tuple[float, float, str]]:
    """Return START, GOAL and the checkpoints' numbers, and where they stand: a tile's upper left corner [m]."""
    names: dict[int, list[str]] = {}
    for number, tile in enumerate(course.checkpoints, start=1):
        names.setdefault(int(tile), []).append(str(number))
    words = {tile: " · ".join(numbers) for tile, numbers in names.items()}
    words |= {course.start_tile: "START", course.goal: "GOAL"}
    aside = 0.44 * course.tile_size_m
    centres = {tile: course.layout.centre_m(tile) for tile in words}
    return [(centres[k][0] - aside, centres[k][1] + aside, word) for k, word in words.items()]


def _thing(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle's outline about its own middle, and where it stands."""
    centred = replace(obstacle, x=0.0, y=0.0, heading=0.0)
    pose = (obstacle.x, obstacle.y, obstacle.heading)
    return {"shape": _rings(centred.outline)[0], "pose": pose, "movable": obstacle.movable}


def robot_json(robot: Robot) -> dict[str, Any]:
    """Return a robot's outlines about its axle's centre [m]."""
    shape = shape_of(robot)
    return {
        "body": shape.body.tolist(),
        "left": shape.left_wheel.tolist(),
        "right": shape.right_wheel.tolist(),
        "sensor": shape.sensor[0].tolist(),
    }


def _picture(course: Course) -> str:
    """Return a floor that is a picture, as PNG inside the page."""
    stream = io.BytesIO()
    Image.fromarray(course.raster(_PICTURE_PITCH_M)[::-1]).save(stream, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
