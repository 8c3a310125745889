import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.courses import make_course
from support.racing import beyond_the_bound, farthest, fastest_found

from gecar.world.course.course import load_course
from gecar.world.course.lower_bound.fastest_time import sprint, travelled
from gecar.world.effects import CATALOGUE
from gecar.world.robot import load_robot
from gecar.world.rollout import Outcome, World, simulate

EV3 = load_robot("ev3")
UNCAPPED = EV3.model_copy(update={"drive": EV3.drive.model_copy(update={"duty_cap": 1.0})})
REGULATED = EV3.model_copy(update={"drive": EV3.drive.model_copy(update={"mode": "speed"})})
# What can make a robot move or turn faster; sensors and clocks can not.
MOVING = [e for e in CATALOGUE if set(e.channels) & {"motor", "pose"} and "clock" not in e.channels]
FULL_SPEED = np.array([[0, 100, 100, 1000, 0, 1]], np.int32)


def effect_of(effect, end, share):
    """Return an effect with its size at a share of the way from neutral to a bound, the rest inside its bounds."""
    values = {}
    for p in effect.parameters:
        neutral, bound = size_of(p, end)
        share = share if not values else 0.5
        values[p.label] = (1.0 - share) * neutral + share * bound
    if effect.id == "slippery_patch":  # under the robot
        values |= {"x_m": 0.0, "y_m": 0.0, "coefficient": 0.02}
    return {effect.id: values}


def size_of(p, end):
    """Return a parameter's neutral value and its bound in this robot, both finite."""
    lowest, highest = EV3.bounds(p)
    neutral, bound = EV3.nominal(p), min(max(getattr(p, end), lowest), highest)
    return tuple(value if math.isfinite(value) else p.start for value in (neutral, bound))


STRENGTHS = [
    (effect, end, share)
    for effect in MOVING
    for end in ("low", "high")
    for share in (0.3, 1.0)
    if len(set(size_of(effect.parameters[0], end))) == 2
]


def named(case):
    return f"{case[0].id}-{case[1]}-{case[2]}"


def test_the_fastest_speed_is_the_motors_at_full_duty_less_friction():
    p = EV3.physics[0]
    volts = p["duty_cap"] * p["voltage"]
    assert sprint(EV3).speed == pytest.approx(0.028 * (volts - 5.5 * 0.0165 / 0.2746) / 0.4731)
    assert sprint(EV3).time_constant == pytest.approx(
        (0.00248 + 0.5 * 0.75 * 0.028**2) * 5.5 / (0.2746 * 0.4731)
    )


@pytest.mark.parametrize("seconds", [0.01, 0.1, 0.5, 3.0])
@pytest.mark.parametrize("limit", [0.2, math.inf])
def test_the_way_travelled_is_the_speed_integrated(seconds, limit):
    fast = sprint(EV3)._replace(limit=limit)
    t = np.linspace(0.0, seconds, 200001)
    speed = np.minimum(limit, fast.speed * (1 - np.exp(-t / fast.time_constant)))
    assert travelled(fast, seconds) == pytest.approx(np.trapezoid(speed, t), abs=1.1e-4)


def test_a_robot_that_can_not_move_never_arrives():
    stuck = EV3.model_copy(update={"battery": EV3.battery.model_copy(update={"voltage": 0.1})})
    assert load_course("paper").lower_bound_s(stuck) == math.inf


@pytest.mark.parametrize("effects", [{}, {"supply_voltage": {"scale": 1.2}}, {"wheel_radius": {"scale": 1.1}},
                                     {"rotor_inertia": {"scale": 0.3}}, {"full_duty": {"gain": 0.2}},
                                     {"start_latency": {"time_s": 0.25}}, {"actuation_delay": {"time_s": 0.2}},
                                     {"battery_drain": {"rate_v_s": -0.02}}])  # fmt: skip
