"""The kinds of the seventh set: that they matter, that worlds feel them alike, that zero is neutral."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip(
    "mujoco", reason="MUJOCO IS MISSING: the seventh kinds are not tested (pip install gecar[test])"
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
from benchmarks.concealed.kinds.seventh import SEVENTH
from benchmarks.concealed.recording import channels
from benchmarks.concealed.robot import NEUTRAL, Concealed
from benchmarks.concealed.worlds import holds, truth

START = (0.6, 0.13, 0.2)  # of the way across the lower line
LEFT, RIGHT = 0, 1
LESS, MORE = -1, 1
AHEAD, TURNED = 0, 2  # of the pose
STRAIGHT = ((70, 70),)
LEAKING = ("mujoco", "continuous")  # worlds in which a wheel can shrink
STILL = {"line_wider", "speed_lift", "stitch", "predictor"}  # what moves no robot

# What is concealed, the duties given one after the other, and how which part of the last pose then differs.
FELT = [
    ({"overrun": 1.0}, ((75, 75), (20, 20)), AHEAD, MORE),
    ({"motor_sync": 1.0}, ((70, 20), (50, 50), (50, 50)), TURNED, MORE),
    ({"sticky_pct": 25.0}, ((40, 40), (60, 60)), AHEAD, LESS),
    ({"duty_budget": 0.9}, STRAIGHT, AHEAD, LESS),
    ({"brush": (0.5, 0.05, 0.08)}, STRAIGHT, TURNED, MORE),
    ({"brush": (0.5, -0.05, -0.08)}, STRAIGHT, TURNED, LESS),
    ({"curl": (0.25, 0.45)}, STRAIGHT, AHEAD, MORE),
    ({"leak": (0.1, 0.2, LEFT)}, STRAIGHT, TURNED, MORE),
    ({"leak": (0.1, 0.2, RIGHT)}, STRAIGHT, TURNED, LESS),
    ({"turret": (0.1, 2.0, 0.0)}, STRAIGHT, TURNED, MORE),
]
NOTHING = {
    "brush": (0.0, 0.05, 0.05),
    "curl": (0.0, 0.3),
    "leak": (0.0, 5.0, LEFT),
    "turret": (0.0, 2.0, 0.5),
    "stitch": (0.1, 0.0, 0.0, 0.0, 0.0),
    "predictor": (0.0, 0.05),
}


@pytest.fixture(scope="module")
def in_mujoco():
    """How each thing changes the last pose in MuJoCo's world."""
    return changes("mujoco", FELT)


@pytest.fixture(scope="module", params=HERE)
def crossing(request):
    """A world, and what the nominal robot does there as it weaves across the lower line for over a metre."""
    return request.param, crossed(request.param, NEUTRAL, START)


def robot_at(name, share):
    (robot,), _ = SEVENTH[name].draw(np.random.default_rng(3), 1, Exactly(share))
    return robot


@pytest.mark.parametrize("name", SEVENTH)
def test_at_the_upper_strength_each_kind_is_material(crossing, name):
    world, nominal = crossing
    robot = robot_at(name, 1.0)
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


@pytest.mark.parametrize("world", HERE)
@pytest.mark.parametrize(
    ("fields", "duties"),
    [
        ({"overrun": 1.0}, ((40, 40), (0, 0))),
        ({"motor_sync": 1.0}, ((60, 40), (30, 50))),
        ({"sticky_pct": 15.0}, ((40, 20), (60, -20), (0, 0))),
        ({"duty_budget": 1.2}, ((60, 60), (-70, 50))),
        ({"curl": (0.25, 0.15)}, ((60, 60),)),
    ],
    ids=lambda given: next(iter(given)) if isinstance(given, dict) else "",
)
def test_where_it_does_not_act_each_thing_leaves_a_drive_as_it_is(world, fields, duties):
    def last(robot):
        most, start = len(duties) - 1, (0.6, 0.6, 0.3)
        return (
            truth(world, robot)
            .run(start, lambda time_s, _: duties[min(int(time_s / 0.5), most)], 0.5 * len(duties))
            .pose[-1]
        )

    assert last(Concealed(**fields)) == pytest.approx(last(NEUTRAL), abs=1e-9)


