"""The null distribution holds what the search for an effect finds where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality.fitting.initial_values import Wave
from gecar.reality.selection.null_distribution import largest_gains
from gecar.reality.selection.problem import Problem, problem_of
from gecar.reality.selection.screening import candidate_steps


def of_noise(effect: str, seed: int) -> Problem:
    """Return the problem of one effect and recordings in which nothing is missing."""
    runs = [recorded(EV3, 10 * seed + k, seconds=4.0) for k in range(3)]
    residuals = motion_of(runs)
    return problem_of(residuals, EV3, (effect,))


@pytest.mark.parametrize("effect", ["slippery_patch", "torque_ripple", "speed_limit"])
def test_what_a_search_over_places_cycles_and_limits_finds_in_noise_is_no_surprise(
    effect: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gecar.reality.selection.screening.PRICE", -1.0)  # fit it whatever it promises
    monkeypatch.setattr("gecar.reality.selection.screening.NEGLIGIBLE", -1.0)
    monkeypatch.setattr("gecar.reality.fitting.initial_values.LEAST_GAIN", -1.0)
    p = []
    for seed in range(8):
        problem = of_noise(effect, seed)
        nulls = largest_gains(problem.estimator, problem.catalogue, problem.known)
        gain = max(step.gain for step in candidate_steps(problem, problem.known))
        assert np.quantile(nulls, 0.95) > 0.0
        p.append(np.mean(nulls >= gain))
    # of eight that are even between 0 and 1 three are as small in 0.6 % of all cases
    assert np.sum(np.array(p) < 0.05) <= 2
    assert np.median(p) > 0.1


def test_what_a_search_would_find_is_replayed_once_for_all_robots_that_are_near() -> None:
    estimator = of_noise("torque_ripple", 0).estimator
    one, near, far = (
        estimator.fit(("rotor_inertia",), {"rotor_inertia": {"scale": scale}}, rounds=0)
        for scale in (1.1, 1.12, 1.5)
    )
    waves = estimator.ripples(one)
    assert one.is_near(near)
    assert estimator.ripples(near) is waves
    assert not one.is_near(far)
    assert not one.is_near(estimator.known())
    assert estimator.ripples(far) is not waves
    anew = of_noise("torque_ripple", 0).estimator.ripples(near)
    off, of = (np.linalg.norm([w.columns for w in each]) for each in (_less(anew, waves), anew))
    assert 0.0 < off < 0.1 * of


def _less(some: list[Wave], others: list[Wave]) -> list[Wave]:
    return [a._replace(columns=a.columns - b.columns) for a, b in zip(some, others, strict=True)]
