import itertools
import math

import pytest

from gecar.world.course.tiles import BY_CHARACTER, CENTRE, MIRRORED, TILES, Side


def test_every_character_means_one_tile():
    assert len(BY_CHARACTER) == len({(t.character, t.drawn) for t in TILES} | set()) * 2 - sum(
        t.character == t.drawn for t in TILES
    )


@pytest.mark.parametrize("tile", TILES, ids=lambda t: t.character)
def test_lines_end_in_the_middles_of_their_sides_or_inside(tile):
    ends = {end for stroke in tile.strokes for end in (stroke[0], stroke[-1])}
    on_edges = {(x, y) for x, y in ends if x in (0.0, 1.0) or y in (0.0, 1.0)}
    assert on_edges == {side.middle for side in tile.sides}


@pytest.mark.parametrize("tile", TILES, ids=lambda t: t.character)
def test_mirror_images_exchange_left_and_right(tile):
    image = BY_CHARACTER[MIRRORED[tile.character]]
    swap = {Side.LEFT: Side.RIGHT, Side.RIGHT: Side.LEFT, Side.UP: Side.UP, Side.DOWN: Side.DOWN}
    assert image.sides == {swap[side] for side in tile.sides}
    assert MIRRORED[image.character] == tile.character


def test_a_curved_corner_is_a_quarter_circle():
    path = BY_CHARACTER["f"].path(Side.DOWN, Side.RIGHT)
    assert path[0] == Side.DOWN.middle
    assert path[-1] == Side.RIGHT.middle
    assert all(math.isclose(math.dist(p, (1.0, 0.0)), 0.5) for p in path)
    length = sum(math.dist(a, b) for a, b in itertools.pairwise(path))
    assert length == pytest.approx(0.25 * math.pi, rel=1e-4)


def test_the_way_turns_at_a_branch_and_goes_straight_over_a_gap():
    assert BY_CHARACTER[">"].path(Side.DOWN, Side.RIGHT) == ((0.5, 0.0), CENTRE, (1.0, 0.5))
    assert BY_CHARACTER["+"].path(Side.DOWN, Side.UP) == ((0.5, 0.0), (0.5, 1.0))
    way = BY_CHARACTER["="].path(Side.RIGHT, Side.LEFT)
    assert [x for x, _ in way] == sorted((x for x, _ in way), reverse=True)


@pytest.mark.parametrize("side", Side)
def test_stepping_over_an_edge_and_back_returns(side):
    assert side.opposite.opposite == side
    assert [a + b for a, b in zip(side.step, side.opposite.step, strict=True)] == [0, 0]
