import pickle

import numpy as np
import pytest

from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.search.fitness import UNSOLVED
from gecar.search.robust import RobustEvaluator
from gecar.world.course import load_course
from gecar.world.perturbation import perturbed
from gecar.world.robot import load_robot
from gecar.world.rollout import Outcome, World

WORLD = World(load_robot("ev3"), load_course("paper"))
SOLVES = parse_program("if(SensorValue > 85):\n    motor(70,70,10)\nelse:\n    motor(50,-50,190)\n").opcodes
SLOW = parse_program("if(SensorValue > 50):\n    motor(40,60,10)\nelse:\n    motor(30,-30,30)\n").opcodes
LEAVES = parse_program("motor(80,80,100)").opcodes


def test_no_perturbed_robots_is_the_nominal_fitness():
    score = RobustEvaluator(WORLD, 0)([SOLVES], [1])[0]
    assert score["outcome"] == Outcome.GOAL
    assert score["fitness_s"] == score["time_s"]


def test_the_first_robot_that_fails_ends_the_race():
    failed = RobustEvaluator(WORLD, 10)([LEAVES], [1])[0]
    assert failed["fitness_s"] == UNSOLVED
    assert failed["steps"] < 1500
    assert 0.0 <= failed["share"] < 0.1


@pytest.mark.parametrize("summary", ["mean", "worst"])
def test_a_program_far_behind_the_best_is_not_driven_on_by_all(summary):
    evaluator = RobustEvaluator(WORLD, 4, summary)
    whole = evaluator([SLOW], [1])[0]
    behind = evaluator([SLOW], [1], whole["fitness_s"] / 1.2)[0]
    assert behind["steps"] < whole["steps"]
    assert whole["fitness_s"] / 1.1 < behind["fitness_s"] < UNSOLVED


def test_a_program_that_may_be_the_best_is_driven_by_all():
    evaluator = RobustEvaluator(WORLD, 4)
    whole = evaluator([SLOW], [1])[0]
    assert whole["fitness_s"] < UNSOLVED
    assert evaluator([SLOW], [1], whole["fitness_s"] / 1.04)[0] == whole


def test_worst_is_no_better_than_mean_and_a_nominal_winner_may_fail():
    times = [
        RobustEvaluator(WORLD, 2, summary)([SOLVES], [1])[0]["fitness_s"] for summary in ("mean", "worst")
    ]
    assert times[0] <= times[1]


def test_scores_do_not_depend_on_what_stands_beside_a_program():
    evaluator = RobustEvaluator(WORLD, 3)
    alone, together = evaluator([SOLVES], [7])[0], evaluator([LEAVES, SOLVES], [3, 7])[1]
    assert alone == together


def test_it_travels_to_a_worker_and_scores_the_same():
    evaluator = RobustEvaluator(WORLD, 2, "worst", 5)
    again = pickle.loads(pickle.dumps(evaluator))
    assert np.array_equal(evaluator([SOLVES], [1]), again([SOLVES], [1]))


def test_perturbed_robots_are_the_first_ones_of_their_seed():
    few, many = perturbed(WORLD, 3, 1), perturbed(WORLD, 5, 1)
    assert [world.robot for world in few] == [world.robot for world in many[:3]]
    assert few[0].robot != perturbed(WORLD, 1, 2)[0].robot


def test_a_negative_number_of_robots_is_refused():
    with pytest.raises(InputError, match="expected 0 to 10000"):
        perturbed(WORLD, -1)
