"""Encoders or a camera with an error that no effect explains hide nothing of what the other shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality import discovery
from gecar.reality.advise.notes import ALONG_ENCODERS
from gecar.reality.discovery import discover
from gecar.reality.materiality import DEFAULT, Size
from gecar.reality.prove import confirmation
from gecar.reality.recordings.recording import Case, Recording
from gecar.world.robot import Robot
from gecar.world.terms import Term


def jumping(robot: Robot, seed: int) -> Recording:
    """Return a drive whose encoders jump by half a radian, six times each."""
    run, rng = recorded(robot, seed), np.random.default_rng(seed)
    angles = []
    for angle in (run.left_angle_rad, run.right_angle_rad):
        angles.append(angle.copy())
        for row in rng.integers(100, len(angle) - 50, 6):
            angles[-1][row:] += rng.normal(0.0, 0.6)
    return replace(run, left_angle_rad=angles[0], right_angle_rad=angles[1])


def knocked(robot: Robot, seed: int) -> Recording:
    """Return a drive whose camera is knocked in its middle, by 4 cm and six degrees, in a direction of its own."""
    run, rng = recorded(robot, seed), np.random.default_rng(seed)
    late = run.t_s > rng.uniform(2.0, 6.0)
    way, turn = rng.uniform(-np.pi, np.pi), rng.choice([-0.1, 0.1])
    cos, sin = np.where(late, np.cos(turn), 1.0), np.where(late, np.sin(turn), 0.0)
    x = run.x_m * cos - run.y_m * sin + 0.04 * np.cos(way) * late
    y = run.x_m * sin + run.y_m * cos + 0.04 * np.sin(way) * late
    return replace(run, x_m=x, y_m=y, heading_rad=run.heading_rad + turn * late)


@pytest.mark.parametrize(
    ("damaged", "instrument", "effect", "label", "value", "within"),
    [
        pytest.param(
            jumping, "encoders", "track_width", "scale", 0.93, 0.003, marks=pytest.mark.slow, id="encoders"
        ),
        pytest.param(knocked, "poses", "viscous_friction", "coefficient_nms", 0.002, 2e-4, id="poses"),
    ],
)
def test_an_effect_is_found_beside_an_instrument_that_errs_and_this_stays_unexplained(
    damaged: Callable[[Robot, int], Recording],
    instrument: str,
    effect: str,
    label: str,
    value: float,
    within: float,
) -> None:
    robot = EV3.with_effects({effect: {label: value}})
    verdict = discover(Case("made", tuple(damaged(robot, seed) for seed in range(4))))
    assert verdict.verdict == "missing_and_unexplained"
    (found,) = verdict.effects
    assert found.id == effect
    assert found.parameters[label].value == pytest.approx(value, abs=within)
    assert f"The {instrument} have an error of their own" in " ".join(verdict.notes)
    assert verdict.residual.material


@pytest.mark.parametrize("damaged", [jumping, knocked])
def test_an_instrument_that_errs_alone_is_unexplained_and_nothing_is_named(
    damaged: Callable[[Robot, int], Recording],
) -> None:
    verdict = discover(Case("made", tuple(damaged(EV3, seed) for seed in range(4))))
    assert (verdict.verdict, verdict.effects) == ("unexplained", ())


@pytest.mark.parametrize(
    ("instrument", "off_mm", "cost", "worse"),
    [("encoders", 28.0, 50.0, True), ("encoders", 8.0, 100.0, False),
     ("poses", 28.0, 50.0, False), ("poses", 8.0, 95.0, True)],
)  # fmt: skip
def test_paths_speak_for_the_encoders_and_encoders_for_the_poses(
    instrument: str, off_mm: float, cost: float, worse: bool
) -> None:
    """Before, 9 mm a metre are left, and the instrument that stays costs 100."""
    problem = SimpleNamespace(material=DEFAULT, cost_of=float)
    before, without = (
        SimpleNamespace(problem=problem, left=Size(mm_1m=mm), taken=SimpleNamespace(physics=costs))
        for mm, costs in ((9.0, 100.0), (off_mm, cost))
    )
    assert discovery._is_worse_without(instrument, before, without) is worse  # type: ignore[arg-type]


@pytest.mark.parametrize(("damaged", "undone"), [(recorded, True), (jumping, False)])
def test_encoders_that_saw_the_known_robot_are_not_left_out(
    damaged: Callable[[Robot, int], Recording], undone: bool
) -> None:
    rough = EV3.with_effects({"viscous_friction": {"coefficient_nms": 0.002}})
    runs = [damaged(rough if damaged is jumping else EV3, seed) for seed in range(2)]
    without = SimpleNamespace(taken=SimpleNamespace(physics=rough.physics))
    assert discovery._is_undone("encoders", EV3, without, motion_of(runs)) is undone  # type: ignore[arg-type]


def test_where_the_robot_went_is_explained_by_its_wheels_whatever_turned_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Motors pushed about in a way of each drive's own, above wheels that are too close.

    Nothing that turned the wheels can be a part of what is found, so that it need not be as steady as elsewhere.
    """
    monkeypatch.setattr(confirmation, "most_uneven", lambda problem, steps: next(iter(steps), None))
    narrow, runs = EV3.with_effects({"track_width": {"scale": 0.95}}), []
    for seed in range(4):
        pushed = Term(port="motor_torque", law="c1 * sin(c2 * time) * side", c1=0.06, c2=5.0 + 1.7 * seed)
        runs.append(recorded(narrow.with_terms([pushed]), seed))
    verdict = discover(Case("made", tuple(runs)))
    assert verdict.verdict == "missing_and_unexplained"
    (found,) = verdict.effects
    assert found.id == "track_width"
    assert found.parameters["scale"].value == pytest.approx(0.95, abs=0.005)
    assert ALONG_ENCODERS in verdict.notes
