"""A motor's constants on a bench: found together, the most plausible set of them, and past thresholds."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support.concealing import EV3, motion_of

from gecar.reality.optimisation.least_squares import least_squares, row_by_row
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.selection.motor_constants import CONSTANTS, implausibility, with_constants
from gecar.reality.selection.observability import observable
from gecar.reality.selection.problem import Problem, problem_of
from gecar.reality.selection.stepwise import explain
from gecar.world.effects import CATALOGUE
from gecar.world.robot import Robot

LIGHT_AND_LOW = {"rotor_inertia": {"scale": 0.57}, "supply_voltage": {"scale": 0.85}}
SETUP = Setup(rig="bench", course="none", duty_cap=1.0)


def step(robot: Robot, level: float) -> Recording:
    t = np.arange(0.0, 1.5, 0.01)
    columns = {"t_s": t, "left_duty_pct": np.full(len(t), level)}
    angle = replayer_of(make_recording("made", columns, SETUP)).play(robot.physics).rows[:, 0]
    columns["left_angle_deg"] = np.round(
        np.degrees(angle) + np.random.default_rng(1).normal(0.0, 0.2, len(t))
    )
    return make_recording(f"step_{level:.0f}", columns, SETUP)


@cache
def bench(holds: bool = False) -> Problem:
    """A motor lighter than the EV3's with a low battery; one that holds does not move at 5 % duty, either."""
    held = {"dead_band": {"duty_pct": 8.0, "offset_share": 0.0}} if holds else {}
    robot = EV3.with_effects({**LIGHT_AND_LOW, "coulomb_friction": {"torque_nm": 0.009}, **held})
    runs = [step(robot, level) for level in (5.0, 10.0, 40.0, 70.0, 90.0)]
    residuals = motion_of(runs)
    return problem_of(residuals, EV3, observable(CATALOGUE, residuals))


def test_of_sets_of_constants_that_fit_alike_the_most_plausible_is_taken() -> None:
    problem = bench()
    found = with_constants(problem, problem.known)
    far = problem.estimator.fit(("viscous_friction", "supply_voltage", "coulomb_friction"), {})
    assert "rotor_inertia" in found.effects
    assert implausibility(found) < implausibility(far)


def test_nothing_is_named_where_the_constants_are_known() -> None:
    runs = [step(EV3, level) for level in (20.0, 60.0, 90.0)]
    residuals = motion_of(runs)
    problem = problem_of(residuals, EV3, CONSTANTS)
    assert with_constants(problem, problem.known).effects == ()


def test_a_lighter_rotor_is_found_beside_a_threshold_that_only_one_recording_shows() -> None:
    explained = explain(bench(holds=True))
    assert "rotor_inertia" in explained.taken.effects
    assert {"dead_band", "static_friction"} & set(explained.taken.effects)
    assert not explained.unexplained


def test_a_fit_goes_past_a_jump_that_one_coordinate_would_make() -> None:
    def residual(z: np.ndarray) -> np.ndarray:
        jump = 100.0 if z[0] > 1.01 else 0.0
        return np.r_[3.0 * (z[1] - 5.0), 3.0 * (z[1] - 5.0) + 10.0 * (z[0] - 1.4), jump]

    bounds = np.full(2, -10.0), np.full(2, 10.0)
    found = least_squares(
        row_by_row(residual), np.array([1.0, 0.0]), bounds, np.full(2, 0.005), past_jumps=True
    )
    assert found.z[1] == pytest.approx(5.0, abs=1.0)
