"""Fitness as a chance: what counts is arriving under conditions nobody knows, not one drive to the last digit."""

import math

import numpy as np
import pytest
from support.searching import new_evolution, resume_evolution

from gecar.errors import InputError
from gecar.evolution.ask_tell import run
from gecar.evolution.scores import UNSOLVED
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper
from gecar.language.program import parse_program
from gecar.results.arrival import arrives
from gecar.search import chance
from gecar.search.batches import Batches
from gecar.search.chance import (
    CHOICE_STEPS_S,
    MARGIN,
    Arrivals,
    add_drives,
    arrivals,
    chosen,
    drives_at_steps,
    merit_of,
    pool,
    times_at_steps,
    wants_more,
)
from gecar.search.evaluation import DriveEvaluator
from gecar.search.fitness import score_type
from gecar.search.programs import RobotPrograms
from gecar.search.settings import Settings
from gecar.world.course.course import load_course
from gecar.world.kernel.conditions import conditions
from gecar.world.perturbation import drawn_conditions, drawn_steps_s
from gecar.world.robot import load_robot
from gecar.world.rollout import Driver, Fleet, Outcome, World, simulate

WORLD = World(load_robot("ev3"), load_course("paper"))
STEADY = parse_program("if(SensorValue > 75):\n    motor(50,60,10)\nelse:\n    motor(30,-60,10)").opcodes
FRAGILE = parse_program("if(SensorValue > 40):\n    motor(100,100,10)\nelse:\n    motor(0,-90,20)").opcodes
LEAVES = parse_program("motor(80,80,100)").opcodes


def score_of(fitness, drawn, n=8):
    score = np.zeros(1, score_type(0, n))[0]
    score["fitness_s"], score["share"] = fitness, 0.5
    score["fastest_s"] = score["slowest_s"] = fitness
    score["drawn_s"] = [*drawn, *[np.nan] * (n - len(drawn))]
    return score


def test_the_merit_is_the_median_time_of_what_arrives_often_enough():
    score = score_of(15.0, [16.0, 17.0, np.inf])
    pool(score, 0.75)
    assert score["merit"] == 16.0
    pool(score, 0.9)
    assert score["merit"] == UNSOLVED


def test_a_program_whose_time_depends_on_the_step_has_to_be_faster_to_count_as_much():
    steady, unsteady, lost = (score_of(16.0, [16.0, 16.0]) for _ in range(3))
    steady["slowest_s"], unsteady["slowest_s"], lost["slowest_s"] = 16.2, 16.8, np.inf
    for score in (steady, unsteady, lost):
        pool(score, 0.75)
    assert steady["merit"] == 16.2
    assert unsteady["merit"] == pytest.approx(16.8 * (1.0 + chance.PRICE * (16.8 / 16.0 - chance.STEADY)))
    assert lost["merit"] == UNSOLVED


def test_the_fastest_and_slowest_of_all_generations_steps_are_kept():
    score, more = score_of(16.0, [16.0, 16.0], n=4), score_of(16.0, [16.0, 16.0], n=4)
    more["fastest_s"], more["slowest_s"] = 15.9, 16.1
    add_drives(score, more, 0.75)
    assert (score["fastest_s"], score["slowest_s"]) == (15.9, 16.1)


def test_what_comes_through_the_race_is_driven_at_other_steps_and_nothing_else_is():
    fragile, steady = DriveEvaluator(WORLD, draws=16)([FRAGILE, STEADY], [1, 2])
    assert fragile["fastest_s"] == fragile["slowest_s"] == fragile["fitness_s"]
    times = drives_at_steps(WORLD, [STEADY], drawn_steps_s((0, 0)))[0]
    assert steady["slowest_s"] == max(steady["fitness_s"], *times)
    assert steady["fastest_s"] == min(steady["fitness_s"], *times)


def test_steps_are_drawn_afresh_every_generation_from_every_quarter_of_their_range():
    first, again, later = (drawn_steps_s((3, generation)) for generation in (0, 0, 1))
    assert first == again != later
    assert np.digitize(first, 0.0007 * 6.0 ** np.array([0.0, 0.25, 0.5, 0.75, 1.0])).tolist() == [1, 2, 3, 4]


