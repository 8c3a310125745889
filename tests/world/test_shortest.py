import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from support.courses import make_course

from gecar.world.course.course import load_course
from gecar.world.course.layout import Layout
from gecar.world.course.lower_bound.shortest_way import shortest_way
from gecar.world.course.tiles import Side

FLOOR = Layout("." * 81, 9, 1.0, 0.1)


def length_of(tiles, x=None, y=None):
    """Shortest way through tiles of 1 m named by (column, row), from the first one's middle."""
    first, *rest = (FLOOR.index(*place) for place in tiles)
    x0, y0 = FLOOR.centre_m(first)
    return shortest_way(FLOOR, first, rest, x0 if x is None else x, y0 if y is None else y).length_m


def test_straight_ahead_it_is_straight():
    assert length_of([(0, 0), (1, 0), (2, 0), (3, 0)]) == pytest.approx(2.5)


def test_round_a_corner_it_bends_at_the_corner():
    way = shortest_way(FLOOR, 0, [1, 10], 0.1, 0.9)
    assert way.length_m == pytest.approx(math.hypot(0.9, 0.1))
    assert way.path.coords[-1] == (1.0, 1.0)


def test_it_cuts_across_a_diagonal_staircase():
    stairs = [(k // 2, (k + 1) // 2) for k in range(9)]
    assert length_of(stairs) == pytest.approx(math.hypot(3.5, 3.5))


def test_the_papers_shortest_way_hugs_the_inner_corners():
    way = load_course("paper").shortest
    assert way.length_m == pytest.approx(math.hypot(0.125, 0.15) + 1.8 + 0.6 + 1.8)


def test_a_crossing_does_not_shorten_the_way():
    """Through the crossing, round the second loop, and back to it."""
    assert load_course("figure_eight").shortest.length_m > 4.0


def test_turning_back_costs_no_more_than_the_way_there_and_back():
    there_and_back = length_of([(0, 0), (1, 0), (2, 0), (1, 0), (0, 0)])
    assert there_and_back == pytest.approx(1.5 + 1.0)


def test_tiles_that_must_be_passed_are_put_in():
    corridor = make_course("...\n#.#\n...", start="[0, 0]", goal="[2, 2]", more="checkpoints = []")
    listed = make_course(
        "...\n#.#\n...", start="[0, 0]", goal="[2, 2]", more="checkpoints = [[1, 0], [1, 1], [1, 2]]"
    )
    assert corridor.shortest.length_m == pytest.approx(listed.shortest.length_m)


def test_a_corner_where_two_tiles_only_touch_may_be_slipped_over():
    course = make_course("#..\n.#.\n...", start="[0, 1]", goal="[2, 2]", more="checkpoints = []")
    assert course.shortest.length_m <= 0.3 + 0.15


def test_a_way_round_is_not_taken_for_a_must():
    course = make_course("...\n.#.\n...", start="[0, 1]", goal="[2, 1]", more="checkpoints = []")
    assert course.shortest.length_m <= 0.3 + 0.15


def walk(turns):
    """A way over tiles that turns left (1), right (-1) or goes on (0), within the floor and never back."""
    place, side, tiles = (4, 4), Side.UP, [(4, 4)]
    for turn in turns:
        side = Side((side + turn) % 4)
        place = place[0] + side.step[0], place[1] + side.step[1]
        if FLOOR.index(*place) < 0:
            return tiles
        tiles.append(place)
    return tiles


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.sampled_from([-1, 0, 1]), min_size=2, max_size=9),
    st.floats(4.05, 4.95),
    st.floats(4.05, 4.95),
)
def test_it_is_as_short_as_numerical_minimisation_finds(turns, x, y):
    tiles = walk(turns)
    if len(tiles) < 2:
        return
    edges = []
    for a, b in itertools.pairwise(tiles):
        middle, along = np.add(a, b) / 2 + 0.5, np.array([b[1] - a[1], b[0] - a[0]]) / 2
        edges.append((middle - along, middle + along))
    low, high = (np.array([edge[k] for edge in edges]) for k in (0, 1))

    def length(t, rounding):
        points = np.vstack([[x, y], low + t[:, None] * (high - low)])
        return np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1) + rounding).sum()

    # Convex, but not smooth where two points meet: the corners are rounded less and less.
    t, bounds = np.full(len(edges), 0.5), [(0, 1)] * len(edges)
    for rounding in (1e-2, 1e-3, 1e-4, 1e-6, 1e-8):
        t = minimize(length, t, (rounding,), bounds=bounds, options={"maxiter": 300}).x
    best = length(t, 0.0)
    assert length_of(tiles, x, y) <= best + 1e-6
    assert length_of(tiles, x, y) >= best - 0.02
