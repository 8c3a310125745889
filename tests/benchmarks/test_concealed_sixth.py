"""The kinds of the sixth set: that they matter, that worlds feel them alike, and that their zero is neutral."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip(
    "mujoco", reason="MUJOCO IS MISSING: the sixth kinds are not tested (pip install gecar[test])"
)

from support.concealed_worlds import (
    HERE,
    assert_drawn_alone,
    assert_felt_alike,
    assert_material,
    assert_nothing,
    changes,
    crossed,
    driven,
    label_of,
)

from benchmarks.concealed.cases import unlike_neutral
from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.effects import Exactly
from benchmarks.concealed.history import History
from benchmarks.concealed.kinds.sixth import SIXTH
from benchmarks.concealed.recording import channels
from benchmarks.concealed.robot import EV3, NEUTRAL, Concealed
from benchmarks.concealed.worlds import holds, truth

START = (0.2, 0.13, 0.2)  # of the way across the lower line
LEFT, RIGHT = 0, 1
LESS, MORE = -1, 1
AHEAD, TURNED = 0, 2  # of the pose
STRAIGHT, SLOW, SPIN = ((70, 70),), ((40, 40),), ((-50, 50),)
CARRYING = ("mujoco", "continuous")  # worlds that carry robots, and in which wheels slip on their axles
STILL = {"wobble", "seams", "nod", "aspect", "compass"}  # what moves no robot

# What is concealed, the duties given one after the other, and how which part of the last pose differs from nominal.
FELT = [
    ({"expo": 0.5}, SLOW, AHEAD, LESS),
    ({"expo": -0.5}, SLOW, AHEAD, MORE),
    ({"cut_out": (0.5, 0.03, 0.1)}, STRAIGHT, AHEAD, LESS),
    ({"pulses": (0.3, 1.0, 0.6, 0.0)}, STRAIGHT, AHEAD, LESS),
    ({"clutch": (0.01, LEFT)}, STRAIGHT, TURNED, MORE),
    ({"yaw_inertia_scale": 5.0}, SPIN, TURNED, LESS),
    ({"fin": (0.03, math.pi / 2.0)}, STRAIGHT, TURNED, MORE),
    ({"nap": (0.1, 0.0)}, STRAIGHT, AHEAD, MORE),
    ({"nap": (0.1, math.pi)}, STRAIGHT, AHEAD, LESS),
]
NOTHING = {
    "cut_out": (0.5, 0.03, 0.0),
    "pulses": (0.0, 1.0, 0.5, 0.0),
    "fin": (0.0, 1.0),
    "nap": (0.0, 1.0),
    "wobble": (0.0, 0.3, 0.0, 0.0),
    "seams": (0.0, 0.003),
    "nod": (0.0, 0.05),
    "compass": (0.0, 2, 0.5),
}


@pytest.fixture(scope="module")
def in_mujoco():
    """How each thing changes the last pose in MuJoCo's world."""
    return changes("mujoco", FELT)


@pytest.fixture(scope="module", params=HERE)
def crossing(request):
    """A world, and what the nominal robot does there as it weaves across the lower line for over a metre."""
    return request.param, crossed(request.param, NEUTRAL, START)


@pytest.mark.parametrize("name", SIXTH)
def test_at_the_upper_strength_each_kind_is_material(crossing, name):
    world, nominal = crossing
    (robot,), _ = SIXTH[name].draw(np.random.default_rng(3), 1, Exactly(1.0))
    if not holds(world, unlike_neutral(robot)):
        pytest.skip(f"the {world} world has no law for it")
    moved = nominal if STILL & set(unlike_neutral(robot)) else crossed(world, robot, START)
    assert_material(nominal, moved, robot)


@pytest.mark.parametrize("world", HERE)
def test_each_thing_concealed_moves_the_robot_as_it_should_and_as_far_as_elsewhere(world, in_mujoco):
    held = [(felt, there) for felt, there in zip(FELT, in_mujoco, strict=True) if holds(world, felt[0])]
    assert_felt_alike(world, *zip(*held, strict=True))


@pytest.mark.parametrize("world", HERE)
def test_at_no_strength_each_thing_leaves_a_recording_as_it_is(world):
    assert_nothing(world, NOTHING)


@pytest.mark.parametrize("world", CARRYING)
def test_a_floor_carries_the_robot_aside_and_its_wheels_notice_nothing(world):
    still, carrying = (
        truth(world, Concealed(nap=nap)).run((0.5, 0.6, 2.0), lambda *_: (70, 60), 1.0)
        for nap in (None, (0.1, math.pi / 2.0))
    )
    way = np.hypot(*np.diff(still.pose[:, :2], axis=0).T).sum()
    assert carrying.pose[-1] - still.pose[-1] == pytest.approx([0.0, 0.1 * way, 0.0], abs=5e-4)
    np.testing.assert_allclose(carrying.angles, still.angles, atol=0.02)


@pytest.mark.parametrize("world", CARRYING)
def test_a_clutch_that_holds_leaves_a_drive_as_it_is_and_one_that_slips_is_unseen_by_the_encoder(world):
    nominal, holding, slipping = (
        truth(world, robot).run((0.5, 0.6, 0.0), lambda *_: (70, 70), 0.5)
        for robot in (NEUTRAL, Concealed(clutch=(0.05, RIGHT)), Concealed(clutch=(0.01, RIGHT)))
    )
    assert holding.pose[-1] == pytest.approx(nominal.pose[-1], abs=1e-4)
    assert holding.angles[-1] == pytest.approx(nominal.angles[-1], abs=1e-3)
    assert slipping.pose[-1, TURNED] < -0.1
    assert slipping.angles[-1, RIGHT] > slipping.angles[-1, LEFT] - 0.01


