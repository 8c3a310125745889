import numpy as np
import pytest
from support.courses import make_course

from gecar.errors import InputError
from gecar.world.course.driving_order import first_side
from gecar.world.course.tiles import Side

CROSSED = "F-7###\n|#|###\nL-+-7#\n##|#|#\n##L-J#"


@pytest.mark.parametrize(
    ("degrees", "side"), [(0, Side.RIGHT), (100, Side.UP), (181, Side.LEFT), (-80, Side.DOWN)]
)
def test_a_heading_points_over_the_nearest_edge(degrees, side):
    assert first_side(np.radians(degrees)) == side


def places(course):
    return [course.layout.place(int(k)) for k in course.sequence]


def test_the_line_is_followed_the_way_the_robot_looks():
    up = make_course(goal="[0, 0]", heading='"up"')
    down = make_course(goal="[0, 2]", heading='"down"')
    assert places(up)[0] == (0, 2)
    assert places(down)[0] == (0, 0)
    assert len(up.sequence) == len(down.sequence) == 7


def test_crossings_are_driven_straight_over():
    course = make_course(CROSSED, start="[0, 3]", goal="[1, 2]")
    assert places(course)[4:7] == [(2, 2), (2, 1), (2, 0)]
    assert places(course).count((2, 2)) == 2


def test_an_open_course_may_end_at_the_fields_edge():
    assert places(make_course("---", start="[0, 0]", goal="[2, 0]", heading='"right"')) == [(1, 0), (2, 0)]


def test_goal_next_to_start_needs_no_checkpoint():
    course = make_course("--", start="[0, 0]", goal="[1, 0]", heading='"right"')
    assert len(course.checkpoints) == 0
    assert course.shortest.length_m == pytest.approx(0.15)


def test_bare_floor_is_driven_by_listed_checkpoints():
    course = make_course("...\n...", start="[0, 0]", goal="[2, 1]", more="checkpoints = [[2, 0], [1, 1]]")
    assert places(course) == [(2, 0), (1, 1), (2, 1)]
    assert course.centreline.is_empty


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ({"tiles": "F-7\n|#|\nL-="}, "to the right and stops at the field's edge"),
        (
            {"tiles": "F-7\n|#.\nL-J"},
            r"tile \[2, 0\] 'J': found a line that leaves upwards and stops at tile '\.'",
        ),
        ({"tiles": "F-7#[]\n|#|###\nL-J###"}, r"a line at tile \[4, 2\] that START's line does not reach"),
        ({"tiles": "F->\n|#|\nL-J"}, "leaves to the right"),
        ({"tiles": "F-v-7\n|#!#|\nL---J"}, r"checkpoints: found a branch at tile \[2, 2\], expected a list"),
        (
            {"tiles": "[-]", "start": "[1, 0]", "goal": "[0, 0]", "heading": '"right"'},
            r"an end of the line at tile \[2, 0\]",
        ),
        ({"heading": '"right"'}, r"no line onwards from tile \[0, 1\]"),
        ({"goal": "[0, 1]"}, "START's own tile"),
        ({"goal": "[1, 1]"}, r"\[1, 1\], a blank tile"),
        ({"goal": "[3, 0]"}, r"found \[3, 0\], expected \[column, row\] from \[0, 0\] to \[2, 2\]"),
        ({"start": "[7, 7]"}, r"start.tile: found \[7, 7\]"),
        ({"more": "checkpoints = [[2, 2], [1, 1]]"}, r"checkpoints\[1\]: found \[1, 1\], a blank tile"),
        ({"more": "checkpoints = [[2, 2], [2, 2]]"}, "the same tile twice running"),
        ({"more": "checkpoints = [[2, 2], [0, 0], [1, 0]]"}, "GOAL's tile among the checkpoints"),
        (
            {"tiles": "..#..", "start": "[0, 0]", "goal": "[4, 0]", "more": "checkpoints = []"},
            r"tile \[4, 0\]: found no drivable way from tile \[0, 0\]",
        ),
        (
            {"tiles": "....", "start": "[0, 0]", "goal": "[1, 0]", "more": "checkpoints = [[3, 0]]"},
            r"tile \[3, 0\]: found no drivable way",
        ),
    ],
)
def test_orders_that_can_not_be_driven_are_refused(case, message):
    with pytest.raises(InputError, match=message):
        make_course(**case)


def test_a_line_that_never_reaches_goal_is_refused():
    tiles = "F-7##\n|#|[]\nL-J##"
    with pytest.raises(InputError, match="does not reach"):
        make_course(tiles, goal="[4, 1]")
    with pytest.raises(InputError, match="never reaches GOAL"):
        make_course("F-7.\n|#|.\nL-J.", goal="[3, 1]")
