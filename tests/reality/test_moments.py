"""Where something unknown acts now and then, or in one kind of driving, the rest tells of effects all the same."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality import discovery
from gecar.reality.discovery import discover
from gecar.reality.locate.moments import KIND, Acting, kind_of_driving, moments
from gecar.reality.materiality import DEFAULT
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.recordings.split import hold_out
from gecar.reality.selection.problem import problem_of
from gecar.reality.verdict import Verdict
from gecar.world.effects import CATALOGUE
from gecar.world.robot import Robot

LOST_S = 0.4
WEAKENED = 0.75  # of what the log claims
OVER_S = 0.8  # after which a replay with a memory of a second has forgotten what happened


def losing(robot: Robot, seed: int) -> Recording:
    """Return a drive whose log claims another command, at one moment, than the robot followed."""
    run, rng = recorded(robot, seed, seconds=12.0), np.random.default_rng(seed)
    left, right = run.left_duty.copy(), run.right_duty.copy()
    left[_lost(run, seed)], right[_lost(run, seed)] = rng.choice([-0.4, 0.4], 2)
    return replace(run, left_duty=left, right_duty=right)


def weak_in_turns(robot: Robot, seed: int) -> Recording:
    """Return a drive whose motors get less than the log claims while they are driven opposite ways."""
    run = recorded(robot, seed, seconds=12.0)
    claimed = np.where(_opposite(run), 1.0 / WEAKENED, 1.0)
    return replace(run, left_duty=run.left_duty * claimed, right_duty=run.right_duty * claimed)


def _opposite(run: Recording) -> npt.NDArray[np.bool_]:
    return run.left_duty * run.right_duty < 0.0


def named_alone_if_any(verdict: Verdict, size: float) -> None:
    """Assert that wheels that differ by a size are named alone, with it in their interval, and that more is left."""
    assert {found.id for found in verdict.effects} == ({"wheel_radius_difference"} if size else set())
    assert verdict.verdict == ("missing_and_unexplained" if size else "unexplained")
    for found in verdict.effects:
        span = found.parameters["right_minus_left"]
        assert span.low <= size <= span.high


def _lost(run: Recording, seed: int, after_s: float = 0.0) -> npt.NDArray[np.bool_]:
    first = 1.0 + 1.5 * seed
    return (run.t_s >= first) & (run.t_s < first + LOST_S + after_s)


def test_moments_at_which_commands_were_lost_are_told_beside_an_effect_of_any_size() -> None:
    robot = EV3.with_effects({"wheel_radius": {"scale": 0.96}})
    runs = [losing(robot, seed) for seed in range(3)]
    fitted = motion_of(runs)
    problem = problem_of(fitted, EV3, [effect.id for effect in CATALOGUE if effect.id == "wheel_radius"])
    _, told, aside, _ = moments(problem, problem.known, motion_of([losing(robot, 3)]))
    for run, seed, rows in zip((*runs, losing(robot, 3)), range(4), (*told, *aside), strict=True):
        assert rows[_lost(run, seed)].mean() > 0.6
        assert rows[~_lost(run, seed, OVER_S)].mean() < 0.03
    except_there = fitted.except_at(told)
    assert len(except_there.index.t_s) > 0.5 * len(fitted.index.t_s)
    assert except_there.everywhere().index.t_s.tolist() == fitted.index.t_s.tolist()


def test_noise_alone_makes_no_moment() -> None:
    fitted = motion_of([recorded(EV3, seed) for seed in range(3)])
    problem = problem_of(fitted, EV3, ["wheel_radius", "viscous_friction"])
    _, told, aside, _ = moments(problem, problem.known, motion_of([recorded(EV3, 3)]))
    assert np.concatenate([*told, *aside]).mean() < 0.01


@pytest.mark.parametrize("size", [-0.012, pytest.param(0.0, marks=pytest.mark.slow)])
def test_an_effect_is_named_beside_lost_commands_and_none_where_there_is_none(size: float) -> None:
    robot = EV3.with_effects({"wheel_radius_difference": {"right_minus_left": size}})
    verdict = discover(Case("made", tuple(losing(robot, seed) for seed in range(4))))
    named_alone_if_any(verdict, size)
    (told,) = [note for note in verdict.notes if note.startswith("At some moments")] or [""]
    assert ("run_1 at 2." in told) == bool(size)


def test_what_acts_now_and_then_is_taken_for_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """It acts where the robot is just then."""
    runs = tuple(recorded(EV3, seed) for seed in range(3))
    fitted, held = motion_of(runs[:2]), motion_of(runs[2:])
    problem = problem_of(fitted, EV3, ["wheel_radius"])
    found = SimpleNamespace(explained=SimpleNamespace(problem=problem, taken=problem.known))
    split = hold_out(Case("made", runs))
    context = discovery._Context(
        EV3, tuple(CATALOGUE), split, 0, problem.tell, False, DEFAULT, None, None, False, ""
    )
    rows = [[run.t_s > 6.0] * count for run, count in ((runs[0], 2), (runs[2], 1))]
    tried: list[str] = []
    monkeypatch.setattr(
        discovery, "_explained_in_part", lambda within, *_: tried.extend(e.id for e in within.catalogue)
    )
    stage = discovery._explained_at_other_times(
        context,
        found,
        lambda *_: Acting("", *rows),
        fitted,
        held,  # type: ignore[arg-type]
    )
    assert stage is found  # type: ignore[comparison-overlap]
    assert len(tried) == len(CATALOGUE) - 1
    assert "slippery_patch" not in tried


def test_the_kind_of_driving_in_which_motors_are_weak_is_told_beside_an_effect_of_any_size() -> None:
    robot = EV3.with_effects({"wheel_radius": {"scale": 0.96}})
    runs = [weak_in_turns(robot, seed) for seed in range(4)]
    problem = problem_of(motion_of(runs[:3]), EV3, ["wheel_radius"])
    told = kind_of_driving(problem, problem.known, motion_of(runs[3:]))
    assert told is not None
    assert told.kind == "while the motors were driven opposite ways"
    assert 0.0 < told.left < KIND
    for run, rows in zip(runs, (*told.fitted, *told.held), strict=True):
        assert rows.tolist() == _opposite(run).tolist()


def test_noise_alone_or_what_acts_in_all_driving_has_no_kind() -> None:
    for size in (1.0, 0.96):
        robot = EV3.with_effects({"wheel_radius": {"scale": size}})
        problem = problem_of(
            motion_of([recorded(robot, seed) for seed in range(3)]), EV3, ["viscous_friction"]
        )
        assert kind_of_driving(problem, problem.known, motion_of([recorded(robot, 3)])) is None


@pytest.mark.parametrize("size", [-0.012, pytest.param(0.0, marks=pytest.mark.slow)])
def test_an_effect_is_named_beside_motors_that_are_weak_in_turns(size: float) -> None:
    robot = EV3.with_effects({"wheel_radius_difference": {"right_minus_left": size}})
    verdict = discover(Case("made", tuple(weak_in_turns(robot, seed) for seed in range(4))))
    named_alone_if_any(verdict, size)
    (told,) = [note for note in verdict.notes if "mainly while the motors were driven opposite ways" in note]
    assert ("was left out" in told) == bool(size)
