"""Faults of logs, missing rows and times that jitter, are told by what the wheels did; and errors of instruments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, recorded

from gecar.reality.advise.notes import notes_on_recordings
from gecar.reality.discovery import discover
from gecar.reality.noise.sensor_noise import Noise, estimate_noise
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.recordings.split import Split
from gecar.reality.replay.kernel import YAW_RATE
from gecar.reality.replay.log_faults import without_log_faults
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.residuals.of_case import ENCODER_WAVE_RAD, GYRO_SCALE, motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.world.effects import BY_ID

MEMORY_S = 1.0
CHANGED = (80, 240, 400, 560)  # rows at which the commands of `recorded` change


@pytest.fixture(scope="module")
def whole() -> Recording:
    return recorded(EV3, 0)


@pytest.fixture(scope="module")
def noise(whole: Recording) -> Noise:
    return estimate_noise([whole], EV3.physics, MEMORY_S)


def only(recording: Recording, rows: np.ndarray) -> Recording:
    return replace(recording, **{name: getattr(recording, name)[rows] for name, _ in COLUMNS.values()})


def mended(recording: Recording, noise: Noise) -> Recording:
    return without_log_faults(recording, EV3.physics, noise.sd, noise.walk, MEMORY_S)


def misfit(recording: Recording, noise: Noise) -> float:
    errors = replayer_of(recording, noise.sd, noise.walk, MEMORY_S).play(EV3.physics).row_errors[:, :2]
    return float(np.nanmean(errors**2))


def test_a_command_changes_in_a_gap_when_the_wheels_tell(whole: Recording, noise: Noise) -> None:
    kept = np.setdiff1d(np.arange(len(whole.t_s)), CHANGED)
    missing = only(whole, kept)
    found = mended(missing, noise)
    assert misfit(missing, noise) > 2.0 * misfit(whole, noise)
    assert misfit(found, noise) < 1.1 * misfit(whole, noise)
    # The next command came with the lost row, which is a row's time earlier than the log has it.
    assert found.lost_t_s == pytest.approx(whole.t_s[list(CHANGED)], abs=0.003)
    assert np.array_equal(found.commands, missing.commands)


def test_without_encoders_and_gyro_it_is_told_by_where_the_robot_was_seen(
    whole: Recording, noise: Noise
) -> None:
    unseen = np.full(len(whole.t_s), np.nan)
    whole = replace(whole, left_angle_rad=unseen, right_angle_rad=unseen)
    for lost in (CHANGED, np.subtract(CHANGED, 1)):  # the next command came at once, or after the gap
        kept = np.setdiff1d(np.arange(len(whole.t_s)), lost)
        found = mended(only(whole, kept), noise)
        assert found.lost_t_s == pytest.approx(whole.t_s[list(CHANGED)], abs=0.003)


def test_a_command_that_changed_after_the_gap_stays_where_it_is(whole: Recording, noise: Noise) -> None:
    kept = np.setdiff1d(np.arange(len(whole.t_s)), np.subtract(CHANGED, 1))
    found = mended(only(whole, kept), noise)
    assert found.lost_t_s == pytest.approx(whole.t_s[list(CHANGED)], abs=0.003)
    assert misfit(found, noise) < 1.1 * misfit(whole, noise)


def test_where_all_is_off_by_many_standard_deviations_it_is_told_too(whole: Recording, noise: Noise) -> None:
    kept = np.setdiff1d(np.arange(len(whole.t_s)), CHANGED)
    found = without_log_faults(only(whole, kept), EV3.physics, 0.02 * noise.sd, noise.walk, MEMORY_S)
    assert found.lost_t_s == pytest.approx(whole.t_s[list(CHANGED)], abs=0.003)


def test_gaps_of_a_log_are_told_once_more_by_the_robot_that_was_found() -> None:
    """Motors of twice the inertia start late, so that known ones say that each step came a row late."""
    heavy, lines = EV3.with_effects({"rotor_inertia": {"scale": 2.0}}), list[str]()
    whole = [recorded(heavy, seed) for seed in range(5)]
    kept = np.setdiff1d(np.arange(len(whole[0].t_s)), CHANGED)
    case = Case("heavy", tuple(only(run, kept) for run in whole))
    catalogue = [BY_ID["rotor_inertia"], BY_ID["coulomb_friction"]]
    verdict = discover(case, catalogue=catalogue, tell=lines.append)
    (found,) = verdict.effects
    assert any("gaps of the logs" in line for line in lines)
    again = max(k for k, line in enumerate(lines) if "gaps of the logs" in line)
    assert not any("gains" in line for line in lines[again:])  # what was found before is not looked for anew
    assert found.parameters["scale"].low < 2.0 < found.parameters["scale"].high
    assert verdict.evidence is not None
    for run in verdict.evidence.fitted.recordings:
        changed = np.intersect1d(run.recording.lost_t_s.round(2), whole[0].t_s[list(CHANGED)].round(2))
        assert len(changed) == len(run.recording.lost_t_s)


def test_gaps_between_equal_commands_and_logs_without_gaps_need_nothing(
    whole: Recording, noise: Noise
) -> None:
    assert mended(whole, noise) is whole
    held = only(whole, np.setdiff1d(np.arange(len(whole.t_s)), (100, 101, 300)))
    assert mended(held, noise) is held


def test_times_that_jitter_in_the_log_alone_are_made_even(whole: Recording, noise: Noise) -> None:
    late = np.random.default_rng(1).uniform(0.0, 0.002, len(whole.t_s))
    jittering = replace(whole, t_s=whole.t_s + late - late[0])
    found = mended(jittering, noise)
    assert np.ptp(np.diff(found.t_s)) < 1e-9
    assert misfit(found, noise) < misfit(jittering, noise)


def test_rows_that_were_read_at_uneven_times_stay_so(whole: Recording, noise: Noise) -> None:
    rng = np.random.default_rng(2)
    uneven = replace(whole, t_s=whole.t_s + rng.uniform(0.0, 0.002, len(whole.t_s)))
    start = np.array([1.0, 0.5, 0.3])
    rows = replayer_of(uneven).play(EV3.physics, start).rows
    degree = np.radians(1.0)
    left, right = (degree * np.round(rows[:, k] / degree) for k in range(2))
    driven = replace(uneven, left_angle_rad=left, right_angle_rad=right, x_m=rows[:, 4], y_m=rows[:, 5])
    assert mended(driven, noise) is driven


def test_a_note_tells_what_was_made_good(whole: Recording, noise: Noise) -> None:
    kept = np.setdiff1d(np.arange(len(whole.t_s)), CHANGED[:1])
    late = np.random.default_rng(1).uniform(0.0, 0.002, len(whole.t_s))
    logged = Split((only(whole, kept), replace(whole, t_s=whole.t_s + late - late[0])), ())
    split = Split(tuple(mended(run, noise) for run in logged.fitted), ())
    residuals = motion_residuals(split.fitted, noise, MEMORY_S, Threads(1))
    notes = notes_on_recordings(split, logged, residuals, False, False)
    assert any("miss rows, and once the command changed there" in note for note in notes)
    assert any("times of rows in run_0 jitter" in note for note in notes)
    assert not any("rows" in note for note in notes_on_recordings(split, split, residuals, False, False)[1:])


def test_an_encoder_s_wave_adds_to_residuals_what_is_foretold(whole: Recording, noise: Noise) -> None:
    angle = whole.left_angle_rad
    waving = replace(whole, left_angle_rad=angle + ENCODER_WAVE_RAD * np.sin(angle))
    plain, waved = (motion_residuals([run], noise, MEMORY_S, Threads(1)) for run in (whole, waving))
    added = waved.errors(EV3.physics) - plain.errors(EV3.physics)
    foretold = plain.instrument_errors(EV3.physics)
    sine = foretold[:, 3]
    assert np.abs(added).max() > 0.5
    assert added == pytest.approx(sine, abs=1e-6)
    assert np.all(foretold[plain.index.channel > 1, 3:] == 0.0)


def test_a_gyro_s_errors_are_those_of_the_rates_predicted_whatever_noise_was_measured(
    whole: Recording, noise: Noise
) -> None:
    rate = replayer_of(whole, noise.sd, noise.walk, MEMORY_S).play(EV3.physics).rows[:, YAW_RATE]
    shaking = np.random.default_rng(0).normal(0.0, np.radians(2.0), len(rate))
    exact, scaled, noisy = (
        motion_residuals([replace(whole, yaw_rate_rad_s=rates)], noise, MEMORY_S, Threads(1))
        for rates in (rate, (1.0 + GYRO_SCALE) * rate, rate + shaking)
    )
    added = scaled.errors(EV3.physics) - exact.errors(EV3.physics)
    assert added == pytest.approx(exact.instrument_errors(EV3.physics)[:, 0], abs=1e-9)
    assert np.array_equal(noisy.instrument_errors(EV3.physics), exact.instrument_errors(EV3.physics))
