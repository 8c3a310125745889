import math

import numpy as np
import pytest

from gecar.world.robot import load_robot
from gecar.world.shaft_speed import altered, settled_speeds

EV3 = load_robot("ev3")


def free_speed(duty):
    """Where torque and dry friction balance [deg/s]: w = (u V - R T / Kt) / Ke."""
    motor = EV3.motor
    lost = motor.resistance * motor.coulomb_friction / motor.torque_constant
    return math.degrees(max(duty * EV3.battery.voltage - lost, 0.0) / motor.back_emf_constant)


def test_told_a_power_the_motor_settles_where_torque_and_friction_balance():
    levels = (0, 3, 10, 40, 80, 100)
    wanted = [free_speed(min(level, 80) / 100.0) for level in levels]
    assert np.allclose(settled_speeds(altered(EV3, "duty"), levels), wanted, atol=0.1)


def test_told_a_speed_it_turns_ten_degrees_a_second_for_each_percent_up_to_the_limit():
    assert np.allclose(
        settled_speeds(altered(EV3, "speed"), (10, 55, 80, 100)), [100, 550, 800, 800], atol=0.5
    )


def test_recordings_stand_beside_the_simulation(gecar, tmp_path):
    bench = tmp_path / "motor_x"
    bench.mkdir()
    for name, duty, speed in (("a", 40, 300), ("b", -40, -320), ("c", 60, 500)):
        rows = "".join(f"{0.01 * k},{duty},{speed * 0.01 * k}\n" for k in range(100))
        (bench / f"{name}.csv").write_text("t_s,left_duty_pct,left_angle_deg\n" + rows)
        (bench / f"{name}.toml").write_text('rig = "bench"\n')
    answer = gecar("motor", bench, "--json").json
    assert answer["recorded_deg_s"]["motor x"] == pytest.approx({"40.0": 310.0, "60.0": 500.0})
    assert answer["told_a_power_deg_s"]["100.0"] == pytest.approx(800.0, abs=0.1)
    assert (tmp_path / "motor.png").exists()


@pytest.mark.parametrize(
    ("words", "named"),
    [(("nowhere",), "nowhere"), ((".",), "no recording"), (("--out", "a.txt"), "a.txt")],
)
def test_bad_input_is_one_line(gecar, words, named):
    assert named in gecar.error("motor", *words)
