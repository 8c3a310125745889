import numpy as np
import pytest
from PIL import Image

from gecar.world.course.course import list_courses, load_course, mirrored, parse_course


@pytest.mark.parametrize("name", list_courses())
def test_a_mirrored_course_is_the_course_flipped(name):
    course, image = load_course(name), mirrored(load_course(name))
    assert np.array_equal(image.raster(), course.raster()[:, ::-1])
    assert image.start.x_m == pytest.approx(course.width_m - course.start.x_m)
    assert np.cos(image.start.heading_rad) == pytest.approx(-np.cos(course.start.heading_rad))
    assert [course.columns - 1 - k % course.columns for k in image.sequence] == [
        k % course.columns for k in course.sequence
    ]
    assert image.length_m == pytest.approx(course.length_m)
    assert image.shortest.length_m == pytest.approx(course.shortest.length_m)


@pytest.mark.parametrize("name", ["maze", "obstacles"])
def test_mirroring_twice_changes_nothing(name):
    course, again = load_course(name), mirrored(mirrored(load_course(name)))
    assert again.layout == course.layout
    assert np.array_equal(again.sequence, course.sequence)
    assert again.walls == pytest.approx(course.walls)
    for before, after in zip(course.obstacles, again.obstacles, strict=True):
        assert after.outline.symmetric_difference(before.outline).area < 1e-9


def test_obstacles_are_mirrored_with_the_floor():
    course, image = load_course("obstacles"), mirrored(load_course("obstacles"))
    for before, after in zip(course.obstacles, image.obstacles, strict=True):
        x0, y0, x1, y1 = before.outline.bounds
        assert after.outline.bounds == pytest.approx((course.width_m - x1, y0, course.width_m - x0, y1))


def test_a_scan_is_mirrored(tmp_path):
    picture = np.random.default_rng(0).integers(0, 256, (100, 201), np.uint8)
    Image.fromarray(picture).save(tmp_path / "scan.png")
    text = "map = '..'\ngoal = [1, 0]\ncheckpoints = []\ntile_size_m = 0.1\n[start]\ntile = [0, 0]\nheading = 0.0\n"
    text += "[image]\nfile = 'scan.png'\npixels_per_metre = 1000\n"
    course = parse_course(text, str(tmp_path / "c.toml"))
    assert np.array_equal(mirrored(course).raster(), course.raster()[:, ::-1])
