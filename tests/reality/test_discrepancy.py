"""What a simulation is off by where nothing worth a name is missing: small changes, and physics in no list."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.signal import lfilter
from support.concealing import motion_of, recorded
from support.linear_case import EV3, bumps, linear, linear_problem

from gecar.cli.commands.discover import discover as command
from gecar.errors import InputError
from gecar.reality.discovery import discover
from gecar.reality.fitting.discrepancy import discrepancy
from gecar.reality.fitting.initial_values import patches
from gecar.reality.fitting.model import Model, Step
from gecar.reality.fitting.parameters import free
from gecar.reality.materiality import Material, Size
from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.optimisation.least_squares import Minimum, cost
from gecar.reality.recordings.recording import Case, Recording, write_recording
from gecar.reality.residuals import parting
from gecar.reality.residuals.of_case import motion_residuals
from gecar.reality.residuals.parting import Sizes
from gecar.reality.residuals.threads import Threads
from gecar.reality.selection import problem as selection_problem
from gecar.reality.selection.problem import problem_of, worth_a_name
from gecar.reality.selection.stepwise import explain, left_share, left_share_of_each
from gecar.reality.selection.thresholds import LARGE, SMALL
from gecar.report.verdict import words
from gecar.world.effects import CATALOGUE
from gecar.world.robot import load_robot

FOUR = ("viscous_friction", "rotor_inertia", "track_width", "wheel_radius")
RESPONSES = {effect: bumps(seed, 4, 1.0) for seed, effect in enumerate(FOUR, start=1)}
SLOPES = np.stack(list(RESPONSES.values()), axis=1)
INDEX = linear({}, RESPONSES).index
BLOCKS = Blocks(INDEX)
SIZES = np.full(len(FOUR), SMALL), np.full(len(FOUR), LARGE), len(FOUR)


def test_small_changes_are_noise_of_unit_variance_and_so_is_their_sum_with_noise() -> None:
    rng, drawn = np.random.default_rng(0), []
    for _ in range(300):
        errors = rng.normal(size=len(SLOPES)) + SLOPES @ rng.normal(0.0, SMALL, len(FOUR))
        if not drawn:
            made = discrepancy(SLOPES, errors, BLOCKS, INDEX.channel, *SIZES)
            made = replace(made, root_weight=np.ones(len(errors)))
        drawn.append(made.basis.T @ made.whitened(errors))
    assert np.std(drawn, axis=0) == pytest.approx(np.ones(len(FOUR)), abs=0.15)


def test_small_changes_are_told_within_their_bounds() -> None:
    true = np.array([0.4, -0.3, 0.0, 5.0])
    errors = np.random.default_rng(0).normal(size=len(SLOPES)) - SLOPES @ true
    made = discrepancy(SLOPES, errors, BLOCKS, INDEX.channel, *SIZES)
    found = made.small_changes(errors, np.full(4, -10.0), np.full(4, 10.0))
    assert found == pytest.approx(true, abs=0.1)
    kept = made.small_changes(errors, np.full(4, -1.0), np.array([1.0, 0.0, 1.0, 1.0]))
    assert kept[3] == pytest.approx(1.0)
    assert np.all(kept <= [1.0, 1e-9, 1.0, 1.0])


def test_small_changes_without_bounds_are_solved_for_beside_those_of_parameters() -> None:
    errors = np.random.default_rng(1).normal(size=len(SLOPES)) - SLOPES @ np.array([0.4, -3.0, 0.3, 0.6])
    made = discrepancy(SLOPES, errors, BLOCKS, INDEX.channel, *SIZES[:2], 2)
    found = made.small_changes(errors, np.full(2, -1.0), np.full(2, 1.0))
    rows = np.vstack([made.spread[:, None] * made.back, np.eye(4)])
    inside = (errors * made.scale * made.root_weight) @ made.basis
    bounds = np.array([1.0, 1.0, np.inf, np.inf]) / made.small
    whole = lsq_linear(rows, -np.r_[inside, np.zeros(4)], (-bounds, bounds), "bvls").x * made.small
    assert found == pytest.approx(whole[:2], abs=1e-6)
    assert found[1] == -1.0


def test_physics_in_no_list_makes_a_channel_as_noisy_as_it_leaves_it() -> None:
    unlisted = bumps(9, 4, 2.0)
    noise = np.random.default_rng(0).normal(size=len(unlisted))
    made, none = (discrepancy(SLOPES, e, BLOCKS, INDEX.channel, *SIZES) for e in (noise + unlisted, noise))
    assert made.ratios[0] == pytest.approx(
        1.0 + 50 * np.mean(unlisted**2) * 0.7, rel=0.3
    )  # spans of 50 samples
    assert none.ratios[0] < 1.3


def test_what_a_model_is_off_by_for_a_moment_counts_as_what_lasts_does() -> None:
    """Once up and once down within a tenth of a second, every half second: their mean over the span is nothing."""
    rows = np.tile(np.r_[[5.0] * 5, [-5.0] * 5, np.zeros(40)], len(INDEX.t_s) // 50)
    assert BLOCKS.variances(rows)[0] == pytest.approx(5.0**2 * 5 * 0.2, rel=0.05)
    assert BLOCKS.variances(np.ones(len(rows)))[0] == pytest.approx(50.0)


def test_many_small_changes_name_nothing() -> None:
    explained = explain(linear_problem(linear({"viscous_friction": 0.6, "rotor_inertia": -0.5}, RESPONSES)))
    assert explained.steps == ()
    assert not explained.unexplained


def test_an_effect_beside_small_changes_and_unlisted_physics_is_named_alone() -> None:
    case = linear({"viscous_friction": 0.6, "rotor_inertia": -0.5, "track_width": 4.0}, RESPONSES)
    case = replace(case, noise=case.noise + bumps(9, 4, 0.3))
    explained = explain(linear_problem(case))
    assert [step.effect for step in explained.steps] == ["track_width"]
    assert explained.taken.z == pytest.approx([4.0], abs=0.2)
    assert not explained.unexplained


def sizes_of(runs: list[Recording]) -> Sizes:
    noise = estimate_noise(runs, EV3.physics, 1.0)
    return Sizes(motion_residuals(runs, noise, 1.0, Threads(1)).recordings, sensor=False)


def test_sizes_are_millimetres_and_degrees_that_anybody_can_check() -> None:
    runs = [recorded(EV3, seed) for seed in range(3)]
    sizes, known = sizes_of(runs), EV3.physics
    narrow = EV3.with_effects({"track_width": {"scale": 0.97}}).physics
    left, apart = sizes.left(known), sizes.apart(known, narrow)
    assert left.mm_1m < 2.0
    assert left.deg_1m < 0.3
    # Half a track of 60 mm: a metre of spinning on the spot is 16.7 rad, of which 3 % are 28.6 degrees.
    assert 3.0 < apart.deg_1m < 28.7
    assert 3.0 < sizes.left(narrow).deg_1m <= 1.1 * apart.deg_1m


def wandering(run: Recording, seed: int) -> Recording:
    """Return a recording whose camera is off by 1.5 mm and 0.45 degrees more, by errors that last for 0.3 s."""
    rng, keep = np.random.default_rng(seed), np.exp(-0.01 / 0.3)
    noise = rng.normal(size=(3, len(run.t_s) + 500))
    slow = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], noise)[:, 500:]
    x, y, heading = slow * np.array([[0.0015], [0.0015], [np.radians(0.45)]])
    return replace(run, x_m=run.x_m + x, y_m=run.y_m + y, heading_rad=run.heading_rad + heading)


def test_slow_errors_of_a_camera_are_not_left_by_the_robot() -> None:
    runs = [recorded(EV3, seed) for seed in range(3)]
    quiet, slow = (
        problem_of(motion_of(each), EV3, ())
        for each in (runs, [wandering(run, seed) for seed, run in enumerate(runs)])
    )
    assert quiet.slow_noise(quiet.known).max() < 1.5
    inflation = slow.slow_noise(slow.known)
    assert inflation.min() > 3.0
    as_white, left = slow.sizes.left(EV3.physics), slow.sizes.left(EV3.physics, inflation=inflation)
    assert as_white.mm_1m > 1.8
    assert left.mm_1m < 0.8
    assert left.deg_1m < 0.7 * as_white.deg_1m


def test_worth_a_name_is_what_moves_the_robot_by_a_material_amount() -> None:
    sizes, line = sizes_of([recorded(EV3, seed) for seed in range(3)]), Material(5.0)
    shares = worth_a_name(sizes, line, EV3, ("track_width", "rolling_resistance", "load_transfer"))
    assert 0.15 <= shares["track_scale"] < 0.6
    narrow = EV3.with_effects({"track_width": {"scale": 1.0 + 0.006 * shares["track_scale"]}}).physics
    assert line.times(sizes.apart(EV3.physics, narrow)) == pytest.approx(1.0, rel=0.1)
    # Never below what the law itself is off by, never above the catalogue's size.
    assert shares["com_height"] >= 0.6
    assert max(shares.values()) <= 1.0
    assert worth_a_name(sizes, Material(500.0), EV3, ("track_width",)) == {"track_scale": 1.0}


def test_worth_a_name_is_told_of_what_another_body_bounds_too() -> None:
    spike = load_robot("spike")
    sizes = sizes_of([recorded(spike, seed) for seed in range(3)])
    assert 0.15 <= worth_a_name(sizes, Material(1.0), spike, ("com_offset",))["com_ahead"] < 1.0


def test_recordings_set_aside_count_in_what_an_effect_does() -> None:
    still, spun = [recorded(EV3, 0, most=0)], [recorded(EV3, 1)]
    narrow = EV3.with_effects({"track_width": {"scale": 0.97}}).physics
    alone = sizes_of(still)
    beside = replace(alone, beside=sizes_of(spun).runs)
    assert alone.apart(EV3.physics, narrow).deg_1m < 0.1
    assert beside.apart(EV3.physics, narrow).deg_1m > 1.0
    assert beside.left(narrow) == alone.left(narrow)


def test_what_is_left_repeatedly_is_so_in_two_recordings_at_least() -> None:
    narrow = EV3.with_effects({"track_width": {"scale": 0.97}}).physics
    still, spun = [recorded(EV3, k, most=0) for k in range(3)], [recorded(EV3, k) for k in (5, 6)]
    assert sizes_of([*still, spun[0]]).left(narrow, repeatedly=True).deg_1m < 0.3
    assert sizes_of([*still, *spun]).left(narrow, repeatedly=True).deg_1m > 1.0
    assert sizes_of([*still, *spun]).left(narrow).deg_1m < 0.3
    assert sizes_of(spun[:1]).left(narrow, repeatedly=True).deg_1m > 1.0


def test_robots_are_apart_if_any_recording_parts_them_by_a_material_size() -> None:
    narrow = EV3.with_effects({"track_width": {"scale": 0.97}}).physics
    sizes = sizes_of([recorded(EV3, 0, most=0), recorded(EV3, 1)])
    line = sizes.apart(EV3.physics, narrow).deg_1m * 5.0  # mm: a degree is a fifth of it
    for share in (0.9, 1.1):
        material = Material(share * line)
        assert sizes.are_apart(EV3.physics, narrow, material) is (share < 1.0)
        assert (material.times(sizes.apart(EV3.physics, narrow)) >= 1.0) is (share < 1.0)


@pytest.mark.parametrize(("even_rows", "left"), [(0, 0.0), (100, 10.0)])
def test_what_dims_readings_shows_on_even_floor_where_a_line_hides_it(even_rows: int, left: float) -> None:
    """Beside the edges of a line a path that is known to 3 mm leaves 30 % of a reading uncertain."""
    noise = 1.5
    predicted_sd = np.where(np.arange(1000) < even_rows, noise, 30.0)
    dimmed = SimpleNamespace(
        recording=SimpleNamespace(reflection_pct=np.full(1000, 80.0 - np.hypot(10.0, noise))),
        noise=SimpleNamespace(reflection_sd=noise),
        nuisances=SimpleNamespace(start=np.zeros(3)),
        readings=lambda _: np.full(1000, 80.0),
        predicted_reading_sd=lambda *_: predicted_sd,
    )
    sizes = Sizes((cast("Any", dimmed),), sensor=True)
    assert sizes.left(EV3.physics).reading_pct == pytest.approx(left)


@pytest.mark.parametrize(("others", "far"), [(1, False), (2, True)])
def test_one_of_two_recordings_does_not_decide_what_is_typical(others: int, far: bool) -> None:
    narrow = EV3.with_effects({"track_width": {"scale": 0.97}})
    runs = [recorded(EV3, 0), *(recorded(narrow, seed) for seed in range(1, 1 + others))]
    assert (sizes_of(runs).left(EV3.physics).deg_1m > 3.0) == far


def test_what_one_of_two_recordings_shows_at_a_spot_is_that_recordings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sizes = sizes_of([recorded(EV3, seed) for seed in range(2)])
    left = dict(zip(map(id, sizes.runs), (Size(mm_1m=1.0), Size(mm_1m=9.0)), strict=True))
    monkeypatch.setattr(parting, "_left_about", lambda run, *_: left[id(run)])
    assert sizes.left_about(EV3.physics, (0.6, 0.6)) == Size(mm_1m=1.0)


def with_sizes(**sizes: float) -> Model:
    """Return a model of effects that are so many times as large as is worth a name."""
    z = np.array(list(sizes.values()))
    return Model(tuple(sizes), free(EV3, tuple(sizes)), Minimum(z, np.zeros(1), 0.0), 0.0)


def test_laws_may_leave_what_they_are_off_by() -> None:
    late, loose = (left_share(with_sizes(**{name: 5.0})) for name in ("pose_delay", "backlash"))
    assert left_share(with_sizes()) < late < loose
    assert left_share(with_sizes(pose_delay=5.0, backlash=5.0)) == loose > 0.12


def test_laws_may_leave_more_of_what_is_small() -> None:
    assert left_share(with_sizes(tyre_friction=-1.5)) > left_share(with_sizes(tyre_friction=-4.0)) + 0.05
    assert left_share(with_sizes(tyre_friction=-0.1)) == left_share(with_sizes(tyre_friction=-1.0))


def test_laws_may_leave_no_more_than_a_share_of_what_they_do() -> None:
    runs = [recorded(EV3.with_effects({"supply_voltage": {"scale": 0.9}}), seed) for seed in range(2)]
    noise = estimate_noise(runs, EV3.physics, 1.0)
    residuals = motion_residuals(runs, noise, 1.0, Threads(1))
    effects = ("supply_voltage", "tyre_friction")
    problem = problem_of(residuals, EV3, effects)
    model = problem.estimator.fit(effects, {})
    steps = tuple(Step(effect, problem.known, model, 1.0) for effect in effects)
    assert left_share_of_each(problem, model, steps) < left_share(model) - 0.05
    assert left_share_of_each(problem, model, ()) == left_share(problem.known)


def test_small_changes_are_of_the_effects_that_a_problem_has() -> None:
    runs = [recorded(EV3.with_effects({"wheel_radius": {"scale": 1.003}}), seed) for seed in range(2)]
    residuals = motion_residuals(runs, estimate_noise(runs, EV3.physics, 1.0), 1.0, Threads(1))
    problem = problem_of(residuals, EV3, FOUR)
    assert set(problem.under(problem.known).small_changes(problem.known)) == set(FOUR)
    fewer = problem.of_effects(FOUR[2:])
    assert set(fewer.under(fewer.known).small_changes(fewer.known)) == set(FOUR[2:])


def test_small_changes_each_have_their_own_size() -> None:
    errors = np.random.default_rng(0).normal(size=len(SLOPES)) - SLOPES @ np.array([0.5, 0.5, 0.0, 0.0])
    small = np.array([0.3, 0.01, 0.3, 0.3])
    made = discrepancy(SLOPES, errors, BLOCKS, INDEX.channel, small, *SIZES[1:])
    found = made.small_changes(errors, np.full(4, -1.0), np.full(4, 1.0))
    assert found[0] == pytest.approx(0.5, abs=0.1)
    assert found[1] < 0.3


def test_recordings_without_poses_say_nothing_of_a_place() -> None:
    runs = [recorded(EV3, seed) for seed in range(3)]
    unseen = np.full(len(runs[0].t_s), np.nan)
    blind = [replace(recorded(EV3, k), x_m=unseen, y_m=unseen, heading_rad=unseen) for k in (8, 9)]
    wide = EV3.with_effects({"track_width": {"scale": 1.05}}).physics
    there, nowhere = (1.0, 0.5), (9.0, 9.0)
    assert sizes_of(runs).left_about(wide, there).deg_1m > 1.0
    assert sizes_of(runs + blind).left_about(wide, there).deg_1m > 1.0
    assert sizes_of(runs + blind).left_about(wide, nowhere) == Size()


def test_what_is_material_is_so_by_any_of_its_units() -> None:
    line = Material(5.0)
    assert line.times(Size(mm_1m=5.0)) == pytest.approx(1.0)
    assert line.times(Size(deg_1m=2.0)) == pytest.approx(2.0)
    assert line.times(Size(mm_drive=10.0, reading_pct=7.5)) == pytest.approx(3.0)
    assert Material(10.0).times(Size(deg_1m=2.0)) == pytest.approx(1.0)


@pytest.fixture(scope="module")
def nothing():
    return discover(Case("made", tuple(recorded(EV3, seed) for seed in range(5))))


@pytest.mark.parametrize(("effect", "label"), [("track_width", "scale"), ("actuation_delay", "time_s")])
def test_an_effect_of_the_size_of_its_limit_is_found(nothing, effect: str, label: str) -> None:
    limit = nothing.limits[effect]
    neutral = 1.0 if label == "scale" else 0.0
    robot = EV3.with_effects({effect: {label: neutral + limit.size}})
    verdict = discover(Case("made", tuple(recorded(robot, seed) for seed in range(5))))
    assert [found.id for found in verdict.effects] == [effect]


@pytest.mark.slow
def test_patches_of_the_size_of_their_limit_are_found_at_most_places_that_were_passed(nothing) -> None:
    size, found = nothing.limits["slippery_patch"].size, 0
    fitted = [recorded(EV3, int(name.removeprefix("run_"))) for name in nothing.fitted_on]
    for place in patches(fitted, 2):
        robot = EV3.with_effects({"slippery_patch": {**place, "radius_m": size}})
        for effect in discover(Case("made", tuple(recorded(robot, seed) for seed in range(5)))).effects:
            assert effect.id == "slippery_patch"
            found += abs(effect.parameters["x_m"].value - place["x_m"]) < 0.15
    assert found >= 2


def test_of_a_sensor_that_read_nothing_nothing_is_known(nothing) -> None:
    assert nothing.limits["sensor_delay"] is None
    assert nothing.as_json()["limits"]["sensor_delay"] is None
    assert "sensor_delay" in " ".join(words(nothing)).split("cannot show: ")[1]
    assert not nothing.residual.material


def test_what_matters_may_be_chosen(nothing, tmp_path) -> None:
    robot = EV3.with_effects({"actuation_delay": {"time_s": 0.03}})
    runs = [recorded(robot, seed, seconds=5.0) for seed in range(3)]
    for run in runs:
        write_recording(run, tmp_path / f"{run.name}.csv")
    verdict = discover(Case("made", tuple(runs)), material=Material(1000.0))
    assert verdict.verdict == "nothing"
    assert [minor.id for minor in verdict.minor] == ["actuation_delay"]
    assert verdict.as_json()["minor"][0]["moves"]["mm"] > 1.0
    with pytest.raises(InputError, match="--material: found 0"):
        command([tmp_path], material=0.0)


def test_what_is_bent_at_neutral_is_no_small_change(nothing) -> None:
    bent = {p.label for effect in CATALOGUE for p in effect.parameters if not p.smooth}
    assert bent == {"right_minus_left_pct", "forward_minus_backward_pct"}
    assert nothing.residual.white
    assert nothing.residual.size.mm_1m < 1.0


def test_small_changes_that_are_not_in_proportion_are_fitted_by_replay(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A little play, and a little less grip: linear small changes leave more than those fitted."""
    worn = {"backlash": {"angle_deg": 0.7}, "tyre_friction": {"coefficient": 0.82}}
    runs = [recorded(EV3.with_effects(worn), seed) for seed in range(4)]
    residuals = motion_of(runs)
    problem = problem_of(residuals, EV3, ("backlash", "tyre_friction", "track_width", "wheel_radius"))
    problem = problem.under(problem.known)

    def left() -> float:
        return cost(residuals.errors(replace(problem, kept={}).with_small_changes(problem.known)))

    fitted = left()
    monkeypatch.setattr(selection_problem, "REFINEMENTS", 0)
    assert fitted < left() - 1.0
    assert fitted < cost(residuals.errors(EV3.physics))
