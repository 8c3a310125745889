import math

import numpy as np
import pytest
from support.driving import NOMINAL, axle, hold, run, wild_duties
from support.nominal_reference import nominal_run

from gecar.world.kernel.motor import bench_step, conduct
from gecar.world.kernel.state import DERIVED, GRAVITY, STATE, derive, place

MOTOR, BODY = NOMINAL.motor, NOMINAL.body
VOLTAGE = NOMINAL.battery.voltage


def constants(robot=NOMINAL, dt=0.002):
    physics, derived = robot.physics, np.zeros(1, DERIVED)
    derive(physics[0], dt, derived[0])
    return physics[0], derived[0]


def no_load_speed(duty):
    friction = MOTOR.resistance * MOTOR.coulomb_friction / MOTOR.torque_constant
    return (duty * VOLTAGE - friction) / MOTOR.back_emf_constant


@pytest.mark.parametrize("duty", [0.2, 0.5, 0.8, -0.8])
def test_free_shaft_reaches_the_no_load_speed(duty):
    p, c = constants()
    (s,) = np.zeros(1, STATE)
    place(s, p, 0.0, 0.0, 0.0)
    for _ in range(2000):
        bench_step(s, duty, duty, p, c)
    assert s["left_speed"] == pytest.approx(math.copysign(no_load_speed(abs(duty)), duty), rel=1e-9)


def test_eighty_percent_duty_runs_the_free_wheel_at_the_papers_800_degrees_a_second():
    assert math.degrees(no_load_speed(0.8)) == pytest.approx(800.0, rel=0.001)


def test_stalled_motor_gives_its_stall_torque():
    p, c = constants(dt=1e-7)
    torque = conduct(0.8, VOLTAGE, 0.0, 0.0, p, c) * MOTOR.inertia / 1e-7
    assert torque == pytest.approx(0.8 * VOLTAGE * MOTOR.torque_constant / MOTOR.resistance, rel=1e-5)


def test_straight_drive_reaches_wheel_speed_times_radius():
    last = run(hold(0.6, 0.6, 4.0))[-1]
    assert last["vx"] == pytest.approx(no_load_speed(0.6) * BODY.wheel_radius, rel=1e-6)
    assert last["yaw_rate"] == 0.0


def test_circle_has_the_radius_of_differential_drive():
    # eq. 2, corrected: R = l/2 (v_r + v_l) / (v_r - v_l)
    history = run(hold(0.3, 0.45, 8.0))
    left, right = history["left_speed"][-1], history["right_speed"][-1]
    expected = 0.5 * BODY.track_width * (right + left) / (right - left)
    path = axle(history)[-2000:]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1).mean() / 0.002
    assert speed / history["yaw_rate"][-1] == pytest.approx(expected, rel=2e-4)


def test_pivot_turns_about_the_standing_wheel():
    history = run(hold(0.0, 0.15, 4.0))
    # The standing wheel is braked by its shorted motor and dry friction: it does not roll.
    assert abs(history["left_angle"][-1]) < 1e-3
    path = axle(history)[-1000:]
    radius = np.ptp(path[:, 0]) / 2.0 if np.ptp(history["heading"][-1000:]) > 6.3 else None
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1).mean() / 0.002
    assert radius is None or radius == pytest.approx(BODY.track_width / 2.0, rel=1e-2)
    assert speed / history["yaw_rate"][-1] == pytest.approx(BODY.track_width / 2.0, rel=1e-3)


def told(levels, seconds, dt):
    """Commands of either motor held from times [s] on, (time, left, right), as the means that act in each step."""
    edges = np.maximum(dt * (np.arange(round(seconds / dt) + 1) - 0.5), 0.0)
    sums = np.zeros((len(edges), 2))
    for (start, *duties), end in zip(levels, [*(level[0] for level in levels[1:]), np.inf], strict=True):
        sums += np.outer(np.clip(edges, start, end) - start, duties)
    return np.diff(sums, axis=0) / dt


@pytest.mark.parametrize("late", np.linspace(0.0, 0.002, 6)[:-1])
@pytest.mark.parametrize(("left", "right"), [(0.6, 0.6), (0.4, 0.7), (0.1, -0.3)])
def test_a_wheel_that_sets_off_and_turns_round_comes_as_far_wherever_in_a_step_it_does(late, left, right):
    """Angles after 0.9 s are those of a step forty times as short; they were off by up to 1.8 mrad, at random."""
    levels = [(0.1 + late, left, right), (0.5 + late, -right, -left)]
    coarse, fine = (run(told(levels, 0.9, dt), dt=dt)[-1] for dt in (2e-3, 5e-5))
    for side in ("left_angle", "right_angle"):
        assert coarse[side] == pytest.approx(fine[side], abs=3e-4)


@pytest.mark.parametrize("late", np.linspace(0.0, 0.002, 6)[:-1])
@pytest.mark.parametrize(("left", "right"), [(0.8, 0.8), (-0.8, 0.8), (0.8, 0.4)])
def test_tyres_that_begin_to_slide_take_the_robot_as_far_wherever_in_a_step_they_do(late, left, right):
    """Poses after 0.9 s are those of a step forty times as short; they were off by up to 0.5 mm and 0.4 degrees."""
    smooth = NOMINAL.with_effects({"tyre_friction": {"coefficient": 0.3}})
    levels = [(0.1 + late, left, right), (0.5 + late, -right, -left)]
    coarse, fine = (run(told(levels, 0.9, dt), smooth, dt) for dt in (2e-3, 5e-5))
    assert axle(coarse)[-1] == pytest.approx(axle(fine)[-1], abs=1e-4)
    assert coarse["heading"][-1] == pytest.approx(fine["heading"][-1], abs=math.radians(0.1))


