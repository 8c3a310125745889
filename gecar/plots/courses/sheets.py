"""Which piece of a course's field goes on which sheet of paper."""

from __future__ import annotations

import math
from collections.abc import Container
from typing import NamedTuple

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import LineString, box
from shapely.geometry.base import BaseGeometry

from gecar.errors import expected
from gecar.world.course.course import Course

PAPERS_MM = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "Letter": (215.9, 279.4)}
PAPERS = ("sheet", *PAPERS_MM)
# Printers leave up to 6 mm blank; the foot holds ruler and name.
MARGIN_MM, FOOT_MM, STRIP_MM = 12.0, 24.0, 10.0
_LONGEST_PAGE_MM = 5080.0  # 14 400 points, the largest page PDF readers show
_MOST_SHEETS = 500


class Sheet(NamedTuple):
    """A piece of the field on paper.

    Attributes
    ----------
    name
        Column letter and row number; A1 is at the lower left.
    x, y, width, height
        The piece [mm], in the field.
    right, above, left, below
        Names of the sheets that join there, "" where none does.
    """

    name: str
    x: float
    y: float
    width: float
    height: float
    right: str = ""
    above: str = ""
    left: str = ""
    below: str = ""


class Plan(NamedTuple):
    """Paper size, width and height [mm], and the sheets to print."""

    page: tuple[float, float]
    sheets: list[Sheet]


def plan_sheets(course: Course, paper: str, only_line: bool = False) -> Plan:
    """Divide a course's field into sheets; those with nothing but bare floor are left out.

    Parameters
    ----------
    course
        What to print.
    paper
        "A4", "A3" or "Letter", upright or lying, whichever takes fewer sheets; "sheet": the whole field on one page.
    only_line
        Whether to leave out sheets without line, too, though START, GOAL, a wall or an obstacle is marked there.

    Raises
    ------
    InputError
        If the paper is unknown, one page would be longer than PDF allows, or there would be over 500 sheets.
    """
    if paper == "sheet":
        return _one_sheet(course)
    if paper not in PAPERS_MM:
        raise expected("--paper", f"'{paper}'", " or ".join(PAPERS))
    short, long = PAPERS_MM[paper]
    printed = _printed(course, only_line)
    plans = (_tiled(course, page, printed) for page in ((short, long), (long, short)))
    plan = min(plans, key=lambda plan: len(plan.sheets))
    if len(plan.sheets) > _MOST_SHEETS:
        raise expected(
            "--paper", f"{paper}, which takes {len(plan.sheets)} sheets", f"at most {_MOST_SHEETS}"
        )
    return plan


def _one_sheet(course: Course) -> Plan:
    width, height = 1000.0 * course.width_m, 1000.0 * course.height_m
    page = width + 2 * MARGIN_MM, height + MARGIN_MM + FOOT_MM
    if max(page) > _LONGEST_PAGE_MM:
        raise expected(
            "--paper", f"sheet, for a field of {width:g} x {height:g} mm", "A4, A3 or Letter: PDF ends at 5 m"
        )
    return Plan(page, [Sheet("A1", 0.0, 0.0, width, height)])


def _printed(course: Course, only_line: bool) -> BaseGeometry:
    """Return where sheets are needed [mm]: line, and the places marked; of a picture all that may be driven on."""
    layout = course.layout
    squares = [layout.square(int(k)) for k in np.flatnonzero(course.drivable)]
    parts: list[BaseGeometry] = [*squares] if course.image else [course.line_area]
    if not only_line:
        parts += [layout.square(course.start_tile), layout.square(course.goal)]
        parts += [LineString([wall[:2], wall[2:]]).buffer(0.001) for wall in course.walls]
        parts += [obstacle.outline for obstacle in course.obstacles]
    return affinity.scale(shapely.union_all(parts), 1000.0, 1000.0, origin=(0, 0))


def _tiled(course: Course, page: tuple[float, float], printed: BaseGeometry) -> Plan:
    width, height = 1000.0 * course.width_m, 1000.0 * course.height_m
    step_x, step_y = page[0] - 2 * MARGIN_MM - STRIP_MM, page[1] - MARGIN_MM - FOOT_MM - STRIP_MM
    shapely.prepare(printed)
    pieces = {}
    for row in range(math.ceil(height / step_y - 1e-9)):
        for column in range(math.ceil(width / step_x - 1e-9)):
            x, y = column * step_x, row * step_y
            size = min(step_x, width - x), min(step_y, height - y)
            if printed.intersection(box(x, y, x + size[0], y + size[1])).area > 0.0:
                pieces[column, row] = (x, y, *size)
    return Plan(page, [Sheet(_name(*at), *piece, *_joined(*at, pieces)) for at, piece in pieces.items()])


def _name(column: int, row: int) -> str:
    letters = ""
    while column >= 0:
        letters = chr(ord("A") + column % 26) + letters
        column = column // 26 - 1
    return f"{letters}{row + 1}"


def _joined(column: int, row: int, pieces: Container[tuple[int, int]]) -> list[str]:
    around = (column + 1, row), (column, row + 1), (column - 1, row), (column, row - 1)
    return [_name(*at) if at in pieces else "" for at in around]
