"""How far conditions may go until a program misses GOAL: shares that arrive, their range, the picture."""

import numpy as np
import pytest

from gecar.language.program import parse_program
from gecar.plots.drives.robustness import robustness_figure
from gecar.plots.style import is_whole
from gecar.search.robustness import CONDITIONS, Sweep, robustness
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World

WORLD = World(load_robot("ev3"), load_course("paper"))
SOURCE = "if(SensorValue > 80):\n    motor(70,90,0)\nelse:\n    motor(40,-100,30)"
PROGRAM = parse_program(SOURCE)


@pytest.fixture(scope="module")
def sweeps():
    return robustness(WORLD, PROGRAM.opcodes, draws=8)


def test_a_program_arrives_near_nominal_and_not_far_away(sweeps):
    by_id = {sweep.condition.id: sweep for sweep in sweeps}
    battery, grip = by_id["battery_pct"], by_id["grip"]
    assert battery.shares[np.searchsorted(battery.condition.levels, 100.0)] >= 0.8
    assert grip.shares[0] < grip.shares.max()
    assert all(s.shares.min() >= 0.0 and s.shares.max() <= 1.0 for s in sweeps)


def test_levels_hold_the_nominal_one(sweeps):
    for sweep in sweeps:
        assert sweep.condition.levels[0] <= sweep.nominal <= sweep.condition.levels[-1]
        assert np.diff(sweep.condition.levels).min() > 0.0


@pytest.mark.parametrize(
    ("shares", "expected"),
    [([1, 1, 1], (-30.0, 30.0)), ([0, 1, 0], (0.0, 0.0)), ([1, 0, 1], None), ([0.5, 1, 0.95], (0.0, 30.0))],
)
def test_the_range_is_what_hangs_together_about_nominal(shares, expected):
    turned = CONDITIONS[1]._replace(levels=(-30.0, 0.0, 30.0))
    assert Sweep(turned, 0.0, np.array(shares, float)).range == expected


def test_the_picture_is_whole(sweeps):
    assert is_whole(robustness_figure(sweeps, "How far", "8 drives a point"))


def test_simulate_draws_and_tells_it(gecar, tmp_path, monkeypatch):
    monkeypatch.setattr("gecar.search.robustness.DRAWS", 4)
    (tmp_path / "best.txt").write_text(SOURCE)
    told = gecar("simulate", "best.txt", "--no-picture", "--robustness", "far.png", "--json")
    assert (tmp_path / "far.png").is_file()
    assert told.json["robustness"]["grip"]["nominal"] == 0.9
    assert "Battery, share of its voltage: " in told.err
    assert ".png, .pdf or .svg" in gecar.error("simulate", "best.txt", "--robustness", "far.gif")
