"""Where simulation and reality part, and hard cases of what is missing: on recordings the simulation itself made."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, recorded, verdict_on

from gecar.reality.discovery import discover
from gecar.reality.locate.misfit_energy import misfit_energy, noise_inflation
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.residuals.of_recording import RecordingResiduals, residuals_of
from gecar.reality.selection.problem import Problem
from gecar.reality.verdict import Verdict
from gecar.world.course.course import load_course
from gecar.world.effects import CATALOGUE
from gecar.world.robot import Robot


def strip_of(recording: Recording) -> RecordingResiduals:
    return residuals_of(recording, estimate_noise([recording], EV3.physics, 1.0), 1.0, None)


def found_in(robot: Robot, *missing: str) -> Verdict:
    runs = (recorded(robot, seed) for seed in range(5))
    gone = [replace(run, **{name: np.full_like(run.t_s, np.nan) for name in missing}) for run in runs]
    return discover(Case("made", tuple(gone)))


def test_a_stretch_s_start_is_a_nuisance_however_far_off() -> None:
    run = recorded(EV3, 1)
    turned = replace(
        run,
        x_m=0.7 - run.y_m,
        y_m=run.x_m - 3.0,
        heading_rad=run.heading_rad + 0.5 * math.pi,
        left_angle_rad=run.left_angle_rad + 40.0,
    )
    there, moved = (
        misfit_energy(strip_of(r), EV3.physics, EV3.physics, EV3.physics, 90, 0.1) for r in (run, turned)
    )
    assert moved[0].sum(axis=1) == pytest.approx(there[0].sum(axis=1), rel=0.15)
    per_sample = there[0].sum(axis=1)[[0, 1, 4, 5, 6]] / there[2].sum(axis=1)[[0, 1, 4, 5, 6]]
    assert (per_sample < 1.5).all()


def test_misfit_energy_shows_the_sensor_and_the_time_of_what_went_wrong() -> None:
    run = recorded(EV3, 1)
    pushed = run.heading_rad + np.where(run.t_s > 5.0, 0.2, 0.0)
    before, _, samples, _ = misfit_energy(
        strip_of(replace(run, heading_rad=pushed)), *(EV3.physics,) * 3, 80, 0.1
    )
    excess = before - samples
    assert np.argmax(excess.sum(axis=1)) == 6
    assert excess[6, 40:60].sum() > 0.9 * excess[6].sum()


def test_lingering_noise_is_told_by_the_typical_bin_unless_something_is_unexplained() -> None:
    rng = np.random.default_rng(0)
    lingering = np.repeat(rng.normal(size=(7, 1, 300)), 2, axis=2) * 40.0
    sums, samples = np.zeros((8, 1, 600)), np.full((8, 1, 600), 20.0)
    sums[6] = lingering[0]
    sums[0] = lingering[1]
    noise = noise_inflation(sums, samples, explained=True)
    assert noise[6] == 20.0  # at its most
    assert noise[0] == 1.0  # encoders do not linger
    assert noise_inflation(sums, samples, explained=False)[6] == 6.0


def test_what_is_pointed_at_first_is_the_loudest_sensor_and_its_loudest_spans() -> None:
    verdict = verdict_on("actuation_delay", "time_s", 0.03)
    where, first = verdict.evidence.where, verdict.located[0]
    assert first.channel in {"left_angle", "right_angle"}
    assert int(np.argmax(where.stretch_energy.sum(axis=(1, 2)))) == 0
    of = next(k for k, s in enumerate(where.runs) if s.recording.name == first.recording)
    spans = np.zeros(where.stretch_energy.shape[2], bool)
    for start, end in first.times_s:
        spans[round(start / 0.2) : round(end / 0.2)] = True
    assert where.stretch_energy[0, of, spans].min() >= where.stretch_energy[0, of, ~spans].max()


def test_a_recording_set_aside_is_pointed_at_where_it_shows_most() -> None:
    robot = EV3.with_effects({"viscous_friction": {"coefficient_nms": 0.003}})
    calm = (recorded(robot, seed, most=3) for seed in range(3))
    verdict = discover(Case("made", (*calm, recorded(robot, 3, most=9))), ["run_3"])
    assert [f.id for f in verdict.effects] == ["viscous_friction"]
    assert verdict.located[0].recording == "run_3"


@pytest.mark.parametrize(
    ("cycles_per_rev", "missing"), [(7.0, ()), (6.0, ("left_angle_rad", "right_angle_rad"))]
)
def test_a_ripple_is_found_whatever_the_phases_of_the_two_motors(
    cycles_per_rev: float, missing: tuple[str, ...]
) -> None:
    phases = {"phase_rad": -1.55, "right_lead_rad": 0.47}
    ripple = {"amplitude_nm": 0.036, "cycles_per_rev": cycles_per_rev, **phases}
    robot = EV3.with_effects({"torque_ripple": ripple})
    verdict = found_in(robot, *missing)
    if missing:  # a camera alone tells no cycles for sure: it may abstain, and names nothing else
        assert verdict.verdict != "nothing"
        assert {f.id for f in verdict.effects} <= {"torque_ripple"}
        return
    assert [f.id for f in verdict.effects] == ["torque_ripple"]
    cycles = verdict.effects[0].parameters["cycles_per_rev"]
    assert cycles.low < cycles_per_rev < cycles.high


def test_a_patch_smaller_than_a_robot_is_found() -> None:
    patch = {"x_m": 1.05, "y_m": 0.52, "radius_m": 0.1, "coefficient": 0.08}
    verdict = found_in(EV3.with_effects({"slippery_patch": patch}))
    assert [f.id for f in verdict.effects] == ["slippery_patch"]
    for name, value in patch.items():
        assert verdict.effects[0].parameters[name].value == pytest.approx(value, abs=0.03)


def test_an_offset_that_clips_black_is_not_told_as_a_gain() -> None:
    concealed = EV3.with_effects({"sensor_gain": {"gain": 1.0, "offset_pct": -6.0}})
    runs = [seen_on_the_course(seed, concealed) for seed in range(4)]
    verdict = discover(Case("made", tuple(runs)))
    assert [f.id for f in verdict.effects] == ["sensor_gain"]
    found = verdict.effects[0].parameters
    assert found["gain"].low < 1.0 < found["gain"].high
    assert found["offset_pct"].low < -6.0 < found["offset_pct"].high


@pytest.mark.parametrize("bumped", [False, True])
def test_a_line_lies_elsewhere_beside_unexplained_motion_only_if_it_does_in_all_recordings(
    monkeypatch: pytest.MonkeyPatch, bumped: bool
) -> None:
    shifted = EV3.with_effects({"line_shift": {"dx_m": 0.0, "dy_m": 0.02, "angle_rad": 0.0}})
    slow = EV3.with_effects({"viscous_friction": {"coefficient_nms": 0.001}})
    runs = [seen_on_the_course(seed, EV3 if bumped else shifted, slow, -0.3) for seed in (1, 2, 3, 5)]
    if bumped:  # the camera's frame lies elsewhere in each recording
        rng = np.random.default_rng(0)
        runs = [
            replace(run, x_m=run.x_m + rng.normal(0, 0.02), y_m=run.y_m + rng.normal(0, 0.02)) for run in runs
        ]
    monkeypatch.setattr(Problem, "with_clocks", lambda *_: None)
    catalogue = [effect for effect in CATALOGUE if effect.id in ("line_shift", "sensor_delay", "spot_size")]
    verdict = discover(Case("made", tuple(runs)), catalogue=catalogue)
    assert verdict.residual.material
    assert ("line_shift" in {f.id for f in verdict.effects}) is not bumped


def seen_on_the_course(
    seed: int, robot: Robot, moved: Robot = EV3, up_m: float = 0.0, drift_m_s: float = 0.0
) -> Recording:
    """Let a robot's colour sensor look at the paper's course on its way, with 0.8 % of noise, in whole percent.

    The way is that of another robot, ``up_m`` farther up, on a floor that carries it on.
    """
    run = recorded(moved, seed)
    run = replace(run, y_m=run.y_m + up_m + drift_m_s * run.t_s)
    run = replace(run, setup=replace(run.setup, course="paper"))
    run = replace(run, reflection_pct=np.zeros(len(run.t_s)))
    beside = residuals_of(run, estimate_noise([run], EV3.physics, 1.0), 1.0, load_course("paper"))
    beside = beside.with_path(EV3.physics, np.ones(3))
    noise = np.random.default_rng(seed).normal(0.0, 0.8, len(run.t_s))
    return replace(run, reflection_pct=np.clip(np.round(beside.readings(robot.physics) + noise), 0.0, 100.0))


def test_readings_set_aside_that_met_another_floor_are_told_of() -> None:
    """A stain that only one drive crosses, and that is not fitted on."""
    runs = [replace(seen_on_the_course(seed, EV3), name=f"run_{seed}") for seed in (1, 2, 3)]
    odd = replace(seen_on_the_course(5, EV3), name="odd")
    odd = replace(odd, reflection_pct=np.round(0.8 * odd.reflection_pct))
    catalogue = [effect for effect in CATALOGUE if effect.id in ("sensor_delay", "spot_size")]
    verdict = discover(Case("made", (*runs, odd)), ["odd"], catalogue=catalogue)
    assert verdict.verdict == "unexplained"
    assert verdict.residual.size.reading_pct > 7.5
    assert any(note.startswith("odd, which was held out, has readings") for note in verdict.notes)
