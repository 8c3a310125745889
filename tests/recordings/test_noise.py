"""Noise of the sensors: what rounding leaves is the least of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, recorded

from gecar.reality.noise.sensor_noise import Noise, estimate_noise
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.replayer import replayer_of

WHOLE_DEGREE = math.radians(1.0)


def with_columns(run: Recording, gyro_noise: float, volt_step: float) -> Recording:
    """Add a gyro in whole degrees a second, with noise [deg/s], and a battery in steps [V]."""
    rows = replayer_of(run).play(EV3.physics).rows
    rng = np.random.default_rng(len(run.name))
    rate = np.degrees(rows[:, 3]) + rng.normal(0.0, gyro_noise, len(rows))
    volts = np.round((rows[:, 2] - 0.02 * run.t_s) / volt_step) * volt_step
    return replace(run, yaw_rate_rad_s=np.radians(np.round(rate)), battery_v=volts)


def noise_of(gyro_noise: float, volt_step: float) -> Noise:
    runs = [with_columns(recorded(EV3, seed), gyro_noise, volt_step) for seed in range(2)]
    return estimate_noise(runs, EV3.physics, 1.0)


@pytest.mark.parametrize("gyro_noise", [0.0, 0.05, 0.2])
def test_a_gyro_in_whole_degrees_is_no_finer_than_its_rounding(gyro_noise: float) -> None:
    assert noise_of(gyro_noise, 0.01).sd[2] > 0.99 * WHOLE_DEGREE / math.sqrt(12.0)


@pytest.mark.parametrize("step", [0.01, 0.05])
def test_a_battery_in_steps_is_no_finer_than_its_rounding(step: float) -> None:
    assert noise_of(0.2, step).sd[1] > 0.99 * step / math.sqrt(12.0)


def test_noise_larger_than_rounding_is_itself() -> None:
    assert noise_of(3.0, 0.01).sd[2] == pytest.approx(math.radians(3.0), rel=0.2)
