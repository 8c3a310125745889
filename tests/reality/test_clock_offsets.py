"""Camera clocks that are late by another time in every recording."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.recordings.recording import Recording
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.alternatives import ON_THE_ROBOT, late_as_well
from gecar.reality.selection.problem import Problem, problem_of, scattered
from gecar.reality.selection.stepwise import explain
from gecar.world.robot import Robot
from gecar.world.terms import Term


def late(run: Recording, by_s: float) -> Recording:
    """Let a camera show where the robot was a while ago."""
    seen = ~np.isnan(run.x_m)
    shown = {
        name: np.where(seen, np.interp(run.t_s - by_s, run.t_s[seen], getattr(run, name)[seen]), np.nan)
        for name in ("x_m", "y_m", "heading_rad")
    }
    return replace(run, **shown)


def beside(*offsets_s: float, robot: Robot = EV3) -> Residuals:
    runs = [late(recorded(robot, seed), offset) for seed, offset in enumerate(offsets_s)]
    return motion_of(runs)


def test_offsets_come_back_of_residuals_nothing_was_asked_of_before() -> None:
    """Recordings set aside are fitted first of all: their index must not depend on an earlier replay."""
    fitted, cost = with_fitted_clocks(beside(0.03, -0.03), EV3.physics)
    assert fitted.clock_offsets_s == pytest.approx([0.03, -0.03], abs=0.003)
    assert cost < 0.5 * np.sum(beside(0.03, -0.03).errors(EV3.physics) ** 2)


def test_the_residuals_given_stay_as_they_are() -> None:
    before = beside(0.03, -0.03)
    with_fitted_clocks(before, EV3.physics)
    assert before.clock_offsets_s.tolist() == [0.0, 0.0]


def test_one_delay_common_to_all_is_no_scatter() -> None:
    assert not scattered(np.array([0.03, 0.03, 0.0305]))
    assert not scattered(np.array([0.03]))
    assert scattered(np.array([0.03, -0.03]))


@pytest.mark.parametrize(("by_s", "named"), [(-0.03, []), (0.03, ["pose_delay"])])
def test_a_clock_that_is_early_by_the_same_everywhere_is_no_late_camera(
    by_s: float, named: list[str]
) -> None:
    """Nothing shows a camera where the robot will be, but its clock may be early."""
    explained = explain(problem_of(beside(by_s, by_s, by_s), EV3, ("rotor_inertia", "pose_delay")))
    assert [step.effect for step in explained.steps] == named
    assert explained.problem.clocks_fitted is not bool(named)
    expected = [0.0 if named else by_s] * 3
    assert explained.problem.residuals.clock_offsets_s == pytest.approx(expected, abs=0.002)


def test_clocks_fitted_beside_a_late_camera_are_late_by_that_too() -> None:
    """The delay is no effect any more once clocks are fitted: 100 ms common to all were lost with it."""
    offsets = (0.08, 0.10, 0.12)
    problem = problem_of(beside(*offsets), EV3, ("rotor_inertia", "pose_delay"))
    delayed = problem.estimator.fit(("pose_delay",), {"pose_delay": {"time_s": 0.05}})
    fitted = problem.with_clocks(delayed)
    assert fitted is not None
    assert fitted.residuals.clock_offsets_s == pytest.approx(offsets, abs=0.002)


@pytest.mark.parametrize(
    ("effect", "fitted", "wheels", "instead"),
    [
        ("sensor_delay", True, False, {"actuation_delay": {"time_s": 0.04}}),
        ("sensor_lag", True, False, {}),
        ("sensor_delay", False, False, {}),
        ("sensor_delay", True, True, {}),
    ],
)
def test_where_only_the_camera_tells_of_the_motion_a_late_sensor_may_be_late_commands(
    effect: str, fitted: bool, wheels: bool, instead: dict[str, dict[str, float]]
) -> None:
    run = recorded(EV3, 0)
    unlogged = {name: np.full(len(run.t_s), np.nan) for name in ON_THE_ROBOT}
    motion = SimpleNamespace(recordings=[run if wheels else replace(run, **unlogged)], clocks_fitted=fitted)
    step = SimpleNamespace(effect=effect, model=SimpleNamespace(values={effect: {"time_s": 0.04}}))
    assert late_as_well(motion, step) == instead  # type: ignore[arg-type]


def test_clocks_fitted_before_an_effect_was_known_are_fitted_anew_beside_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A heavier rotor makes the robot late, which clocks take for theirs as long as no effect is known."""
    offsets = [0.03, -0.03, 0.025, -0.025, 0.02]
    heavy = EV3.with_effects({"rotor_inertia": {"scale": 1.12}})
    problem = problem_of(beside(*offsets, robot=heavy), EV3, ("rotor_inertia", "viscous_friction"))
    explained = explain(problem)
    (step,) = explained.steps
    assert step.effect == "rotor_inertia"
    assert explained.problem.clocks_fitted
    assert explained.problem.residuals.clock_offsets_s == pytest.approx(offsets, abs=0.001)
    monkeypatch.setattr(Problem, "with_clocks_beside", lambda *_: None)
    once = explain(problem).problem.residuals.clock_offsets_s
    assert float(np.mean(once - offsets)) > 0.003


