"""The kinds that nobody has met: that worlds feel them alike, and that they are drawn when asked for only."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip(
    "mujoco", reason="MUJOCO IS MISSING: the kinds unmet are not tested (pip install gecar[test])"
)

from support.concealed_worlds import HERE, assert_felt_alike, changes, driven, label_of

from benchmarks.concealed import cases
from benchmarks.concealed.__main__ import main
from benchmarks.concealed.cases import Manner
from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.history import History
from benchmarks.concealed.kinds import ALL_OUTSIDE, SETS
from benchmarks.concealed.kinds.unmet import UNMET
from benchmarks.concealed.plan import outside_kinds
from benchmarks.concealed.recording import channels
from benchmarks.concealed.robot import NEUTRAL, Concealed
from benchmarks.concealed.worlds import truth

LEFT = 0
LESS, MORE = -1, 1
AHEAD, TURNED = 0, 2  # of the pose
STRAIGHT, BEND = ((70, 70),), ((70, 30),)
STOPPED, THERE_AND_BACK = ((70, 70), (0, 0)), ((70, 70), (-70, -70))

# What is concealed, the duties given one after the other, and how which part of the last pose differs from nominal.
FELT = [
    ({"gear_loss": (0.5, LEFT)}, STRAIGHT, TURNED, MORE),
    ({"grease": (0.05, 2.0, 10.0, LEFT)}, STRAIGHT, TURNED, MORE),
    ({"frame_rub": (0.1, -1.0, LEFT)}, BEND, TURNED, MORE),
    ({"hair": (1.5, 0.1)}, STRAIGHT, AHEAD, LESS),
    ({"hair": (1.5, 0.1)}, BEND, TURNED, MORE),
    ({"slow_sag": (6.0, 0.2)}, STRAIGHT, AHEAD, LESS),
    ({"holding": 0.5}, STOPPED, AHEAD, LESS),
    ({"latch": (0.3, 0.0)}, STRAIGHT, AHEAD, LESS),
    ({"latch": (0.3, 0.5)}, THERE_AND_BACK, AHEAD, MORE),
    ({"grooves": (1.2, math.pi / 4.0)}, STRAIGHT, AHEAD, LESS),
    ({"grooves": (1.2, 0.0)}, BEND, TURNED, MORE),
]


@pytest.fixture(scope="module")
def in_mujoco():
    """How each thing changes the last pose in MuJoCo's world."""
    return changes("mujoco", FELT)


@pytest.mark.parametrize("world", HERE)
def test_each_thing_concealed_moves_the_robot_as_it_should_and_as_far_as_elsewhere(world, in_mujoco):
    assert_felt_alike(world, FELT, in_mujoco)


@pytest.mark.parametrize("world", HERE)
def test_a_turn_the_other_way_presses_no_wheel_on_the_frame(world):
    free, rubbing = (driven(world, Concealed(frame_rub=(rub, 1.0, LEFT)), BEND) for rub in (0.0, 0.1))
    assert free == pytest.approx(rubbing, abs=1e-9)


@pytest.mark.parametrize("world", HERE)
def test_along_grooves_and_unwound_nothing_holds_the_caster(world):
    nominal = driven(world, NEUTRAL, ((-70, -70),))
    for fields in ({"grooves": (1.2, 0.0)}, {"hair": (1.5, 0.1)}):
        assert driven(world, Concealed(**fields), ((-70, -70),)) == pytest.approx(nominal, abs=1e-6)


@pytest.mark.parametrize("world", HERE)
def test_a_battery_recovers_while_the_motors_rest(world):
    robot = truth(world, Concealed(slow_sag=(6.0, 0.3)))
    seen = robot.run((0.0, 0.6, 0.0), lambda time_s, _: (80, 80) if time_s < 0.5 else (0, 0), 1.0).terminal_v
    assert seen[500] < seen[0] - 0.5
    assert seen[500] + 0.3 < seen[-1] < seen[0]


def test_a_second_spot_is_seen_in_its_share():
    # The line's left side, 25 mm wide, has its middle at x = 0.15 m.
    sensor = ColourSensor(Concealed(second_spot=(0.3, 0.0, 0.03)))
    ahead = NEUTRAL.sensor_ahead
    lights = [sensor.look(x, 0.6 - ahead, math.pi / 2.0) for x in (0.15, 0.18, 0.21)]
    assert lights == pytest.approx([30.0, 70.0, 100.0])


def test_a_gain_rises_after_a_while_over_the_line_and_falls_over_white():
    sensor = ColourSensor(Concealed(auto_gain=(0.5, 0.1)))
    ahead, edge, white = NEUTRAL.sensor_ahead, 0.15 + 0.0125, 0.2
    dark = [sensor.look(x, 0.6 - ahead, math.pi / 2.0) for x in [white] * 500 + [edge] * 1000]
    assert dark[499] == pytest.approx(100.0)
    assert dark[500] < 51.0
    assert dark[-1] == pytest.approx(50.0 * 0.5**-0.5, rel=1e-3)


def test_a_camera_askew_sees_places_and_headings_in_one_perspective():
    history = History.blank(101)
    history.pose[:, 0], history.pose[:, 1], history.pose[:, 2] = np.linspace(1.9, 2.0, 101), 0.9, 0.0
    seen = channels(history, Concealed(keystone=(0.1, 0.2)))
    assert seen["x_m"][0] == pytest.approx(1.2 + 0.7 / 1.13)
    assert seen["y_m"][0] == pytest.approx(0.6 + 0.3 / 1.13)
    way = np.arctan2(np.diff(seen["y_m"]), np.diff(seen["x_m"]))
    assert np.radians(seen["heading_deg"][:-1]) == pytest.approx(way, abs=1e-3)


def test_a_clock_of_counted_frames_falls_behind():
    history = History.blank(1001)
    history.pose[:, 0] = history.time_s
    seen = channels(history, Concealed(frame_rate=0.25))
    assert seen["x_m"] == pytest.approx(history.time_s[::10] / 1.25)


def test_at_most_two_kinds_differ_from_run_to_run():
    differing = {
        name for name, kind in UNMET.items() if len(set(kind.draw(np.random.default_rng(1), 2, 0.0)[0])) == 2
    }
    assert len(differing) <= 2


def test_sets_share_no_name_and_kinds_unmet_are_drawn_alone_or_not_at_all():
    assert len(UNMET) >= 12
    assert len(ALL_OUTSIDE) == sum(
        len(SETS[name]) for name in ("last", "final", "unmet", "fresh", "sixth", "seventh")
    )
    for manner in (Manner("continuous", background=True), Manner("mujoco")):
        assert outside_kinds(manner, "unmet") == list(UNMET)
        assert not set(UNMET) & {
            name for kinds in ("met", "last", "final") for name in outside_kinds(manner, kinds)
        }


def test_one_case_of_any_kind_is_drawn_by_its_name(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(cases, "draw_case", lambda name, kind, things, *_: drawn.append(things))
    (tmp_path / "cases").mkdir()
    for name in ALL_OUTSIDE:
        options = ["--kind", "outside", "--effect", name, "--out", str(tmp_path)]
        assert main(["draw", "--seed", "7", *options]) == 0
    assert drawn == [(name,) for name in ALL_OUTSIDE]


def test_a_label_says_which_kind_and_how_strong(tmp_path, monkeypatch):
    label = label_of("slow_sag", tmp_path, monkeypatch)
    assert label["outside"]["id"] == "slow_sag"
    assert set(label["outside"]["numbers"]) == {"ohm", "time_s"}
    assert label["size"]["slow_sag"]["mm_drive"] > 0.0
