"""Courses from photographs taken at a slant: made straight by marks of known places."""

import numpy as np
import pytest
from PIL import Image, ImageFilter
from support.courses import course_text

from gecar.errors import InputError
from gecar.world.course.course import load_course, parse_course

# What a camera at a slant makes of a field's corners [pixels], counter-clockwise from the lower left.
SEEN = [(110.0, 880.0), (1490.0, 930.0), (1230.0, 170.0), (330.0, 130.0)]
CORNERS = "[[110, 880], [1490, 930], [1230, 170], [330, 130]]"


def photographed(course, path, size=(1600, 1000), blur=1.0, noise=3.0):
    """Photograph a course at a slant: project every pixel's ray onto the floor; grey table, blur and noise."""
    floor = Image.fromarray(np.ascontiguousarray(course.raster()[::-1]))
    wide, high = floor.size
    corners = [(0, high), (wide, high), (wide, 0), (0, 0)]
    rows = [
        part
        for (u, v), (x, y) in zip(SEEN, corners, strict=True)
        for part in ([u, v, 1, 0, 0, 0, -x * u, -x * v], [0, 0, 0, u, v, 1, -y * u, -y * v])
    ]
    map_back = np.linalg.solve(np.array(rows, float), np.array(corners, float).ravel())
    taken = floor.transform(
        size, Image.Transform.PERSPECTIVE, map_back, Image.Resampling.BILINEAR, fillcolor=255
    )
    seen = np.asarray(taken.filter(ImageFilter.GaussianBlur(blur)), float) * 0.8 + 25.0
    seen += np.random.default_rng(1).normal(0.0, noise, seen.shape)
    Image.fromarray(np.clip(seen, 0, 255).astype(np.uint8)).save(path)


def with_photograph(folder, more):
    text = course_text(start_more=f"[image]\nfile = 'photo.png'\nwhite = 229\nblack = 25\n{more}")
    (folder / "c.toml").write_text(text)
    return load_course(folder / "c.toml")


def test_a_photographed_course_is_read_back(tmp_path):
    drawn = parse_course(course_text())
    photographed(drawn, tmp_path / "photo.png")
    read = with_photograph(tmp_path, f"marks_px = {CORNERS}")
    error = np.abs(read.averaged(0.008) - drawn.averaged(0.008)) / 255.0
    assert np.sqrt(np.mean(error**2)) < 0.015  # of white to black, as a spot of 8 mm sees it
    assert line_moved_mm(read, drawn) < 0.2


def line_moved_mm(read, drawn):
    """Return how far the dark middle of the left straight lies from where it was drawn [mm]."""
    rows = slice(200, 700)
    middles = []
    for course in (read, drawn):
        dark = 255.0 - course.raster()[rows, :300]
        dark[dark < 60] = 0.0
        middles.append((dark * np.arange(300)).sum(axis=1) / dark.sum(axis=1))
    return float(np.abs(middles[0] - middles[1]).max())


def test_more_marks_than_four_average_out_what_a_hand_misses(tmp_path):
    drawn = parse_course(course_text())
    photographed(drawn, tmp_path / "photo.png")
    read = with_photograph(
        tmp_path,
        f"marks_px = {CORNERS[:-1]}, [110, 882], [1488, 930]]\n"
        "marks_m = [[0, 0], [0.9, 0], [0.9, 0.9], [0, 0.9], [0, 0], [0.9, 0]]",
    )
    assert line_moved_mm(read, drawn) < 2.0


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("marks_px = [[110, 880], [1490, 930], [1230, 170]]", "marks_px: found 3 marks, expected 4 to 16"),
        ("marks_px = [[0, 0], [500, 500], [999, 999], [200, 900]]", "marks_px: found marks on a line, or nearly"),
        (f"marks_px = {CORNERS}\nmarks_m = [[0, 0], [0.9, 0], [0.9, 0.9]]", "marks_m: found 3 places, expected 4"),
        (f"marks_px = {CORNERS}\nmarks_m = [[0, 0], [0.3, 0], [0.6, 0], [0, 0.9]]", "marks_m: found marks on a line"),
        ("marks_px = [[330, 130], [1230, 170], [1490, 930], [110, 880]]", "marks_px: found marks in another order"),
        (f"marks_px = {CORNERS[:-1]}, [900, 500]]\nmarks_m = [[0, 0], [0.9, 0], [0.9, 0.9], [0, 0.9], [0.1, 0.1]]",
         "marks_px: found marks that fit together to"),
        ("marks_px = [[-800, 880], [1490, 930], [1230, 170], [330, 130]]", "that cuts the field"),
        ("marks_px = [[1, 1, 1]]", "image.marks_px[0]"),
        ("", "image: found no scale, expected pixels_per_metre, or marks_px"),
        (f"marks_px = {CORNERS}\npixels_per_metre = 500", "image: found both"),
        ("marks_m = [[0, 0]]\npixels_per_metre = 500", "image: found marks_m without marks_px"),
        (f"file = 'no.png'\nmarks_px = {CORNERS}", "no.png"),
    ],
)  # fmt: skip
def test_what_can_not_be_made_straight_is_refused(tmp_path, more, message):
    Image.new("L", (1600, 1000), 200).save(tmp_path / "photo.png")
    file = "" if "file" in more else "file = 'photo.png'\n"
    (tmp_path / "c.toml").write_text(course_text(start_more=f"[image]\n{file}{more}"))
    with pytest.raises(InputError) as error:
        load_course(tmp_path / "c.toml")
    assert message in str(error.value), error.value
    assert "\n" not in str(error.value)
