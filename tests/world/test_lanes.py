"""Lanes drive as the scalar kernel does: a thousand programs, all effects, all conditions."""

import numpy as np
import pytest
from support.acting import strong

from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper
from gecar.language.program import parse_program
from gecar.world.course.course import load_course
from gecar.world.effects import CATALOGUE
from gecar.world.kernel.conditions import impatient, joined, select
from gecar.world.kernel.lanes import LANES
from gecar.world.perturbation import drawn_conditions, under_drawn_conditions
from gecar.world.robot import load_robot
from gecar.world.rollout import Driver, Fleet, Outcome, World

EV3, PAPER = load_robot("ev3"), load_course("paper")
WORLD = World(EV3, PAPER, time_limit_s=12.0)


def random_programs(n: int, seed: int = 1) -> list[np.ndarray]:
    mapped = Mapper(load_grammar("paper")).map(
        np.random.default_rng(seed).integers(0, 256, (4 * n, 200), dtype=np.uint8)
    )
    programs = [mapped.program(i) for i in range(len(mapped)) if mapped.valid[i]]
    return [program.opcodes for program in programs[:n]]


def assert_same(world, programs, under, pairs, streams):
    summary, arrival = Fleet(world).drive(programs, under, pairs, streams)
    drivers = {row: Driver(world, select(under, [row])) for row in {row for _, row in pairs}}
    for k, (program, row) in enumerate(pairs):
        drive = drivers[row].simulate(programs[program], int(streams[k]))
        assert (summary["outcome"][k], summary["steps"][k]) == (drive.outcome, drive.steps)
        np.testing.assert_array_equal(arrival[k], drive.arrival_s)


def test_a_thousand_random_programs_end_at_the_same_step():
    programs = random_programs(1000)
    assert_same(WORLD, programs, WORLD.nominal, [(k, 0) for k in range(len(programs))], np.zeros(1000))


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.id)
def test_each_effect_acts_in_a_lane_as_it_does_alone(effect):
    world = World(EV3.with_effects({effect.id: strong(effect)}), PAPER, time_limit_s=6.0)
    programs = random_programs(12, seed=2)
    assert_same(world, programs, world.nominal, [(k, 0) for k in range(12)], np.zeros(12))


def test_lanes_keep_conditions_apart():
    under = joined([WORLD.nominal, drawn_conditions(WORLD, 2 * LANES, 5)])
    programs = random_programs(4, seed=3)
    pairs = [(p, row) for p in range(4) for row in range(len(under))]
    assert_same(WORLD, programs, under, pairs, np.arange(len(pairs)) + 7)


def test_a_regulated_robot_and_a_late_sensor_drive_in_lanes():
    drive = EV3.drive.model_copy(update={"mode": "speed"})
    slow = EV3.model_copy(update={"drive": drive}).with_effects(
        {"sensor_delay": {"time_s": 0.05}, "sensor_lag": {"time_constant_s": 0.03}}
    )
    world = World(slow, PAPER, time_limit_s=6.0)
    assert_same(world, random_programs(12, seed=4), world.nominal, [(k, 0) for k in range(12)], np.zeros(12))


def test_what_a_drive_ends_as_does_not_depend_on_those_beside_it():
    programs = random_programs(40, seed=6)
    alone = [Fleet(WORLD).drive([p], WORLD.nominal, [(0, 0)], [3])[0][0] for p in programs]
    together = Fleet(WORLD).drive(programs, WORLD.nominal, [(k, 0) for k in range(40)], np.full(40, 3))[0]
    assert [tuple(row) for row in alone] == [tuple(row) for row in together]


def test_no_programs_make_no_drives():
    summary, arrival = Fleet(WORLD).drive([], WORLD.nominal, np.zeros((0, 2)), [])
    assert (len(summary), len(arrival)) == (0, 0)


def test_drawn_conditions_cover_each_range_evenly():
    under = drawn_conditions(WORLD, 100, 1)
    friction = under.physics["coulomb_friction"] / EV3.motor.coulomb_friction
    counts, _ = np.histogram(friction, 10, (0.6, 1.6))
    assert counts.tolist() == [10] * 10
    assert abs(under.physics["supply_scale"].std() - 0.04) < 0.004
    assert 0.002 <= under.derived["dt"].min() < under.derived["dt"].max() <= 0.004


def test_drawn_conditions_come_from_their_seed():
    first, again, other = (drawn_conditions(WORLD, 5, seed) for seed in ((1, 2), (1, 2), (1, 3)))
    assert (first.start == again.start).all()
    assert (first.start != other.start).any()


def test_drives_under_drawn_conditions_keep_their_traces():
    opcodes = parse_program("motor(80,80,100)").opcodes
    drives = under_drawn_conditions(WORLD, opcodes, 3, 1)
    assert {drive.outcome for drive in drives} == {Outcome.OFF_COURSE}
    assert len({round(float(drive.trace["x_m"][-1]), 6) for drive in drives}) == 3


def test_drives_given_up_end_alike_in_lanes_and_alone():
    world = World(EV3, PAPER)
    under = impatient(joined([world.nominal, drawn_conditions(world, LANES, 5)]))
    programs = random_programs(40, seed=4)
    pairs = [(p, row) for p in range(40) for row in range(len(under))]
    assert_same(world, programs, under, pairs, np.arange(len(pairs)))


def test_a_drive_is_given_up_a_third_of_the_time_limit_after_its_last_new_tile():
    world = World(EV3, PAPER, time_limit_s=12.0)
    program = parse_program("motor(80, 80, 1000) motor(0, 0, 60000)")
    pairs = [(0, 0)]
    (patient,), _ = Fleet(world).drive([program.opcodes], world.nominal, pairs, [0])
    (summary,), (arrival,) = Fleet(world).drive([program.opcodes], impatient(world.nominal), pairs, [0])
    assert patient["time_s"] == 12.0
    assert summary["outcome"] == Outcome.OUT_OF_TIME
    assert summary["time_s"] == pytest.approx(np.nanmax(arrival) + 4.0)
