"""Where something unknown acts at one place on the floor, what happens elsewhere tells of effects all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.concealing import EV3, motion_of

from gecar.reality import discovery
from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import Case, Recording, make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.residuals.parting import Sizes
from gecar.world.robot import Robot
from gecar.world.terms import Term

PLACE = (1.2, 0.6)
KICK = Term(
    port="yaw_moment", law=f"m * exp(-(square(x - {PLACE[0]}) + square(y - {PLACE[1]})) / 0.01)", m=0.03
)
WHEELS = {"wheel_radius_difference": {"right_minus_left": -0.012}}


def across(robot: Robot, seed: int, seconds: float = 8.0) -> Recording:
    """Return a drive that begins half a metre from the place, towards it, ahead or to and fro."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 0.02)
    duties = np.repeat(rng.integers(3, 7, (2, int(seconds / 0.8) + 1)) * 10.0, 40, axis=1)[:, : len(t)]
    if seed % 2:
        duties = duties * np.where(np.arange(len(t)) // 120 % 2, -1.0, 1.0)
    way = rng.uniform(-np.pi, np.pi)
    start = np.array([PLACE[0] - 0.5 * np.cos(way), PLACE[1] - 0.5 * np.sin(way), way + rng.normal(0.0, 0.1)])
    columns = {"t_s": t, "left_duty_pct": duties[0], "right_duty_pct": duties[1]}
    setup = Setup(rig="floor", course="none", duty_cap=1.0)
    rows = replayer_of(make_recording("made", columns, setup)).play(robot.physics, start).rows
    columns |= {
        "left_angle_deg": np.round(np.degrees(rows[:, 0])),
        "right_angle_deg": np.round(np.degrees(rows[:, 1])),
        "x_m": rows[:, 4] + rng.normal(0.0, 0.001, len(t)),
        "y_m": rows[:, 5] + rng.normal(0.0, 0.001, len(t)),
        "heading_deg": np.degrees(rows[:, 6]) + rng.normal(0.0, 0.3, len(t)),
    }
    return make_recording(f"run_{seed}", columns, setup)


def test_motion_is_not_compared_near_a_place_nor_just_after() -> None:
    runs = [across(EV3, seed) for seed in range(3)]
    whole = motion_of(runs)
    away = whole.away_from(PLACE, 0.2)
    counts = [np.bincount(each.index.recording, minlength=3) for each in (whole, away)]
    for run, before, after in zip(runs, *counts, strict=True):
        near = np.hypot(run.x_m - PLACE[0], run.y_m - PLACE[1]) < 0.2
        last = np.maximum.accumulate(np.where(near, run.t_s, -np.inf))
        assert near.any()
        assert after / before == pytest.approx(np.mean(run.t_s - last > 0.3), abs=0.01)
    assert away.everywhere().index.t_s.tolist() == whole.index.t_s.tolist()
    assert np.array_equal(away.everywhere().errors(EV3.physics), whole.errors(EV3.physics))


def test_a_recording_that_tells_headings_alone_tells_no_place() -> None:
    runs = [across(EV3, seed) for seed in range(2)]
    gone = np.full_like(runs[1].t_s, np.nan)
    away = motion_of([runs[0], replace(runs[1], x_m=gone, y_m=gone)]).away_from(PLACE, 0.2)
    assert [run.recording.name for run in away.recordings] == ["run_0"]


def test_what_a_robot_leaves_is_told_by_metres_that_are_judged_throughout() -> None:
    robot = EV3.with_terms([KICK])
    whole = motion_of([across(robot, seed) for seed in range(6)])
    everywhere, away = (
        Sizes(each.recordings, sensor=False).left(EV3.physics, repeatedly=True)
        for each in (whole, whole.away_from(PLACE, 0.35))
    )
    assert everywhere.mm_1m > 10.0
    assert away.mm_1m < 0.3 * everywhere.mm_1m
    nowhere = Sizes(whole.away_from(PLACE, 9.0).recordings, sensor=False).left(EV3.physics)
    assert (nowhere.mm_1m, nowhere.deg_1m) == (0.0, 0.0)


@pytest.mark.parametrize("much", [True, False])
def test_an_effect_is_found_beside_something_unknown_at_one_place(
    monkeypatch: pytest.MonkeyPatch, much: bool
) -> None:
    """Also where it leaves little of whole drives, as beside an effect that does far more, and shows at the place."""
    written = discovery._written

    def leaving(*given: object) -> object:
        stage = written(*given)
        return replace(stage, explained=replace(stage.explained, unexplained=much))

    monkeypatch.setattr(discovery, "_written", leaving)
    monkeypatch.setattr(discovery, "with_spot", lambda explained: replace(explained, unexplained=True))
    robot = EV3.with_effects(WHEELS).with_terms([KICK])
    verdict = discover(Case("made", tuple(across(robot, seed) for seed in range(6))))
    assert verdict.verdict == "missing_and_unexplained"
    (found,) = verdict.effects
    assert found.id == "wheel_radius_difference"
    span = found.parameters["right_minus_left"]
    assert span.low <= -0.012 <= span.high
    assert any("something acts that no effect of the catalogue explains" in note for note in verdict.notes)


@pytest.mark.slow
def test_a_place_where_something_unknown_acts_is_no_effect_of_the_rest() -> None:
    robot = EV3.with_terms([KICK])
    verdict = discover(Case("made", tuple(across(robot, seed) for seed in range(6))))
    assert (verdict.verdict, verdict.effects) == ("unexplained", ())
