"""Formulas for what nothing explains: chosen without leaks, on any grid of times."""

from __future__ import annotations

import numpy as np
import pytest

from gecar.reality.invent.formula import NAMES, _chosen, _Signal, _signal, _sparse

MEMORY_S = 1.0


def noise(seed: int) -> _Signal:
    """Return a short recording of noise that many terms happen to fit."""
    rng = np.random.default_rng(seed)
    return _Signal(rng.normal(size=40), rng.normal(size=(40, len(NAMES))))


def test_a_recording_drawn_twice_is_left_out_twice() -> None:
    """Else its copy predicts it: a resample of one recording three times would choose terms that fit its noise."""
    signals = [noise(k) for k in range(3)]
    assert _chosen(signals, np.array([3, 0, 0])) == []


def drifting(t: np.ndarray) -> _Signal:
    """Return what a speed that is off by 0.5 leaves of an angle that is drawn back within a second."""
    fine = np.arange(0.0, t[-1] + 1e-9, 0.001)
    drift = 0.5 * MEMORY_S * (1.0 - np.exp(-fine / MEMORY_S))
    terms = np.ones((len(t), len(NAMES)))
    return _signal(t, terms, t, np.interp(t, fine, drift), 1.0, MEMORY_S)


@pytest.mark.parametrize("uneven", [False, True])
def test_terms_go_through_the_replay_s_memory_whatever_the_rows(uneven: bool) -> None:
    t = np.arange(0.0, 12.0, 0.01)
    if uneven:
        t = np.r_[t[t < 6.0][::10], t[t >= 6.0]]  # while the drift still grows
    signal = drifting(t)
    found = float(signal.pull[0] / signal.normal[0, 0])
    assert found == pytest.approx(0.5, rel=0.03)


def test_the_seed_draws_the_resamples() -> None:
    """Two terms that are nearly the same: a resample chooses either, and the seed decides how many choose one."""
    rng = np.random.default_rng(0)
    signals = []
    for _ in range(5):
        terms = 0.1 * rng.normal(size=(40, len(NAMES)))
        terms[:, 1] = terms[:, 0] + rng.normal(size=40)
        terms[:, 2] = terms[:, 1] + 0.02 * rng.normal(size=40)
        signals.append(_Signal(terms[:, 1] + 0.3 * rng.normal(size=40), terms))
    found = [_sparse("v", "m/s", signals, seed) for seed in (0, 0, 1, 2, 3, 4)]
    assert found[0] == found[1]
    assert len(set(map(str, found))) > 1