@pytest.mark.parametrize("world", CARRYING)
def test_a_clutch_and_play_go_together(world):
    play, both = (
        driven(world, Concealed(backlash_deg=6.0, rolling_resistance=0.02, clutch=clutch), STRAIGHT)
        for clutch in (None, (0.01, LEFT))
    )
    assert both[TURNED] > play[TURNED] + 0.1


@pytest.mark.parametrize("world", HERE)
def test_a_driver_bears_a_gentle_start_and_its_motor_runs_free_while_it_is_off(world):
    robot = Concealed(cut_out=(0.75, 0.03, 0.3))
    assert driven(world, robot, SLOW) == pytest.approx(driven(world, NEUTRAL, SLOW), abs=1e-9)
    stopped = ((40, 40), (75, 75), (-75, -75))  # turning round takes most current
    assert driven(world, robot, stopped)[AHEAD] > driven(world, NEUTRAL, stopped)[AHEAD] + 0.02


@pytest.mark.parametrize("world", HERE)
def test_a_pulsed_load_shows_at_the_terminals(world):
    seen = truth(world, Concealed(pulses=(0.2, 0.4, 0.5, 0.25))).run((0.5, 0.6, 0.0), lambda *_: (0, 0), 0.5)
    shares = seen.terminal_v[[50, 200, 400]] / EV3.supply
    assert shares == pytest.approx([0.8, 1.0, 0.8])


@pytest.mark.parametrize("world", HERE)
def test_a_robot_that_heads_into_the_draught_is_not_turned(world):
    straight = driven(world, Concealed(fin=(0.03, 0.0)), STRAIGHT)
    assert straight == pytest.approx(driven(world, NEUTRAL, STRAIGHT), abs=1e-4)


def test_a_line_weaves_across_its_place():
    sensor, ahead = ColourSensor(Concealed(wobble=(0.02, 0.2, 0.0, 0.0))), NEUTRAL.sensor_ahead
    lights = [
        sensor.look(x, y - ahead, math.pi / 2.0)
        for x, y in ((0.15, 0.6), (0.15, 0.65), (0.13, 0.65), (0.17, 0.55))
    ]
    assert lights == pytest.approx([0.0, 100.0, 0.0, 0.0], abs=1e-6)


def test_a_spot_sees_its_share_of_a_seam():
    sensor, ahead = ColourSensor(Concealed(seams=(0.5, 0.002))), NEUTRAL.sensor_ahead
    lights = [
        sensor.look(x - ahead, y, 0.0) for x, y in ((1.05, 0.75), (1.2, 0.75), (1.204, 0.75), (1.2, 0.6))
    ]
    assert lights == pytest.approx([100.0, 75.0, 87.5, 56.25])


def test_a_reading_falls_with_acceleration_and_rises_with_braking():
    sensor = ColourSensor(Concealed(nod=(0.1, 0.02)))
    time_s = np.arange(1000) * 0.001
    x = 1.0 + np.where(time_s < 0.4, time_s**2, 0.16 + 0.8 * (time_s - 0.4) - (time_s - 0.4) ** 2)
    lights = np.array([sensor.look(place, 0.6, 0.0) for place in x])
    assert lights[[0, 350, 790]] == pytest.approx([100.0, 80.0, 120.0], abs=0.1)


def test_a_stretched_image_shows_places_and_headings_alike():
    history = History.blank(101)
    way = np.linspace(0.0, 1e-3, 101)
    history.pose[:] = np.column_stack([1.7 + 0.6 * way, 0.9 + 0.8 * way, np.full(101, math.atan2(0.8, 0.6))])
    seen = channels(history, Concealed(aspect=0.1))
    assert seen["x_m"][0] == pytest.approx(1.75)
    assert seen["y_m"][0] == pytest.approx(0.87)
    heads = np.arctan2(np.diff(seen["y_m"]), np.diff(seen["x_m"]))
    assert np.radians(seen["heading_deg"][1:]) == pytest.approx(heads, abs=1e-9)


def test_a_compass_deviates_by_where_the_robot_heads():
    history = History.blank(1001)
    history.pose[:, 2] = np.linspace(0.0, 2.0 * math.pi, 1001)
    off = channels(history, Concealed(compass=(0.1, 2, 0.0)))["heading_deg"] - np.degrees(
        history.pose[::10, 2]
    )
    assert np.radians(off[[0, 25, 50]]) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert [np.radians(off.max()), np.radians(off.min())] == pytest.approx([0.1, -0.1], abs=1e-3)


def test_only_what_the_clock_switches_differs_from_run_to_run():
    differing = {
        name for name, kind in SIXTH.items() if len(set(kind.draw(np.random.default_rng(1), 2, 0.0)[0])) == 2
    }
    assert differing == {"pulsed_load"}


def test_sixth_kinds_are_drawn_alone_or_not_at_all():
    assert len(SIXTH) >= 12
    assert_drawn_alone("sixth", {"continuous": 12, "mujoco": 12, "bullet": 10})


def test_a_label_says_which_kind_and_how_strong(tmp_path, monkeypatch):
    label = label_of("slipping_clutch", tmp_path, monkeypatch)
    assert label["outside"]["id"] == "slipping_clutch"
    assert set(label["outside"]["numbers"]) == {"torque_nm", "side"}
    assert label["size"]["slipping_clutch"]["deg_drive"] > 0.0
