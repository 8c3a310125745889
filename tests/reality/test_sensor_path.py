"""The path that carries a colour sensor is off by about one place while the sensor crosses an edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3
from test_location import seen_on_the_course

from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.replay.reflectance import readings_along
from gecar.reality.residuals.nuisances import SensorPath
from gecar.reality.residuals.of_recording import residuals_of
from gecar.reality.residuals.parting import PATH_KNOWN
from gecar.reality.residuals.registration import beyond_any_path
from gecar.world.course.course import load_course

ROWS, BLOCK = 95, 30  # the last block is not full
RNG = np.random.default_rng(0)
SLOPES = RNG.normal(0.0, 5.0, (ROWS, 3))
PATH = SensorPath(np.zeros((ROWS, 3)), 0.0, 0.001, 0.001, np.full(ROWS, 2.0), SLOPES, BLOCK)


def across(t: np.ndarray) -> np.ndarray:
    """Return poses of a robot that crosses the course's upper line at 0.3 m/s, shape (rows, 3)."""
    return np.column_stack([np.full_like(t, 1.2), 0.6 + 0.3 * t, np.full_like(t, 0.5 * np.pi)])


def edges(width: float, at: float = 0.0) -> np.ndarray:
    """Return readings across one edge in the middle of each block [%], at 1 mm a row."""
    way = np.arange(ROWS) % BLOCK - 0.5 * BLOCK - at
    return 50.0 * (1.0 + np.tanh(way / width))


def left_of(errors: np.ndarray, path: SensorPath) -> float:
    """Return which share of the squared errors is left by what the path may be off by."""
    return float(np.sum(path.whitened(errors[None]) ** 2) / np.sum((errors / path.own_sd) ** 2))


def test_errors_are_whitened_by_the_root_of_each_blocks_covariance() -> None:
    errors = RNG.normal(size=(4, ROWS))
    found = PATH.whitened(errors)
    for first in range(0, ROWS, BLOCK):
        own = slice(first, first + BLOCK)
        covariance = 4.0 * np.eye(len(SLOPES[own])) + SLOPES[own] @ SLOPES[own].T
        squares, basis = np.linalg.eigh(covariance)
        root = basis @ np.diag(squares**-0.5) @ basis.T
        assert found[:, own] == pytest.approx(errors[:, own] @ root, abs=1e-9)
    assert PATH.whitened(errors[:0]).shape == (0, ROWS)


def test_a_reading_that_is_not_there_says_nothing_of_others() -> None:
    errors = RNG.normal(size=(1, ROWS))
    own_sd, slopes = np.full(ROWS, 2.0), SLOPES.copy()
    own_sd[5], slopes[5], errors[0, 5] = np.nan, np.nan, np.nan
    beside = SensorPath(PATH.poses, 0.0, 0.001, 0.001, own_sd, slopes, BLOCK).whitened(errors)
    there = np.arange(ROWS) != 5
    assert np.isfinite(beside[0, there]).all()
    assert np.isnan(beside[0, 5])


def test_an_edge_that_comes_early_is_the_paths_error_and_one_that_is_wider_is_not() -> None:
    # A path known to 3 mm: per reading, both would drown in it.
    slopes = np.zeros((ROWS, 3))
    slopes[:, 0] = 15.0 * (edges(4.0, at=0.1) - edges(4.0, at=-0.1))
    path = SensorPath(np.zeros((ROWS, 3)), 0.0, 0.001, 0.001, np.full(ROWS, 1.0), slopes, BLOCK)
    early, wider = (each - edges(4.0) for each in (edges(4.0, at=-0.3), edges(5.0)))
    assert left_of(early, path) < 0.01
    assert left_of(wider, path) > 0.5
    assert np.sum((wider / path.reading_sd) ** 2) < 0.05 * np.sum(wider**2)


@pytest.mark.parametrize(
    ("off_m", "waxing", "unmoved", "least", "most"),
    [(0.0, 0.0, 0.6, 0.0, 0.3), (0.002, 0.0, 2.4, 0.0, 0.3), (0.002, 0.08, 6.1, 5.0, 6.0)],
    ids=["as measured", "path 2 mm off", "and the light flickers"],
)
def test_what_readings_leave_however_the_path_is_shifted(
    off_m: float, waxing: float, unmoved: float, least: float, most: float
) -> None:
    run = seen_on_the_course(4, EV3)
    light = 1.0 + waxing * np.sin(2.0 * np.pi * 1.1 * run.t_s)
    run = replace(run, reflection_pct=np.round(run.reflection_pct * light), y_m=run.y_m + off_m)
    beside = residuals_of(run, estimate_noise([run], EV3.physics, 1.0), 1.0, load_course("paper"))
    along = beside.with_path(EV3.physics, np.ones(3))
    left = np.sqrt(max(float(np.nanmean(beyond_any_path(along, EV3.physics, PATH_KNOWN))), 0.0))
    assert least <= left <= most
    errors = run.reflection_pct - along.readings(EV3.physics)
    assert np.sqrt(np.nanmean(errors**2)) == pytest.approx(unmoved, abs=0.1)


def test_a_lag_is_the_same_however_rarely_the_log_was_written() -> None:
    course, physics = (
        load_course("paper"),
        EV3.with_effects({"sensor_lag": {"time_constant_s": 0.011}}).physics,
    )
    often = np.arange(0.0, 2.0, 0.01)

    def read(t: np.ndarray) -> np.ndarray:
        return readings_along(t, across(t), 0.0, 0.5, course.surface, physics, np.zeros(3))

    assert np.ptp(read(often)) > 50.0
    assert np.abs(read(often[::5]) - read(often)[::5]).max() < 1.0
