"""A course on paper at true scale: one sheet, or A4, A3 or Letter sheets to cut and join; vector PDF.

Every sheet shows a piece of the field inside a frame that is its cutting line. To the right and above, where
another sheet joins, the print goes on for a strip: the neighbour, cut along its own frame, is glued onto it.
Diamonds on the frames meet their other halves, and a 100 mm ruler in the margin shows whether the printer kept
the scale. What is drawn on the floor besides the line are grey hairlines, too thin for a colour sensor to see.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D
from shapely import affinity
from shapely.geometry import LineString, MultiLineString, Point, box
from shapely.geometry.base import BaseGeometry

from gecar.files import write_whole
from gecar.plots.courses.course import outline_patch
from gecar.plots.courses.robot import Points, placed
from gecar.plots.courses.sheets import FOOT_MM, MARGIN_MM, STRIP_MM, Plan, Sheet, plan_sheets
from gecar.plots.style import FAINT, SOFT
from gecar.world.course.course import Course

RULER_MM = 100
_MM_PER_INCH = 25.4
# Grey and width [mm] of strokes.
_HAIRLINE, _CUT, _MARK = ("#C4C4C4", 0.12), ("#9A9A9A", 0.15), ("#404040", 0.2)
_DIAMOND = 3.0 * np.array([[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])  # mm
_TEXT_MM = 42.0
_INSTRUCTIONS = """{} sheets. Print them at 100 %, without fitting to the page; the ruler on each must measure 100 mm.
Cut each along its frame on the left and below, and leave the strips on the right and above.
Start with the lowest row on the left; glue each sheet onto its neighbours' strips, so that the diamonds close.
Sheets of bare floor are left out."""


class _Floor(NamedTuple):
    """What is printed on the field [mm]: the line, hairlines, and words at places."""

    line: BaseGeometry
    hairlines: BaseGeometry
    words: list[tuple[Point, str]]


def print_course(
    course: Course, path: Path, paper: str = "A4", guides: bool = True, only_line: bool = False
) -> Plan:
    """Write a course as PDF at true scale.

    Parameters
    ----------
    course
        What.
    path
        Where to.
    paper
        "A4", "A3", "Letter", or "sheet" for the whole field on one page.
    guides
        Whether to draw tiles, START, GOAL, walls and the places of obstacles as hairlines.
    only_line
        Whether to print the line and nothing else, on the sheets it crosses.

    Returns
    -------
    Plan
        The sheets printed; with more than one, an overview comes before them.

    Raises
    ------
    InputError
        As `gecar.plots.courses.sheets.plan_sheets`.
    """
    plan, floor = plan_sheets(course, paper, only_line), _floor(course, guides and not only_line)
    about = {"Title": f"{course.title or course.name}, 1:1", "Creator": "gecar", "CreationDate": None}
    look: Any = {
        "path.simplify": False,
        "pdf.fonttype": 42,
        "font.family": "DejaVu Sans",
        "text.color": _MARK[0],
    }
    stream = io.BytesIO()
    with mpl.rc_context(look), PdfPages(stream, metadata=about) as pdf:
        if len(plan.sheets) > 1:
            pdf.savefig(_overview(course, plan))
        for number, sheet in enumerate(plan.sheets, start=1):
            words = f"{course.title or course.name}  ·  sheet {sheet.name}, {number} of {len(plan.sheets)}"
            pdf.savefig(_page(course, plan, sheet, floor, words))
    write_whole(path, stream.getvalue())
    return plan


def _floor(course: Course, guides: bool) -> _Floor:
    line = affinity.scale(course.line_area, 1000.0, 1000.0, origin=(0, 0))
    if not guides:
        return _Floor(line, MultiLineString(), [])
    tiles = [course.layout.square(int(k)).exterior for k in np.flatnonzero(course.drivable)]
    walls = [LineString([wall[:2], wall[2:]]) for wall in course.walls]
    obstacles = [obstacle.outline.exterior for obstacle in course.obstacles]
    strokes = shapely.union_all([*tiles, *walls, *obstacles, _start_cross(course)])
    words = [
        (_corner_mm(course, tile), word)
        for tile, word in ((course.start_tile, "START"), (course.goal, "GOAL"))
    ]
    return _Floor(line, affinity.scale(strokes, 1000.0, 1000.0, origin=(0, 0)), words)


def _start_cross(course: Course) -> MultiLineString:
    """Return START [m]: the wheels' axle, and an arrow from its middle the way the robot looks."""
    axle, shaft = [(0.0, -0.06), (0.0, 0.06)], [(-0.03, 0.0), (0.09, 0.0)]
    head = [(0.075, -0.01), (0.09, 0.0), (0.075, 0.01)]
    return MultiLineString([LineString(placed(np.array(s), *course.start)) for s in (axle, shaft, head)])


