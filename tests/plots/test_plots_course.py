import pytest
from matplotlib.figure import Figure
from PIL import Image
from support.courses import make_course

from gecar.plots.courses.course import course_figure, describe, draw_course
from gecar.plots.style import save
from gecar.world.course.course import list_courses, load_course, parse_course
from gecar.world.robot import load_robot


def words(figure):
    return {text.get_text() for text in figure.findobj(lambda a: hasattr(a, "get_text"))}


@pytest.mark.parametrize("name", list_courses())
def test_every_shipped_course_is_drawn_whole(name):
    figure = course_figure(load_course(name), load_robot("ev3"))
    figure.draw_without_rendering()
    drawn = figure.get_tightbbox()
    assert drawn.x0 >= 0
    assert drawn.y0 >= 0
    assert drawn.x1 <= figure.get_figwidth()
    assert drawn.y1 <= figure.get_figheight()
    assert {"START", "GOAL"} <= words(figure)


def test_tiles_driven_twice_bear_both_numbers():
    assert "8 · 18" in words(course_figure(load_course("figure_eight")))


def test_without_marks_only_the_floor_is_drawn():
    axes = Figure().add_subplot()
    draw_course(axes, make_course(), marks=False)
    assert not axes.texts


def test_the_field_is_to_scale():
    axes = Figure().add_subplot()
    draw_course(axes, make_course())
    assert axes.get_aspect() == 1.0
    low, high = axes.get_xlim()
    assert low < 0.0
    assert high > 0.9


def test_the_line_is_black_on_white_in_the_picture(tmp_path):
    save(course_figure(make_course()), tmp_path / "c.png")
    with Image.open(tmp_path / "c.png") as picture:
        grey = picture.convert("L")
    shades = grey.histogram()
    assert sum(shades[:60]) > 0.01 * grey.width * grey.height
    assert sum(shades[250:]) > 0.3 * grey.width * grey.height


def test_a_scan_is_shown(tmp_path):
    Image.new("L", (200, 100), 90).save(tmp_path / "scan.png")
    text = "map = '..'\ngoal = [1, 0]\ncheckpoints = []\ntile_size_m = 0.1\n[start]\ntile = [0, 0]\nheading = 0.0\n"
    course = parse_course(
        text + "[image]\nfile = 'scan.png'\npixels_per_metre = 1000\n", str(tmp_path / "c.toml")
    )
    assert len(course_figure(course).axes[0].images) == 1


def test_the_description_names_the_lower_bound():
    assert "lower bound 11.85 s if tyres hold" in describe(load_course("paper"), load_robot("ev3"))
