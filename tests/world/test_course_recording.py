"""The paper's course against a practice recording on it, with nothing concealed (every row with a camera pose)."""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import UnivariateSpline

from gecar.world.course.course import load_course, parse_course
from gecar.world.robot import load_robot

ROWS = np.genfromtxt(Path(__file__).parent / "practice_line.csv", delimiter=",", names=True)
SENSOR = load_robot("ev3").colour_sensor


def smooth(column, sigma):
    """Smooth a pose column to its camera noise."""
    return UnivariateSpline(ROWS["t_s"], ROWS[column], k=5, s=len(ROWS) * sigma**2)(ROWS["t_s"])


def predicted(course, shift_m=(0.0, 0.0)):
    """Reflection along the measured pose [%], averaged over the sensor's spot."""
    x, y, heading = smooth("x_m", 1e-3), smooth("y_m", 1e-3), np.radians(smooth("heading_deg", 0.3))
    k = np.arange(200) + 0.5
    disc = 0.5 * SENSOR.spot_diameter * np.sqrt(k / 200) * np.exp(1j * k * np.pi * (3 - np.sqrt(5)))
    spot = (x + 1j * y + SENSOR.ahead * np.exp(1j * heading))[:, None] + disc + complex(*shift_m)
    cells = course.raster(0.0005)
    columns, rows = (spot.real / 0.0005).astype(int), (spot.imag / 0.0005).astype(int)
    return cells[rows, columns].mean(axis=1) / 2.55


def misfit(course, shift_m=(0.0, 0.0)):
    return np.sqrt(np.mean((ROWS["reflection_pct"] - predicted(course, shift_m)) ** 2))


def test_the_line_lies_where_the_sensor_saw_it():
    paper = load_course("paper")
    assert misfit(paper) < 8.5  # the camera's 1 mm noise, on edges that rise by 12 % a millimetre
    for shift in ((0.003, 0.0), (-0.003, 0.0), (0.0, 0.003), (0.0, -0.003)):
        assert misfit(paper, shift) > misfit(paper) + 2


def test_the_corners_are_sharp():
    paper = load_course("paper")
    round_tiles = "f------?\n|######|\n|######|\nl------j"
    text = f"map = '''\n{round_tiles}\n'''\ngoal = [0, 1]\n[start]\ntile = [0, 2]\nheading = 'up'\n"
    assert misfit(parse_course(text)) > 2.5 * misfit(paper)


def test_the_robot_was_put_down_beside_the_line_as_on_our_course():
    start = load_course("paper").start
    assert ROWS["x_m"][0] == pytest.approx(start.x_m, abs=0.01)
    assert np.radians(ROWS["heading_deg"][0]) == pytest.approx(start.heading_rad, abs=0.06)
