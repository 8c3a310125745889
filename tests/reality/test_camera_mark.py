"""A camera's mark that is not over the axle's centre."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality.discovery import discover
from gecar.reality.fitting.camera_mark import with_fitted_mark
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.selection.problem import Problem, problem_of
from gecar.world.effects import BY_ID
from gecar.world.robot import Robot

MAYBE = ("track_width", "wheel_radius", "tyre_friction", "com_offset", "pose_delay", "motor_gain_asymmetry")
MARK = (0.012, -0.007, math.radians(1.5))


def marked(run: Recording, mark: tuple[float, float, float] = MARK) -> Recording:
    """Film a mark ahead, left and turned on the robot, rather than its axle."""
    (ahead, left, turn), cos, sin = mark, np.cos(run.heading_rad), np.sin(run.heading_rad)
    return replace(
        run,
        x_m=run.x_m + ahead * cos - left * sin,
        y_m=run.y_m + ahead * sin + left * cos,
        heading_rad=run.heading_rad + turn,
    )


def problem(robot: Robot = EV3, mark: tuple[float, float, float] = MARK, runs: int = 4) -> Problem:
    filmed = [marked(recorded(robot, seed), mark) for seed in range(runs)]
    residuals = motion_of(filmed)
    return problem_of(residuals, EV3, ("track_width", "pose_delay"))


@pytest.mark.parametrize("runs", [1, 4])
def test_a_mark_comes_back(runs: int) -> None:
    found, gain = with_fitted_mark(problem(runs=runs).estimator, EV3.physics)
    assert found.mark == pytest.approx(MARK, abs=6e-4)
    assert gain > 100.0


def test_a_mark_over_the_axle_stays_there() -> None:
    assert problem(mark=(0.0, 0.0, 0.0)).with_mark(problem().known) is None


def test_without_headings_no_mark_is_looked_for() -> None:
    blind = [replace(recorded(EV3, seed), heading_rad=np.full(800, np.nan)) for seed in range(2)]
    residuals = motion_of(blind)
    seen = problem_of(residuals, EV3, ("track_width",))
    assert seen.with_mark(seen.known) is None


@pytest.mark.parametrize("scale", [None, 1.05])
def test_an_effect_is_found_beside_a_mark_and_only_the_mark_without_one(scale: float | None) -> None:
    robot = EV3.with_effects({"track_width": {"scale": scale}}) if scale else EV3
    case = Case("filmed", tuple(marked(recorded(robot, seed)) for seed in range(5)))
    verdict = discover(case, catalogue=[BY_ID[effect] for effect in MAYBE])
    assert [found.id for found in verdict.effects] == (["track_width"] if scale else [])
    (note,) = (note for note in verdict.notes if "mark" in note)
    assert "ahead of the axle's centre" in note
    assert "to its right" in note
    assert "--mark 0.012" in note
    for channel in ("x_m", "y_m", "heading_deg"):  # whole drives set aside are judged with the mark, too
        misfit = verdict.judgement.channels[channel]
        assert misfit.after < 1.2 * misfit.floor
    assert verdict.verdict == ("missing" if scale else "nothing")
    if scale:
        found = verdict.effects[0].parameters["scale"]
        assert found.low < scale < found.high


def test_a_camera_that_sees_lengths_smaller_is_told_as_such() -> None:
    """Wheels and a track that are both smaller by as much would look alike."""
    runs = []
    for seed in range(4):
        run = recorded(EV3, seed)
        runs.append(replace(run, x_m=1.2 + 0.97 * (run.x_m - 1.2), y_m=0.6 + 0.97 * (run.y_m - 0.6)))
    verdict = discover(Case("made", tuple(runs)))
    (found,) = verdict.effects
    assert (verdict.verdict, found.id) == ("missing", "pose_scale")
    assert found.parameters["scale"].low < 0.97 < found.parameters["scale"].high