@pytest.mark.parametrize("world", HERE)
def test_motors_that_outrun_their_duty_are_braked_again_at_none(world):
    slowed, stopped = ((75, 75), (10, 10)), ((75, 75), (0, 0))
    freed, nominal = Concealed(overrun=1.0), NEUTRAL
    assert driven(world, freed, slowed)[AHEAD] > driven(world, nominal, slowed)[AHEAD] + 0.02
    assert driven(world, freed, stopped)[AHEAD] == pytest.approx(
        driven(world, nominal, stopped)[AHEAD], abs=1e-4
    )


@pytest.mark.parametrize("world", HERE)
def test_synchronised_motors_end_where_they_were_given_the_same(world):
    history = truth(world, Concealed(motor_sync=1.0)).run(
        (0.5, 0.6, 0.0), lambda time_s, _: (70, 20) if time_s < 0.5 else (50, 50), 2.5
    )
    lead = history.angles[:, LEFT] - history.angles[:, RIGHT]
    assert lead[600:].max() > lead[500] + 0.2
    assert lead[-1] == pytest.approx(lead[500], abs=0.05)


@pytest.mark.parametrize("world", HERE)
def test_a_small_change_waits_for_a_larger_one(world):
    sticky = Concealed(sticky_pct=10.0)
    waited = driven(world, sticky, ((40, 40), (45, 45), (48, 48), (52, 52)))
    assert waited == pytest.approx(driven(world, NEUTRAL, ((40, 40), (40, 40), (40, 40), (52, 52))), abs=1e-9)


@pytest.mark.parametrize("world", HERE)
def test_a_budget_takes_from_both_alike(world):
    rationed = driven(world, Concealed(duty_budget=0.9), ((80, 40),))
    assert rationed == pytest.approx(driven(world, NEUTRAL, ((60, 30),)), abs=1e-9)


@pytest.mark.parametrize("world", HERE)
def test_a_brush_turns_the_robot_the_other_way_when_it_goes_back(world):
    def turned(duties):
        brush = Concealed(brush=(0.5, 0.0, 0.08))
        return driven(world, brush, duties)[TURNED] - driven(world, NEUTRAL, duties)[TURNED]

    assert turned(((-70, -70),)) == pytest.approx(-turned(STRAIGHT), rel=0.15)


@pytest.mark.parametrize("world", HERE)
def test_a_curled_mat_leads_the_robot_to_the_middle_from_every_side(world):
    def moved(robot, start):
        return truth(world, robot).run(start, lambda *_: (60, 60), 0.5).pose[-1]

    for start in (
        (0.2, 0.6, 0.0),
        (2.2, 0.6, math.pi),
        (1.2, 0.1, math.pi / 2.0),
        (1.2, 1.1, -math.pi / 2.0),
    ):
        off = (moved(Concealed(curl=(0.2, 0.4)), start) - moved(NEUTRAL, start))[:2]
        assert off @ (math.cos(start[2]), math.sin(start[2])) > 1e-3


@pytest.mark.parametrize("world", LEAKING)
def test_a_leaking_tyre_is_whole_again_in_the_next_recording(world):
    robot = truth(world, Concealed(leak=(0.1, 0.5, LEFT)))
    first, again = (robot.run((0.5, 0.6, 0.0), lambda *_: (60, 60), 1.0) for _ in range(2))
    np.testing.assert_array_equal(first.pose, again.pose)
    rolled = np.diff(first.angles[[100, 400, 700, 1000]], axis=0)
    turned = np.diff(first.pose[[100, 400, 700, 1000], TURNED])
    assert np.all(np.diff(turned / rolled[:, LEFT]) > 0.0)


