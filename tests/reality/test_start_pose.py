"""Recordings without a camera: where they began, and what their readings then tell. All simulated."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, recorded
from support.trials import ARRIVES, trial
from test_location import seen_on_the_course

from gecar.reality.discovery import discover
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.replay.odometry import odometry
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.replay.rigid_alignment import starting_at
from gecar.reality.residuals.of_recording import residuals_of
from gecar.reality.start_pose.localise import (
    bare_floor,
    find_start,
    with_other_wheels,
)
from gecar.world.course.course import load_course
from gecar.world.effects import BY_ID
from gecar.world.robot import Robot

PAPER = load_course("paper")
START = np.array([PAPER.start.x_m, PAPER.start.y_m, PAPER.start.heading_rad])
SPINS = ARRIVES.replace("20,-80", "10,-70")


def reckoned(recording: Recording) -> np.ndarray:
    return odometry(replayer_of(recording), EV3.physics)


def whereabouts(recording: Recording, path: np.ndarray | None = None) -> np.ndarray | None:
    path = reckoned(recording) if path is None else path
    return find_start(recording.t_s, path, recording.reflection_pct, PAPER, EV3.physics)


def blind(robot: Robot, count: int = 4) -> Case:
    sources = (ARRIVES, SPINS)
    return Case(
        "made", tuple(trial(f"run_{k}", robot, sources[k % 2], seed=k, posed=False) for k in range(count))
    )


def test_dead_reckoning_keeps_the_path_of_a_robot_that_is_not_as_simulated() -> None:
    weak = EV3.with_effects({"coulomb_friction": {"torque_nm": 0.03}, "backlash": {"angle_deg": 3.0}})
    run = recorded(weak, 3)
    path = starting_at(reckoned(run), np.array([1.0, 0.5, 0.3]))
    seen = ~np.isnan(run.x_m)
    assert np.hypot(path[seen, 0] - run.x_m[seen], path[seen, 1] - run.y_m[seen]).max() < 0.012


def test_a_line_follower_s_start_is_found_from_what_it_read() -> None:
    found = whereabouts(trial("made", EV3, posed=False))
    assert found is not None
    assert np.abs(found - START)[:2].max() < 0.003
    assert abs(found[2] - START[2]) < math.radians(0.5)


def test_a_start_nothing_tells_is_not_told() -> None:
    run = trial("made", EV3, posed=False)
    once = reckoned(run)
    straight = np.column_stack([np.linspace(0.0, 1.0, len(once)), np.zeros(len(once)), np.zeros(len(once))])
    reading = np.where(np.abs(straight[:, 0] - 0.5) < 0.01, 0.0, 100.0)
    white = np.full(len(once), 100.0)
    assert find_start(run.t_s, straight, reading, PAPER, EV3.physics) is None
    assert find_start(run.t_s, once, white, PAPER, EV3.physics) is None


@pytest.mark.parametrize("wheels", [(0.0, 0.015, 0.0), (0.01, 0.0, 0.0), (0.0, 0.0, 0.05)])
def test_dead_reckoning_with_wrong_wheels_is_seen_through(wheels: tuple[float, float, float]) -> None:
    run = trial("made", EV3, SPINS, posed=False)
    found = whereabouts(run, with_other_wheels(reckoned(run), np.array([0.0, 0.0, 0.0, *wheels])))
    assert found is None


@pytest.mark.parametrize("source", [ARRIVES, SPINS])
def test_a_start_is_found_though_the_sensor_is_mounted_elsewhere_and_late(source: str) -> None:
    elsewhere = EV3.with_effects({"sensor_position": {"ahead_m": 0.1, "left_m": 0.015}})
    run = trial("made", elsewhere, source, posed=False)
    late = replace(run, reflection_pct=np.interp(run.t_s - 0.05, run.t_s, run.reflection_pct))
    found = whereabouts(late)
    assert found is not None
    assert np.abs(found - START)[:2].max() < 0.003
    assert abs(found[2] - START[2]) < math.radians(0.5)


def test_two_robots_are_judged_from_one_start() -> None:
    runs = (
        replace(run, reflection_pct=np.round(0.9 * run.reflection_pct)) for run in blind(EV3, 3).recordings
    )
    verdict = discover(Case("made", tuple(runs)), catalogue=[BY_ID["sensor_gain"]])
    assert [f.id for f in verdict.effects] == ["sensor_gain"]
    starts = [
        [run.nuisances.start for run in held.recordings]
        for held in (verdict.evidence.held_before, verdict.evidence.held)
    ]
    assert np.array_equal(*starts)


def test_other_wheels_stretch_a_path_and_a_new_start_carries_it() -> None:
    path = np.column_stack([np.linspace(0.0, 1.0, 101), np.zeros(101), np.zeros(101)])
    longer = with_other_wheels(path, np.array([0.5, 0.0, 0.5 * math.pi, 0.1, 0.0, 0.0]))
    assert longer[0] == pytest.approx([0.5, 0.0, 0.5 * math.pi])
    assert longer[-1] == pytest.approx([0.5, 1.1, 0.5 * math.pi])
    veering = with_other_wheels(path, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.2]))
    assert veering[-1, 2] == pytest.approx(0.2)


def test_only_even_bright_readings_are_bare_floor() -> None:
    t = np.arange(0.0, 6.0, 0.01)
    readings = np.where((t > 2.0) & (t < 2.3), 5.0, 98.0)
    readings[t > 5.0] = np.nan
    bare = bare_floor(t, readings, 1.0)
    assert bare[t < 1.7].all()
    assert not bare[(t > 1.8) & (t < 2.5)].any()
    assert not bare[t > 5.0].any()


def test_without_a_camera_nothing_concealed_is_nothing_found() -> None:
    verdict = discover(blind(EV3, 3))
    assert verdict.verdict == "nothing"
    assert any("began" in note for note in verdict.notes)


@pytest.mark.slow
def test_without_a_camera_a_sensor_mounted_elsewhere_is_found() -> None:
    verdict = discover(blind(EV3.with_effects({"sensor_position": {"left_m": 0.012}}), 3))
    assert [f.id for f in verdict.effects] == ["sensor_position"]
    assert verdict.effects[0].parameters["left_m"].value == pytest.approx(0.012, abs=0.001)
    assert verdict.located[0].channel == "reflection"


def test_light_that_changes_with_the_heading_is_unexplained_where_no_line_was_crossed() -> None:
    runs = []
    for seed in range(3):
        run = seen_on_the_course(seed, EV3)
        gone = np.full_like(run.t_s, np.nan)
        dimmed = run.reflection_pct * (1.0 - 0.1 * (1.0 + np.cos(np.nan_to_num(path_heading(run)))))
        runs.append(replace(run, reflection_pct=np.round(dimmed), x_m=gone, y_m=gone, heading_rad=gone))
    assert discover(Case("made", tuple(runs))).verdict == "unexplained"


def path_heading(run: Recording) -> np.ndarray:
    seen = ~np.isnan(run.heading_rad)
    return np.interp(run.t_s, run.t_s[seen], run.heading_rad[seen])


def test_a_strip_no_camera_saw_looks_only_once_it_is_located() -> None:
    run = trial("made", EV3, posed=False)
    beside = residuals_of(run, estimate_noise([run], EV3.physics, 1.0), 1.0, PAPER)
    assert not beside.reads
    beside = beside.localised(EV3.physics).with_path(EV3.physics, np.ones(3))
    assert beside.reads
    assert np.nanstd(beside.sensor_errors(EV3.physics)) < 1.0
