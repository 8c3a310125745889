"""Two effects of which either stands in for both, in recordings made by the simulation itself."""

from __future__ import annotations

import pytest
from support.concealing import EV3, motion_of, recorded

from gecar.reality.selection.problem import problem_of
from gecar.reality.selection.stepwise import explain

SHOWN_BY_SLIP = ("load_transfer", "tyre_friction", "com_offset")


@pytest.mark.parametrize(
    ("height_m", "grip", "first", "runs", "most"),
    [
        pytest.param(0.085, 0.65, 10, 2, 8, id="one alone is larger"),
        pytest.param(0.1, 0.6, 20, 3, 10, id="one alone is at its bound"),
    ],
)
def test_tyres_and_a_high_centre_of_mass_are_both_found(
    height_m: float, grip: float, first: int, runs: int, most: int
) -> None:
    robot = EV3.with_effects(
        {"load_transfer": {"height_m": height_m}, "tyre_friction": {"coefficient": grip}}
    )
    made = [recorded(robot, first + run, most=most) for run in range(runs)]
    residuals = motion_of(made)
    explained = explain(problem_of(residuals, EV3, SHOWN_BY_SLIP))
    assert explained.taken.values == {
        "load_transfer": {"height_m": pytest.approx(height_m, rel=0.02)},
        "tyre_friction": {"coefficient": pytest.approx(grip, rel=0.02)},
    }
    assert not explained.unexplained
