import math

import numpy as np
import pytest

from courses import make_course
from gecar.world.course import load_course
from gecar.world.lower_bound import fastest_time, sprint
from gecar.world.robot import load_robot
from gecar.world.rollout import Outcome, World, simulate

EV3 = load_robot("ev3")


def test_the_fastest_speed_is_the_motors_at_full_duty_less_friction():
    p = EV3.physics[0]
    volts = p["duty_cap"] * p["voltage"]
    assert sprint(EV3).no_load == pytest.approx(0.028 * volts / 0.4731)
    assert sprint(EV3).limit == pytest.approx(0.028 * (volts - 5.5 * 0.0165 / 0.2746) / 0.4731)
    assert sprint(EV3).time_constant == pytest.approx(
        (0.00248 + 0.5 * 0.75 * 0.028**2) * 5.5 / (0.2746 * 0.4731)
    )


def distance_in(time, fast):
    """Integrate the bound on the speed numerically."""
    t = np.linspace(0.0, time, 200001)
    return np.trapezoid(np.minimum(fast.limit, fast.no_load * (1 - np.exp(-t / fast.time_constant))), t)


@pytest.mark.parametrize("metres", [1e-4, 0.01, 0.1, 0.3, 4.395])
def test_the_time_is_where_the_distance_is_covered(metres):
    assert distance_in(fastest_time(metres, EV3), sprint(EV3)) == pytest.approx(metres, rel=1e-6)


def test_the_time_grows_with_the_way_and_starts_at_nothing():
    times = [fastest_time(s, EV3) for s in np.linspace(0.0, 2.0, 50)]
    assert times[0] == pytest.approx(0.0, abs=1e-6)
    assert all(np.diff(times) > 0)


def test_a_robot_that_can_not_move_never_arrives():
    stuck = EV3.model_copy(update={"battery": EV3.battery.model_copy(update={"voltage": 0.1})})
    assert fastest_time(1.0, stuck) == math.inf


@pytest.mark.parametrize("effects", [{}, {"supply_voltage": {"scale": 1.2}}, {"wheel_radius": {"scale": 1.1}},
                                     {"floor_tilt": {"x_rad": 0.05}}, {"rotor_inertia": {"scale": 0.3}}])  # fmt: skip
@pytest.mark.parametrize("tiles", [2, 9])
def test_full_speed_ahead_is_hardly_slower_than_the_bound(effects, tiles):
    robot = EV3.with_effects(effects)
    course = make_course("-" * tiles, start="[0, 0]", goal=f"[{tiles - 1}, 0]", heading='"right"')
    full_speed = np.array([[0, 100, 100, 1000, 0, 1]], np.int32)
    drive = simulate(World(robot, course), full_speed)
    assert drive.outcome == Outcome.GOAL
    assert course.lower_bound_s(robot) <= drive.time_s <= 1.06 * course.lower_bound_s(robot) + 0.02


def test_the_papers_best_time_is_above_the_bound():
    assert 11.0 < load_course("paper").lower_bound_s(EV3) < 16.74
