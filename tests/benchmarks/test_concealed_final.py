"""The kinds kept for a last examination: that each world feels them alike, and that no other draw has changed."""

from __future__ import annotations

import hashlib
import json
import math

import numpy as np
import pytest

pytest.importorskip(
    "mujoco", reason="MUJOCO IS MISSING: the last kinds are not tested (pip install gecar[test])"
)

from support.concealed_worlds import HERE, driven, label_of

from benchmarks.concealed.__main__ import main
from benchmarks.concealed.cases import Manner, unlike_neutral
from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.history import History
from benchmarks.concealed.kinds import ALL_OUTSIDE, SETS
from benchmarks.concealed.kinds.final import FINAL
from benchmarks.concealed.kinds.fresh import FRESH
from benchmarks.concealed.kinds.outside import OUTSIDE
from benchmarks.concealed.kinds.sealed import SEALED
from benchmarks.concealed.kinds.unmet import UNMET
from benchmarks.concealed.plan import Counts, outside_kinds, plan
from benchmarks.concealed.recording import channels
from benchmarks.concealed.robot import NEUTRAL, Concealed
from benchmarks.concealed.worlds import WORLDS, holds

LEFT, RIGHT = 0, 1
LESS, MORE = -1, 1
AHEAD, ASIDE, TURNED = 0, 1, 2  # of the pose
STRAIGHT, BEND, THERE_AND_BACK = ((70, 70),), ((70, 30),), ((70, 70), (-70, -70))

# What is concealed, the duties given one after the other, and how which part of the last pose differs from nominal.
FELT = [
    ({"axle_rub": 0.03}, BEND, TURNED, MORE),
    ({"strip": (0.05, 0.1, 0.2, 0.0)}, STRAIGHT, AHEAD, LESS),
    ({"strip": (0.05, 0.15, 0.2, math.pi / 4)}, STRAIGHT, TURNED, MORE),
    ({"reversal_pause": 0.1}, THERE_AND_BACK, AHEAD, MORE),
    ({"toe": (0.08, RIGHT)}, STRAIGHT, ASIDE, MORE),
    ({"trailer": (0.8, 0.2)}, STRAIGHT, AHEAD, LESS),
    ({"twist": 0.05}, BEND, TURNED, MORE),
    ({"keeper": (3.0, 0.2)}, STRAIGHT, AHEAD, MORE),
    ({"wander": (LEFT, (0.0, 0.2, 0.2, 0.2))}, STRAIGHT, TURNED, LESS),
]


@pytest.mark.parametrize("world", HERE)
def test_each_thing_concealed_moves_the_robot_as_it_should(world):
    nominal = {duties: driven(world, NEUTRAL, duties) for duties in (STRAIGHT, BEND, THERE_AND_BACK)}
    for fields, duties, part, wanted in FELT:
        change = (driven(world, Concealed(**fields), duties) - nominal[duties])[part]
        assert abs(change) > 1e-3, fields
        assert math.copysign(1.0, change) == wanted, fields


@pytest.mark.parametrize("world", HERE)
def test_a_slack_string_does_not_pull(world):
    back, dragging = (
        driven(world, Concealed(trailer=(force, 0.3)), ((-70, -70),))[AHEAD] for force in (0.0, 0.8)
    )
    assert back == pytest.approx(dragging, abs=1e-6)


def test_a_shadow_has_a_straight_and_blurred_edge():
    sensor = ColourSensor(Concealed(shadow=(0.2, 1.2, 0.02, 0.0)))
    ahead = NEUTRAL.sensor_ahead
    lights = [sensor.look(x - ahead, 0.6, 0.0) for x in (1.0, 1.2, 1.4)]
    assert lights == pytest.approx([100.0, 90.0, 80.0])


def test_a_camera_sees_its_marker_go_round_the_axle():
    history = History.blank(11)
    history.pose[:] = (1.0, 0.6, math.pi / 2.0)
    seen = channels(history, Concealed(marker=(0.02, 0.01)))
    assert seen["x_m"] == pytest.approx([0.99, 0.99])
    assert seen["y_m"] == pytest.approx([0.62, 0.62])
    assert seen["heading_deg"] == pytest.approx([90.0, 90.0])


@pytest.mark.parametrize("name", [*FINAL, *UNMET, *FRESH])
def test_each_kind_is_kept_held_by_all_worlds_and_drawn_again_alike(name):
    kind = ALL_OUTSIDE[name]
    (robots, numbers), again = (kind.draw(np.random.default_rng(1), 2, 0.0) for _ in range(2))
    assert (robots, numbers) == again
    assert kind.last
    assert all(holds(world, unlike_neutral(robots[0])) for world in WORLDS)
    assert json.loads(json.dumps(numbers)) == numbers


def test_what_is_drawn_by_chance_differs_from_run_to_run():
    differing = {
        name for name, kind in FINAL.items() if len(set(kind.draw(np.random.default_rng(1), 2, 0.0)[0])) == 2
    }
    assert 0 < len(differing) <= 3


def test_the_last_kinds_are_drawn_alone_or_not_at_all():
    manner = Manner("continuous", background=True)
    assert outside_kinds(manner, "final") == list(FINAL)
    assert not set(FINAL) & {*outside_kinds(manner, "last"), *OUTSIDE, *SEALED}


@pytest.mark.parametrize(
    ("background", "kinds", "digest"),
    [
        (False, "met", "e86938185368c8fd"),
        (True, "met", "5843117a0cf3199c"),
        (True, "last", "21f99483abb5d24f"),
    ],
)
def test_an_old_seed_plans_what_it_planned_before(background, kinds, digest):
    counts = {"mujoco": Counts(2, 5, 3, 20), "continuous": Counts(1, 5, 3, 30, 2, 10)}
    planned = plan(7, counts, background=background, kinds=kinds)
    told = repr([(case.name, case.kind, case.effects, case.seed) for case in planned])
    assert hashlib.sha256(told.encode()).hexdigest()[:16] == digest


@pytest.mark.parametrize("kinds", ["final", "unmet", "fresh", "sixth", "seventh"])
def test_the_command_plans_cases_of_a_set_alone(monkeypatch, tmp_path, kinds):
    drawn = []
    monkeypatch.setattr("benchmarks.concealed.plan.draw_all", lambda cases, out, workers: drawn.extend(cases))
    world = ["--world", f"continuous:outside={len(SETS[kinds])},mixed=2"]
    assert main(["plan", "--seed", "3", "--kinds", kinds, *world, "--out", str(tmp_path)]) == 0
    outside = [case.effects[-1] for case in drawn]
    assert set(outside) == set(SETS[kinds])
    assert len(outside) == len(SETS[kinds]) + 2


def test_a_label_says_which_kind_and_how_strong(tmp_path, monkeypatch):
    label = label_of("worn_brushes", tmp_path, monkeypatch)
    assert label["outside"]["id"] == "worn_brushes"
    assert set(label["outside"]["numbers"]) == {"share", "side"}
    assert len(label["robot"]["wander"][1]) > 24
    assert label["size"]["worn_brushes"]["mm_drive"] > 0.0