def test_clocks_fitted_before_a_law_was_known_are_fitted_anew_beside_it() -> None:
    """Commands that act late make the robot late, which clocks take for theirs as long as no law is known."""
    offsets = [0.03, -0.03, 0.025]
    slow = Term(port="command", law="c1 * (store - command)", store="command", store_s=0.05, c1=1.0)
    lagging = EV3.with_terms([slow])
    problem = problem_of(beside(*offsets, robot=lagging), EV3, ("viscous_friction",))
    taken, _ = with_fitted_clocks(problem.residuals, EV3.physics)
    assert float(np.mean(taken.clock_offsets_s - offsets)) > 0.003
    beside_law = replace(problem_of(taken, lagging, ("viscous_friction",)), clocks_fitted=True)
    beside_law = beside_law.under(beside_law.known)
    renewed = beside_law.with_clocks_beside(beside_law.known)
    assert renewed is not None
    again = problem.filmed_as(renewed)
    assert again.residuals.clock_offsets_s == pytest.approx(offsets, abs=0.001)
    assert again.clocks_fitted
    assert not again.estimator.robot.term


CATALOGUE = (
    "command_slew", "clock_skew", "supply_voltage", "wheel_radius", "pose_delay", "current_limit", "torque_ripple",
)  # fmt: skip


@pytest.mark.parametrize(
    ("effects", "seed", "late_s"),
    [
        ({"command_slew": {"rate_pct_s": 2400.0}}, 1, 0.0),
        ({"command_slew": {"rate_pct_s": 2400.0}}, 2, 0.0),
        ({"command_slew": {"rate_pct_s": 2400.0}, "clock_skew": {"rate": -0.03}}, 1, 0.0),
        ({"command_slew": {"rate_pct_s": 2400.0}}, 1, 0.03),
        ({}, 1, -0.03),
    ],
)
def test_the_clock_of_an_only_recording_takes_up_nothing_that_makes_a_robot_late(
    effects: dict[str, dict[str, float]], seed: int, late_s: float
) -> None:
    """Commands that ramp make a robot without encoders 20 ms late: as late as a camera may be."""
    run = late(recorded(EV3.with_effects(effects), seed), late_s)
    unseen = np.full(len(run.t_s), np.nan)
    blind = replace(run, left_angle_rad=unseen, right_angle_rad=unseen)
    explained = explain(problem_of(motion_of([blind]), EV3, CATALOGUE))
    assert {step.effect for step in explained.steps} == set(effects)
    assert explained.problem.residuals.clock_offsets_s == pytest.approx([late_s], abs=0.002)
