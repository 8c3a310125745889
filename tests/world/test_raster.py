import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from shapely.geometry import MultiPolygon, Point, Polygon, box
from support.courses import make_course

from gecar.errors import InputError
from gecar.world.course.course import load_course, parse_course
from gecar.world.course.raster import draw, read_image, resample

# Whole nanometres: GEOS, the judge here, cuts polygons wrongly whose corners are 5e-324 m from a cell's edge.
coordinate = st.integers(0, 20_000_000).map(lambda nanometres: nanometres * 1e-9)


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=6))
def test_every_cell_holds_the_share_a_polygon_covers(points):
    hull = shapely.MultiPoint(points).convex_hull
    if not isinstance(hull, Polygon):
        return
    shown = draw(MultiPolygon([hull]), 0.02, 0.02, 0.001)
    cells = [[box(i / 1e3, j / 1e3, (i + 1) / 1e3, (j + 1) / 1e3) for i in range(20)] for j in range(20)]
    share = shapely.area(shapely.intersection(np.array(cells), hull)) / 1e-6
    assert np.abs(shown - 255 * (1 - share)).max() <= 0.51


def test_holes_stay_white():
    ring = Point(0.01, 0.01).buffer(0.009).difference(Point(0.01, 0.01).buffer(0.004))
    shown = draw(MultiPolygon([ring]), 0.02, 0.02, 0.001)
    assert shown[10, 10] == 255
    assert shown[10, 16] == 0
    assert (255 - shown.astype(float)).sum() / 255 * 1e-6 == pytest.approx(ring.area, rel=2e-3)


def test_the_papers_line_is_25_mm_wide_and_antialiased():
    raster = load_course("paper").raster()
    assert raster.shape == (1200, 2400)
    assert raster.dtype == np.uint8
    across = raster[100:200, 1200]
    assert (255 - across.astype(float)).sum() / 255 == pytest.approx(25.0, abs=0.01)
    assert across[[37, 50, 62]].tolist() == [128, 0, 128]
    assert raster[600, 1200] == 255


def test_a_raster_is_drawn_once_for_each_pitch():
    course = make_course()
    assert course.raster() is course.raster()
    assert course.raster(0.002).shape == (450, 450)


@pytest.mark.parametrize("name", ["s_bends", "chicane", "figure_eight", "maze"])
def test_the_line_is_seamless(name):
    """Where tiles meet nothing is lighter than elsewhere on the line."""
    course = load_course(name)
    way = course.centreline
    at = shapely.get_coordinates(way.interpolate(np.arange(0.0, way.length, 0.001)))
    cells = course.raster()[tuple((at[:, ::-1] / 0.001).astype(int).T)]
    assert cells.max() == 0


@pytest.mark.parametrize("pitch", [0.0, -1.0, float("nan"), 1e-9, 2e-5])
def test_absurd_pitches_are_refused(pitch):
    with pytest.raises(InputError, match="raster pitch"):
        load_course("paper").raster(pitch)


def scanned(tmp_path, picture, more=""):
    Image.fromarray(picture).save(tmp_path / "scan.png")
    text = "map = '''\n...\n...\n'''\ngoal = [2, 0]\ncheckpoints = [[2, 1]]\ntile_size_m = 0.1\n"
    text += f"[start]\ntile = [0, 1]\nheading = 'right'\n[image]\nfile = 'scan.png'\npixels_per_metre = 500\n{more}\n"
    return parse_course(text, str(tmp_path / "scan.toml"))


def test_a_scan_becomes_the_raster(tmp_path):
    picture = np.full((100, 150), 255, np.uint8)
    picture[:10, :20] = 0  # upper left
    raster = scanned(tmp_path, picture).raster()
    assert raster.shape == (200, 300)
    assert raster[195, 5] == 0
    assert raster[5, 5] == 255
    assert raster[195, 60] == 255


def test_a_scans_grey_levels_are_stretched(tmp_path):
    picture = np.full((100, 150), 200, np.uint8)
    picture[40:60] = 30
    raster = scanned(tmp_path, picture, "white = 200\nblack = 30").raster()
    assert (raster[100].max(), raster[10].min()) == (0, 255)


def test_a_scan_is_averaged_over_cells(tmp_path):
    stripes = np.zeros((100, 150), np.uint8)
    stripes[::2] = 255
    raster = scanned(tmp_path, stripes).raster(0.004)
    assert set(raster.ravel().tolist()) <= {127, 128}


def test_a_scan_at_a_wrong_scale_is_refused(tmp_path):
    with pytest.raises(
        InputError, match=r"0\.6 x 0\.4 m at 500 pixels per metre, expected the field's 0\.3 x 0\.2 m"
    ):
        scanned(tmp_path, np.full((200, 300), 255, np.uint8))


def test_what_is_no_picture_is_refused(tmp_path):
    (tmp_path / "scan.png").write_bytes(b"\x89PNG\r\n\x1a\nnonsense")
    with pytest.raises(InputError, match="cannot be read"):
        read_image(tmp_path / "scan.png", "here")
    with pytest.raises(InputError, match="no file"):
        read_image(tmp_path / "none.png", "here")


def test_transparency_is_white(tmp_path):
    Image.new("RGBA", (4, 4), (0, 0, 0, 0)).save(tmp_path / "clear.png")
    assert read_image(tmp_path / "clear.png", "here").min() == 255


def test_where_a_picture_ends_the_floor_is_white():
    from gecar.world.course.raster import FloorImage

    shown = resample(FloorImage(np.zeros((9, 10), np.uint8), 1000.0), 0.01, 0.01, 0.001)
    assert shown[9].min() == 255
    assert shown[:9].max() == 0
