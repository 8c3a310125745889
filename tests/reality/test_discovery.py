"""Discovering what a simulation lacks: on recordings made by the simulation itself with an effect concealed.

The proof that counts is on recordings of other worlds: `benchmarks/concealed`, and the practice cases below.
"""

from __future__ import annotations

import json
import os
import signal
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import start
from support.concealing import EV3, recorded, verdict_on

from gecar import notebook
from gecar.errors import InputError
from gecar.plots.reality.verdict import regimes_figure, verdict_figures
from gecar.reality.discovery import discover
from gecar.reality.fitting.initial_values import initial_values
from gecar.reality.fitting.parameters import free
from gecar.reality.invent.corrected_replay import with_formulas
from gecar.reality.invent.formula import NAMES, Formula, describe
from gecar.reality.materiality import Size
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.optimisation.cma_es import cma_es
from gecar.reality.prove.whiteness import whiteness
from gecar.reality.recordings.recording import Case, read_case, write_recording
from gecar.reality.recordings.split import ENOUGH_S, hold_out, with_enough
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.residuals.of_recording import residuals_of
from gecar.reality.verdict import Judgement, Misfit, Residual
from gecar.report.verdict import sentences
from gecar.world.effects import CATALOGUE

SHARED = Path(__file__).parents[3] / "shared" / "recordings"


def test_nothing_concealed_is_nothing_found() -> None:
    verdict = verdict_on()
    assert verdict.verdict == "nothing"
    assert verdict.effects == ()
    assert verdict.residual.white


def test_a_late_motor_is_named_with_its_delay() -> None:
    found = verdict_on("actuation_delay", "time_s", 0.03).effects
    assert [f.id for f in found] == ["actuation_delay"]
    interval = found[0].parameters["time_s"]
    assert interval.low < 0.03 < interval.high
    assert found[0].holdout_gain > found[0].null_95


def test_a_verdict_closes_the_gap_on_recordings_it_never_fitted() -> None:
    verdict = verdict_on("actuation_delay", "time_s", 0.03)
    assert not set(verdict.fitted_on) & set(verdict.judgement.recordings)
    assert verdict.judgement.gap_closed is not None
    assert verdict.judgement.gap_closed > 0.9


def test_the_gap_closed_counts_channels_made_worse_and_not_those_that_show_noise_alone() -> None:
    noise_alone = Misfit(1.0, 1.0, 0.9)
    channels = {
        "x_m": Misfit(1.0, 0.2, 0.1),
        "heading_deg": Misfit(0.3, 0.45, 0.2),
        "battery_v": noise_alone,
    }
    judged = Judgement(("run_07",), False, channels)
    assert channels["heading_deg"].gaps == pytest.approx((0.5, 1.25))
    assert judged.gap_closed == pytest.approx((8.0 - 0.75) / (9.0 + 0.5))


@pytest.mark.parametrize(
    ("after", "shows", "failed"), [(1.2, True, True), (1.02, True, False), (1.2, False, False)]
)
def test_a_test_fails_where_recordings_show_what_was_found_and_a_channel_is_made_worse(
    after: float, shows: bool, failed: bool
) -> None:
    assert Judgement(("run_07",), False, {"x_m": Misfit(1.0, after, 0.1)}, shows).failed == failed


def test_what_a_missing_effect_leaves_on_a_bench_is_not_white() -> None:
    evidence = verdict_on("viscous_friction", "coefficient_nms", 0.004, rig="bench").evidence
    assert not whiteness(evidence.motion.problem, evidence.motion.problem.known)[0]
    assert whiteness(evidence.motion.problem, evidence.motion.taken)[0]


