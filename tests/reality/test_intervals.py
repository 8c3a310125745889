"""Intervals: as long as few recordings and flat valleys ask for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student
from support.concealing import EV3, motion_of, recorded
from support.linear_case import bumps, linear, linear_problem

from gecar.reality import discovery
from gecar.reality.fitting.model import Model
from gecar.reality.fitting.parameters import free
from gecar.reality.prove import confirmation
from gecar.reality.prove.confirmation import confirmed
from gecar.reality.residuals.nuisances import Nuisances, SensorPath
from gecar.reality.selection.problem import Problem, problem_of
from gecar.reality.selection.stepwise import explain
from gecar.reality.uncertainty.intervals import (
    _along_surer_paths,
    contains_neutral,
    half_widths,
    hulls,
    intervals,
    model_error,
    weakest_absent,
)
from gecar.reality.verdict import Interval
from gecar.world.effects import BY_ID

VISCOUS, INERTIA, TRACK = "viscous_friction", "rotor_inertia", "track_width"
SIZE = BY_ID[VISCOUS].parameters[0].worthwhile


def fitted(problem: Problem, *effects: str) -> Model:
    return problem.estimator.fit(effects, {})


@pytest.mark.parametrize("recordings", [1, 4])
def test_intervals_hold_the_truth_as_often_as_they_say(recordings: int) -> None:
    held = []
    for seed in range(200):
        response = {VISCOUS: bumps(1, recordings, 0.2)}
        problem = linear_problem(linear({VISCOUS: 5.0}, response, seed, recordings))
        model = fitted(problem, VISCOUS)
        held.append(abs(model.z[0] - 5.0) < half_widths(problem.estimator, model)[0])
    assert np.mean(held) > 0.92


def test_a_model_without_parameters_has_no_intervals() -> None:
    problem = linear_problem(linear({}, {VISCOUS: bumps(1, 4, 0.2)}))
    assert half_widths(problem.estimator, fitted(problem)).shape == (0,)


def test_where_recordings_disagree_few_of_them_widen_an_interval_by_student_s_t() -> None:
    """One recording says 5, the other three 4: with three degrees of freedom, 3.18 standard errors, not 1.96."""
    problem = linear_problem(linear({VISCOUS: 4.0}, {VISCOUS: np.tile(bumps(1, 1, 1.0), 4)}))
    residuals = problem.residuals
    noise = residuals.noise.copy()  # type: ignore[attr-defined]
    noise[:600] += residuals.responses[VISCOUS][:600]  # type: ignore[attr-defined]
    problem = linear_problem(type(residuals)(residuals.responses, residuals.truth, noise, 4))  # type: ignore[attr-defined]
    model = fitted(problem, VISCOUS)
    estimates = np.array([5.0, 4.0, 4.0, 4.0])
    expected = student.ppf(0.975, 3) * np.std(estimates, ddof=1) / 2.0
    assert half_widths(problem.estimator, model)[0] == pytest.approx(expected, rel=0.15)


def test_the_only_recording_is_left_out_by_sixths() -> None:
    """Three parts hardly tell how much they differ by: Student's t is 4.3 with two degrees of freedom, 2.6 with 5."""
    problem = linear_problem(linear({VISCOUS: 5.0}, {VISCOUS: bumps(1, 1, 0.2)}, count=1))
    blocks, t_s = problem.estimator.blocks, problem.residuals.index.t_s
    assert np.unique(blocks.folds).tolist() == [0, 1, 2]
    assert np.unique(blocks.parts).tolist() == [0, 1, 2, 3, 4, 5]
    assert np.all(np.diff(blocks.parts[np.argsort(t_s, kind="stable")]) >= 0)


