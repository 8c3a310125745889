"""A cause has one size in all recordings, at all times and in all regimes; what imitates other physics drifts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded
from test_location import seen_on_the_course
from test_start_pose import path_heading

from gecar.reality.advise.notes import DRIFTS, notes_on_findings
from gecar.reality.recordings.split import Split
from gecar.reality.selection.homogeneity import heterogeneity
from gecar.reality.selection.problem import Problem, problem_of
from gecar.reality.selection.screening import step_of
from gecar.reality.selection.stepwise import explain
from gecar.world.robot import Robot
from gecar.world.terms import Term

GRIP = "tyre_friction"
GROUPS = np.repeat(np.arange(4), 500)
LOSING_GRIP = EV3.with_terms([Term(port="tyre_grip", law="-a * time", a=0.1)])


def asked(sizes: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return whitened residuals without an effect and with it, where each group has its own size of it."""
    rng = np.random.default_rng(seed)
    noise, response = rng.normal(size=len(GROUPS)), rng.normal(size=len(GROUPS))
    without = noise + sizes[GROUPS] * response
    return without, without - response


def test_one_size_in_all_groups_is_no_heterogeneity() -> None:
    found = [heterogeneity(GROUPS, *asked(np.ones(4), seed)) for seed in range(200)]
    assert np.mean([each.p < 0.05 for each in found]) == pytest.approx(0.05, abs=0.05)
    assert np.median([each.relative for each in found]) < 0.03


def test_the_spread_of_sizes_beyond_noise_is_told() -> None:
    found = heterogeneity(GROUPS, *asked(np.array([0.7, 0.9, 1.1, 1.3])))
    assert found.p < 1e-6
    assert found.relative == pytest.approx(np.std([0.7, 0.9, 1.1, 1.3], ddof=1), abs=0.05)


def test_groups_that_hardly_show_an_effect_say_nothing_of_its_size() -> None:
    without, with_effect = asked(np.array([1.0, 1.0, 1.0, 9.0]))
    faint = np.where(GROUPS == 3, 0.01, 1.0) * (without - with_effect)
    found = heterogeneity(GROUPS, with_effect + faint, with_effect)
    assert found.relative < 0.1


def grip_alone(robot: Robot) -> Problem:
    """Return the problem of a robot's recordings, in which less grip, other wheels or another track may be found."""
    runs = [recorded(robot, seed) for seed in range(4)]
    residuals = motion_of(runs)
    return problem_of(residuals, EV3, (GRIP, "wheel_radius", "track_width"))


def test_less_grip_has_one_size_and_is_named() -> None:
    explained = explain(grip_alone(EV3.with_effects({GRIP: {"coefficient": 0.5}})))
    assert [step.effect for step in explained.steps] == [GRIP]
    assert explained.drifting == ()


def test_grip_that_is_lost_on_the_way_has_not_and_stays_unexplained() -> None:
    explained = explain(grip_alone(LOSING_GRIP))
    assert explained.steps == ()
    assert explained.unexplained
    (step,) = explained.drifting
    assert (step.effect, step.drifts) == (GRIP, True)
    assert step.gain > 50.0


@pytest.mark.parametrize(
    ("leaning", "waxing"), [(0.0, 0.0), (0.04, 0.0), (0.0, 0.04)], ids=["even", "from one side", "flickers"]
)
def test_light_that_is_not_even_is_no_gain(leaning: float, waxing: float) -> None:
    """White reads 6 % less; by as much on the mean where the light falls from one side, or waxes and wanes."""
    runs, turn = [], 2.0 * np.pi * 1.1  # of the light, each second
    for seed in range(4):
        run = seen_on_the_course(seed, EV3)
        light = 0.94 + leaning * np.cos(path_heading(run)) + waxing * np.sin(turn * run.t_s + seed)
        dimmed = run.reflection_pct * light
        runs.append(replace(run, reflection_pct=np.round(dimmed)))
    moved = motion_of(runs)
    read = moved.with_paths(EV3.physics).of_sensor()
    explained = explain(problem_of(read, EV3, ("sensor_gain", "sensor_delay")))
    named, drifting = ([s.effect for s in steps] for steps in (explained.steps, explained.drifting))
    uneven = leaning or waxing
    assert named == ["sensor_gain"] * (not uneven)
    assert drifting == ["sensor_gain"] * bool(uneven)


def test_the_notes_say_why_what_drifts_is_no_finding() -> None:
    problem = grip_alone(EV3)
    step = step_of(problem.estimator, GRIP, problem.known, problem.known)
    split = Split(problem.recordings, (), by_time=False)
    for drifting in (True, False):
        note, *_ = notes_on_findings(split, EV3, [replace(step, drifts=drifting)])
        assert note.startswith(GRIP)
        assert (DRIFTS in note) is drifting
