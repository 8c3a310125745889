import numpy as np
import pytest

from gecar.errors import InputError
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper
from gecar.language.program import mirrored as mirrored_program
from gecar.language.program import parse_program
from gecar.world.course.course import load_course
from gecar.world.course.course import mirrored as mirrored_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Driver, Noise, Outcome, World, simulate, simulate_many
from gecar.world.stepped_robot import SteppedRobot

EV3, PAPER = load_robot("ev3"), load_course("paper")
WORLD = World(EV3, PAPER)
# The best of 40,000 random programs of the paper's grammar with one if.
LAPS = parse_program("if(SensorValue > 95):\n    motor(70,90,40)\nelse:\n    motor(20,-100,170)\n")


def opcodes(text):
    return parse_program(text).opcodes


def random_programs(count, seed=1):
    mapped = Mapper(load_grammar("paper")).map(
        np.random.default_rng(seed).integers(0, 256, (4 * count, 200), np.uint8)
    )
    programs = [mapped.program(i) for i in np.flatnonzero(mapped.valid)]
    return [program.opcodes for program in programs[:count]]


def test_an_edge_follower_laps_the_papers_course():
    drive = simulate(WORLD, LAPS.opcodes)
    assert drive.outcome is Outcome.GOAL
    assert drive.checkpoints == 18
    assert np.all(np.diff(drive.arrival_s) > 0)
    assert drive.arrival_s[-1] == drive.time_s
    assert PAPER.lower_bound_s(EV3) < drive.time_s < 60.0


@pytest.mark.parametrize(
    ("text", "outcome"),
    [
        ("motor(80,80,100)", Outcome.OFF_COURSE),
        ("motor(0,0,100)", Outcome.OUT_OF_TIME),
        ("motor(0,0,0)", Outcome.STUCK),
        ("if(SensorValue > 50):\n    motor(80,80,0)\nelse:\n    motor(0,0,100)\n", Outcome.OFF_COURSE),
        ("motor(-50,-50,100)", Outcome.MISSED_CHECKPOINT),
    ],
)
def test_outcomes_are_named(text, outcome):
    assert simulate(WORLD, opcodes(text)).outcome is outcome


def test_a_program_without_statements_is_stuck():
    assert simulate(WORLD, np.zeros((0, 6), np.int32)).outcome is Outcome.STUCK


def test_statements_shorter_than_a_step_keep_their_schedule():
    assert (
        simulate(WORLD, opcodes("motor(50,50,1)")).time_s
        == simulate(WORLD, opcodes("motor(50,50,100)")).time_s
    )


def test_motor_until_ends_when_the_test_holds():
    drive = simulate(WORLD, opcodes("motor_until(50,50,5000,SensorValue < 50)\nmotor(0,0,60000)"), trace=True)
    stopped = np.argmax(drive.trace["line"] == 2)
    assert drive.outcome is Outcome.OUT_OF_TIME
    assert 0.9 < drive.trace["y_m"][stopped] < 1.05


def test_pymunk_and_inline_integrators_agree_on_a_thousand_random_programs():
    programs = random_programs(1000)
    assert len(programs) == 1000
    inline = simulate_many(World(EV3, PAPER, engine="inline"), programs)
    pymunk = simulate_many(World(EV3, PAPER, engine="pymunk"), programs)
    assert np.array_equal(inline, pymunk)


def test_pymunk_and_inline_paths_agree_to_rounding():
    one = simulate(World(EV3, PAPER, engine="inline"), LAPS.opcodes, trace=True)
    other = simulate(World(EV3, PAPER, engine="pymunk"), LAPS.opcodes, trace=True)
    assert np.abs(one.trace["x_m"] - other.trace["x_m"]).max() < 1e-12


def test_mirrored_program_drives_the_mirrored_path_on_the_mirrored_course():
    there = World(EV3, mirrored_course(PAPER))
    for text in ("motor(60,50,200)motor(20,40,100)", LAPS.source):
        program = parse_program(text)
        one = simulate(WORLD, program.opcodes, trace=True)
        other = simulate(there, mirrored_program(program).opcodes, trace=True)
        assert other.outcome is one.outcome
        assert other.time_s == pytest.approx(one.time_s, abs=0.002)
        assert np.abs(PAPER.width_m - other.trace["x_m"] - one.trace["x_m"]).max() < 1e-9


def test_same_seed_same_noise_other_seed_other():
    noisy = World(EV3, PAPER, noise=Noise(sensor_pct=5.0, motor_share=0.05))
    times = [simulate(noisy, LAPS.opcodes, seed).time_s for seed in (1, 1, 2)]
    assert times[0] == times[1] != times[2]


