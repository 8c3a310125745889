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


def test_a_slow_ripple_below_the_catalogue_s_size_is_named_where_it_is_material() -> None:
    ripple = {"amplitude_nm": 0.0025, "cycles_per_rev": 1.0, "phase_rad": 0.5, "right_lead_rad": 1.5}
    robot = EV3.with_effects({"torque_ripple": ripple})
    verdict = discover(Case("made", tuple(recorded(robot, seed) for seed in range(5))))
    (found,) = verdict.effects
    assert (verdict.verdict, found.id) == ("missing", "torque_ripple")
    assert found.parameters["amplitude_nm"].value == pytest.approx(0.0025, abs=0.0002)
    assert DEFAULT.times(found.size) > 1.0