def test_credit_grows_with_arrivals_and_never_reaches_a_program_that_arrives_often_enough():
    scores = [score_of(15.0, [np.inf] * k + [16.0] * (3 - k)) for k in (3, 2, 1)] + [
        score_of(15.0, [16.0] * 3)
    ]
    for score in scores:
        pool(score, 0.95)
    shares = [float(score["share"]) for score in scores]
    assert shares == sorted(shares)
    assert shares[-2] < shares[-1] == 1.0


def test_what_misses_goal_on_the_nominal_robot_has_less_credit_than_any_that_does_not():
    missed, arrived = score_of(UNSOLVED, []), score_of(15.0, [np.inf])
    pool(missed, 0.95)
    pool(arrived, 0.95)
    assert missed["share"] < arrived["share"]


def test_drives_of_a_program_met_again_add_up_until_there_is_no_room():
    score = score_of(15.0, [16.0, 16.0], n=4)
    pool(score, 0.75)
    assert wants_more(score)
    add_drives(score, score_of(15.0, [18.0, np.inf], n=4), 0.75)
    assert score["drawn_s"].tolist() == [16.0, 16.0, 18.0, np.inf]
    assert not wants_more(score)


def test_a_program_that_misses_too_often_is_not_driven_again():
    score = score_of(15.0, [np.inf])
    pool(score, 0.95)
    assert not wants_more(score)


def test_a_bad_program_costs_one_drive_and_a_slow_one_few():
    evaluator = DriveEvaluator(WORLD, draws=16, required_share=0.95)
    bad, steady = evaluator([LEAVES, STEADY], [1, 2])
    assert bad["steps"] == simulate(WORLD, LEAVES).steps
    assert np.isfinite(steady["drawn_s"]).sum() >= 15
    (slow,) = evaluator([STEADY], [2], to_beat_s=steady["merit"] / MARGIN / 1.1)
    assert np.isfinite(slow["drawn_s"]).sum() == 3


def test_a_fragile_program_is_told_from_a_steady_one():
    evaluator = DriveEvaluator(WORLD, draws=16)
    fragile, steady = evaluator([FRAGILE, STEADY], [1, 2])
    assert fragile["fitness_s"] < steady["fitness_s"] < UNSOLVED
    assert steady["merit"] < UNSOLVED <= fragile["merit"]