def readings(robot):
    """What the sensor reports every 2 ms while the robot turns over the line, shape (steps,)."""
    stepped = SteppedRobot(World(robot, PAPER))
    stepped.set_duty(-0.3, 0.3)
    found = []
    for _ in range(300):
        found.append(stepped.reflection_pct)
        stepped.advance(2)
    return np.array(found)


def test_a_late_sensor_reports_what_it_saw_before():
    now, late = readings(EV3), readings(EV3.with_effects({"sensor_delay": {"time_s": 0.04}}))
    assert np.ptp(now) > 90.0
    assert np.array_equal(late[20:], now[:-20])


def test_a_lagging_sensor_approaches_what_it_sees():
    now, lags = readings(EV3), readings(EV3.with_effects({"sensor_lag": {"time_constant_s": 0.02}}))
    level, keep = now[0], np.exp(-0.002 / 0.02)
    for k, reading in enumerate(now):
        level = keep * level + (1.0 - keep) * reading
        assert lags[k] == pytest.approx(level, abs=1.01)  # both are whole percents
    assert np.abs(lags - now).max() > 10.0


def test_the_longest_delay_is_kept_at_the_smallest_step():
    late = World(
        EV3.with_effects({"actuation_delay": {"time_s": 0.25}}), PAPER, step_s=0.0001, time_limit_s=0.5
    )
    trace = simulate(late, opcodes("motor(60,60,1000)"), trace=True).trace
    moved = trace["t_s"][trace["left_angle_rad"] > 0.0]
    assert moved[0] == pytest.approx(0.26)


def test_a_delay_of_whole_steps_shifts_the_motion_by_them():
    late = World(EV3.with_effects({"actuation_delay": {"time_s": 0.02}}), PAPER)
    program = opcodes("motor(40,60,200)")
    one, other = simulate(WORLD, program, trace=True).trace, simulate(late, program, trace=True).trace
    assert np.array_equal(one["x_m"][:60], other["x_m"][2:62])


def test_trace_is_sampled_at_100_hz_and_ends_at_the_outcome():
    drive = simulate(WORLD, LAPS.opcodes, trace=True)
    assert np.allclose(np.diff(drive.trace["t_s"])[:-1], 0.01)
    assert drive.trace["t_s"][-1] == pytest.approx(drive.time_s)


def test_driver_can_be_used_again():
    driver = Driver(WORLD)
    first = driver.simulate(LAPS.opcodes)
    driver.simulate(opcodes("motor(80,-80,100)"))
    assert driver.simulate(LAPS.opcodes).time_s == first.time_s


def test_stepped_robot_drives_as_the_program_does():
    robot = SteppedRobot(WORLD)
    while robot.time_s < 2.0:
        white = robot.reflection_pct > 95
        robot.set_duty(*((0.7, 0.9) if white else (0.2, -1.0)))
        robot.advance(40 if white else 170)
    trace = simulate(WORLD, LAPS.opcodes, trace=True).trace
    n = round(100 * robot.time_s)
    assert robot.pose == pytest.approx((trace["x_m"][n], trace["y_m"][n], trace["heading_rad"][n]), abs=1e-12)


def test_a_stepped_robots_sensor_has_noise():
    robot = SteppedRobot(World(EV3, PAPER, noise=Noise(sensor_pct=5.0)))
    readings = np.array([robot.reflection_pct for _ in range(400)])
    assert np.mean(readings == 100.0) == pytest.approx(0.5 + 0.04, abs=0.08)  # half of them err upwards
    assert readings[readings < 100.0].mean() == pytest.approx(100.0 - 5.0 * np.sqrt(2.0 / np.pi), abs=1.0)


def test_a_stepped_robots_motors_have_noise_as_a_programs_do():
    noisy = World(EV3, PAPER, noise=Noise(motor_share=0.1))
    trace = simulate(noisy, opcodes("motor(50,50,400)"), seed=3, trace=True).trace
    robot, other = SteppedRobot(noisy, seed=3), SteppedRobot(noisy, seed=4)
    for each in (robot, other):
        each.set_duty(0.5, 0.5)
        each.advance(400)
    assert robot.pose == pytest.approx(
        (trace["x_m"][40], trace["y_m"][40], trace["heading_rad"][40]), abs=1e-12
    )
    assert robot.pose != other.pose


@pytest.mark.parametrize(
    "options",
    [{"step_s": 0.0}, {"step_s": float("nan")}, {"time_limit_s": -1.0}, {"engine": "bullet"}],
)
def test_bad_world_is_refused(options):
    with pytest.raises(InputError):
        World(EV3, PAPER, **options)


def test_inline_is_refused_where_there_is_something_to_touch():
    with pytest.raises(InputError, match="pymunk"):
        World(EV3, load_course("obstacles"), engine="inline")
