"""Terms: laws at the ports of the dynamics, beside catalogue effects that are the same physics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.synthetic import drive

from gecar.errors import InputError
from gecar.language.program import parse_program
from gecar.reality.replay.kernel import ASIDE
from gecar.reality.replay.replayer import replayer_of
from gecar.world.course.course import load_course
from gecar.world.ports import AT_A_POINT, PORTS, VARIABLES
from gecar.world.robot import load_robot, read_robot, robot_from, write_robot
from gecar.world.rollout import World, simulate, simulate_many
from gecar.world.terms import MOST_CHARACTERS, Term

NOMINAL = load_robot("ev3")
MASS, TRACK = NOMINAL.body.mass, NOMINAL.body.track_width
RECORDING = drive(seconds=6.0)
FOLLOW = parse_program("if(SensorValue > 50): motor(60,20,50)\nelse: motor(20,60,50)").opcodes


def rows(robot):
    """Return what an open-loop replay predicts, from the second row on: before, nothing has acted."""
    return replayer_of(RECORDING).play(robot.physics).rows[1:]


def apart(one, other):
    """Return how far two robots' replays part, beside what the first parts from the nominal robot.

    Of the speed to the side 1 cm/s counts for nothing: a tyre that begins to slide a step sooner creeps by as much.
    """
    change = np.abs(rows(one) - rows(NOMINAL)).max(axis=0)
    assert change.max() > 1e-3, "the effect itself does nothing"
    least = np.full(len(change), 1e-3)
    least[ASIDE] = 1e-2
    return (np.abs(rows(one) - rows(other)).max(axis=0) / np.maximum(change, least)).max()


def law(port, text, **constants):
    return NOMINAL.with_terms([Term(port=port, law=text, **constants)])


def effect(name, **values):
    return NOMINAL.with_effects({name: values})


SAME = [
    (effect("wheel_radius", scale=1.05), law("rolling_radius", "a", a=0.05), 1e-9),
    (effect("wheel_radius_difference", right_minus_left=0.04), law("rolling_radius", "a * side", a=0.02), 1e-9),
    (effect("command_slew", rate_pct_s=200.0),
     law("command", "store - command", store="store + max(-0.05, min(0.05, command - store))", store_s=0.025), 0.03),
    (effect("backlash", angle_deg=4.0), law("gear_play", "a", a=math.radians(4.0)), 1e-9),
    (effect("track_width", scale=1.05), law("track_width", "a", a=0.05), 1e-9),
    (effect("caster_drag", coefficient=0.1), law("caster_friction", "a", a=0.1), 1e-9),
    (effect("coulomb_friction", torque_nm=NOMINAL.motor.coulomb_friction + 0.01),
     law("gear_friction", "a", a=0.01), 1e-9),
    (effect("viscous_friction", coefficient_nms=0.002), law("motor_torque", "-b * speed", b=0.002), 0.04),
    (effect("motor_gain_asymmetry", right_minus_left=0.1), law("command", "0.5 * a * side * command", a=0.1), 1e-9),
    (effect("supply_voltage", scale=0.9), law("supply_voltage", f"-0.1 * {NOMINAL.battery.voltage}"), 1e-3),
    (effect("battery_drain", rate_v_s=0.05), law("supply_voltage", "-r * time", r=0.05), 1e-3),
    (effect("floor_tilt", x_rad=0.02, y_rad=-0.01),
     NOMINAL.with_terms([Term(port="force_x", law=f"{MASS * 9.81 * math.sin(0.02)}"),
                         Term(port="force_y", law=f"{-MASS * 9.81 * math.sin(0.01)}")]), 0.02),
    (effect("floor_tilt", x_rad=0.02, y_rad=0.0),
     NOMINAL.with_terms([Term(port="force_ahead", law="f * cos(heading)", f=MASS * 9.81 * math.sin(0.02)),
                         Term(port="force_aside", law="-f * sin(heading)", f=MASS * 9.81 * math.sin(0.02))]), 0.02),
    (effect("tyre_friction", coefficient=0.2 * NOMINAL.tyre.friction), law("tyre_grip", "a", a=-0.8), 1e-9),
]  # fmt: skip


@pytest.mark.parametrize(("one", "other", "share"), SAME, ids=[f"{k}" for k in range(len(SAME))])
def test_a_law_does_what_the_same_physics_of_the_catalogue_does(one, other, share):
    assert apart(one, other) < share


def test_a_moment_turns_as_opposite_torques_would_and_a_pull_is_its_two_parts():
    moment = rows(law("yaw_moment", "m", m=0.02))
    # F = M / track at the contacts of both wheels, hence F radius at their shafts
    torques = rows(law("motor_torque", "t * side", t=0.02 / TRACK * NOMINAL.body.wheel_radius))
    change = np.abs(torques - rows(NOMINAL))[:, :2].max()
    assert np.abs(moment - torques)[:, :2].max() < 0.01 * change
    spring = law("force_toward", "k * distance", k=0.5, at_x=1.0, at_y=0.5)
    along = [
        Term(port=f"force_{axis}", law=f"k * ({at} - {axis})", k=0.5) for axis, at in (("x", 1.0), ("y", 0.5))
    ]
    assert apart(spring, NOMINAL.with_terms(along)) < 1e-9


def test_a_load_gives_grip_to_a_tyre_that_slides():
    slippery = NOMINAL.with_effects({"tyre_friction": {"coefficient": 0.1}})
    weighed = slippery.with_terms([Term(port="wheel_load", law="n", n=100.0)])
    moved, less = (np.abs(rows(robot) - rows(NOMINAL))[:, 4:6].max() for robot in (slippery, weighed))
    assert less < 0.1 * moved


def test_a_wheel_that_lifts_its_axle_as_it_turns_is_held_back_by_its_load():
    # Straight ahead both wheels have one angle: a radius that follows the other wheel's is the same, and lifts nothing.
    straight = replayer_of(replace(RECORDING, right_duty=RECORDING.left_duty))
    radius = NOMINAL.body.wheel_radius
    lifting = law("rolling_radius", "a * sin(angle)", a=0.05)
    flat = Term(port="rolling_radius", law="a * sin(other_angle)", a=0.05)
    held_back = Term(port="motor_torque", law="-a * load * cos(angle)", a=0.05 * radius)
    plain, alike, other = (
        straight.play(robot.physics).rows[1:]
        for robot in (NOMINAL.with_terms([flat]), NOMINAL.with_terms([flat, held_back]), lifting)
    )
    assert np.abs(other - alike).max() < 0.01 * np.abs(other - plain).max()
    assert np.abs(other - plain)[:, 7].max() > 0.1  # rad/s


def test_contacts_that_are_not_beside_one_another_scrub_as_the_robot_turns():
    # A wavy tread puts its contact a n r cos(n angle) ahead of the axle: a turn then rubs with the grip of one wheel.
    duty = np.full(len(RECORDING.left_duty), 0.4)
    turning = replayer_of(replace(RECORDING, left_duty=-duty, right_duty=duty))
    body, share, waves = NOMINAL.body, 0.025, 8
    load = 0.5 * MASS * 9.81 * (1.0 - body.com_ahead / body.caster_ahead)
    moment = NOMINAL.tyre.friction * load * share * waves * body.wheel_radius * 2.0 / math.pi  # on the mean
    wavy = Term(port="rolling_radius", law="a * sin(n * angle)", a=share, n=waves, side="right")
    turns = [
        turning.play(robot.physics).rows[-1, 6]
        for robot in (
            NOMINAL,
            law("yaw_moment", "-m * tanh(turn_rate / 0.02)", m=moment),
            NOMINAL.with_terms([wavy]),
        )
    ]
    assert turns[2] - turns[0] == pytest.approx(turns[1] - turns[0], rel=0.1)


def test_terms_add_up_and_sides_are_told_apart():
    whole = law("motor_torque", "a", a=0.02)
    halves = NOMINAL.with_terms([Term(port="motor_torque", law="a", a=0.01)] * 2)
    sides = NOMINAL.with_terms(
        [Term(port="motor_torque", law="a", a=0.02, side=side) for side in ("left", "right")]
    )
    assert apart(whole, halves) < 1e-9
    assert apart(whole, sides) < 1e-9
    assert apart(whole, law("motor_torque", "a", a=0.02, side="left")) > 0.1


def test_a_store_fills_with_its_time_constant():
    # Filled from the start with a constant it is 1 - exp(-t / T): the supply then falls as that.
    filling = law("supply_voltage", "-a * store", store="one", store_s=2.0, a=1.0, one=1.0)
    closed = law("supply_voltage", "-a * (1 - exp(-time / T))", a=1.0, T=2.0)
    assert apart(closed, filling) < 0.01
    rolled = replayer_of(RECORDING)
    assert np.array_equal(rolled.play(filling.physics).rows, rolled.play(filling.physics).rows), (
        "a drive left its store"
    )


@pytest.mark.parametrize(
    ("port", "column", "value"),
    [("encoder_reading", 0, 0.1), ("gyro_reading", 3, 0.1)],
)
def test_an_error_of_a_reading_changes_that_reading_alone(port, column, value):
    change = rows(law(port, "a", a=value)) - rows(NOMINAL)
    others = [k for k in range(change.shape[1]) if k != column and not (port == "encoder_reading" and k == 1)]
    assert np.allclose(change[:, column], value)
    assert np.abs(change[:, others]).max() == 0.0


def test_an_error_of_the_camera_changes_poses_alone():
    shifted = law("pose_x", "a * y", a=0.1)
    plain, seen = (replayer_of(RECORDING).play(robot.physics) for robot in (NOMINAL, shifted))
    assert np.allclose(seen.poses[:, 0] - plain.poses[:, 0], 0.1 * plain.poses[:, 1])
    assert np.array_equal(seen.poses[:, 1:], plain.poses[:, 1:])
    assert np.array_equal(seen.rows, plain.rows)


def test_a_camera_that_turns_turns_all_that_it_sees_about_a_point():
    turning = law("pose_turn", "a * time", a=0.02, at_x=0.3, at_y=-0.1)
    plain, seen = (replayer_of(RECORDING).play(robot.physics) for robot in (NOMINAL, turning))
    turn = 0.02 * RECORDING.t_s[np.flatnonzero(~np.isnan(RECORDING.x_m))]
    x, y = (plain.poses[:, :2] - (0.3, -0.1)).T
    there = np.column_stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)])
    there += np.array([0.3, -0.1])
    assert np.allclose(seen.poses[:, :2], there, atol=1e-4)
    assert np.allclose(seen.poses[:, 2] - plain.poses[:, 2], turn, atol=1e-4)
    assert np.array_equal(seen.rows, plain.rows)


def test_a_camera_that_is_late_shows_poses_of_a_moment_ago():
    plain, seen = (
        replayer_of(RECORDING).play(robot.physics) for robot in (NOMINAL, law("pose_late", "a", a=0.005))
    )
    t = RECORDING.t_s[np.flatnonzero(~np.isnan(RECORDING.x_m))]
    expected, found = -0.005 * np.gradient(plain.poses, t, axis=0), seen.poses - plain.poses
    assert np.median(np.abs(found - expected)) < 1e-5
    assert np.all(np.abs(found - expected)[1:].max(axis=0) < 0.1 * np.abs(expected).max(axis=0))
    assert np.array_equal(seen.rows, plain.rows)


def test_a_lens_moves_poses_along_the_line_to_its_middle():
    bent = law("pose_toward", "a * distance ** 2", a=-0.2, at_x=0.3, at_y=-0.1)
    plain, seen = (replayer_of(RECORDING).play(robot.physics) for robot in (NOMINAL, bent))
    away = plain.poses[:, :2] - (0.3, -0.1)
    error = seen.poses[:, :2] - plain.poses[:, :2]
    assert np.allclose(error, 0.2 * np.hypot(*away.T)[:, None] * away)
    assert np.array_equal(seen.poses[:, 2], plain.poses[:, 2])
    assert np.array_equal(seen.rows, plain.rows)


def test_an_error_of_the_colour_sensor_turns_another_way():
    course = load_course("paper")
    plain, blind = (
        simulate(World(r, course), FOLLOW, trace=True) for r in (NOMINAL, law("colour_reading", "-100"))
    )
    assert (plain.trace["line"][5], blind.trace["line"][5]) == (2.0, 4.0)


def test_a_sensor_that_a_law_moves_sees_what_one_that_sits_there_does():
    course = load_course("paper")
    sensor = NOMINAL.colour_sensor
    ahead = effect("sensor_position", ahead_m=sensor.ahead + 0.01, left_m=sensor.left)
    left = effect("sensor_position", ahead_m=sensor.ahead, left_m=sensor.left + 0.01)
    for moved, port in ((ahead, "sensor_ahead"), (left, "sensor_aside")):
        one, other = (simulate(World(r, course), FOLLOW, trace=True) for r in (moved, law(port, "0.01")))
        assert np.array_equal(one.trace["reflection_pct"], other.trace["reflection_pct"])


@pytest.mark.parametrize("port", PORTS, ids=lambda port: port.id)
def test_a_term_of_nothing_is_bit_for_bit_no_term(port):
    point = {"at_x": 1.0, "at_y": 1.0} if port.id in AT_A_POINT else {}
    robot = law(port.id, "a * time", a=0.0, **point)
    replayer = replayer_of(RECORDING, memory_s=1.0)
    assert np.array_equal(replayer.errors(robot.physics), replayer.errors(NOMINAL.physics), equal_nan=True)
    course = load_course("paper")
    one, other = (simulate(World(r, course), FOLLOW, trace=True) for r in (robot, NOMINAL))
    assert all(np.array_equal(one.trace[name], other.trace[name]) for name in one.trace)


def test_many_drives_of_a_robot_with_terms_are_as_one():
    world = World(law("motor_torque", "-a * speed * abs(speed)", a=2e-4), load_course("paper"))
    many = simulate_many(world, [FOLLOW, FOLLOW])
    assert many["steps"].tolist() == [simulate(world, FOLLOW).steps] * 2
    assert many["steps"][0] != simulate(World(NOMINAL, world.course), FOLLOW).steps


FORMULAS = [
    ("-a * speed * abs(speed)", lambda a, b, v: -a * v * abs(v)),
    ("a + b * speed ** 2 - 3", lambda a, b, v: a + b * v * v - 3),
    ("a / (speed - speed)", lambda a, b, v: a / 1e-9),
    ("min(a, speed) + max(b, -speed)", lambda a, b, v: min(a, v) + max(b, -v)),
    ("exp(-square(speed) / b)", lambda a, b, v: math.exp(-v * v / b)),
    ("sqrt(speed) * sign(-speed)", lambda a, b, v: math.sqrt(abs(v)) * np.sign(-v)),
    ("tanh(a * speed) + positive(speed) + sin(speed) - cos(b * speed)",
     lambda a, b, v: math.tanh(a * v) + (v > 0) + math.sin(v) - math.cos(b * v)),
    ("ramp(abs(speed) - b)", lambda a, b, v: max(abs(v) - b, 0.0)),
    ("a - (b - (a - (b - (a - speed))))", lambda a, b, v: a - (b - (a - (b - (a - v))))),
]  # fmt: skip


@pytest.mark.parametrize(("text", "formula"), FORMULAS, ids=[text for text, _ in FORMULAS])
def test_a_law_is_worked_out_as_it_is_written(text, formula):
    a, b = 0.3, 1.7
    plain, wrong = rows(NOMINAL), rows(law("encoder_reading", text, a=a, b=b))
    found = wrong[:, 0] - plain[:, 0]
    expected = np.clip([formula(a, b, v) for v in plain[:, 7]], -1e6, 1e6)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(expected).max()))


def test_whatever_a_law_says_the_result_is_finite():
    wild = [
        "exp(exp(exp(exp(9 + time))))",
        "1 / (time - time)",
        "sqrt(-time) / 0.0",
        "exp(99)*exp(99)*exp(99)*exp(99)",
    ]
    for text in wild:
        for port in ("motor_torque", "yaw_moment", "tyre_grip", "rolling_radius"):
            assert np.isfinite(rows(law(port, text))).all(), (port, text)


def test_a_robot_file_keeps_terms(tmp_path):
    terms = [
        Term(
            port="motor_torque",
            law="-a * store * speed",
            side="left",
            store="command ** 2",
            store_s=12.0,
            a=0.01,
        ),
        Term(port="force_toward", law="k * distance", k=0.2, at_x=1.2, at_y=-0.5),
        Term(port="gear_friction", law="0.01 + 0.002 * sin(3 * angle)"),
    ]
    robot = NOMINAL.with_terms(terms)
    write_robot(robot, tmp_path / "robot.toml")
    again = read_robot(tmp_path / "robot.toml")
    assert again == robot
    assert np.array_equal(again.physics["terms"], robot.physics["terms"])


GOOD = {"port": "motor_torque", "law": "-a * speed", "a": 1.0}
BAD = [
    ({"port": "engine"}, "found port 'engine', expected one of command"),
    ({"law": "-a * sped"}, "found 'sped', expected a constant given with the law (a) or a variable of motor_torque"),
    ({"law": "distance * a"}, "found 'distance'"),
    ({"law": "-a * * speed"}, "expected a formula"),
    ({"law": "__import__('os').system('true')"}, "expected numbers, variables"),
    ({"law": "a.real * speed"}, "found 'a.real'"),
    ({"law": "speed ** 3"}, "found 'speed ** "),
    ({"law": "min(speed)"}, "found min of 1 values, expected 2"),
    ({"law": "a if speed else a"}, "found 'a if speed else a'"),
    ({"law": "+".join(["speed"] * 60)}, "found a law of"),
    ({"law": "a*(" * 200 + "speed" + ")" * 200}, f"expected at most {MOST_CHARACTERS}"),
    ({"law": "-(" * 140 + "a" + ")" * 140}, "found a law of"),
    ({"law": "1-(2-(3-(4-(5-(6-speed)))))"}, "constants, expected at most 6"),
    ({"law": "a-(a-(a-(a-(a-(a-speed)))))"}, "holds more than 6 values at once"),
    ({"unit": "N"}, "found unit 'N', expected that of motor_torque: N m"),
    ({"speed": 3.0}, "found constant 'speed'"),
    ({"a": float("nan")}, "found a = nan, expected a finite number"),
    ({"a": "much"}, "found a = 'much', expected a finite number"),
    ({"law": "store * a"}, "found a law of 'store' without one"),
    ({"store": "speed", "store_s": 0.0}, "found store_s = 0, expected 0.001 to 10000 s"),
    ({"port": "force_x", "side": "left"}, "force_x has no sides"),
    ({"port": "force_toward"}, "found force_toward without at_x and at_y"),
    ({"port": "pose_toward", "law": "a * distance"}, "found pose_toward without at_x and at_y"),
    ({"port": "pose_x", "law": "a * x", "store": "x"}, "found a store at pose_x"),
    ({"side": "top"}, "'both', 'left' or 'right'"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), BAD, ids=[words[:40] for _, words in BAD])
def test_a_wrong_term_is_refused_with_what_was_found(change, words):
    table = {**NOMINAL.model_dump(exclude={"effects", "term"}), "term": [{**GOOD, **change}]}
    with pytest.raises(InputError) as raised:
        robot_from(table, "robot.toml")
    told = str(raised.value)
    assert words in told
    assert "robot.toml" in told


def test_a_robot_has_at_most_four_terms():
    table = {**NOMINAL.model_dump(exclude={"effects", "term"}), "term": [GOOD] * 5}
    with pytest.raises(InputError, match=r"robot\.toml"):
        robot_from(table, "robot.toml")


def test_every_variable_is_what_it_says():
    for variable in VARIABLES:
        ports = [port for port in PORTS if variable.id in port.variables]
        assert ports or variable.id in ("store", "distance"), f"{variable.id} acts nowhere"