def test_every_generation_draws_afresh_and_the_same_one_alike():
    evaluator = DriveEvaluator(WORLD, draws=4, seed=3)
    first, again, later = (evaluator([STEADY], [1], math.inf, g)[0]["drawn_s"] for g in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert (first[:3] != later[:3]).all()


def test_a_score_does_not_depend_on_the_programs_beside_it():
    evaluator = DriveEvaluator(WORLD, draws=6)
    together = evaluator([FRAGILE, STEADY, LEAVES], [1, 2, 3])[1]
    alone = evaluator([STEADY], [2])[0]
    assert together["merit"] == alone["merit"]


def test_the_reported_share_is_of_200_drives_and_the_steps_are_the_nominal_robots():
    told = arrives(WORLD, parse_program("motor(80,80,100)"), 1)
    assert (told["share"], told["of"], told["median_s"]) == (0.0, 200, None)
    assert set(told["steps"].values()) == {None}
    assert times_at_steps(WORLD, STEADY)["0.002"] == simulate(WORLD, STEADY).time_s


def test_the_choice_is_made_on_fresh_draws():
    assert chosen(WORLD, [FRAGILE, LEAVES, STEADY], 0.95, 1) == 2


def test_a_program_that_owes_its_time_to_one_step_is_not_chosen():
    fragile, steady = drives_at_steps(WORLD, [FRAGILE, STEADY], (WORLD.step_s, *CHOICE_STEPS_S))
    assert fragile[0] < steady[0] == pytest.approx(steady.max(), rel=0.02)
    assert not fragile.max() <= 1.02 * fragile[0]
    assert chosen(WORLD, [FRAGILE, STEADY], 0.0, 1) == 1


def test_statements_that_are_only_overwritten_act_where_statements_take_time():
    world = World(WORLD.robot, WORLD.course)
    backwards = "motor(-70,-70,0)\n" * 4
    hidden = parse_program(
        backwards + "if(SensorValue > 75):\n    motor(50,60,10)\nelse:\n    motor(30,-60,10)"
    )
    assert simulate(world, hidden.opcodes).time_s == simulate(world, STEADY).time_s
    late = conditions(world.robot.physics, world.step_s, world.start, world.time_limit_s, statement_ms=0.9)
    for under, arrives_too in ((world.nominal, True), (late, False)):
        summary, _ = Fleet(world).drive([hidden.opcodes], under, [[0, 0]], [0])
        alone = Driver(world, under).simulate(hidden.opcodes)
        assert (summary["outcome"][0] == Outcome.GOAL) == arrives_too
        assert (summary["outcome"][0], summary["steps"][0]) == (alone.outcome, alone.steps)
    assert Driver(world, late).simulate(STEADY).outcome == Outcome.GOAL


def test_merit_orders_by_time_only_what_arrives_often_enough():
    often, seldom = Arrivals(np.array([17.0] * 20)), Arrivals(np.array([15.0] * 10 + [np.inf] * 10))
    assert merit_of(often, 0.9) == 17.0
    assert merit_of(seldom, 0.9) > UNSOLVED


def test_arrivals_under_the_same_seed_are_the_same():
    one, other = arrivals(WORLD, [STEADY], 20, 5), arrivals(WORLD, [STEADY], 20, 5)
    np.testing.assert_array_equal(one[0].times_s, other[0].times_s)


def test_a_run_with_draws_goes_on_to_the_same_end():
    settings = Settings(population=12, generations=3, codons=60, draws=4, checkpoint_credit=True)
    mapper = Mapper(load_grammar("paper"))

    def evolve(evolution):
        with Batches(DriveEvaluator(WORLD, draws=4)) as batches:
            run(evolution, batches)
        return evolution

    whole = evolve(new_evolution(settings, mapper, 1))
    begun = new_evolution(settings, mapper, 1)
    with Batches(DriveEvaluator(WORLD, draws=4)) as batches:
        begun.tell(batches(begun.ask()))
        begun.tell(batches(begun.ask()))
    resumed = evolve(resume_evolution(settings, mapper, begun.state()))
    assert resumed.scores.tobytes() == whole.scores.tobytes()
    assert resumed.best.genome.tolist() == whole.best.genome.tolist()


def test_a_program_that_was_lucky_once_does_not_end_the_race_for_the_others():
    evolution = new_evolution(Settings(population=8, elites=1, generations=3, codons=60, draws=4))
    lucky = None
    for to_beat, drawn in ((math.inf, 10.0), (10.0, math.inf), (20.0, math.inf)):
        asked = evolution.ask()
        assert {candidate.to_beat for candidate in asked} == {to_beat}
        lucky = lucky or asked[0].program
        scores = np.array([score_of(20.0, [20.0] * 3, n=24) for _ in asked])
        for score, candidate in zip(scores, asked, strict=True):
            if candidate.program == lucky:
                score["fitness_s"] = score["fastest_s"] = score["slowest_s"] = 10.0
                score["drawn_s"][:3] = drawn
            pool(score, 0.95)
        evolution.tell(scores)


def test_programs_that_differ_beyond_the_cap_are_one():
    texts = ("motor(80,-100,50)", "motor(100,-80,50)", "motor(70,-80,50)")
    capped = [RobotPrograms(duty_cap_pct=80).meaning(parse_program(text)) for text in texts]
    assert capped[0] == capped[1] != capped[2]
    assert len({RobotPrograms().meaning(parse_program(text)) for text in texts}) == 3


def test_a_hysteresis_controller_polls_between_its_thresholds():
    text = "if(SensorValue > 60){motor(40,60,0)}\nif(SensorValue < 40){motor(40,-20,0)}"
    drive = simulate(World(WORLD.robot, WORLD.course, time_limit_s=3.0), parse_program(text).opcodes)
    assert drive.outcome != Outcome.STUCK
    assert drive.steps > 100


def test_too_many_draws_are_refused():
    with pytest.raises(InputError, match="found -1"):
        drawn_conditions(WORLD, -1)
