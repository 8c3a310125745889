import math

import numpy as np
import pytest
from support.acting import strong
from support.driving import run, wild_duties

from gecar.world.effects import CATALOGUE
from gecar.world.kernel.motor import bench_step
from gecar.world.kernel.state import DERIVED, REGULATOR_RATE, STATE, derive, place
from gecar.world.motor_bench import altered, settled_speeds
from gecar.world.robot import load_robot

EV3 = load_robot("ev3")


def free_speed(duty):
    """Where torque and dry friction balance [deg/s]: w = (u V - R T / Kt) / Ke."""
    motor = EV3.motor
    lost = motor.resistance * motor.coulomb_friction / motor.torque_constant
    return math.degrees(max(duty * EV3.battery.voltage - lost, 0.0) / motor.back_emf_constant)


def test_under_a_duty_command_the_motor_settles_where_torque_and_friction_balance():
    levels = (0, 3, 10, 40, 80, 100)
    wanted = [free_speed(min(level, 80) / 100.0) for level in levels]
    assert np.allclose(settled_speeds(altered(EV3, "duty"), levels), wanted, atol=0.1)


def test_under_a_speed_command_it_turns_ten_degrees_a_second_for_each_percent_up_to_the_limit():
    assert np.allclose(
        settled_speeds(altered(EV3, "speed"), (10, 55, 80, 100)), [100, 550, 800, 800], atol=0.5
    )


MOTOR_EFFECTS = [effect for effect in CATALOGUE if effect.channels == ("motor",)]


@pytest.mark.parametrize("mode", ["duty", "speed"])
@pytest.mark.parametrize("effect", MOTOR_EFFECTS, ids=lambda effect: effect.id)
def test_motors_on_a_bench_obey_the_laws_of_motors_that_turn_freely_on_ice(effect, mode):
    ice = altered(EV3, mode).model_copy(update={"tyre": EV3.tyre.model_copy(update={"friction": 0.0})})
    robot, duties = ice.with_effects({effect.id: strong(effect)}), wild_duties(5, 1.0)
    (p,), (c,), (s,) = robot.physics, np.zeros(1, DERIVED), np.zeros(1, STATE)
    derive(p, 0.002, c)
    place(s, p, 0.0, 0.0, 0.0)
    angles = np.empty((len(duties), 2))
    for k, (left, right) in enumerate(duties):
        bench_step(s, left, right, p, c)
        angles[k] = s["left_angle"], s["right_angle"]
    history = run(duties, robot)
    assert np.column_stack([history["left_angle"], history["right_angle"]]) == pytest.approx(angles, abs=1e-9)


def regulated_speeds(inertia_scale, step_s, command=0.5, seconds=1.5):
    """The left shaft's speed after each step [rad/s], regulated, from rest."""
    motor = EV3.motor.model_copy(update={"inertia": EV3.motor.inertia * inertia_scale})
    physics = altered(EV3, "speed").model_copy(update={"motor": motor}).physics
    (p,), (c,), (s,) = physics, np.zeros(1, DERIVED), np.zeros(1, STATE)
    derive(p, step_s, c)
    place(s, p, 0.0, 0.0, 0.0)
    speeds = np.empty(round(seconds / step_s))
    for k in range(len(speeds)):
        bench_step(s, command, command, p, c)
        speeds[k] = s["left_speed"]
    return speeds


@pytest.mark.parametrize("step_s", [0.00025, 0.002, 0.01])
@pytest.mark.parametrize("inertia_scale", [1e-6, 1e-3, 0.03, 0.158, 0.16, 1.0, 4.0])
def test_a_regulated_wheel_of_any_inertia_goes_the_right_way_and_settles_where_commanded(
    inertia_scale, step_s
):
    wanted = math.radians(500.0)
    speeds = regulated_speeds(inertia_scale, step_s)
    assert speeds.min() >= 0.0
    assert speeds.max() < 1.1 * wanted
    assert speeds[-1] == pytest.approx(wanted, rel=1e-3)


def test_a_regulator_answers_a_light_wheel_at_its_own_rate_whatever_the_step():
    """Without inertia to shape it, the loop is one lag of 1 / REGULATOR_RATE."""
    times = [np.argmax(regulated_speeds(1e-6, step) > (1 - 1 / math.e) * math.radians(500)) * step
             for step in (0.00025, 0.002)]  # fmt: skip
    assert np.allclose(times, 1.0 / REGULATOR_RATE, atol=0.005)


def test_recordings_stand_beside_the_simulation(gecar, tmp_path):
    bench = tmp_path / "motor_x"
    bench.mkdir()
    for name, duty, speed in (("a", 40, 300), ("b", -40, -320), ("c", 60, 500)):
        rows = "".join(f"{0.01 * k},{duty},{speed * 0.01 * k}\n" for k in range(100))
        (bench / f"{name}.csv").write_text("t_s,left_duty_pct,left_angle_deg\n" + rows)
        (bench / f"{name}.toml").write_text('rig = "bench"\n')
    answer = gecar("motor", bench, "--json").json
    assert answer["recorded_deg_s"]["motor x"] == pytest.approx({"40.0": 310.0, "60.0": 500.0})
    assert answer["duty_command_deg_s"]["100.0"] == pytest.approx(800.0, abs=0.1)
    assert (tmp_path / "motor.png").exists()


@pytest.mark.parametrize(
    ("words", "named"),
    [(("nowhere",), "nowhere"), ((".",), "no recording"), (("--out", "a.txt"), "a.txt")],
)
def test_bad_input_is_one_line(gecar, words, named):
    assert named in gecar.error("motor", *words)
