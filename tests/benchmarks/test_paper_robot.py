"""The paper's own program on the robots inferred from the paper (docs/paper_robot.md)."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.paper_robot.trials import trials
from benchmarks.paper_robot.twin import LONG_SIDE
from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.reality.compare.gap import gap
from gecar.world.course.course import Pose, load_course
from gecar.world.robot import list_robots, load_robot
from gecar.world.rollout import Outcome, World, simulate

FIG_6 = parse_program("if(SensorValue > 80):\n    motor(80,80,50)\nelse:\n    motor(80,0,160)")
COURSE = load_course("paper")
PAPER = World(load_robot("paper"), COURSE)


@pytest.mark.parametrize("step_s", [0.004, 0.002, 0.001, 0.0005, 0.00025])
def test_fig_6_reaches_goal_when_the_paper_says_at_any_step(step_s):
    drive = simulate(replace(PAPER, step_s=step_s), FIG_6.opcodes)
    assert drive.outcome == Outcome.GOAL
    assert drive.time_s == pytest.approx(16.74, abs=0.05)


def test_fig_6_reaches_goal_then_from_starts_half_a_millimetre_away():
    start, drives = COURSE.start, []
    for angle in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
        pose = Pose(start.x_m + 5e-4 * np.cos(angle), start.y_m + 5e-4 * np.sin(angle), start.heading_rad)
        drives.append(simulate(replace(PAPER, course=COURSE.starting(pose)), FIG_6.opcodes))
    assert all(drive.outcome == Outcome.GOAL for drive in drives)
    assert np.allclose([drive.time_s for drive in drives], 16.74, atol=0.05)


def test_fig_6_leaves_the_course_on_the_nominal_robot():
    drive = simulate(World(load_robot("ev3"), COURSE), FIG_6.opcodes)
    assert drive.outcome == Outcome.OFF_COURSE
    assert drive.time_s == pytest.approx(1.43, abs=0.05)


def test_trials_of_paper_ev3_arrive_as_in_tables_6_and_7():
    found = gap(trials("long_side"), PAPER.robot, LONG_SIDE, parse_program(FIG_6.source))
    assert all(trial.arrived for trial in found.trials)
    assert np.mean([trial.arrival_s for trial in found.trials]) == pytest.approx(19.32, abs=0.3)
    assert np.mean([trial.correlation for trial in found.trials], 0) == pytest.approx(
        [0.9553, 0.7743], abs=0.03
    )


def test_paper_ev3_arrives_on_the_course_that_ships_too():
    drive = simulate(World(load_robot("paper_ev3"), COURSE), FIG_6.opcodes)
    assert drive.outcome == Outcome.GOAL
    assert drive.time_s == pytest.approx(19.3, abs=0.6)


def test_robots_that_ship_are_listed_and_shown(gecar):
    assert list_robots()[0] == "ev3"
    listed = gecar("robot", "list", "--json").json["robots"]
    assert set(listed) == set(list_robots()) == {"ev3", "paper", "paper_ev3", "spike", "worn_ev3"}
    assert listed["ev3"]["top_speed_m_s"] == pytest.approx(0.8 * 8.67 / 0.4731 * 0.028)
    shown = gecar("robot", "show", "paper", "--json")
    assert shown.json["constants"]["drive"]["mode"] == "speed"
    assert "inferred" in shown.err


def test_an_unknown_robot_is_refused_with_those_there_are():
    with pytest.raises(
        InputError, match=r"'paperr', expected a robot file .* ev3, paper, paper_ev3, spike, worn_ev3"
    ):
        load_robot("paperr")
