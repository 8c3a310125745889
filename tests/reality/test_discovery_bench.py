"""Discovery on motors of a bench: what drivers do, what differs by direction, and several causes at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.concealing import EV3, recorded

from gecar.reality.discovery import discover
from gecar.reality.recordings.recording import Case, read_case
from gecar.reality.verdict import Verdict

EMPS = Path(__file__).parents[3] / "shared" / "recordings" / "real" / "emps"


def verdict_with(most: int = 10, **effects: dict[str, float]) -> Verdict:
    robot = EV3.with_effects(effects)
    return discover(Case("made", tuple(recorded(robot, seed, rig="bench", most=most) for seed in range(5))))


@pytest.mark.parametrize(
    ("effect", "label", "value"),
    [
        ("viscous_asymmetry", "forward_minus_backward_nms", 0.004),
        ("duty_curve", "bulge", 0.5),
        ("current_limit", "current_a", 0.6),
    ],
)
def test_what_a_driver_or_a_direction_does_is_named_with_its_size(effect, label, value) -> None:
    (found,) = verdict_with(**{effect: {label: value}}).effects
    assert found.id == effect
    assert found.parameters[label].low < value < found.parameters[label].high


def test_a_constant_torque_is_named_or_what_it_is_while_the_shaft_turns() -> None:
    (found,) = verdict_with(constant_torque={"torque_nm": 0.008}).effects
    assert {found.id, *found.alternatives} == {"constant_torque", "friction_asymmetry"}


def test_a_late_start_and_a_sagging_battery_are_found_together() -> None:
    verdict = verdict_with(start_latency={"time_s": 0.03}, battery_resistance={"resistance_ohm": 1.0})
    assert {found.id for found in verdict.effects} == {"start_latency", "battery_resistance"}


@pytest.mark.skipif(not EMPS.is_dir(), reason="the real recordings (../shared/recordings) are not here")
def test_friction_of_a_real_drive_differs_by_direction_and_does_not_only_break_away() -> None:
    verdict = discover(read_case(EMPS))
    assert {found.id for found in verdict.effects} == {
        "viscous_friction", "viscous_asymmetry", "coulomb_friction"
    }  # fmt: skip
    # 0.061 at steps of 1, 0.5 and 0.25 ms
    assert verdict.judgement.channels["left_angle_deg"].after < 0.065
