"""Effects concealed at the limits that verdicts state, and cases without one of the sensors."""

import csv
import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MUJOCO IS MISSING: no concealed cases are drawn")

from benchmarks.concealed import cases
from benchmarks.concealed.at_limits import AtLimit, draw_at_limits, stated
from benchmarks.concealed.cases import Manner, draw_case
from benchmarks.concealed.effects import EFFECTS, SEVERAL, at_size, is_below
from benchmarks.concealed.judging import judge
from benchmarks.concealed.plan import Counts, plan
from benchmarks.concealed.robot import EV3
from benchmarks.concealed.settings import Setting
from benchmarks.concealed.sizes import is_material

UNSEEN = {"d_prime": {}, "groups": {}, "timeline": [], "by_channel": {}}


@pytest.fixture(scope="module")
def short():
    """Cases of two recordings of three seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cases, "SECONDS", 3.0)
        patch.setattr(cases, "draw_setting", lambda *_: Setting(EV3, ("holds", "line"), 100.0, 1))
        yield


@pytest.fixture(scope="module")
def empty(short, tmp_path_factory):
    """A case with nothing concealed, and a verdict on it that states limits."""
    out = tmp_path_factory.mktemp("limits")
    draw_case("c001", "none", (), (1,), out, Manner("continuous", background=True))
    (out / "verdicts" / "c001").mkdir(parents=True)
    limits = {
        "backlash": {"size": 2.5, "unit": "deg"},
        "floor_tilt": {"size": 0.01, "unit": "rad"},
        "pose_delay": None,
    }
    (out / "verdicts" / "c001" / "verdict.json").write_text(json.dumps({"limits": limits}))
    return out


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def test_an_effect_is_concealed_at_the_limit_in_the_empty_cases_robot_under_its_commands(empty, tmp_path):
    rng = np.random.default_rng(0)
    chosen = stated(empty, empty / "verdicts", 5, rng)
    assert chosen == [AtLimit("c001", "backlash", 2.5)]  # a tilt has two numbers, and a delay has no limit
    draw_at_limits(empty, chosen, tmp_path, rng, 1)
    label = json.loads((tmp_path / "sealed" / "c001" / "label.json").read_text())
    assert label["effects"] == [
        {"id": "backlash", "parameters": {"angle_deg": {"value": 2.5, "unit": "deg"}}}
    ]
    before = json.loads((empty / "sealed" / "c001" / "label.json").read_text())
    assert label["background"] == before["background"]
    assert label["d_prime"]["backlash"] > 0.0
    names = sorted(path.name for path in (tmp_path / "cases" / "c001").iterdir())
    assert names == sorted(path.name for path in (empty / "cases" / "c001").iterdir())
    old, new = (rows(root / "cases" / "c001" / "run_01_holds.csv") for root in (empty, tmp_path))
    assert [row["left_duty_pct"] for row in old] == [row["left_duty_pct"] for row in new]
    assert [row["heading_deg"] for row in old] != [row["heading_deg"] for row in new]


def test_what_is_drawn_as_material_is_and_is_drawn_again_alike(short, tmp_path):
    draw_case("c001", "single", ("sensor_gain",), (4,), tmp_path, Manner("continuous", True, material=True))
    label = json.loads((tmp_path / "sealed" / "c001" / "label.json").read_text())
    assert label["material"]
    assert is_material(label["size_repeatedly"]["sensor_gain"])
    _, case, _, _ = cases.redrawn(tmp_path, label)
    assert case.manner.material


def test_verdicts_that_state_no_limit_are_refused(empty, tmp_path):
    with pytest.raises(ValueError, match="found no limit"):
        stated(empty, tmp_path, 5, np.random.default_rng(0))


@pytest.mark.parametrize("effect", sorted(set(EFFECTS) - set(SEVERAL)))
def test_an_effect_at_a_size_is_just_not_below_that_limit(effect):
    size = 8.0 if effect == "speed_limit" else 0.005
    drawn = at_size(effect, size, np.random.default_rng(3))
    stronger, weaker = (0.9, 1.1) if effect in {"speed_limit", "command_slew"} else (1.1, 0.9)
    assert is_below(effect, drawn.parameters, stronger * size)
    assert not is_below(effect, drawn.parameters, weaker * size)


def test_without_a_camera_no_case_has_poses_and_none_conceals_what_only_they_show():
    planned = plan(3, {"continuous": Counts(0, 66, 4, 4)}, background=True, without="camera")
    needed = {column for case in planned for name in case.effects for column in cases._needed([name])}
    assert "x_m" not in needed
    assert all(case.manner.without == "camera" for case in planned)
    conditions = cases._conditions(np.random.default_rng(1), ("backlash",), 8, "camera")
    assert not {"x_m", "y_m", "heading_deg"} & set(conditions.columns)
    assert {"left_angle_deg", "reflection_pct"} <= set(conditions.columns)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"backlash": None}, True),
        ({"backlash": {"size": 2.0, "unit": "deg"}}, True),
        ({"backlash": {"size": 1.0, "unit": "deg"}}, False),
        ({}, False),
    ],
)
def test_an_effect_is_called_invisible_by_no_limit_or_by_one_above_it(limits, said):
    effect = {"id": "backlash", "parameters": {"angle_deg": {"value": 1.5, "unit": "deg"}}}
    label = {
        "case": "c", "kind": "single", "effects": [effect], "outside": None, "runs": ["holds"],
        "conditions": {"columns": ["left_angle_deg"]},
    }  # fmt: skip
    one = judge(label, {"verdict": "nothing", "limits": limits}, UNSEEN)
    assert (one.invisible, one.camera) == (said, False)
