"""What moves the robot by a material amount, though no effect of a size worth a name explains it, is not nothing."""

from __future__ import annotations

import pytest
from support.concealing import EV3, recorded

from gecar.reality.discovery import discover
from gecar.reality.materiality import DEFAULT
from gecar.reality.recordings.recording import Case


def test_it_stays_unexplained_and_the_effect_is_minor() -> None:
    robot = EV3.with_effects({"dead_band_asymmetry": {"right_minus_left_pct": 1.2}})
    verdict = discover(Case("made", tuple(recorded(robot, seed) for seed in range(5))))
    assert (verdict.verdict, verdict.effects) == ("unexplained", ())
    (minor,) = verdict.minor
    assert minor.id == "dead_band_asymmetry"
    assert minor.parameters["right_minus_left_pct"].value == pytest.approx(1.2, abs=0.1)
    assert DEFAULT.times(minor.size) > 1.0
    assert verdict.residual.material
