"""Each effect's law against a closed form: at rest, settled, on ice (shafts that turn freely), or sliding."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support.driving import NOMINAL, axle, hold, run, wild_duties

from gecar.world.effects import BY_ID, CATALOGUE
from gecar.world.kernel.state import GRAVITY
from gecar.world.robot import Robot

MOTOR, BODY = NOMINAL.motor, NOMINAL.body
KT, KE, RESISTANCE = MOTOR.torque_constant, MOTOR.back_emf_constant, MOTOR.resistance
VOLTAGE, FRICTION = NOMINAL.battery.voltage, MOTOR.coulomb_friction
DAMPING = KT * KE / RESISTANCE
WEIGHT = BODY.mass * GRAVITY
CASTER = WEIGHT * BODY.com_ahead / BODY.caster_ahead
DT = 0.002
ICE = NOMINAL.model_copy(update={"tyre": NOMINAL.tyre.model_copy(update={"friction": 0.0})})
SHAPED = ("static_friction", "dead_band", "torque_ripple", "slippery_patch", "point_drag")


def with_effect(effect: str, robot: Robot = NOMINAL, **values: float) -> Robot:
    return robot.with_effects({effect: values})


def settled(robot: Robot, left: float = 0.6, right: float = 0.6) -> np.ndarray:
    """Speeds both shafts settle at under duties [rad/s]."""
    last = run(hold(left, right, 3.0), robot)[-1]
    return np.array([last["left_speed"], last["right_speed"]])


def steady(duty: float, voltage: float = VOLTAGE, torque: float = FRICTION, viscous: float = 0.0) -> float:
    """The speed [rad/s] at which Kt (duty V - Ke w) / R = torque + viscous w, for a duty above 0."""
    return (KT * duty * voltage / RESISTANCE - torque) / (DAMPING + viscous)


def moves(robot: Robot, duty: float) -> bool:
    return bool(abs(run(hold(duty, duty, 1.0), robot)["left_angle"][-1]) > 1e-4)


def spinning_up(robot: Robot, seconds: float = 0.2, **start: tuple[float, float, float]) -> np.ndarray:
    """Full duty on a floor so slippery that the tyres slide: velocity ahead [m/s], shape (steps,)."""
    return run(hold(0.8, 0.8, seconds), robot, **start)["vx"]


def pull(grip: float, height: float = BODY.com_height, ahead: float = BODY.com_ahead) -> float:
    """Acceleration of sliding tyres [m/s^2]: F = grip (load - F height / caster arm), the caster takes the rest."""
    load = WEIGHT * (1.0 - ahead / BODY.caster_ahead)
    return grip * load / (1.0 + grip * height / abs(BODY.caster_ahead)) / BODY.mass


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.id)
def test_a_robot_with_an_effect_at_neutral_is_the_robot_itself(effect):
    neutral = {p.label: NOMINAL.nominal(p) for p in effect.parameters}
    assert np.array_equal(NOMINAL.with_effects({effect.id: neutral}).physics, NOMINAL.physics)


@pytest.mark.parametrize("effect", SHAPED)
def test_an_effect_of_no_size_vanishes_whatever_its_shape(effect):
    rng = np.random.default_rng(7)
    size, *shape = BY_ID[effect].parameters
    values = {p.label: float(rng.uniform(p.low, p.high)) for p in shape} | {size.label: size.neutral}
    assert np.array_equal(run(wild_duties(2), NOMINAL.with_effects({effect: values})), run(wild_duties(2)))


def test_coulomb_friction_takes_its_torque_off_the_motors():
    robot = with_effect("coulomb_friction", ICE, torque_nm=0.04)
    assert settled(robot) == pytest.approx(steady(0.6, torque=0.04), rel=1e-6)


def test_viscous_friction_grows_with_speed():
    robot = with_effect("viscous_friction", ICE, coefficient_nms=0.01)
    assert settled(robot) == pytest.approx(steady(0.6, viscous=0.01), rel=1e-6)


def test_static_friction_holds_at_rest_and_fades_with_speed():
    robot = with_effect("static_friction", extra_torque_nm=0.02, speed_rad_s=1.0)
    breakaway = (FRICTION + 0.02) * RESISTANCE / (KT * VOLTAGE)
    assert not moves(robot, 0.95 * breakaway)
    assert moves(robot, 1.05 * breakaway)
    assert settled(robot) == pytest.approx(settled(NOMINAL), rel=1e-6)
    near = settled(with_effect("static_friction", ICE, extra_torque_nm=0.02, speed_rad_s=8.0))[0]
    assert near == pytest.approx(
        steady(0.6, torque=FRICTION + 0.02 * math.exp(-((near / 8.0) ** 2))), rel=1e-3
    )


def test_friction_differs_by_direction():
    robot = with_effect("friction_asymmetry", ICE, friction_ratio=0.5, gain_ratio=0.0)
    forward, backward = settled(robot, 0.6, -0.6)
    assert forward == pytest.approx(steady(0.6, torque=1.5 * FRICTION), rel=1e-6)
    assert backward == pytest.approx(-steady(0.6, torque=0.5 * FRICTION), rel=1e-6)


def test_gain_differs_by_direction():
    robot = with_effect("friction_asymmetry", ICE, friction_ratio=0.0, gain_ratio=0.1)
    assert settled(robot, 0.6, -0.6) == pytest.approx([steady(0.66), -steady(0.54)], rel=1e-6)


def test_viscous_friction_differs_by_direction():
    robot = with_effect("viscous_asymmetry", ICE, forward_minus_backward_nms=0.01)
    expected = steady(0.6, viscous=0.005), -steady(0.6, viscous=-0.005)
    assert settled(robot, 0.6, -0.6) == pytest.approx(expected, rel=1e-6)


def test_a_constant_torque_helps_one_way_and_is_held_by_friction_at_rest():
    robot = with_effect("constant_torque", ICE, torque_nm=0.01)
    expected = steady(0.6, torque=FRICTION - 0.01), -steady(0.6, torque=FRICTION + 0.01)
    assert settled(robot, 0.6, -0.6) == pytest.approx(expected, rel=1e-6)
    assert not moves(robot, 0.0)


def test_backlash_lets_the_encoder_turn_before_the_robot_moves():
    history = run(hold(0.3, 0.3, 1.0), with_effect("backlash", angle_deg=6.0))
    moving = np.argmax(history["vx"] > 1e-4)
    assert math.degrees(history["left_angle"][moving]) == pytest.approx(3.0, abs=0.6)


def test_backlash_is_lost_in_whole_at_a_reversal():
    slow = np.concatenate(
        [hold(0.045, 0.045, 1.0), hold(-0.045, -0.045, 2.0)]
    )  # gears that meet hard slip the tyres
    history = run(slow, with_effect("backlash", angle_deg=6.0))
    lost = np.degrees(history["left_angle"] - history["x"] / BODY.wheel_radius)
    assert lost[499] - lost[-1] == pytest.approx(6.0, rel=0.01)


def test_a_dead_band_gives_nothing_inside_and_takes_its_offset_off_outside():
    robot = with_effect("dead_band", ICE, duty_pct=30.0, offset_share=0.5)
    assert not moves(robot, 0.29)
    assert settled(robot) == pytest.approx(steady(0.45), rel=1e-6)


def test_dead_bands_differ_by_motor_and_direction():
    dead = with_effect("dead_band", ICE, duty_pct=20.0, offset_share=1.0)
    robot = with_effect(
        "dead_band_asymmetry", dead, right_minus_left_pct=10.0, forward_minus_backward_pct=4.0
    )
    assert settled(robot, 0.6, 0.6) == pytest.approx([steady(0.43), steady(0.33)], rel=1e-6)
    assert settled(robot, -0.6, -0.6) == pytest.approx([-steady(0.47), -steady(0.37)], rel=1e-6)


def test_a_dead_band_is_no_narrower_than_none():
    robot = with_effect("dead_band_asymmetry", ICE, right_minus_left_pct=20.0)
    assert settled(robot) == pytest.approx([steady(0.6), steady(0.5)], rel=1e-6)


@pytest.mark.parametrize("bulge", [-0.5, 4.0])
def test_a_drivers_curve_bends_between_none_and_full_duty(bulge):
    robot = with_effect("duty_curve", ICE, bulge=bulge)
    bent = steady(0.6 * (1.0 + bulge) / (1.0 + 0.6 * bulge))
    assert settled(robot, 0.6, -0.6) == pytest.approx([bent, -bent], rel=1e-6)
    assert settled(robot, 1.0, -1.0) == pytest.approx([steady(1.0), -steady(1.0)], rel=1e-6)


def test_a_current_limit_bounds_the_torque_at_the_start_and_when_braking():
    robot = with_effect("current_limit", ICE, current_a=0.3)
    history = run(np.concatenate([hold(0.8, 0.8, 2.0), hold(-0.8, -0.8, 0.1)]), robot)
    pace = np.diff(history["left_speed"]) / DT
    assert pace[1:30] == pytest.approx((KT * 0.3 - FRICTION) / MOTOR.inertia, rel=0.02)
    assert pace[1005:1030] == pytest.approx(-(KT * 0.3 + FRICTION) / MOTOR.inertia, rel=0.02)
    assert history["left_speed"][999] == pytest.approx(steady(0.8), rel=0.01)


def test_full_duty_gives_more_and_less_does_not():
    robot = with_effect("full_duty", ICE, gain=0.1)
    assert settled(robot, 1.0, 0.99) == pytest.approx([steady(1.1), steady(0.99)], rel=1e-6)


def test_rotor_inertia_slows_the_start():
    history = run(hold(0.6, 0.6, 0.3), with_effect("rotor_inertia", ICE, scale=3.0))
    expected = steady(0.6) * (1.0 - math.exp(-0.3 * DAMPING / (3.0 * MOTOR.inertia)))
    assert history["left_speed"][-1] == pytest.approx(expected, rel=1e-6)


def test_yaw_inertia_slows_the_start_of_a_turn_and_of_nothing_else():
    heavy = with_effect("yaw_inertia", scale=3.0)
    across = 0.5 * (3.0 * BODY.yaw_inertia + BODY.mass * BODY.com_ahead**2)
    load = MOTOR.inertia + across * (BODY.wheel_radius / (0.5 * BODY.track_width)) ** 2
    turn = run(hold(-0.3, 0.3, 0.1), heavy)
    assert turn["right_speed"][-1] == pytest.approx(
        steady(0.3) * (1.0 - math.exp(-0.1 * DAMPING / load)), rel=0.01
    )
    duties = hold(0.4, 0.4, 0.5)
    assert run(duties, heavy)["left_angle"] == pytest.approx(run(duties)["left_angle"], rel=1e-6)


def test_start_latency_shifts_the_first_motion_and_nothing_else():
    late, duties = with_effect("start_latency", time_s=0.1), hold(0.6, 0.4, 1.0)
    one, other = run(duties)["left_angle"], run(duties, late)["left_angle"]
    assert not other[:50].any()
    # the latency ends in the middle of a step, which has half the duty
    assert other[60:] == pytest.approx(0.5 * (one[10:-50] + one[9:-51]), abs=1e-3)


def test_slew_ramps_the_duty():
    ramped = with_effect("command_slew", rate_pct_s=100.0)
    history = run(hold(0.5, 0.5, 0.25), ramped)
    assert history["left_duty"][-1] == pytest.approx(0.25)
    # what acts is the mean over the step
    assert history["left_drive"][-1] == pytest.approx(0.249)


@pytest.mark.parametrize("rate_pct_s", [700.0, 1431.0, 5300.0, math.inf])
def test_a_ramp_turns_the_shaft_as_far_whatever_the_step(rate_pct_s):
    robot = with_effect("command_slew", rate_pct_s=rate_pct_s)
    coarse, fine = (ramped_angle(robot, dt) for dt in (2e-3, 5e-5))
    assert coarse == pytest.approx(fine, abs=1e-3)


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.55, 0.8])
def test_a_ramp_turns_back_in_time_wherever_in_a_step_its_command_changes(phase):
    robot = with_effect("command_slew", ICE, rate_pct_s=700.0)
    coarse, fine = (run(reversed_at(0.1 + phase * DT, dt), robot, dt)["left_angle"][-1] for dt in (DT, 2e-5))
    assert coarse == pytest.approx(fine, abs=2e-4)


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.55, 0.8])
def test_gears_meet_in_time_wherever_in_a_step_they_do(phase):
    """Tyres slide as gears meet: a step early, and the robot would be 0.3 mm off after a start and a reversal."""
    robot = with_effect("backlash", angle_deg=2.4)
    coarse, fine = (run(reversed_at(0.8 + phase * DT, dt, 1.4), robot, dt)["x"][-1] for dt in (DT, 2e-5))
    assert coarse == pytest.approx(fine, abs=4e-5)


def reversed_at(change, dt, seconds=0.3, duty=0.5):
    """Duties of both motors that are reversed at a time [s], each the mean over a step that lies half a step back."""
    begins = (np.arange(round(seconds / dt)) - 0.5) * dt
    ahead = np.clip((change - begins) / dt, 0.0, 1.0)
    duties = duty * (2.0 * ahead - 1.0)
    duties[0] *= 0.5
    return np.stack([duties, duties], axis=1)


def ramped_angle(robot, dt):
    """Return how far a shaft turns in 0.3 s [rad], its command as late as commands are: half a step."""
    duties = hold(0.4, 0.4, 0.3, dt)
    duties[0] *= 0.5
    return run(duties, robot, dt)["left_angle"][-1]


def test_one_motor_is_stronger():
    robot = with_effect("motor_gain_asymmetry", ICE, right_minus_left=0.2)
    assert settled(robot) == pytest.approx([steady(0.54), steady(0.66)], rel=1e-6)


def test_supply_voltage_scales_what_drives():
    robot = with_effect("supply_voltage", ICE, scale=0.8)
    assert settled(robot) == pytest.approx(steady(0.6, 0.8 * VOLTAGE), rel=1e-6)


def test_a_battery_sags_under_both_motors_current():
    # settled, a motor draws the current that balances its friction: duty Kt I = duty T, from each of two
    robot = with_effect("battery_resistance", ICE, resistance_ohm=4.0)
    sagged = VOLTAGE - 4.0 * 2.0 * 0.6 * FRICTION / KT
    assert settled(robot) == pytest.approx(steady(0.6, sagged), rel=1e-6)


def test_braking_does_not_charge_the_battery():
    duties = np.concatenate([hold(0.8, 0.8, 1.0), hold(0.1, 0.1, 0.3)])
    history = run(duties, with_effect("battery_resistance", resistance_ohm=4.0))
    assert history["voltage"].max() == VOLTAGE


def test_a_battery_drains():
    history = run(hold(0.6, 0.6, 5.0), with_effect("battery_drain", ICE, rate_v_s=0.2))
    fell = history["left_speed"][-1001] - history["left_speed"][-1]
    assert fell == pytest.approx(0.2 * 2.0 * 0.6 / KE, rel=1e-3)


def test_torque_ripples_with_the_shafts_angle():
    # J dw/dt + B w = A sin(n angle), near a steady speed: w swings by A / |J i n w + B|
    history = run(
        hold(0.6, 0.6, 5.0), with_effect("torque_ripple", ICE, amplitude_nm=0.01, cycles_per_rev=6.0)
    )
    speed, angle = history["left_speed"][-2000:], history["left_angle"][-2000:]
    mean = speed.mean()
    swing = 0.01 / math.hypot(MOTOR.inertia * 6.0 * mean, DAMPING)
    share = np.exp(-6j * angle) @ (speed - mean) * 2.0 / len(speed)
    assert abs(share) == pytest.approx(swing, rel=0.02)


def test_the_right_motors_ripple_leads_by_an_angle():
    leads = with_effect("torque_ripple", ICE, amplitude_nm=0.01, cycles_per_rev=6.0, right_lead_rad=0.1)
    phase = with_effect("torque_ripple", ICE, amplitude_nm=0.01, cycles_per_rev=6.0, phase_rad=0.6)
    duties = hold(0.6, 0.6, 1.0)
    led, right = run(duties, leads)["left_angle"], run(duties, leads)["right_angle"]
    assert right == pytest.approx(run(duties, phase)["left_angle"], abs=1e-9)
    assert np.abs(led - right).max() > 1e-3


def test_speed_limit_holds_the_wheel_at_the_limit_both_ways():
    limited = with_effect("speed_limit", speed_rad_s=8.0)
    assert settled(limited, 0.8, 0.8) == pytest.approx(8.0, rel=0.01)
    assert settled(limited, -0.8, -0.8) == pytest.approx(-8.0, rel=0.01)


def test_larger_wheels_roll_farther():
    history = run(hold(0.5, 0.5, 2.0), with_effect("wheel_radius", scale=1.1))
    rolled = history["left_angle"][-1] * 1.1 * BODY.wheel_radius
    assert axle(history)[-1, 0] == pytest.approx(rolled, rel=1e-3)


def test_one_larger_wheel_turns_the_robot_while_the_encoders_agree():
    last = run(hold(0.3, 0.3, 3.0), with_effect("wheel_radius_difference", right_minus_left=0.1))[-1]
    rolled = BODY.wheel_radius * (1.05 * last["right_angle"] - 0.95 * last["left_angle"])
    assert last["heading"] == pytest.approx(rolled / BODY.track_width, rel=1e-2)


def test_a_wider_track_turns_less():
    last = run(hold(-0.2, 0.2, 3.0), with_effect("track_width", scale=1.2))[-1]
    rolled = BODY.wheel_radius * (last["right_angle"] - last["left_angle"])
    assert last["heading"] == pytest.approx(rolled / (1.2 * BODY.track_width), rel=1e-3)


def test_sliding_tyres_pull_with_their_grip():
    speed = spinning_up(with_effect("tyre_friction", coefficient=0.1))
    assert np.diff(speed)[50:] == pytest.approx(pull(0.1) * DT, rel=1e-6)


def test_a_slippery_patch_takes_grip_inside_and_none_outside():
    robot = with_effect("slippery_patch", radius_m=0.2, x_m=1.0, y_m=2.0, coefficient=0.05)
    inside = spinning_up(robot, start=(1.0, 1.81, 0.0))
    assert np.diff(inside)[50:] == pytest.approx(pull(0.05) * DT, rel=1e-6)
    assert np.array_equal(
        spinning_up(robot, start=(1.0, 1.79, 0.0)), spinning_up(NOMINAL, start=(1.0, 1.79, 0.0))
    )


def test_a_higher_centre_of_mass_takes_load_off_the_wheels():
    robot = with_effect("tyre_friction", with_effect("load_transfer", height_m=0.15), coefficient=0.2)
    assert np.diff(spinning_up(robot))[50:] == pytest.approx(pull(0.2, height=0.15) * DT, rel=1e-6)


def test_turning_loads_the_outer_wheel():
    history = run(hold(0.3, 0.6, 3.0), with_effect("load_transfer", height_m=0.1))
    last, aside = history[-1], history["left_side"][-2] + history["right_side"][-2]
    moment = aside / DT * 0.1
    assert last["right_circle"] - last["left_circle"] == pytest.approx(
        2.0 * NOMINAL.tyre.friction * DT * moment / BODY.track_width, rel=1e-6
    )
    assert moment > 0.01


def test_a_wider_track_shifts_less_load_to_the_outer_wheel():
    wide = with_effect("load_transfer", with_effect("track_width", scale=1.4), height_m=0.1)
    history = run(hold(0.3, 0.6, 3.0), wide)
    last, aside = history[-1], history["left_side"][-2] + history["right_side"][-2]
    shifted = NOMINAL.tyre.friction * aside * 0.1 / (1.4 * BODY.track_width)
    assert last["right_circle"] - last["left_circle"] == pytest.approx(2.0 * shifted, rel=1e-6)


def test_a_spin_turns_about_the_axle_wherever_the_centre_of_mass_is():
    robot = with_effect("com_offset", ahead_m=-0.06)
    path = axle(run(hold(-0.15, 0.15, 3.0), robot), robot)
    assert np.abs(path).max() < 2e-3


def test_a_centre_of_mass_near_the_caster_takes_load_off_the_wheels():
    robot = with_effect("tyre_friction", with_effect("com_offset", ahead_m=-0.06), coefficient=0.1)
    assert np.diff(spinning_up(robot))[50:] == pytest.approx(pull(0.1, ahead=-0.06) * DT, rel=1e-6)


def test_a_dragging_caster_takes_its_force_off_the_wheels():
    robot = with_effect("caster_drag", coefficient=0.4)
    drag = 0.5 * 0.4 * CASTER * BODY.wheel_radius
    assert settled(robot) == pytest.approx(steady(0.6, torque=FRICTION + drag), rel=1e-6)


def test_a_dragging_caster_resists_turning():
    free, drags = (
        run(hold(-0.3, 0.3, 3.0), r)[-1]["yaw_rate"]
        for r in (NOMINAL, with_effect("caster_drag", coefficient=0.4))
    )
    side = 0.4 * CASTER * abs(BODY.caster_ahead) / BODY.track_width * BODY.wheel_radius
    expected = steady(0.3, torque=FRICTION + side) / steady(0.3)
    assert drags / free == pytest.approx(expected, rel=0.02)


def test_what_drags_takes_its_force_off_the_wheels():
    robot = with_effect("point_drag", force_n=0.4, off_axle_m=0.05)
    drag = 0.5 * 0.4 * BODY.wheel_radius
    assert settled(robot) == pytest.approx(steady(0.6, torque=FRICTION + drag), rel=1e-6)


@pytest.mark.parametrize("left", [0.06, -0.06])
def test_what_drags_aside_loads_the_wheel_on_its_side_and_turns_the_robot_there(left):
    robot = with_effect("point_drag", force_n=0.4, left_m=left)
    last = run(hold(0.6, 0.6, 2.0), robot)[-1]
    share = 0.5 + left / BODY.track_width
    torques = FRICTION + 0.4 * BODY.wheel_radius * np.array([share, 1.0 - share])
    expected = [steady(0.6, torque=torque) for torque in torques]
    assert [last["left_speed"], last["right_speed"]] == pytest.approx(expected, rel=2e-3)
    assert last["yaw_rate"] * left > 0.0


def test_what_drags_resists_turning_by_its_distance_from_the_axle():
    free, drags = (
        run(hold(-0.3, 0.3, 3.0), r)[-1]["yaw_rate"]
        for r in (NOMINAL, with_effect("point_drag", force_n=0.4, left_m=0.05, off_axle_m=0.06))
    )
    side = 0.4 * math.hypot(0.06, 0.05) / BODY.track_width * BODY.wheel_radius
    assert drags / free == pytest.approx(steady(0.3, torque=FRICTION + side) / steady(0.3), rel=0.02)


def test_what_drags_aside_slows_a_body_on_ice_and_turns_it():
    robot = with_effect("point_drag", ICE, force_n=0.1, left_m=0.05)
    last = run(hold(0.0, 0.0, 0.05), robot.with_effects({"floor_tilt": {"x_rad": 0.2}}))[-1]
    assert last["vx"] == pytest.approx(0.05 * (WEIGHT * math.sin(0.2) - 0.1) / BODY.mass, rel=1e-3)
    assert last["yaw_rate"] == pytest.approx(0.05 * 0.1 * 0.05 / BODY.yaw_inertia, rel=3e-2)


@pytest.mark.parametrize("tilt", [0.8, 0.95])
def test_what_drags_holds_a_robot_on_ice_up_to_its_force(tilt):
    robot = with_effect("point_drag", ICE, force_n=0.3)
    slope = math.asin(tilt * 0.3 / WEIGHT)
    last = run(hold(0.0, 0.0, 0.3), robot.with_effects({"floor_tilt": {"x_rad": -slope}}))[-1]
    assert abs(last["vx"]) < 1e-5  # three sweeps leave a thousandth of what a step of gravity gives


def test_rolling_resistance_takes_its_torque_off_the_wheels():
    robot = with_effect("rolling_resistance", coefficient=0.1)
    torque = FRICTION + 0.1 * 0.5 * (WEIGHT - CASTER) * BODY.wheel_radius
    assert settled(robot) == pytest.approx(steady(0.6, torque=torque), rel=1e-6)


def test_a_tilted_floor_pulls_downhill():
    history = run(hold(0.0, 0.0, 0.5), with_effect("floor_tilt", ICE, x_rad=0.1, y_rad=-0.05))
    assert history["vx"][-1] == pytest.approx(GRAVITY * math.sin(0.1) * 0.5, rel=1e-9)
    assert history["vy"][-1] == pytest.approx(-GRAVITY * math.sin(0.05) * 0.5, rel=1e-9)
