"""The signature of an effect: drawn from the same commands with it and without it."""

import numpy as np
import pytest

from gecar.plots.reality.signature import _driven, shown_size, signature_figure
from gecar.plots.style import is_whole
from gecar.world.course.course import load_course
from gecar.world.effects import CATALOGUE
from gecar.world.robot import load_robot

EV3, COURSE = load_robot("ev3"), load_course("paper")


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.id)
def test_the_size_that_is_shown_can_be_seen(effect):
    changed = EV3.with_effects({effect.id: shown_size(effect, EV3)})
    without, with_it = _driven(EV3, COURSE), _driven(changed, COURSE)
    turned = np.degrees(np.abs(with_it.rows[:, [0, 1, 6]] - without.rows[:, [0, 1, 6]]).max())
    moved = 1e3 * np.abs(with_it.rows[:, 4:6] - without.rows[:, 4:6]).max()
    assert max(turned, moved, np.abs(with_it.reflection - without.reflection).max()) > 1.0


@pytest.mark.parametrize(
    ("effect", "place"),
    [
        ("backlash", []),
        ("slippery_patch", ["slippery"]),
        ("line_shift", ["the line's place"]),
        ("line_scale", ["the line's place"]),
    ],
)
def test_a_signature_is_whole_and_names_both_ways_and_the_place(effect, place):
    figure = signature_figure(effect, EV3, COURSE)
    assert is_whole(figure)
    words = [text.get_text() for text in figure.axes[-1].get_legend().get_texts()]
    assert words == ["without", "with it", *place]


def test_show_draws_it_where_it_is_told_to(gecar, tmp_path):
    ended = gecar("effects", "show", "backlash", "--out", tmp_path / "play.png")
    assert ended.code == 0
    assert (tmp_path / "play.png").read_bytes().startswith(b"\x89PNG")


def test_show_without_a_name_says_what_it_wants(gecar):
    ended = gecar("effects", "show")
    assert ended.code != 0
    assert "`show` and one effect's name" in ended.err