@pytest.mark.parametrize(("share", "first"), [(1.0, 0.3), (0.01, 0.0)])
def test_breakaway_friction_is_looked_for_within_the_speeds_recorded(share: float, first: float) -> None:
    run = recorded(EV3, 1, rig="bench")
    slow = replace(
        run, left_angle_rad=run.left_angle_rad * share, right_angle_rad=run.right_angle_rad * share
    )
    speeds = [
        start["speed_rad_s"]
        for start in initial_values("static_friction", EV3, [slow], lambda tried: np.zeros((len(tried), 9)))
    ]
    assert min(speeds) == pytest.approx(first, abs=0.1)
    assert max(speeds) == pytest.approx(3.0) if first else max(speeds) < 0.3


@pytest.mark.parametrize(
    "missing", [("left_angle_rad", "right_angle_rad"), ("x_m", "y_m", "heading_rad"), ("reflection_pct",)]
)
def test_every_effect_has_places_to_start_from_whichever_columns_are_missing(
    missing: tuple[str, ...],
) -> None:
    run = recorded(EV3, 1)
    blind = replace(run, **{name: np.full_like(getattr(run, name), np.nan) for name in missing})
    for effect in CATALOGUE:
        freedom = free(EV3, [effect.id])
        begun = initial_values(
            effect.id, EV3, [blind], lambda tried: np.array([list(values.values()) for values in tried])
        )
        assert begun or effect.id == "slippery_patch"
        assert all(np.isfinite(freedom.vector({effect.id: s})).all() for s in begun)


def test_the_search_for_a_sensor_begins_nearer_than_an_edge_is_wide() -> None:
    """A fit sees an edge as far as the spot is wide, 8 mm: from 1 cm away or from nominal it never reached 2.9 mm."""
    mount = EV3.colour_sensor
    begun = initial_values("sensor_position", EV3, [], lambda tried: np.zeros((len(tried), 9)))
    for ahead, left in ((0.0, -0.0029), (0.0025, 0.0), (-0.003, 0.003)):
        apart = [np.hypot(s["ahead_m"] - mount.ahead - ahead, s["left_m"] - mount.left - left) for s in begun]
        assert min(apart) < 0.001


def test_a_bench_needs_no_camera() -> None:
    verdict = verdict_on("viscous_friction", "coefficient_nms", 0.004, rig="bench")
    assert "viscous_friction" in {verdict.effects[0].id, *verdict.effects[0].alternatives}


def test_the_verdicts_json_keeps_the_contract() -> None:
    table = verdict_on("actuation_delay", "time_s", 0.03).as_json()
    assert set(table) == {
        "verdict", "effects", "minor", "invented", "limits", "located", "holdout", "residual", "next_recording"
    }  # fmt: skip
    assert set(table["residual"]) == {"white", "p", "formula", "material", "size"}
    assert set(table["residual"]["size"]) >= {"mm", "deg", "arrival_s"}
    assert set(table["limits"]) == {effect.id for effect in CATALOGUE} - {"actuation_delay"}
    assert set(table["limits"]["backlash"]) == {"size", "unit"}
    assert set(table["effects"][0]) == {"id", "or", "parameters", "evidence"}
    assert set(table["effects"][0]["evidence"]) == {"holdout_gain", "null_95", "p"}
    assert set(table["holdout"]) == {"recordings", "channels", "before", "after", "floor", "gap_closed"}
    assert set(table["located"][0]) >= {"channel", "regime", "share", "p", "times_s", "place"}
    json.dumps(table)


def test_the_words_name_effect_size_and_proof() -> None:
    words = " ".join(sentences(verdict_on("actuation_delay", "time_s", 0.03)))
    assert "commands act late" in words
    assert "recordings not used for the fit" in words


def test_all_pictures_are_drawn() -> None:
    verdict = verdict_on("actuation_delay", "time_s", 0.03)
    figures = verdict_figures(verdict)
    assert set(figures) == {"gap", "where", "tried", "traces", "map"}


