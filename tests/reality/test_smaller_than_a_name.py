"""What moves the robot by a material amount is named, though it is smaller than the catalogue's size."""

from __future__ import annotations

import pytest
from support.concealing import EV3, recorded

from gecar.reality.discovery import discover
from gecar.reality.materiality import DEFAULT
from gecar.reality.recordings.recording import Case


def test_a_dead_band_that_differs_by_less_than_the_catalogue_s_size_is_named_where_it_is_material() -> None:
    robot = EV3.with_effects({"dead_band_asymmetry": {"right_minus_left_pct": 0.8}})
    verdict = discover(Case("made", tuple(recorded(robot, seed) for seed in range(5))))
    (found,) = verdict.effects
    assert (verdict.verdict, found.id, verdict.minor) == ("missing", "dead_band_asymmetry", ())
    assert found.parameters["right_minus_left_pct"].value == pytest.approx(0.8, abs=0.1)
    assert DEFAULT.times(found.size) > 1.0
    assert not verdict.residual.material


def test_a_slow_ripple_below_the_catalogue_s_size_is_named_where_it_is_material() -> None:
    ripple = {"amplitude_nm": 0.0025, "cycles_per_rev": 1.0, "phase_rad": 0.5, "right_lead_rad": 1.5}
    robot = EV3.with_effects({"torque_ripple": ripple})
    verdict = discover(Case("made", tuple(recorded(robot, seed) for seed in range(5))))
    (found,) = verdict.effects
    assert (verdict.verdict, found.id) == ("missing", "torque_ripple")
    assert found.parameters["amplitude_nm"].value == pytest.approx(0.0025, abs=0.0002)
    assert DEFAULT.times(found.size) > 1.0
