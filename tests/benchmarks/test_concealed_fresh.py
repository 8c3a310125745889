"""The kinds of the fifth set: that worlds feel them alike, that their zero is neutral, and when they are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip(
    "mujoco", reason="MUJOCO IS MISSING: the fresh kinds are not tested (pip install gecar[test])"
)

from support.concealed_worlds import HERE, assert_felt_alike, changes, driven, label_of

from benchmarks.concealed.cases import Manner
from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.history import History
from benchmarks.concealed.kinds.fresh import FRESH
from benchmarks.concealed.plan import outside_kinds
from benchmarks.concealed.recording import channels
from benchmarks.concealed.robot import NEUTRAL, Concealed
from benchmarks.concealed.worlds import truth

LEFT = 0
LESS, MORE = -1, 1
AHEAD, TURNED = 0, 2  # of the pose
STRAIGHT, BEND, LONG = ((70, 70),), ((70, 30),), ((70, 70), (70, 70))

# What is concealed, the duties given one after the other, and how which part of the last pose differs from nominal.
FELT = [
    ({"hum": (0.05, 9.0, 3.0, LEFT)}, STRAIGHT, TURNED, MORE),
    ({"scrub": 0.05}, BEND, TURNED, MORE),
    ({"fuse": (2.0, 0.3, 0.3)}, STRAIGHT, AHEAD, LESS),
    ({"throttle": (0.3, 0.2)}, STRAIGHT, AHEAD, LESS),
    ({"loose_cell": (0.4, 0.2, -1.0)}, BEND, AHEAD, LESS),
    ({"fan": (-1.0, 0.6, 2.0, 1000.0, 0.0)}, STRAIGHT, AHEAD, MORE),
    ({"fan": (3.0, 0.6, 8.0, 2.0, math.pi / 2.0)}, LONG, AHEAD, LESS),
    ({"rocking": (0.06, 1.0, 0.0, 0.05)}, STRAIGHT, AHEAD, LESS),
    ({"rocking": (0.06, 0.02, 0.0, 0.01)}, LONG, AHEAD, MORE),
    ({"patches": (0.05, 0.05, 3.0)}, STRAIGHT, AHEAD, LESS),
]
NOTHING = {
    "hum": (0.0, 9.0, 3.0, LEFT),
    "fuse": (0.0, 0.3, 0.3),
    "throttle": (0.0, 0.2),
    "loose_cell": (0.0, 0.2, -1.0),
    "fan": (-1.0, 0.6, 0.0, 2.0, 0.0),
    "rocking": (0.0, 1.0, 0.0, 0.05),
    "patches": (0.0, 0.05, 3.0),
    "warming": (0.0, 1.0),
    "faded": (0.0, 0.15, 0.6, 0.2),
}


@pytest.fixture(scope="module")
def in_mujoco():
    """How each thing changes the last pose in MuJoCo's world."""
    return changes("mujoco", FELT)


@pytest.mark.parametrize("world", HERE)
def test_each_thing_concealed_moves_the_robot_as_it_should_and_as_far_as_elsewhere(world, in_mujoco):
    assert_felt_alike(world, FELT, in_mujoco)


@pytest.mark.parametrize("world", HERE)
def test_at_no_strength_each_thing_leaves_a_recording_as_it_is(world):
    def run(robot):
        return truth(world, robot).run((0.175, 0.6, 1.5), lambda time_s, _: (60, 20), 0.3)

    nominal = run(NEUTRAL)
    for field, nothing in NOTHING.items():
        for name, array in vars(run(Concealed(**{field: nothing}))).items():
            np.testing.assert_array_equal(array, vars(nominal)[name], err_msg=field)


@pytest.mark.parametrize("world", HERE)
def test_a_cell_holds_in_curves_of_the_other_way_and_on_the_spot(world):
    for duties in (((30, 70),), ((50, -50),)):
        nominal, loose = (driven(world, Concealed(loose_cell=(s, 0.2, -1.0)), duties) for s in (0.0, 0.4))
        assert loose == pytest.approx(nominal, abs=2e-3)


@pytest.mark.parametrize("world", HERE)
def test_scrub_and_resonance_hold_nothing_straight_ahead_and_far_from_the_rate(world):
    nominal = driven(world, NEUTRAL, STRAIGHT)
    for fields in ({"scrub": 0.05}, {"hum": (0.05, 60.0, 1.0, LEFT)}):
        assert driven(world, Concealed(**fields), STRAIGHT) == pytest.approx(nominal, abs=2e-3), fields


