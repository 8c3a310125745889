import math
import pickle

import numpy as np
import pytest
from shapely.geometry import Point
from support.courses import make_course

from gecar.world.course.course import COURSES, list_courses, load_course, random_course
from gecar.world.course.line import strokes
from gecar.world.robot import load_robot


@pytest.fixture(scope="module")
def paper():
    return load_course("paper")


def test_the_papers_course_has_its_dimensions(paper):
    assert (paper.columns, paper.rows, paper.tile_size_m, paper.line_width_m) == (8, 4, 0.30, 0.025)
    assert paper.drivable.sum() == 20
    assert len(paper.checkpoints) == 18


def test_the_papers_course_is_driven_clockwise_with_goal_below_start(paper):
    assert paper.layout.place(paper.start_tile) == (0, 2)
    assert paper.layout.place(paper.goal) == (0, 1)
    ways = [paper.layout.place(int(k)) for k in paper.sequence]
    assert ways[:3] == [(0, 3), (1, 3), (2, 3)]
    turns = sum(
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        for a, b, c in zip([(0, 2), *ways], ways, ways[1:], strict=False)
    )
    assert turns == -4  # four right turns


def test_the_papers_robot_starts_on_white_right_of_the_line(paper):
    x, y, heading = paper.start
    ahead = load_robot("ev3").colour_sensor.ahead
    sensor = x + ahead * math.cos(heading), y + ahead * math.sin(heading)
    cell = paper.raster()[int(sensor[1] / 0.001), int((sensor[0] - 0.004) / 0.001)]
    assert cell == 255
    assert x > 0.15


def test_a_crossing_is_in_the_order_twice():
    course = load_course("figure_eight")
    crossing = [k for k in range(len(course.drivable)) if course.layout.tile(k).kind == "crossing"]
    assert np.isin(course.sequence, crossing).sum() == 2


@pytest.mark.parametrize("name", list_courses())
def test_shipped_courses_are_whole(name):
    course = load_course(name)
    assert course.title
    assert course.centreline.geom_type == "LineString"
    assert 0 < course.shortest.length_m <= course.length_m + 0.1
    assert course.start_tile == course.layout.index_at(course.start.x_m, course.start.y_m)
    assert strokes(course.layout).distance(Point(course.start.x_m, course.start.y_m)) == pytest.approx(0.025)


def test_the_papers_course_is_listed_first_with_seven_harder_ones():
    assert list_courses()[0] == "paper"
    assert len(list_courses()) >= 8


@pytest.mark.parametrize("path", sorted(COURSES.glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_maps_are_ascii(path):
    assert path.read_text(encoding="utf-8").split('"""')[-2].isascii()


def test_box_characters_mean_the_same_as_ascii():
    ascii_course, drawn = make_course(), make_course("┌─┐\n│░│\n└─┘")
    assert ascii_course.layout == drawn.layout
    assert ascii_course.layout.lines(drawn=True) == ["┌─┐", "│░│", "└─┘"]


def test_the_centreline_runs_from_beside_start_to_goals_edge(paper):
    assert paper.centreline.coords[0] == pytest.approx((0.15, 0.75))
    assert paper.centreline.coords[-1] == pytest.approx((0.15, 0.30))
    assert paper.length_m == pytest.approx(2 * (2.1 + 0.9) - 0.45)


def test_the_start_offset_is_as_the_robot_sees_it():
    course = make_course(
        heading='"down"', start="[0, 1]", goal="[0, 2]", start_more="left_m = 0.05\nahead_m = 0.1"
    )
    assert course.start.x_m == pytest.approx(0.15 + 0.05)
    assert course.start.y_m == pytest.approx(0.45 - 0.10)


def test_listed_checkpoints_lead_through_branches():
    maze = load_course("maze")
    assert maze.layout.place(int(maze.checkpoints[0])) == (0, 1)
    assert maze.centreline.geom_type == "LineString"


def test_a_course_goes_to_worker_processes_whole():
    course = load_course("obstacles")
    course.raster()
    again = pickle.loads(pickle.dumps(course))
    assert np.array_equal(again.raster(), course.raster())
    assert again.obstacles == course.obstacles


def test_random_courses_are_whole_and_differ():
    maps = set()
    for seed in range(60):
        course = random_course(seed)
        assert 12 <= len(course.sequence) + 1 <= 22
        assert (
            len(set(course.sequence.tolist()))
            == len(course.sequence)
            == np.count_nonzero(course.drivable) - 1
        )
        assert course.length_m > 0
        assert max(course.columns / 8, course.rows / 6) <= 1
        maps.add(course.layout.characters)
    assert len(maps) == 60


def test_a_random_course_is_the_same_for_the_same_seed_and_as_long_and_winding_as_asked():
    assert random_course(3).layout == load_course("random:3").layout
    straight, winding = random_course(3, 20, 0.1), random_course(3, 20, 0.9)
    assert len(straight.sequence) == len(winding.sequence) == 19
    corners = [
        sum(course.layout.tile(k).kind.endswith("corner") for k in course.sequence)
        for course in (straight, winding)
    ]
    assert corners[0] < 6 < corners[1]
    assert random_course(3, tile_size_m=0.5).tile_size_m == 0.5
