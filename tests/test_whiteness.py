"""Whether what is left could be noise: of motion and of readings, with draws that follow the seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from linear_case import bumps, linear, linear_problem

from gecar.reality.prove.whiteness import whiteness
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import SENSOR

VISCOUS = "viscous_friction"
RESPONSES = {VISCOUS: bumps(1, 4, 0.3)}


def left(misfit: np.ndarray | float, sensor: bool = False) -> Problem:
    residuals = linear({}, RESPONSES, seed=3)
    residuals = replace(residuals, noise=residuals.noise + misfit, sensor=sensor)
    problem = linear_problem(residuals)
    return replace(problem, limits=SENSOR) if sensor else problem


def test_noise_is_white_and_a_misfit_is_not() -> None:
    noise, missing = left(0.0), left(bumps(9, 4, 3.0))
    assert whiteness(noise, noise.known)[0]
    assert not whiteness(missing, missing.known)[0]


def test_readings_are_allowed_what_paths_leave_and_no_more() -> None:
    allowed, missing = left(bumps(9, 4, 0.4), sensor=True), left(bumps(9, 4, 4.0), sensor=True)
    assert whiteness(allowed, allowed.known)[0]
    assert not whiteness(missing, missing.known)[0]


def test_the_seed_draws_the_nulls() -> None:
    problem = left(bumps(9, 4, 0.15))
    found = {whiteness(problem, problem.known, seed)[1] for seed in range(6)}
    assert len(found) > 1
    assert whiteness(problem, problem.known, 4) == whiteness(problem, problem.known, 4)