@pytest.mark.parametrize("world", HERE)
def test_duties_that_change_are_not_throttled(world):
    def course(time_s, _):
        return (70, 50) if int(time_s / 0.1) % 2 else (60, 60)

    nominal, spared = (
        truth(world, Concealed(throttle=(share, 0.2))).run((0.0, 0.6, 0.0), course, 0.5).pose[-1]
        for share in (0.0, 0.5)
    )
    assert spared == pytest.approx(nominal, abs=1e-9)


@pytest.mark.parametrize("world", HERE)
def test_a_fuse_cools_while_its_motor_rests(world):
    robot = Concealed(fuse=(3.0, 0.3, 0.3))
    cold = driven(world, robot, STRAIGHT)[AHEAD]
    rested = ((70, 70), *((0, 0),) * 4)
    # After a rest half a second brings the robot on as far as at first, but not after as short a stop.
    for before, like_cold in ((rested, True), (rested[:2], False)):
        way = driven(world, robot, (*before, *STRAIGHT))[AHEAD] - driven(world, robot, before)[AHEAD]
        assert (way == pytest.approx(cold, rel=0.02)) == like_cold


def test_a_lamp_fades_to_its_share():
    sensor = ColourSensor(Concealed(warming=(0.2, 0.1)))
    lights = [sensor.look(1.2, 0.6, 0.0) for _ in range(1001)]
    assert lights[0] == pytest.approx(100.0)
    assert lights[100] == pytest.approx(100.0 - 20.0 * (1.0 - math.exp(-1.0)))
    assert lights[-1] == pytest.approx(80.0, abs=0.01)


def test_a_line_is_pale_where_it_is_worn_and_black_elsewhere():
    sensor = ColourSensor(Concealed(faded=(0.4, 0.15, 0.5, 0.1)))
    ahead = NEUTRAL.sensor_ahead
    lights = [sensor.look(x, y - ahead, math.pi / 2.0) for x, y in ((0.15, 0.5), (0.15, 0.8), (0.2, 0.5))]
    assert lights == pytest.approx([40.0, 0.0, 100.0], abs=1e-6)


def test_a_camera_shakes_as_drawn():
    history = History.blank(1001)
    history.pose[:] = (1.2, 0.6, 0.0)
    seen = channels(history, Concealed(shake=((0.0, 0.0, 0.0), (0.02, -0.01, 0.0), (0.0, 0.0, 0.1))))
    assert seen["x_m"][25] == pytest.approx(1.21)
    assert seen["y_m"][25] == pytest.approx(0.595)
    assert seen["heading_deg"][-1] == pytest.approx(math.degrees(0.1))


def test_a_backlog_grows_and_is_thrown_away():
    history = History.blank(3001)
    history.pose[:, 0] = history.time_s
    late = history.time_s[::10] - channels(history, Concealed(backlog=(0.2, 1.0, 0.5)))["x_m"]
    assert late[[25, 49, 75, 149]] == pytest.approx([0.15, 0.198, 0.05, 0.198], abs=1e-6)


@pytest.mark.parametrize("name", FRESH)
def test_each_kind_as_drawn_changes_a_recording(name):
    robots, _ = FRESH[name].draw(np.random.default_rng(3), 1, 0.5)
    _, worn_x, worn_y, _ = robots[0].faded or (0.0, 0.24, 0.65, 0.0)
    start, clean = (worn_x - NEUTRAL.sensor_ahead, worn_y, 0.0), []
    for robot in (robots[0], NEUTRAL):
        history = truth("continuous", robot).run(start, lambda time_s, _: (50, 48 + 20 * (time_s > 1.0)), 2.0)
        clean.append(np.stack(list(channels(history, robot).values())))
    assert np.abs(clean[0] - clean[1]).max() > 1e-3


def test_at_most_four_kinds_differ_from_run_to_run():
    differing = {
        name for name, kind in FRESH.items() if len(set(kind.draw(np.random.default_rng(1), 2, 0.0)[0])) == 2
    }
    assert len(differing) <= 4


def test_fresh_kinds_are_drawn_alone_or_not_at_all():
    assert len(FRESH) >= 12
    for manner in (Manner("continuous", background=True), Manner("mujoco"), Manner("bullet")):
        assert outside_kinds(manner, "fresh") == list(FRESH)
        others = (
            name for kinds in ("met", "last", "final", "unmet") for name in outside_kinds(manner, kinds)
        )
        assert not set(FRESH) & set(others)


def test_a_label_says_which_kind_and_how_strong(tmp_path, monkeypatch):
    label = label_of("tyre_scrub", tmp_path, monkeypatch)
    assert label["outside"]["id"] == "tyre_scrub"
    assert set(label["outside"]["numbers"]) == {"torque_nm"}
    assert label["size"]["tyre_scrub"]["deg_drive"] > 0.0
