"""Whether what is left could be noise: of motion and of readings, with draws that follow the seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, recorded
from support.linear_case import bumps, linear, linear_problem

from gecar.reality import discovery
from gecar.reality.prove.whiteness import whiteness
from gecar.reality.recordings.recording import Case
from gecar.reality.selection.problem import Problem

VISCOUS = "viscous_friction"
RESPONSES = {VISCOUS: bumps(1, 4, 0.3)}


def left(misfit: np.ndarray | float) -> Problem:
    residuals = linear({}, RESPONSES, seed=3)
    residuals = replace(residuals, noise=residuals.noise + misfit)
    return linear_problem(residuals)


def test_noise_is_white_and_a_misfit_is_not() -> None:
    noise, missing = left(0.0), left(bumps(9, 4, 3.0))
    assert whiteness(noise, noise.known)[0]
    assert not whiteness(missing, missing.known)[0]


def test_small_changes_of_constants_are_fitted_first() -> None:
    small = linear_problem(linear({VISCOUS: 0.9}, {VISCOUS: bumps(1, 4, 1.0)}, seed=3))
    assert not whiteness(small, small.known)[0]
    under = small.under(small.known)
    assert whiteness(under, under.known)[0]


def test_the_seed_draws_the_nulls() -> None:
    problem = left(bumps(9, 4, 0.33))
    found = {whiteness(problem, problem.known, seed)[1] for seed in range(6)}
    assert len(found) > 1
    assert whiteness(problem, problem.known, 4) == whiteness(problem, problem.known, 4)


def test_the_seed_of_a_discovery_reaches_all_that_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = dict[str, int]()
    for name in ("whiteness", "describe", "intervals"):
        real = getattr(discovery, name)
        monkeypatch.setattr(
            discovery,
            name,
            lambda *given, name=name, real=real: seeds.update({name: given[2]}) or real(*given),
        )
    turned = [recorded(EV3, seed, seconds=4.0) for seed in range(3)]
    turned = [replace(run, heading_rad=run.heading_rad + 0.3 * (run.t_s > 2.0)) for run in turned]
    verdict = discovery.discover(Case("made", tuple(turned)), seed=7, catalogue=())
    assert verdict.verdict == "unexplained"
    assert seeds == {"whiteness": 7, "describe": 7, "intervals": 7}