@pytest.mark.parametrize(("slow_mm", "widest_mm"), [(1.74, 8.54), (0.59, 5.47)])
def test_a_spot_may_be_as_wide_as_it_looks_where_what_a_model_leaves_is_no_noise_of_the_path(
    slow_mm: float, widest_mm: float
) -> None:
    """Beside a radio that drops out edges seemed sharper than the path was known: a spot of 8 mm was told as 4.8."""
    path = SensorPath(np.zeros((1, 3)), 0.0, slow_mm / 1e3, 0.59e-3)
    run = SimpleNamespace(nuisances=Nuisances(path=path))
    estimator = SimpleNamespace(residuals=SimpleNamespace(recordings=(run, run)))
    assert _along_surer_paths(estimator, 5.47e-3) == pytest.approx(widest_mm / 1e3, abs=1e-5)  # type: ignore[arg-type]


def test_a_profile_refits_the_others() -> None:
    """Two effects that nearly do the same: each alone is known to nothing, whatever the other is held at."""
    nearly = {VISCOUS: bumps(1, 4, 0.3), INERTIA: bumps(1, 4, 0.3) + 1e-3 * bumps(2, 4, 1.0)}
    problem = linear_problem(linear({VISCOUS: 10.0}, nearly))
    model = fitted(problem, VISCOUS, INERTIA)
    found = intervals(problem.estimator, model)[VISCOUS]["coefficient_nms"]
    assert found.low / SIZE < 6.0
    assert found.high / SIZE > 14.0


def test_an_interval_that_contains_neutral_is_told() -> None:
    for size, contained in ((0.0, True), (6.0, False)):
        problem = linear_problem(linear({VISCOUS: size}, {VISCOUS: bumps(1, 4, 1.0)}))
        model = fitted(problem, VISCOUS)
        assert contains_neutral(model, VISCOUS, intervals(problem.estimator, model)) is contained


@pytest.mark.parametrize(
    ("effect", "label", "value", "near", "contained"),
    [
        ("track_width", "scale", 0.9988, 0.9998, True),
        ("track_width", "scale", 0.9988, 1.0002, True),
        ("track_width", "scale", 0.9988, 0.9993, False),
        ("track_width", "scale", 1.0012, 1.0002, True),
        ("track_width", "scale", 1.0012, 1.0007, False),
        ("speed_limit", "speed_rad_s", 10.0, 50.0, True),
        ("speed_limit", "speed_rad_s", 10.0, 11.0, False),
    ],
)
def test_what_one_of_so_many_effects_comes_to_by_chance_is_not_named(
    effect: str, label: str, value: float, near: float, contained: bool
) -> None:
    model = SimpleNamespace(parameters=free(EV3, [effect]))
    far = value - 0.1 if near > value else value + 0.1
    spans = {effect: {label: Interval(value, *sorted((near, far)), "-")}}
    assert contains_neutral(model, effect, spans) is contained  # type: ignore[arg-type]


@pytest.mark.parametrize("on_bench", [True, False])
def test_a_constant_of_a_motor_on_a_bench_is_none_of_many_that_come_by_chance(on_bench: bool) -> None:
    """Without dry friction of 13 mN m (for 17) a real motor was predicted five times worse, to 0.021."""
    model = SimpleNamespace(parameters=free(EV3, ["coulomb_friction"]))
    step = SimpleNamespace(effect="coulomb_friction", gain=100.0)
    spans = {"coulomb_friction": {"torque_nm": Interval(0.0127, 0.0099, 0.0155, "N m")}}
    absent = weakest_absent(model, [step], spans, on_bench=on_bench)  # type: ignore[arg-type,list-item]
    assert absent is (None if on_bench else step)


