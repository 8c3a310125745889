import numpy as np
import pytest

from gecar.world.course.course import load_course
from gecar.world.kernel.sensing import (
    RING,
    delayed,
    glance,
    lag_keep,
    lagged,
    reported,
    spot_average,
    spot_reflection,
)
from gecar.world.kernel.state import STATE, place
from gecar.world.robot import load_robot

EV3, PAPER = load_robot("ev3"), load_course("paper")
RASTER, PITCH = PAPER.raster(), PAPER.pitch_m
AVERAGED = spot_average(RASTER, PITCH, EV3.colour_sensor.spot_diameter)


def seen(x, y, heading=0.0, robot=EV3):
    state = np.zeros(1, STATE)
    place(state[0], robot.physics[0], x, y, heading)
    return glance(AVERAGED, PITCH, state[0], 0.0, robot.physics[0])


def covered(offset, radius=0.004):
    """Share of a disc beyond a straight edge at a signed distance from its centre: a circular segment."""
    d = np.clip(offset / radius, -1.0, 1.0)
    return (np.arccos(d) - d * np.sqrt(1.0 - d * d)) / np.pi


def test_bare_floor_reads_white_and_the_line_black():
    assert seen(1.2, 0.6) == 100.0
    assert seen(1.0, 0.15) == pytest.approx(0.0, abs=1e-4)
    assert seen(-5.0, 9.0) == 100.0


@pytest.mark.parametrize("offset_mm", [-4.5, -3.0, -1.3, 0.0, 0.4, 2.2, 3.7, 5.0])
def test_edge_reads_the_share_of_the_spot_on_the_line(offset_mm):
    x = 0.1625 + offset_mm / 1000.0 - EV3.colour_sensor.ahead
    assert seen(x, 0.6) == pytest.approx(100.0 * (1.0 - covered(offset_mm / 1000.0)), abs=1.6)


def test_readings_change_smoothly_with_place():
    readings = np.array([seen(0.0735 + k * 5e-5, 0.6) for k in range(400)])
    assert np.abs(np.diff(readings, 2)).max() < 0.4


def test_both_ways_to_average_agree():
    rng = np.random.default_rng(0)
    physics = EV3.physics[0]
    for _ in range(200):
        x, heading = rng.uniform(0.05, 0.12), rng.uniform(-0.3, 0.3)
        slow = spot_reflection(RASTER, PITCH, x, 0.6, np.cos(heading), np.sin(heading), 0.0, physics)
        assert seen(x, 0.6, heading) == pytest.approx(slow, abs=1.5)


def test_shifted_line_is_seen_where_it_lies():
    shifted = EV3.with_effects({"line_shift": {"dx_m": 0.01, "dy_m": 0.0}})
    assert seen(0.0915, 0.6, robot=shifted) == pytest.approx(seen(0.0815, 0.6))


def test_report_is_a_whole_percent_within_bounds():
    physics = EV3.with_effects({"sensor_gain": {"gain": 1.5, "offset_pct": -5.0}}).physics[0]
    assert [reported(level, 0.0, physics) for level in (0.0, 30.2, 90.0)] == [0.0, 40.0, 100.0]


def test_lag_answers_with_its_time_constant_and_none_at_once():
    level = 0.0
    for _ in range(20):
        level = lagged(level, 1.0, lag_keep(0.002, 0.04))
    assert level == pytest.approx(1.0 - np.exp(-1.0))
    assert lagged(3.0, 0.7, lag_keep(0.002, 0.0)) == 0.7


def test_delay_is_linear_between_steps():
    rings = np.arange(2 * RING, dtype=float)
    assert delayed(rings, RING, 100, 2.25) == RING + 97.75
    assert delayed(rings, RING, 100, 0.0) == RING + 100
