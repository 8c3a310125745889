"""Encoders with an error that no effect explains hide nothing of what the path shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from concealing import EV3, recorded

from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import Case, Recording
from gecar.world.robot import Robot


def jumping(robot: Robot, seed: int) -> Recording:
    """Return a drive whose encoders jump by half a radian, six times each."""
    run, rng = recorded(robot, seed), np.random.default_rng(seed)
    angles = []
    for angle in (run.left_angle_rad, run.right_angle_rad):
        angles.append(angle.copy())
        for row in rng.integers(100, len(angle) - 50, 6):
            angles[-1][row:] += rng.normal(0.0, 0.6)
    return replace(run, left_angle_rad=angles[0], right_angle_rad=angles[1])


def test_a_narrow_track_is_found_beside_encoders_that_jump_and_these_stay_unexplained() -> None:
    robot = EV3.with_effects({"track_width": {"scale": 0.93}})
    verdict = discover(Case("made", tuple(jumping(robot, seed) for seed in range(5))))
    assert verdict.verdict == "missing_and_unexplained"
    (found,) = verdict.effects
    assert found.id == "track_width"
    assert found.parameters["scale"].value == pytest.approx(0.93, abs=0.003)
    assert "The encoders have an error of their own" in " ".join(verdict.notes)
    assert verdict.residual.material


def test_encoders_that_jump_alone_are_unexplained_and_nothing_is_named() -> None:
    verdict = discover(Case("made", tuple(jumping(EV3, seed) for seed in range(5))))
    assert (verdict.verdict, verdict.effects) == ("unexplained", ())
