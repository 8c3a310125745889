"""The best possible test of a concealed case: beside backgrounds an effect is told less well."""

import json
import math
import shutil

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MUJOCO IS MISSING: no concealed cases are drawn")

from benchmarks.concealed import best_test, cases
from benchmarks.concealed.best_test import d_prime_beside_backgrounds
from benchmarks.concealed.cases import Manner, draw_case
from benchmarks.concealed.robot import EV3
from benchmarks.concealed.settings import Setting

SINGLES = {"a": "track_width", "b": "viscous_friction", "c": "sensor_lag"}


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    out = tmp_path_factory.mktemp("best")
    with pytest.MonkeyPatch.context() as patch:
        for module in (cases, best_test):
            patch.setattr(module, "SECONDS", 2.0)
        patch.setattr(cases, "draw_setting", lambda *_: Setting(EV3, ("holds", "line"), 100.0, 1))
        for number, (name, effect) in enumerate(SINGLES.items()):
            draw_case(name, "single", (effect,), (number,), out, Manner("continuous", background=True))
        yield out


def with_background(out, name, background):
    path = out / "sealed" / name / "label.json"
    label = json.loads(path.read_text())
    label["background"] = background
    path.write_text(json.dumps(label))


def test_what_a_case_conceals_is_told_less_well_beside_backgrounds(drawn):
    label = json.loads((drawn / "sealed" / "a" / "label.json").read_text())
    alone, beside = d_prime_beside_backgrounds(drawn, "a", 2)["track_width"]
    assert math.isclose(alone, label["d_prime"]["track_width"], rel_tol=1e-3)
    assert 0.0 < beside < alone


def test_an_effect_that_backgrounds_have_too_is_hidden_and_another_is_not(drawn):
    for name in "bc":
        with_background(drawn, name, {"track": {"track_scale": 0.05}, "amounts": {"track": 1.0}})
    alone, beside = d_prime_beside_backgrounds(drawn, "a", 2)["track_width"]
    assert beside < 0.2 * alone
    with_background(drawn, "a", {"track": {"track_scale": 0.05}, "amounts": {"track": 1.0}})


def test_a_camera_with_a_lens_hides_some_of_what_the_sensor_shows(drawn):
    for name in "ab":
        with_background(drawn, name, {"camera_lens": {"lens": 0.02}, "amounts": {}})
    alone, beside = d_prime_beside_backgrounds(drawn, "c", 2)["sensor_lag"]
    # A lens is no lag: it hides little. Without displaced readings it would hide nothing at all.
    assert 0.9 * alone < beside < alone - 1e-3


def test_of_several_effects_each_is_weighed_beside_the_others(drawn):
    drawn_as = Manner("continuous", background=True)
    draw_case("d", "double", ("track_width", "viscous_friction"), (3,), drawn, drawn_as)
    found = d_prime_beside_backgrounds(drawn, "d", 2)
    label = json.loads((drawn / "sealed" / "d" / "label.json").read_text())
    assert found.keys() == label["d_prime"].keys()
    for effect, (alone, beside) in found.items():
        assert math.isclose(alone, label["d_prime"][effect], rel_tol=1e-3)
        assert 0.0 < beside < alone
    shutil.rmtree(drawn / "sealed" / "d")
    again = best_test._told(np.array([3.0, 4.0]), [np.array([0.0, 1e6])])
    assert again == pytest.approx((5.0, 3.0))


def test_other_kinds_of_cases_and_changed_cases_are_refused(drawn):
    path = drawn / "sealed" / "c" / "label.json"
    label = json.loads(path.read_text())
    path.write_text(json.dumps({**label, "seed": [99]}))
    with pytest.raises(ValueError, match="expected the code that drew it"):
        d_prime_beside_backgrounds(drawn, "c", 2)
    path.write_text(json.dumps({**label, "kind": "mixed"}))
    with pytest.raises(ValueError, match="found a case of kind mixed, expected single, double, triple"):
        d_prime_beside_backgrounds(drawn, "c", 2)


def test_where_no_other_case_has_a_background_it_says_so(drawn, tmp_path):
    shutil.copytree(drawn / "sealed" / "b", tmp_path / "sealed" / "b")
    with pytest.raises(ValueError, match="found no other case of b's world"):
        d_prime_beside_backgrounds(tmp_path, "b", 2)
    with pytest.raises(ValueError, match="found no other case of b's world"):
        d_prime_beside_backgrounds(drawn, "b", 0)