def _corner_mm(course: Course, tile: int) -> Point:
    x, y = course.layout.centre_m(tile)
    inset = 0.46 * course.tile_size_m
    return Point(1000.0 * (x - inset), 1000.0 * (y + inset))


class _Page:
    """A page of paper to draw on in millimetres from its lower left corner; drawn in the order of the calls."""

    def __init__(self, size: tuple[float, float]) -> None:
        self.figure = Figure(figsize=(size[0] / _MM_PER_INCH, size[1] / _MM_PER_INCH))
        self.mm = Affine2D().scale(1.0 / _MM_PER_INCH) + self.figure.dpi_scale_trans

    def area(self, shape: BaseGeometry, colour: str) -> None:
        """Fill an area."""
        if shape.area > 0.0:
            patch = outline_patch(shape, facecolor=colour, edgecolor="none")
            self.figure.add_artist(patch)
            patch.set_transform(self.mm)

    def stroke(self, lines: Sequence[npt.ArrayLike], grey: str, width_mm: float) -> None:
        """Draw polylines, as one path: a page has hundreds, and an artist for each would take seconds."""
        if lines:
            whole = Outline.make_compound_path(*(Outline(np.asarray(line, np.float64)) for line in lines))
            width = 72.0 * width_mm / _MM_PER_INCH
            patch = PathPatch(whole, fill=False, edgecolor=grey, linewidth=width, capstyle="butt")
            self.figure.add_artist(patch)
            patch.set_transform(self.mm)

    def words(self, x: float, y: float, text: str, size: float, **style: Any) -> None:
        """Write; size in points."""
        self.figure.text(x, y, text, size=size, transform=self.mm, **style)


def _page(course: Course, plan: Plan, sheet: Sheet, floor: _Floor, words: str) -> Figure:
    page = _Page(plan.page)
    wide, high = sheet.width + STRIP_MM * bool(sheet.right), sheet.height + STRIP_MM * bool(sheet.above)
    window = box(sheet.x, sheet.y, sheet.x + wide, sheet.y + high)
    shift = MARGIN_MM - sheet.x, FOOT_MM - sheet.y
    if course.image:
        _put_image(page, plan, course, window, shift)
    page.stroke(_lines_of(affinity.translate(floor.hairlines.intersection(window), *shift)), *_HAIRLINE)
    page.area(affinity.translate(floor.line.intersection(window), *shift), "black")
    for place, word in floor.words:
        if window.contains(place):
            page.words(place.x + shift[0], place.y + shift[1], word, 9.0, color="#B0B0B0", va="top")
    _draw_frame(page, sheet)
    _draw_foot(page, plan, sheet, words)
    return page.figure


def _lines_of(shape: BaseGeometry) -> list[Points]:
    """Return a geometry's lines, shape (n, 2) each; points that a cut left over are none."""
    parts = getattr(shape, "geoms", [shape])
    return [shapely.get_coordinates(p) for p in parts if isinstance(p, LineString) and not p.is_empty]


def _put_image(
    page: _Page, plan: Plan, course: Course, window: BaseGeometry, shift: tuple[float, float]
) -> None:
    """Put a picture's part inside a window [mm], each of its pixels where it lies on the field."""
    assert course.image
    pitch = max(1000.0 / course.image.pixels_per_metre, 0.1)  # mm; 250 dots an inch are enough
    cells = course.raster(pitch / 1000.0)
    x0, y0, x1, y1 = window.bounds
    columns = slice(math.floor(x0 / pitch), math.ceil(x1 / pitch))
    rows = slice(math.floor(y0 / pitch), math.ceil(y1 / pitch))
    part = cells[rows, columns]
    left, bottom = columns.start * pitch + shift[0], rows.start * pitch + shift[1]
    right, top = left + part.shape[1] * pitch, bottom + part.shape[0] * pitch
    axes = page.figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    picture = axes.imshow(
        part, extent=(left, right, bottom, top), origin="lower", cmap="gray", vmin=0, vmax=255, aspect="auto"
    )
    axes.set(xlim=(0.0, plan.page[0]), ylim=(0.0, plan.page[1]))
    picture.set_clip_path(outline_patch(affinity.translate(window, *shift), transform=axes.transData))