@pytest.mark.parametrize("world", HERE)
def test_a_turret_turns_the_robot_to_and_fro(world):
    to, fro = (
        driven(world, Concealed(turret=(0.1, 1.0, phase)), STRAIGHT)[TURNED] for phase in (0.0, math.pi)
    )
    assert to > 0.01
    assert fro == pytest.approx(-to, rel=0.05)


def test_a_wider_line_has_its_edges_farther_out():
    ahead = NEUTRAL.sensor_ahead
    for wider in (0.01, -0.005):
        sensor, edge = ColourSensor(Concealed(line_wider=wider)), 0.0125 + wider / 2.0
        lights = [sensor.look(x - ahead, 0.6, 0.0) for x in (0.15 - edge, 0.15, 0.15 + edge)]
        assert lights == pytest.approx([50.0, 0.0, 50.0])


def test_a_reading_falls_with_the_speed_ahead_or_back():
    for way in (1.0, -1.0):
        sensor = ColourSensor(Concealed(speed_lift=0.5))
        lights = [sensor.look(1.2 + way * 0.4 * tick * 0.001, 0.6, 0.0) for tick in range(500)]
        assert lights[0] == 100.0
        assert lights[-1] == pytest.approx(80.0, abs=0.1)


def test_a_second_camera_sees_beyond_the_seam():
    history = History.blank(21)
    history.pose[:] = [1.1, 0.6, 0.5]
    history.pose[10:] = [1.3, 0.6, 0.5]
    seen = channels(history, Concealed(stitch=(1.2, 0.02, -0.01, 0.1, 0.5)))
    first, _, second = np.column_stack([seen["x_m"], seen["y_m"], np.radians(seen["heading_deg"])])
    assert first == pytest.approx([1.1, 0.6, 0.5])
    arm = [0.15 * math.cos(0.1), 0.15 * math.sin(0.1)]
    assert second == pytest.approx([1.22 + arm[0], 0.59 + arm[1], 0.6])


def test_a_tracker_is_right_at_a_steady_speed_and_overshoots_a_stop():
    history = History.blank(3001)
    history.pose[:, 0] = np.minimum(history.time_s, 2.0) * 0.4
    off = channels(history, Concealed(predictor=(0.1, 0.05)))["x_m"] - history.pose[::10, 0]
    assert off[190] == pytest.approx(0.0, abs=1e-6)
    assert off[210] == pytest.approx(0.04, abs=1e-3)
    assert off[300] == pytest.approx(0.0, abs=1e-6)


def test_strengths_keep_to_their_bounds_and_grow():
    for name, kind in SEVENTH.items():
        first = next(iter(unlike_neutral(robot_at(name, 0.5)).values()))
        drawn = [kind.draw(np.random.default_rng(seed), 1, 0.0)[1] for seed in range(40)]
        weak, strong = (kind.draw(np.random.default_rng(3), 1, Exactly(share))[1] for share in (0.0, 1.0))
        grown = [key for key in weak if abs(weak[key]) != abs(strong[key])]
        assert first is not None
        assert grown, name
        low, high = sorted((abs(weak[grown[0]]), abs(strong[grown[0]])))
        assert high > 2.0 * low, name
        assert all(low <= abs(numbers[grown[0]]) <= high for numbers in drawn), name


def test_only_what_swings_by_the_clock_differs_from_run_to_run():
    differing = {
        name
        for name, kind in SEVENTH.items()
        if len(set(kind.draw(np.random.default_rng(1), 2, 0.0)[0])) == 2
    }
    assert differing == {"swinging_turret"}


def test_seventh_kinds_are_drawn_alone_or_not_at_all():
    assert len(SEVENTH) >= 12
    assert_drawn_alone("seventh", {"continuous": 12, "mujoco": 12, "bullet": 11})


def test_a_label_says_which_kind_and_how_strong(tmp_path, monkeypatch):
    label = label_of("dragging_brush", tmp_path, monkeypatch)
    assert label["outside"]["id"] == "dragging_brush"
    assert set(label["outside"]["numbers"]) == {"force_n", "ahead_m", "left_m"}
    assert label["size"]["dragging_brush"]["deg_drive"] > 0.0