def test_where_no_channel_is_off_the_picture_says_so() -> None:
    verdict = verdict_on("actuation_delay", "time_s", 0.03)
    none = copy(verdict.evidence.where)
    none.energy = np.minimum(none.energy, 0.0)
    figure = regimes_figure(replace(verdict, evidence=replace(verdict.evidence, where=none)))
    assert "no channel is off by more than its noise" in [text.get_text() for text in figure.texts]


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_ctrl_c_ends_a_discovery_with_one_word_and_no_verdict(tmp_path: Path) -> None:
    (tmp_path / "case").mkdir()
    for seed in range(5):
        write_recording(recorded(EV3, seed), tmp_path / "case" / f"run_{seed}.csv")
    process = start("discover", tmp_path / "case", "--out", tmp_path / "out")
    assert process.stdout is not None
    assert any("fitting on" in line for line in process.stdout)  # the first, or after a word of compiling
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode in (130, -signal.SIGINT)
    assert said == "stopped\n"
    assert not (tmp_path / "out").exists()


def test_one_recording_is_split_by_time() -> None:
    parts = hold_out(Case("one", (recorded(EV3, 1),)))
    assert parts.by_time
    assert parts.fitted[0].t_s[-1] < parts.held[0].t_s[-1]
    assert np.flatnonzero(~np.isnan(parts.held[0].x_m[:100])).tolist() == [0]  # where the replay begins


def test_a_recording_set_aside_that_met_something_else_is_told_of() -> None:
    weak = EV3.with_effects({"viscous_friction": {"coefficient_nms": 0.003}})
    runs = [replace(recorded(EV3, seed), name=f"run_{seed}") for seed in range(3)]
    odd = replace(recorded(weak, 3), name="odd")
    verdict = discover(Case("made", (*runs, odd)), ["odd"])
    assert verdict.verdict == "unexplained"
    assert verdict.residual.material
    assert any(note.startswith("odd, which was held out, is off by") for note in verdict.notes)


def test_of_many_drives_enough_are_fitted_and_the_others_set_aside() -> None:
    runs = tuple(replace(recorded(EV3, 1), name=f"run_{number:02}") for number in range(30))
    parts = with_enough(hold_out(Case("many", runs), ["run_29"]))
    fitted = [int(run.name[-2:]) for run in parts.fitted]
    assert sum(run.duration_s for run in parts.fitted) <= ENOUGH_S
    assert np.diff([-1, *fitted, 29]).max() <= 5  # no stretch of the time is left out
    for turn in (2, 3, 4):  # nor a kind of drive, where kinds take turns
        assert len({number % turn for number in fitted}) == turn
    assert parts.spare == 29 - len(fitted)
    assert next(run.name for run in parts.held) == "run_29"
    assert sorted(run.name for run in (*parts.fitted, *parts.held)) == [run.name for run in runs]
    long = tuple(replace(run, t_s=20.0 * run.t_s) for run in runs[:8])
    benches = tuple(replace(run, setup=replace(run.setup, rig="bench")) for run in runs)
    for kept in (runs[:8], long, benches):
        whole = hold_out(Case("whole", kept))
        assert with_enough(whole) is whole


def test_an_unknown_holdout_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="--holdout: found 'run_9'"):
        hold_out(Case("made", (recorded(EV3, 1), recorded(EV3, 2))), ["run_9"])


def test_cma_es_finds_the_bottom_of_a_jagged_bowl() -> None:
    def jagged(z: np.ndarray) -> float:
        return float(np.sum((z - 0.7) ** 2) + 0.05 * np.sum(np.cos(40 * z)))

    bounds = np.full(3, -5.0), np.full(3, 5.0)
    found, cost = cma_es(
        lambda tried: np.array([jagged(z) for z in tried]),
        np.zeros(3),
        np.ones(3),
        bounds,
        np.random.default_rng(0),
        60,
    )
    assert np.all(np.abs(found - 0.7) < 0.2)
    assert cost < 0.0