def test_a_turn_on_the_spot_is_second_order_in_the_step():
    """Twice the step is off by four times as much, and 2 ms by 0.002 degrees; by 0.09 when it was of first order."""
    gripping = NOMINAL.with_effects({"tyre_friction": {"coefficient": 2.0}})
    levels = [(0.0, -0.8, 0.8)]
    exact, two, four = (run(told(levels, 2.0, dt), gripping, dt)["heading"][-1] for dt in (1e-4, 2e-3, 4e-3))
    assert abs(two - exact) < math.radians(0.003)
    assert (four - exact) / (two - exact) == pytest.approx(4.0, rel=0.1)


def test_coasting_distance_in_closed_form():
    # J' dw/dt = -B w - T with B = Kt Ke / R and J' = J + m r^2 / 2 per wheel; the motors brake, being shorted.
    dt = 0.0005
    history = run(np.concatenate([hold(0.8, 0.8, 2.0, dt), hold(0.0, 0.0, 2.0, dt)]), dt=dt)
    start = history[round(2.0 / dt) - 1]
    inertia = MOTOR.inertia + 0.5 * BODY.mass * BODY.wheel_radius**2
    damping = MOTOR.torque_constant * MOTOR.back_emf_constant / MOTOR.resistance
    drop = MOTOR.coulomb_friction / damping
    tau = inertia / damping
    stop = tau * math.log((start["left_speed"] + drop) / drop)
    angle = (start["left_speed"] + drop) * tau * (1.0 - math.exp(-stop / tau)) - drop * stop
    assert history["x"][-1] - start["x"] == pytest.approx(angle * BODY.wheel_radius, rel=0.003)
    assert abs(history["vx"][-1]) < 1e-12


def test_wheel_sticks_below_the_friction_budget():
    breakaway = MOTOR.coulomb_friction * MOTOR.resistance / (MOTOR.torque_constant * VOLTAGE)
    assert abs(run(hold(0.95 * breakaway, 0.95 * breakaway, 1.0))["x"][-1] + 0.0322) < 1e-9
    assert run(hold(1.1 * breakaway, 1.1 * breakaway, 1.0))["x"][-1] + 0.0322 > 1e-4


def test_robot_holds_on_a_slope_its_friction_can_hold():
    tilted = NOMINAL.with_effects({"floor_tilt": {"x_rad": 0.06}})
    assert abs(run(hold(0.0, 0.0, 10.0), tilted)["x"][-1] + 0.0322) < 5e-4


def test_mirrored_duties_drive_the_mirrored_path_bit_for_bit():
    duties = wild_duties(3)
    one, other = run(duties), run(duties[:, ::-1])
    assert np.array_equal(one["x"], other["x"])
    assert np.array_equal(one["y"], -other["y"])
    assert np.array_equal(one["left_angle"], other["right_angle"])


@pytest.mark.parametrize("seed", range(5))
def test_without_power_motion_never_gains_energy(seed):
    driven = wild_duties(seed, 1.0)
    history = run(np.concatenate([driven, hold(0.0, 0.0, 1.0)]))[len(driven) :]
    spin = history["left_speed"] ** 2 + history["right_speed"] ** 2
    energy = BODY.mass * (history["vx"] ** 2 + history["vy"] ** 2)
    energy += BODY.yaw_inertia * history["yaw_rate"] ** 2 + MOTOR.inertia * spin
    assert np.all(np.diff(energy) <= 1e-12)


def test_no_tyre_exceeds_its_friction_circle():
    history = run(wild_duties(1), NOMINAL.with_effects({"tyre_friction": {"coefficient": 0.3}}))
    weight = BODY.mass * GRAVITY * 0.002
    for side in ("left", "right"):
        reach = np.hypot(history[f"{side}_push"], history[f"{side}_side"])
        assert np.all(reach <= history[f"{side}_circle"] * (1.0 + 1e-12))
        assert np.all(history[f"{side}_circle"] <= 0.3 * weight)


@pytest.mark.parametrize("seed", range(3))
def test_halving_the_step_moves_a_hard_drive_by_tenths_of_a_millimetre(seed):
    coarse = axle(run(wild_duties(seed, 6.0), dt=0.002))
    fine = axle(run(np.repeat(wild_duties(seed, 6.0), 2, axis=0), dt=0.001))[1::2]
    assert np.linalg.norm(coarse - fine, axis=1).max() < 3e-4


@pytest.mark.parametrize("seed", range(3))
def test_nominal_robot_equals_a_model_without_effects_bit_for_bit(seed):
    duties = wild_duties(seed, 2.0)
    history = run(duties)
    x, y, left = nominal_run(duties, NOMINAL)
    assert np.array_equal(history["x"], x)
    assert np.array_equal(history["y"], y)
    assert np.array_equal(history["left_angle"], left)


def test_regulated_motor_holds_ten_degrees_a_second_per_percent():
    regulated = NOMINAL.model_copy(update={"drive": NOMINAL.drive.model_copy(update={"mode": "speed"})})
    history = run(hold(0.4, 0.4, 2.0), regulated)
    assert math.degrees(history["left_speed"][-1]) == pytest.approx(400.0, rel=1e-4)
    assert history["left_speed"].max() < 1.2 * history["left_speed"][-1]
