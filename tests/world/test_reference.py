from dataclasses import replace

import pytest

from benchmarks.reference_times import drive_of
from gecar.report.drive import standing_of
from gecar.world.course.course import Pose, list_courses, load_course
from gecar.world.course.reference_times import reference_s, reference_table
from gecar.world.robot import load_robot
from gecar.world.rollout import Drive, Outcome, World

EV3 = load_robot("ev3")


@pytest.mark.parametrize("name", list_courses())
def test_a_reference_time_is_driven_again_and_above_the_bound(name):
    """As a program without a sensor, through all checkpoints, with pymunk where there is something to touch."""
    drive = drive_of(name)
    assert drive.outcome == Outcome.GOAL
    assert drive.time_s == pytest.approx(reference_table()[name]["time_s"], abs=0.002)
    assert load_course(name).lower_bound_s(EV3) < drive.time_s < 1.25 * load_course(name).lower_bound_s(EV3)


def test_a_reference_time_holds_for_the_nominal_robot_on_the_course_as_it_comes():
    paper = load_course("paper")
    assert reference_s(paper, EV3) == reference_table()["paper"]["time_s"]
    assert reference_s(paper, EV3.with_effects({"supply_voltage": {"scale": 1.1}})) is None
    assert reference_s(paper.starting(Pose(0.15, 0.75, 1.57)), EV3) is None
    assert reference_s(replace(paper, name="mine"), EV3) is None


def test_a_drive_is_set_beside_the_bound_and_the_reference():
    world, paper = World(EV3, load_course("paper")), reference_table()["paper"]["time_s"]
    drive = Drive(Outcome.GOAL, 1.5 * paper, 18, None, 0)
    assert f"found {paper:.2f} s (50 % above it)" in standing_of(world, drive)
    tilted = World(EV3.with_effects({"floor_tilt": {"x_rad": 0.01}}), load_course("paper"))
    assert "optimiser" not in standing_of(tilted, drive)