@pytest.mark.parametrize(
    ("low", "grip", "named"), [(0.04, 0.8, True), (0.03, 0.8, False), (0.03, 0.4, True), (0.0, 0.5, False)]
)
def test_a_patch_has_edges_or_grips_less_than_half_as_much(low: float, grip: float, named: bool) -> None:
    model = SimpleNamespace(parameters=free(EV3, ["slippery_patch"]))
    spans = {label: Interval(1.0, 0.9, 1.1, "m") for label in ("x_m", "y_m")}
    spans |= {"radius_m": Interval(0.08, low, 0.1, "m"), "coefficient": Interval(0.1, 0.1, grip, "-")}
    assert contains_neutral(model, "slippery_patch", {"slippery_patch": spans}) is not named  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("gain", "offset", "darker_pct", "doubtful", "contained"),
    [((0.99, 2.0), (-40.0, 0.2), 20.5, True, True), ((0.99, 2.0), (-40.0, 0.2), 20.5, False, False),
     ((1.1, 2.0), (-40.0, 0.2), 20.5, True, False), ((0.99, 2.0), (-0.9, -0.2), 0.5, True, True),
     ((0.99, 2.0), (-2.0, -1.0), 1.5, True, False)],
)  # fmt: skip
def test_along_a_path_in_doubt_gain_or_offset_must_be_there_and_worth_a_name(
    gain: tuple[float, float], offset: tuple[float, float], darker_pct: float, doubtful: bool, contained: bool
) -> None:
    """Beside motors that ignored commands, a white floor of 145 % (99 or more), 21 % less (0 or less), was named.

    Beside a turret that swings it was one of 119 % (99.8 or more), 0.5 % less (0.2 or more).
    """
    parameters = free(EV3, ["sensor_gain"])
    z = parameters.vector({"sensor_gain": {"gain": 1.45, "offset_pct": -darker_pct}})
    spans = {"gain": Interval(1.45, *gain, "-"), "offset_pct": Interval(-darker_pct, *offset, "%")}
    model = SimpleNamespace(parameters=parameters, z=z)
    assert contains_neutral(model, "sensor_gain", {"sensor_gain": spans}, doubtful) is contained  # type: ignore[arg-type]


def test_an_effect_whose_interval_contains_neutral_is_a_candidate_and_not_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    truth, responses = {VISCOUS: 3.0, TRACK: 4.0}, {VISCOUS: bumps(1, 4, 1.0), TRACK: bumps(3, 4, 1.0)}
    held: Any = linear(truth, responses, seed=5)
    monkeypatch.setattr(confirmation, "gaps", lambda *_: (1.0, 1.0))  # of no drives
    proof = confirmed(explain(linear_problem(linear(truth, responses))), held)
    assert {step.effect for step in proof.explained.steps} == {VISCOUS, TRACK}

    def wide(*given: object) -> dict:
        spans = intervals(*given)  # type: ignore[arg-type]
        for label, span in spans.get(VISCOUS, {}).items():
            spans[VISCOUS][label] = replace(span, low=0.0)
        return spans

    monkeypatch.setattr(discovery, "intervals", wide)
    stage = discovery._with_intervals(SimpleNamespace(tell=print, seed=0), proof, held)  # type: ignore[arg-type]
    assert [step.effect for step in stage.explained.steps] == [TRACK]
    assert stage.explained.taken.effects == (TRACK,)
    assert [step.effect for step in stage.candidates] == [VISCOUS]


