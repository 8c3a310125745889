"""Permutation tests by shifts in time: their false alarms are as many as they say, and causes are seen."""

from __future__ import annotations

import numpy as np
import pytest

from gecar.reality.locate.shift_test import best_disc, regime_p

BINS, NULLS = 120, 1000
UNEQUAL, EQUAL = np.array([120, 60, 45, 90]), np.full(4, 120)


def padded(values: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    return np.where(np.arange(values.shape[1]) < lengths[:, None], values, 0)


def lasting_energy(rng: np.random.Generator, lengths: np.ndarray) -> np.ndarray:
    """Return energy that lasts for some bins, above a floor, and is 0 in the padding."""
    noise = rng.chisquare(1.0, (len(lengths), BINS + 4))
    return padded(5.0 + np.stack([np.convolve(row, np.ones(5), "valid") for row in noise]), lengths)


def regime(rng: np.random.Generator, lengths: np.ndarray) -> np.ndarray:
    """Return a mask of stretches of ten bins."""
    return padded(np.repeat(rng.random((len(lengths), BINS // 10)) < 0.3, 10, axis=1), lengths).astype(bool)


def drives(rng: np.random.Generator, lengths: np.ndarray) -> np.ndarray:
    """Return smooth ways over a square metre, nan in the padding."""
    steps = np.cumsum(rng.normal(0.0, 0.02, (len(lengths), BINS, 2)), axis=1)
    path = 0.5 + np.cumsum(np.clip(steps, -0.05, 0.05), axis=1) % 1.0
    path[np.arange(BINS) >= lengths[:, None]] = np.nan
    return path


@pytest.mark.parametrize("lengths", [EQUAL, UNEQUAL], ids=["equal", "unequal"])
def test_one_null_in_twenty_is_called_a_regime_whatever_the_lengths(lengths: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    alarms = [
        regime_p(lasting_energy(rng, lengths), regime(rng, lengths), lengths, rng, 199) <= 0.05
        for _ in range(NULLS)
    ]
    assert np.mean(alarms) == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize("lengths", [EQUAL, UNEQUAL], ids=["equal", "unequal"])
def test_the_best_place_of_a_null_is_called_a_place_no_more_often(
    lengths: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gecar.reality.locate.shift_test.DISC_SHARE", -1.0)  # every null has a best place
    rng = np.random.default_rng(1)
    found = [
        best_disc(lasting_energy(rng, lengths), drives(rng, lengths), lengths, rng, 99) for _ in range(NULLS)
    ]
    assert np.mean([disc is not None and disc.p <= 0.05 for disc in found]) == pytest.approx(0.05, abs=0.02)


def test_energy_of_a_regime_is_seen() -> None:
    rng = np.random.default_rng(2)
    mask = regime(rng, UNEQUAL)
    assert regime_p(lasting_energy(rng, UNEQUAL) + 5.0 * mask, mask, UNEQUAL, rng) < 0.01


def test_energy_at_a_place_is_seen_there() -> None:
    rng = np.random.default_rng(3)
    path = drives(rng, EQUAL)
    place = path[0, 60]
    near = np.hypot(*(path - place).transpose(2, 0, 1)) < 0.1
    disc = best_disc(lasting_energy(rng, EQUAL) + 300.0 * near, path, EQUAL, rng)
    assert disc is not None
    assert np.hypot(disc.x_m - place[0], disc.y_m - place[1]) < 0.12
    assert disc.p < 0.01