def _draw_frame(page: _Page, sheet: Sheet) -> None:
    """Draw the frame to cut along, marks beyond its corners for a ruler, and diamonds where sheets join."""
    x0, y0, x1, y1 = MARGIN_MM, FOOT_MM, MARGIN_MM + sheet.width, FOOT_MM + sheet.height
    right, top = x1 + STRIP_MM * bool(sheet.right), y1 + STRIP_MM * bool(sheet.above)
    marks = [[(x, y), (x, y + 5.0)] for x in (x0, x1) for y in (y0 - 6.0, top + 1.0)]
    marks += [[(x, y), (x + 5.0, y)] for y in (y0, y1) for x in (x0 - 6.0, right + 1.0)]
    page.stroke(marks, *_MARK)
    lines: list[npt.ArrayLike] = [[(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]]
    # Neighbour, ends of the edge, and the way from it into the sheet.
    edges = ((sheet.right, (x1, y0), (x1, y1), (-1, 0)), (sheet.above, (x0, y1), (x1, y1), (0, -1)),
             (sheet.left, (x0, y0), (x0, y1), (1, 0)), (sheet.below, (x0, y0), (x1, y0), (0, 1)))  # fmt: skip
    for name, start, end, inwards in edges:
        for share in (0.2, 0.8) if name else ():
            x, y = (a + share * (b - a) for a, b in zip(start, end, strict=True))
            lines.append(placed(_DIAMOND, x, y, 0.0))
            word, turn = "–".join(sorted((sheet.name, name))), 90 if inwards[0] else 0
            at = x + 5.0 * inwards[0], y + 5.0 * inwards[1]
            page.words(*at, word, 5.0, color=_CUT[0], ha="center", va="center", rotation=turn)
    page.stroke(lines, *_CUT)


def _draw_foot(page: _Page, plan: Plan, sheet: Sheet, words: str) -> None:
    """Draw the ruler, the sheet's name, and how to join it."""
    x, y = MARGIN_MM, 11.0
    page.stroke([[(x, y), (x + RULER_MM, y)]], *_MARK)
    tall = [3.0 if mm % 10 == 0 else 2.0 if mm % 5 == 0 else 1.2 for mm in range(RULER_MM + 1)]
    page.stroke([[(x + mm, y), (x + mm, y + t)] for mm, t in enumerate(tall)], *_MARK)
    page.words(x, y - 1.0, "100 mm: measure me. Print at 100 %, without fitting to the page.", 6.0, va="top")
    page.words(plan.page[0] - MARGIN_MM, 6.0, sheet.name, 20.0, weight="bold", ha="right")
    page.words(x, 4.0, words + _how_to_join(sheet), 6.0)


def _how_to_join(sheet: Sheet) -> str:
    strips = ((sheet.right, "on the right"), (sheet.above, "above"))
    glued = " and ".join(f"{name} onto the strip {where}" for name, where in strips if name)
    return f"  ·  glue {glued}" if glued else ""


def _overview(course: Course, plan: Plan) -> Figure:
    """Draw all sheets in their places on one page, and say how to join them."""
    page = _Page(plan.page)
    room = plan.page[0] - 2 * MARGIN_MM, plan.page[1] - 2 * MARGIN_MM - _TEXT_MM
    scale = min(room[0] / course.width_m, room[1] / course.height_m)
    top = plan.page[1] - MARGIN_MM
    page.words(MARGIN_MM, top, course.title or course.name, 16.0, weight="bold", va="top")
    page.words(MARGIN_MM, top - 10.0, _INSTRUCTIONS.format(len(plan.sheets)), 9.0, va="top", linespacing=1.5)
    shift = MARGIN_MM, top - _TEXT_MM - scale * course.height_m
    page.area(
        affinity.translate(affinity.scale(course.line_area, scale, scale, origin=(0, 0)), *shift), FAINT
    )
    for sheet in plan.sheets:
        x, y, wide, high = (v * scale / 1000.0 for v in sheet[1:5])
        frame = affinity.translate(box(x, y, x + wide, y + high), *shift)
        page.stroke([frame.exterior.coords], SOFT, 0.2)
        middle = frame.centroid
        page.words(middle.x, middle.y, sheet.name, 8.0, color=SOFT, ha="center", va="center")
    return page.figure
