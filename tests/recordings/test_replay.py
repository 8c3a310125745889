"""Replaying recorded commands: open loop, re-based, on the floor and on the bench."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from support.acting import strong

from gecar.compiled import LANES
from gecar.reality.invent.sentences import linear, physics_grammar, single_laws
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.kernel import _between
from gecar.reality.replay.replayer import Replayer, replay, replayer_of
from gecar.world.effects import CATALOGUE
from gecar.world.ports import BY_PORT, CONSTANTS
from gecar.world.robot import load_robot
from gecar.world.terms import Term

EV3 = load_robot("ev3")


def driven(
    left: object, right: object, seconds: float = 4.0, robot: object = EV3, rig: str = "floor"
) -> Recording:
    """A noise-free recording of a robot under commands [%] of time [s], made by a replay of its own."""
    t = np.arange(0.0, seconds, 0.01)
    columns = {"t_s": t, "left_duty_pct": left(t), "right_duty_pct": right(t)}
    blank = make_recording("made", columns, Setup(rig=rig, course="none"))
    rows = replayer_of(blank).play(robot.physics, np.array([1.0, 0.5, 0.3]))[0]
    columns |= {"left_angle_deg": np.degrees(rows[:, 0]), "right_angle_deg": np.degrees(rows[:, 1])}
    columns |= {"x_m": rows[:, 4], "y_m": rows[:, 5], "heading_deg": np.degrees(rows[:, 6])}
    return make_recording("made", columns, Setup(rig=rig, course="none"))


def waves(t: np.ndarray) -> np.ndarray:
    return np.round(60.0 * np.sin(2.0 * t))


def steps(t: np.ndarray) -> np.ndarray:
    return np.where(t % 1.5 < 0.8, 50.0, -30.0)


def test_a_replay_of_its_own_recording_is_exact() -> None:
    recording = driven(waves, steps)
    again = replay(recording, EV3, align=False)
    np.testing.assert_allclose(again.x_m, recording.x_m, atol=1e-12)
    np.testing.assert_allclose(again.left_angle_rad, recording.left_angle_rad, atol=1e-12)


def test_the_start_pose_is_fitted_to_the_whole_path() -> None:
    recording = driven(waves, steps)
    shifted = make_recording("shifted", {
        "t_s": recording.t_s, "left_duty_pct": 100 * recording.left_duty, "right_duty_pct": 100 * recording.right_duty,
        "x_m": np.r_[recording.x_m[0] + 0.01, recording.x_m[1:]], "y_m": recording.y_m,
        "heading_deg": np.degrees(recording.heading_rad),
    }, recording.setup)  # fmt: skip
    assert abs(replay(shifted, EV3).x_m[0] - recording.x_m[0]) < 2e-4


@pytest.mark.parametrize("effects", [{}, {"floor_tilt": {"x_rad": 0.03, "y_rad": 0.02}}])
def test_a_start_that_is_far_off_is_found_where_the_floor_has_a_direction_or_none(effects: dict) -> None:
    robot = EV3.with_effects(effects)
    recording = driven(waves, steps, robot=robot)
    replayer = replayer_of(recording)
    there = replace(replayer, start=replayer.start + np.array([0.05, -0.04, 0.2]))
    np.testing.assert_allclose(there.aligned_start(robot.physics), [1.0, 0.5, 0.3], atol=1e-5)
    early = there.aligned_start(robot.physics, within_s=1.0)
    np.testing.assert_allclose(early, [1.0, 0.5, 0.3], atol=1e-4)


def test_a_late_command_moves_the_whole_run_later() -> None:
    recording = driven(steps, steps)
    late = replay(recording, EV3.with_effects({"actuation_delay": {"time_s": 0.1}}), align=False)
    np.testing.assert_allclose(late.left_angle_rad[10:], recording.left_angle_rad[:-10], atol=1e-9)


def test_a_clock_that_runs_fast_stretches_the_log() -> None:
    recording, skewed = driven(steps, waves), EV3.with_effects({"clock_skew": {"rate": 0.02}})
    stretched = replace(recording, t_s=1.02 * recording.t_s)
    again = replay(stretched, skewed, align=False)
    np.testing.assert_allclose(again.x_m, recording.x_m, atol=1e-6)
    np.testing.assert_allclose(again.left_angle_rad, recording.left_angle_rad, atol=1e-5)


def test_late_camera_poses_are_of_earlier() -> None:
    recording = driven(steps, waves)
    late = EV3.with_effects({"pose_delay": {"time_s": 0.05}}).physics
    poses = replayer_of(recording).play(late).poses
    seen = np.column_stack([recording.x_m, recording.y_m, recording.heading_rad])
    np.testing.assert_allclose(poses[5:], seen[:-5], atol=1e-9)


def test_a_camera_sees_lengths_smaller_about_the_point_below_it() -> None:
    recording = driven(steps, waves)
    smaller = EV3.with_effects({"pose_scale": {"scale": 0.97}}).physics
    began = np.array([1.2 + 0.97 * (1.0 - 1.2), 0.6 + 0.97 * (0.5 - 0.6), 0.3])
    played = replayer_of(recording).with_camera_over((1.2, 0.6)).play(smaller, began)
    np.testing.assert_allclose(played.poses[:, 0], 1.2 + 0.97 * (recording.x_m - 1.2), atol=1e-9)
    np.testing.assert_allclose(played.poses[:, 1], 0.6 + 0.97 * (recording.y_m - 0.6), atol=1e-9)
    np.testing.assert_allclose(played.poses[:, 2], recording.heading_rad, atol=1e-9)
    np.testing.assert_allclose(played.rows[:, 4], recording.x_m, atol=1e-9)


def test_uneven_rows_see_the_same_motion() -> None:
    recording = driven(steps, waves)
    rows = np.sort(np.random.default_rng(1).choice(np.arange(1, 400), 150, replace=False))
    sparse = {"t_s": np.r_[0.0, recording.t_s[rows]], "left_duty_pct": np.r_[50.0, steps(recording.t_s[rows])],
              "right_duty_pct": np.r_[50.0, steps(recording.t_s[rows])]}  # fmt: skip
    again = replay(make_recording("sparse", sparse, recording.setup), EV3)
    assert np.all(np.isfinite(again.x_m))
    assert again.t_s.shape == (151,)


def test_a_re_based_replay_stays_near_a_robot_with_larger_wheels() -> None:
    recording = driven(steps, steps, robot=EV3.with_effects({"wheel_radius": {"scale": 1.1}}))
    far = np.abs(replay(recording, EV3, align=False).x_m - recording.x_m).max()
    near = np.abs(replay(recording, EV3, memory_s=0.2).x_m - recording.x_m).max()
    assert near < 0.2 * far


def jumping(after_s: float = 2.0) -> tuple[Recording, np.ndarray]:
    """Return a drive that a hand moves by 5 cm and each wheel by half a radian, and which rows are up to then."""
    run = driven(waves, steps)
    late = run.t_s >= after_s
    moved = {name: getattr(run, name) + 0.5 * late for name in ("left_angle_rad", "right_angle_rad")}
    return replace(run, x_m=run.x_m + 0.05 * late, **moved), ~late


def largest_errors(replayer: Replayer, late: np.ndarray) -> tuple[float, float]:
    """Return the largest residuals of encoders and of poses at some rows."""
    errors = replayer.errors(EV3.physics)[0]
    angles, poses = errors[: 2 * len(late)].reshape(2, -1), errors[4 * len(late) :].reshape(3, -1)
    return np.abs(angles[:, late]).max(), np.abs(poses[:, late]).max()


def test_what_happened_before_a_replay_begins_anew_does_not_last() -> None:
    run, early = jumping()
    replayer, afterwards = replayer_of(run, memory_s=1.0), np.roll(~early, 1) & ~early
    assert min(largest_errors(replayer, afterwards)) > 3.0
    anew = replayer.anew_at(early | ~afterwards)
    assert max(largest_errors(anew, afterwards)) < 0.01
    again = anew.anew_at(np.zeros(len(early), bool))
    np.testing.assert_array_equal(again.errors(EV3.physics), replayer.errors(EV3.physics))
    whole = replayer.open_loop()
    np.testing.assert_array_equal(whole.anew_at(early).errors(EV3.physics), whole.errors(EV3.physics))


def test_a_replay_with_a_shorter_memory_forgets_sooner() -> None:
    run, _ = jumping()
    late = run.t_s > 2.5
    replayer = replayer_of(run, memory_s=1.0)
    before, after = (largest_errors(each, late) for each in (replayer, replayer.with_memory(0.1)))
    assert after[0] < 0.02 * before[0]
    assert after[1] < 0.1 * before[1]


def test_a_wheel_in_the_air_reaches_the_motors_free_speed() -> None:
    recording = driven(lambda t: np.full(len(t), 50.0), lambda t: np.zeros(len(t)), 2.0, rig="bench")
    motor, volts = EV3.motor, EV3.battery.voltage
    lost = motor.coulomb_friction * motor.resistance / (motor.torque_constant * motor.back_emf_constant)
    free = 0.5 * volts / motor.back_emf_constant - lost
    assert replay(recording, EV3).left_speed_rad_s[-1] == pytest.approx(free, rel=1e-4)
    assert replay(recording, EV3).right_angle_rad[-1] == 0.0


def test_twelve_seconds_replay_within_a_few_milliseconds() -> None:
    replayer = replayer_of(driven(waves, steps, 12.0))
    physics = EV3.physics
    replayer.play(physics)
    began = time.process_time()
    for _ in range(10):
        replayer.play(physics)
    assert (time.process_time() - began) / 10 < 0.006  # 0.0007 on an idle core; this machine may be busy


def test_along_its_encoders_a_robot_goes_where_its_wheels_took_it_whatever_turned_them() -> None:
    weaker = EV3.with_effects(
        {"supply_voltage": {"scale": 0.7}, "viscous_friction": {"coefficient_nms": 0.002}}
    )
    replayer = replayer_of(driven(waves, steps, robot=weaker))
    by_commands, along = (each.play(EV3.physics).poses[-1] for each in (replayer, replayer.along_encoders()))
    ended = replayer.inputs.pose[-1]
    assert abs(by_commands - ended)[2] > 0.5
    assert np.hypot(*(along - ended)[:2]) < 0.003
    assert abs(along - ended)[2] < 0.02
    narrow = EV3.with_effects({"track_width": {"scale": 0.9}}).physics
    turned = replayer.along_encoders().play(narrow).poses[:, 2]
    assert turned[-1] - turned[0] == pytest.approx((ended[2] - 0.3) / 0.9, rel=0.01)


def every_robot() -> np.ndarray:
    """Physics of the EV3, regulated, and with each effect of the catalogue; again with more mass; shape (n,)."""
    drive = EV3.drive.model_copy(update={"mode": "speed"})
    robots = [EV3, EV3.model_copy(update={"drive": drive})]
    robots += [EV3.with_effects({effect.id: strong(effect)}) for effect in CATALOGUE]
    physics = np.concatenate([robot.physics for robot in robots])
    heavier = physics.copy()
    heavier["mass"] *= 1.05
    return np.concatenate([physics, heavier])


@pytest.mark.parametrize("rolls", [False, True])
@pytest.mark.parametrize("memory_s", [1.0, np.inf])
@pytest.mark.parametrize("rig", ["floor", "bench"])
def test_robots_in_lock_step_are_replayed_as_each_alone(memory_s: float, rig: str, rolls: bool) -> None:
    physics = every_robot()
    whole, row = driven(waves, steps, seconds=2.0, rig=rig), np.arange(200)
    gaps = replace(
        whole,
        x_m=np.where(row % 7 == 5, np.nan, whole.x_m),
        heading_rad=np.where(row % 5 == 3, np.nan, whole.heading_rad),
        left_angle_rad=np.where(row % 2 == 0, np.nan, whole.left_angle_rad),
    )
    for recording in (driven(steps, waves, seconds=2.0, rig=rig), gaps):
        replayer = replayer_of(recording, memory_s=memory_s).along_encoders(rolls)
        together = replayer.errors(physics)
        for k in range(len(physics)):
            alone = replayer.play(physics[k : k + 1])
            apart = np.concatenate([alone.row_errors.T.ravel(), alone.pose_errors.T.ravel()])
            np.testing.assert_array_equal(together[k], apart)


def robots_with_laws() -> np.ndarray:
    """Physics of robots with two laws each: those of every port, some in two sizes; shape (n,)."""
    singles = single_laws(physics_grammar())
    at_port = {
        laws[0].port: [other for other in singles if other[0].port == laws[0].port] for laws in singles
    }
    chosen = [laws for here in at_port.values() for laws in here[:: max(len(here) // 8, 1)]]
    drag = Term(port="motor_torque", law="-a * speed * abs(speed)", a=1e-5)
    robots = []
    for laws in chosen:
        for size in (0.01, 0.02):
            sized = [law.with_constants({linear(law)[0]: size * BY_PORT[law.port].worth}) for law in laws]
            robots.append(EV3.with_terms([*sized, drag]))
    return np.concatenate([robot.physics for robot in robots])


@pytest.mark.parametrize("rig", ["floor", "bench"])
def test_robots_with_laws_in_lock_step_are_replayed_as_each_alone(rig: str) -> None:
    physics = robots_with_laws()
    replayer = replayer_of(driven(steps, waves, seconds=2.0, rig=rig), memory_s=1.0)
    together = replayer.errors(physics)
    plain = replayer.errors(EV3.physics)
    assert len(np.unique(together, axis=0)) > 0.5 * len(physics)
    assert not (together == plain).all(axis=1).any()
    for k in range(len(physics)):
        np.testing.assert_array_equal(together[k], replayer.errors(physics[k : k + 1])[0])
    # The same formula eight times is worked out token by token for all at once.
    some = np.repeat(physics[::16], LANES)
    some["terms"][:, 1, CONSTANTS] *= np.tile(np.linspace(0.5, 1.5, LANES), len(some) // LANES)
    together = replayer.errors(some)
    for k in range(len(some)):
        np.testing.assert_array_equal(together[k], replayer.errors(some[k : k + 1])[0])


def test_robots_told_at_other_times_are_replayed_apart() -> None:
    physics = np.repeat(EV3.physics, 2 * LANES)
    physics["actuation_delay"][::2] = 0.02
    physics["clock_skew"][3] = 0.01
    errors = np.nan_to_num(replayer_of(driven(steps, waves), memory_s=1.0).errors(physics))
    assert (errors[::2] == errors[0]).all()
    assert len(np.unique(errors, axis=0)) == 3


def test_yaw_rates_do_not_jump_as_the_log_s_clock_changes() -> None:
    replayer = replayer_of(driven(waves, steps))
    own, *others = (
        replayer.play(EV3.with_effects({"clock_skew": {"rate": rate}}).physics).rows[:, 3]
        for rate in (0.0, 1e-9, -1e-9)
    )
    assert np.abs(np.diff(own)).max() > 0.05
    for other in others:
        np.testing.assert_allclose(other, own, atol=1e-4)


def test_a_yaw_rate_is_that_of_its_moment() -> None:
    recording = driven(waves, steps)
    rate = replayer_of(recording).play(EV3.physics, np.array([1.0, 0.5, 0.3])).rows[:, 3]
    turned = np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.01)
    np.testing.assert_allclose(
        turned, np.unwrap(recording.heading_rad)[1:] - recording.heading_rad[0], atol=2e-3
    )


def test_a_yaw_rate_where_a_command_changes_is_that_of_the_kink() -> None:
    """A rate that rises by 1 a step up to here, and falls by 1 from here on: half a step from both, it is highest."""
    assert _between(-1.5, -0.5, -0.5, -1.5, 0.5) == 0.0
    assert _between(0.0, 0.0, 1.0, 2.0, 0.5) == 0.5  # the kink lies before
    assert _between(-2.0, -1.0, 0.0, 0.0, 0.25) == -0.75  # and here after