@pytest.mark.parametrize("tiles", [2, 9])
def test_full_speed_ahead_is_hardly_slower_than_the_bound(effects, tiles):
    robot = UNCAPPED.with_effects(effects)
    course = make_course("-" * tiles, start="[0, 0]", goal=f"[{tiles - 1}, 0]", heading='"right"')
    drive = simulate(World(robot, course), FULL_SPEED)
    assert drive.outcome == Outcome.GOAL
    assert course.lower_bound_s(robot) <= drive.time_s <= 1.01 * course.lower_bound_s(robot) + 0.03


@pytest.mark.parametrize("case", STRENGTHS, ids=named)
def test_no_commands_carry_the_outer_wheel_farther_than_the_bound_allows(case):
    """Turning counts with half the track, whether the tyres hold or slide."""
    assert max(farthest(UNCAPPED.with_effects(effect_of(*case)), seed=1)) <= 0.0


@pytest.mark.parametrize("dt", [0.0005, 0.002, 0.01])
def test_a_regulator_that_saturates_starts_no_earlier_than_the_bound_allows(dt):
    robot = REGULATED.with_effects({"coulomb_friction": {"torque_nm": 0.12}})
    for seconds in (0.05, 0.3, 1.0):
        assert max(beyond_the_bound(robot, [(-1.0, -1.0)], seconds, dt)) <= 0.0


@pytest.mark.parametrize("dt", [0.0005, 0.002, 0.01])
@pytest.mark.parametrize("seconds", [0.05, 0.3, 1.0, 3.0])
def test_a_torque_that_waits_for_no_command_acts_no_earlier_than_the_bound_allows(seconds, dt):
    robot = EV3.with_effects(
        {"coulomb_friction": {"torque_nm": 0.0}, "constant_torque": {"torque_nm": -0.12}}
    )
    assert max(beyond_the_bound(robot, [(-1.0, -1.0)], seconds, dt)) <= 0.0


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_nor_do_random_commands_with_several_effects(data):
    chosen = data.draw(st.lists(st.sampled_from(STRENGTHS), max_size=3))
    mode = data.draw(st.sampled_from([EV3, UNCAPPED, REGULATED]))
    robot = mode.with_effects({k: v for case in chosen for k, v in effect_of(*case).items()})
    duties = data.draw(
        st.lists(st.tuples(*2 * [st.sampled_from([-1.0, -0.6, 0.0, 0.6, 1.0])]), min_size=1, max_size=8)
    )
    assert max(beyond_the_bound(robot, duties, data.draw(st.sampled_from([0.3, 1.0, 3.0])))) <= 0.0


@pytest.mark.parametrize("case", [c for c in STRENGTHS if c[2] == 1.0], ids=named)
def test_no_drive_that_a_search_finds_beats_the_bound(case):
    """Round a corner, where a robot that slides could save the turn."""
    robot = UNCAPPED.with_effects(effect_of(*case))
    course = make_course("-7\n#|", start="[0, 1]", goal="[1, 0]", heading='"right"')
    assert fastest_found(robot, course) >= course.lower_bound_s(robot)


def test_the_search_finds_a_bound_that_is_too_high():
    """It would not pass a bound 5 % above this one: the drives it finds are near the fastest there are."""
    course = make_course("--7\n##|\n##|", start="[0, 2]", goal="[2, 0]", heading='"right"')
    assert fastest_found(EV3, course) < 1.12 * course.lower_bound_s(EV3)


def test_turning_counts_where_nothing_can_turn_the_robot():
    paper = load_course("paper")
    straight = travelled(sprint(EV3), paper.lower_bound_s(EV3)) - paper.shortest.length_m
    assert 0.1 < straight < 1.5 * math.pi * 0.06
    assert (
        load_course("obstacles").lower_bound_s(EV3) < load_course("gaps").lower_bound_s(EV3) * 4.3953 / 3.7953
    )


def test_tyres_without_grip_may_slide_round_every_corner():
    icy = EV3.with_effects({"tyre_friction": {"coefficient": 0.03}})
    paper = load_course("paper")
    assert travelled(sprint(icy), paper.lower_bound_s(icy)) == pytest.approx(paper.shortest.length_m)


def test_the_papers_best_time_is_above_the_bound():
    assert 11.0 < load_course("paper").lower_bound_s(EV3) < 16.74