def test_a_formula_is_found_on_one_fitted_recording_alone_and_none_in_noise() -> None:
    recording, slow = recorded(EV3, 1), EV3.with_effects({"motor_gain_asymmetry": {"right_minus_left": 0.1}})
    run = residuals_of(recording, estimate_noise([recording], EV3.physics, 1.0), 1.0, None)
    assert describe([run], EV3.physics) == ()
    formulas = describe([run], slow.physics)
    assert {f.target for f in formulas} >= {"the left wheel's speed", "the right wheel's speed"}
    assert all(0.15 < f.share < 1.0 for f in formulas)


def test_a_formula_that_harms_a_channel_says_so() -> None:
    verdict = verdict_on("actuation_delay", "time_s", 0.03)
    described = {"x_m": Misfit(0.1, 0.05, 0.01), "y_m": Misfit(0.1, 0.2, 0.01)}
    harmed = replace(
        verdict, verdict="unexplained", residual=Residual(False, 0.01, Size(), True, "x", described)
    )
    assert "x_m 0.1000 to 0.0500, y_m 0.1000 to 0.2000 (worse)" in " ".join(sentences(harmed))


def test_every_term_of_a_formula_has_one_name() -> None:
    assert len(set(NAMES)) == len(NAMES)


needs_practice = pytest.mark.skipif(
    not (SHARED / "practice").is_dir(), reason="the practice cases (../shared/recordings) are not here"
)


@needs_practice
@pytest.mark.slow
def test_a_floor_that_leans_in_a_3d_world_is_found() -> None:
    case = read_case(SHARED / "practice" / "p08")
    verdict = discover(replace(case, recordings=case.recordings[:4]))  # in a fifth of the time of all
    assert [f.id for f in verdict.effects] == ["floor_tilt"]
    tilt = verdict.effects[0].parameters["x_rad"]
    assert tilt.low < 0.06 < tilt.high
    assert verdict.judgement.gap_closed is not None
    assert verdict.judgement.gap_closed > 0.9


@pytest.mark.skipif(
    not (SHARED / "real").is_dir(), reason="the real recordings (../shared/recordings) are not here"
)
@pytest.mark.slow
def test_a_real_motor_is_predicted_within_a_hundredth() -> None:
    held = ["step_+040", "step_-020", "step_-100"]
    case = read_case(SHARED / "real" / "ev3_motor_a")
    steps = tuple(
        run for run in case.recordings if run.name != "sine_1hz"
    )  # in two thirds of the time of all
    case = replace(case, recordings=steps)
    angle = discover(case, held).judgement.channels["left_angle_deg"]
    assert angle.before > 0.5
    assert angle.after < 0.009


def test_a_notebook_shows_a_verdict_in_words_tables_and_pictures() -> None:
    verdict = verdict_on("actuation_delay", "time_s", 0.03)
    assert "commands act late" in str(notebook.show(verdict))
    assert "<img alt='The gap on held-out recordings'" in notebook.show(verdict)._repr_html_()
    assert notebook.plot(verdict, "tried").get_axes()
    with pytest.raises(InputError, match="picture: found 'nonsense', expected one of gap, where"):
        notebook.plot(verdict, "nonsense")


def test_a_formula_added_to_a_replay_takes_its_speed_error_away() -> None:
    recording = recorded(EV3, 1)
    replayer = replayer_of(recording)
    rows, _, poses, _ = replayer.play(EV3.physics)
    slow = Formula("the left wheel's speed", "rad/s", ((0.5, "1"),), 0.9)
    moved, path = with_formulas([slow])(replayer, rows, poses)
    assert moved[-1, 0] - rows[-1, 0] == pytest.approx(0.5 * (replayer.t[-1] - replayer.t[0]))
    assert np.array_equal(moved[:, 4:7], rows[:, 4:7])
    assert path.shape == poses.shape


def test_full_duty_that_gives_more_is_named() -> None:
    robot = EV3.with_effects({"full_duty": {"gain": 0.03}})
    runs = tuple(recorded(robot, seed, rig="bench", most=10) for seed in range(5))
    assert [f.id for f in discover(Case("made", runs)).effects] == ["full_duty"]