def test_the_interval_of_a_patch_holds_the_truth_and_follows_the_seed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where derivatives say nothing, a random walk does; short here."""
    monkeypatch.setattr("gecar.reality.uncertainty.mcmc.STEPS", 800)
    patch = {"x_m": 1.05, "y_m": 0.52, "radius_m": 0.1, "coefficient": 0.08}
    runs = [recorded(EV3.with_effects({"slippery_patch": patch}), k, seconds=4.0) for k in range(2)]
    residuals = motion_of(runs)
    estimator = problem_of(residuals, EV3, ("slippery_patch",)).estimator
    model = estimator.fit(("slippery_patch",), {"slippery_patch": patch})
    found = intervals(estimator, model, seed=1)["slippery_patch"]
    assert all(found[name].low < value < found[name].high for name, value in patch.items())
    assert intervals(estimator, model, seed=1)["slippery_patch"] == found
    assert intervals(estimator, model, seed=2)["slippery_patch"] != found


def test_a_size_known_by_its_product_with_a_share_is_not_neutral() -> None:
    """Commands of 10 % and more never fall into a dead band of 1 %: they tell how much of it each of them loses."""
    effect = "dead_band"
    runs = [recorded(EV3.with_effects({effect: {"duty_pct": 1.0, "offset_share": 1.0}}), k) for k in range(3)]
    residuals = motion_of(runs)
    estimator = problem_of(residuals, EV3, (effect,)).estimator
    model = estimator.fit((effect,), {effect: {"duty_pct": 3.0, "offset_share": 0.3}})
    assert half_widths(estimator, model)[0] > model.z[0]
    spans = intervals(estimator, model)
    assert not contains_neutral(model, effect, spans)
    assert 0.5 < spans[effect]["duty_pct"].low < 1.0 < spans[effect]["duty_pct"].high


def test_a_threshold_between_two_levels_of_duty_is_put_into_the_middle() -> None:
    """Of 20 % nothing comes; a step in which a command changes from 20 to 30 % has 25 %, and drives."""
    effect = "dead_band"
    runs = [
        recorded(EV3.with_effects({effect: {"duty_pct": 22.0, "offset_share": 0.0}}), k) for k in range(3)
    ]
    estimator = problem_of(motion_of(runs), EV3, (effect,)).estimator
    model = estimator.searched(estimator.fit((effect,), {effect: {"duty_pct": 29.0, "offset_share": 0.0}}))
    found = intervals(estimator, model)[effect]["duty_pct"]
    assert found.value == pytest.approx(22.5, abs=0.3)
    assert 18.5 < found.low < 20.1
    assert 24.9 < found.high < 26.5


def test_parameters_known_by_their_product_alone_go_as_far_as_a_profile_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A dead band of 1 % with an offset of 1 is hardly one of 2 % with 0.5: a straight line leaves that valley."""
    effects = ("dead_band", "rotor_inertia")
    runs = [recorded(EV3, 0)]
    residuals = motion_of(runs)
    estimator = problem_of(residuals, EV3, effects).estimator
    start = {"dead_band": {"duty_pct": 2.0, "offset_share": 0.5}, "rotor_inertia": {"scale": 0.9}}
    parameters = free(EV3, effects)
    model = estimator.at(estimator.fit(effects, start), parameters.vector(start))
    shared, own = (np.resize(bumps(k, 1, 40.0), len(model.errors)) for k in (1, 2))
    slopes = np.stack([shared, shared + 0.3 * own, own], axis=1)
    monkeypatch.setattr(type(estimator), "own_sensitivities", lambda *_: slopes)
    monkeypatch.setattr("gecar.reality.uncertainty.intervals.reaches", lambda *_: (0.9, 1.7))
    found = intervals(estimator, model)
    band, inertia = found["dead_band"]["duty_pct"], found["rotor_inertia"]["scale"]
    # 2 % of duty, by as much as the profile says, and by what the law is off by.
    assert (band.low, band.high) == pytest.approx((1.07, 3.71), abs=0.03)
    assert inertia.high - inertia.low < 0.2


def test_waves_a_turn_are_known_to_a_part_of_a_visible_change_even_at_their_neutral_value() -> None:
    """Once a turn was known to 0.02 %: a share of what it differs from 1 is nothing."""
    _, waves, *_ = free(EV3, ("torque_ripple",)).coordinates
    assert waves.parameter.label == "cycles_per_rev"
    assert model_error(waves, 0.0) * waves.parameter.shape_step == pytest.approx(0.00075)


def test_intervals_hold_for_robots_with_and_without_what_is_too_small_to_be_named() -> None:
    named, beside = Interval(7.0, 5.3, 8.7, "ms"), Interval(9.7, 8.2, 11.2, "ms")
    assert hulls({"time": beside}, {"time": named}) == {"time": Interval(7.0, 5.3, 11.2, "ms")}
