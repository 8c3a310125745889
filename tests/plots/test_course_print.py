import re
import zlib

import pytest
import shapely
from PIL import Image
from shapely.geometry import box
from support.courses import make_course

from gecar.errors import InputError
from gecar.plots.courses.course_print import print_course
from gecar.plots.courses.sheets import FOOT_MM, MARGIN_MM, STRIP_MM, plan_sheets
from gecar.world.course.course import load_course, parse_course

MM = 72.0 / 25.4
NUMBER = rb"(-?[\d.]+)"


def pages(path):
    """Return each page's size [mm] and the ends of its straight strokes [mm]."""
    raw = path.read_bytes()
    sizes = [
        (float(w) / MM, float(h) / MM) for w, h in re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", raw)
    ]
    streams = [
        zlib.decompress(s) for s in re.findall(rb"/FlateDecode >>\nstream\n(.*?)\nendstream", raw, re.DOTALL)
    ]
    drawings = [s for s in streams if b" re\n" in s or b" l\n" in s]
    move_line = re.compile(NUMBER + rb" " + NUMBER + rb" m\n" + NUMBER + rb" " + NUMBER + rb" l\n")
    return sizes, [[[float(v) / MM for v in found] for found in move_line.findall(s)] for s in drawings]


def fills(path):
    """Return the corners of all filled outlines [mm], on all pages."""
    streams = re.findall(rb"/FlateDecode >>\nstream\n(.*?)\nendstream", path.read_bytes(), re.DOTALL)
    outline = re.compile(rb"((?:-?[\d.]+ -?[\d.]+ [ml]\n|h\n|\n)+)f")
    corner = re.compile(NUMBER + rb" " + NUMBER + rb" [ml]\n")
    found = (corner.findall(block) for s in streams for block in outline.findall(zlib.decompress(s)))
    return [[[float(v) / MM for v in at] for at in corners] for corners in found]


def horizontal(strokes, length):
    return [
        s
        for s in strokes
        if s[1] == pytest.approx(s[3], abs=1e-4) and abs(s[2] - s[0]) == pytest.approx(length, abs=1e-3)
    ]


@pytest.mark.parametrize(("paper", "size"), [("A4", {210, 297}), ("A3", {297, 420})])
def test_every_sheet_has_its_paper_size_and_a_100_mm_ruler(tmp_path, paper, size):
    plan = print_course(make_course(), tmp_path / "c.pdf", paper)
    sizes, strokes = pages(tmp_path / "c.pdf")
    assert len(sizes) == len(plan.sheets) + 1
    assert all({round(w, 3), round(h, 3)} == size for w, h in sizes)
    assert all(len(horizontal(page, 100.0)) >= 1 for page in strokes[1:])


def test_one_sheet_shows_the_whole_field_at_true_scale(tmp_path):
    print_course(load_course("paper"), tmp_path / "c.pdf", "sheet")
    (size,), _ = pages(tmp_path / "c.pdf")
    assert size == pytest.approx((2400 + 2 * MARGIN_MM, 1200 + MARGIN_MM + FOOT_MM))
    line = max((corners for corners in fills(tmp_path / "c.pdf") if [0.0, 0.0] not in corners), key=len)
    xs, ys = zip(*line, strict=True)
    assert (max(xs) - min(xs), max(ys) - min(ys)) == pytest.approx((2100 + 25, 900 + 25), abs=1e-3)
    assert min(xs) == pytest.approx(MARGIN_MM + 150 - 12.5, abs=1e-3)


@pytest.mark.parametrize("name", ["paper", "figure_eight"])
@pytest.mark.parametrize("paper", ["A4", "A3", "Letter"])
def test_sheets_cover_line_and_marks_and_fit_their_paper(name, paper):
    course = load_course(name)
    plan = plan_sheets(course, paper)
    covered = shapely.union_all(
        [box(s.x, s.y, s.x + s.width, s.y + s.height).buffer(0.01) for s in plan.sheets]
    )
    marks = [course.layout.square(k) for k in (course.start_tile, course.goal)]
    for marked in (course.line_area, *marks):
        assert covered.covers(shapely.affinity.scale(marked, 1000, 1000, origin=(0, 0)))
    for sheet in plan.sheets:
        assert sheet.width + STRIP_MM + 2 * MARGIN_MM <= plan.page[0] + 1e-9
        assert sheet.height + STRIP_MM + MARGIN_MM + FOOT_MM <= plan.page[1] + 1e-9


def test_sheets_of_bare_floor_are_left_out():
    course = load_course("paper")
    everything, line = (plan_sheets(course, "A4", only_line) for only_line in (False, True))
    assert len(line.sheets) <= len(everything.sheets) <= 33  # of 61 that hold floor
    for sheet in line.sheets:
        piece = box(sheet.x, sheet.y, sheet.x + sheet.width, sheet.y + sheet.height)
        assert (
            piece.intersection(shapely.affinity.scale(course.line_area, 1000, 1000, origin=(0, 0))).area > 0
        )


def test_only_the_line_is_printed_where_that_is_asked_for(tmp_path):
    plain, only = tmp_path / "plain.pdf", tmp_path / "only.pdf"
    print_course(load_course("paper"), plain, "sheet")
    print_course(load_course("paper"), only, "sheet", only_line=True)
    assert only.stat().st_size < plain.stat().st_size


def test_joined_sheets_name_each_other():
    sheets = {sheet.name: sheet for sheet in plan_sheets(load_course("paper"), "A4").sheets}
    for sheet in sheets.values():
        assert not sheet.right or sheets[sheet.right].left == sheet.name
        assert not sheet.above or sheets[sheet.above].below == sheet.name


def test_prints_are_the_same_every_time(tmp_path):
    course = make_course("--", start="[0, 0]", goal="[1, 0]", heading='"right"')
    for name in ("a.pdf", "b.pdf"):
        print_course(course, tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_a_scanned_course_is_printed_as_it_is(tmp_path):
    Image.new("L", (300, 100), 128).save(tmp_path / "scan.png")
    text = "map = '...'\ngoal = [2, 0]\ncheckpoints = []\ntile_size_m = 0.1\n[start]\ntile = [0, 0]\nheading = 0.0\n"
    course = parse_course(
        text + "[image]\nfile = 'scan.png'\npixels_per_metre = 1000\n", str(tmp_path / "c.toml")
    )
    print_course(course, tmp_path / "c.pdf", "sheet")
    assert b"/Image" in (tmp_path / "c.pdf").read_bytes()


def test_unknown_papers_and_endless_pages_are_refused():
    with pytest.raises(InputError, match="--paper: found 'A0', expected sheet or A4 or A3 or Letter"):
        plan_sheets(make_course(), "A0")
    with pytest.raises(InputError, match="PDF ends at 5 m"):
        plan_sheets(make_course("-" * 20, goal="[19, 0]", start="[0, 0]", heading='"right"'), "sheet")


@pytest.mark.parametrize("paper", ["A4", "Letter"])
def test_the_classrooms_course_takes_a_dozen_sheets(paper):
    assert len(plan_sheets(load_course("classroom"), paper).sheets) <= 12
