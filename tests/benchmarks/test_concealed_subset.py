"""A minute of the examination: whole cases of the truth world, from the draw to the judgement."""

from __future__ import annotations

import pytest

pytest.importorskip("mujoco", reason="MUJOCO IS MISSING: discovery is not examined (pip install gecar[test])")

from benchmarks.concealed import cases
from benchmarks.concealed.cases import draw_case
from benchmarks.concealed.judging import judge
from benchmarks.concealed.plan import read_label
from benchmarks.concealed.runner import holdout_names
from benchmarks.concealed.sightings import sight
from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import read_case

FEW = "holds", "line", "reversals"  # recordings, where more than these would cost minutes and prove no more
SHORT = 8.0  # s, each


@pytest.fixture(autouse=True)
def few_and_short(monkeypatch):
    monkeypatch.setattr(cases, "RUNS", FEW)
    monkeypatch.setattr(cases, "SECONDS", SHORT)


def examined(kind, effects, seed, out):
    draw_case("case", kind, effects, (seed,), out)
    folder = out / "cases" / "case"
    verdict = discover(read_case(folder), holdout_names(folder)).as_json()
    return judge(read_label(out, "case"), verdict, sight(out, "case"))


def test_nothing_concealed_is_given_no_name(tmp_path):
    assert examined("none", (), 1, tmp_path).named == ()


def test_concealed_effect_is_named_alone_and_located(tmp_path):
    judged = examined("single", ("motor_gain_asymmetry",), 1, tmp_path)
    assert judged.exact
    assert judged.channel_right
    assert judged.gap_closed > 0.8


def test_physics_outside_the_catalogue_is_given_no_name(tmp_path):
    assert examined("outside", ("magnet",), 1, tmp_path).abstained
