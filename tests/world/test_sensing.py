import numpy as np
import pytest

from gecar.random_streams import normal_bound, normal_quantile
from gecar.reality.replay.reflectance import readings_along
from gecar.world.course.course import load_course
from gecar.world.kernel.sensing import (
    RING,
    delayed,
    glance,
    is_even,
    lag_keep,
    lagged,
    reported,
    spot_average,
    spot_reflection,
    surface,
)
from gecar.world.kernel.state import STATE, place
from gecar.world.robot import load_robot
from gecar.world.rollout import World

EV3, PAPER = load_robot("ev3"), load_course("paper")
RASTER, PITCH = PAPER.raster(), PAPER.pitch_m
SURFACE = surface(RASTER, PITCH)
AVERAGED = spot_average(RASTER, PITCH, EV3.colour_sensor.spot_diameter)


def seen(x, y, heading=0.0, robot=EV3):
    state = np.zeros(1, STATE)
    place(state[0], robot.physics[0], x, y, heading)
    return glance(AVERAGED, PITCH, state[0], 0.0, 0.0, robot.physics[0])


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
        slow = spot_reflection(SURFACE, x, 0.6, np.cos(heading), np.sin(heading), 0.0, 0.0, physics)
        assert seen(x, 0.6, heading) == pytest.approx(slow, abs=1.5)


def test_on_even_floor_one_cell_says_what_the_whole_spot_does():
    rng = np.random.default_rng(1)
    looked = SURFACE._replace(even=np.zeros_like(SURFACE.even))
    skipped = 0
    for _ in range(3000):
        x, y = rng.uniform(-0.05, PAPER.width_m + 0.05), rng.uniform(-0.05, PAPER.height_m + 0.05)
        robot = EV3.with_effects({"spot_size": {"diameter_m": rng.uniform(0.002, 0.03)}})
        p, turn = robot.physics[0], rng.uniform(-np.pi, np.pi)
        one, whole = (
            spot_reflection(floor, x, y, np.cos(turn), np.sin(turn), 0.0, 0.0, p)
            for floor in (SURFACE, looked)
        )
        assert one == pytest.approx(whole, abs=1e-9)
        ahead = p["sensor_ahead"] * np.array([np.cos(turn), np.sin(turn)])
        skipped += is_even(SURFACE, x + ahead[0], y + ahead[1], 0.5 * p["spot_diameter"])
    assert 1000 < skipped < 2900


def test_floor_is_even_as_far_as_its_cells_are_alike():
    cells = np.full((40, 60), 255, np.uint8)
    cells[20, 30] = 0
    floor = surface(cells, 0.001)
    assert is_even(floor, 0.0055, 0.0055, 0.004)
    assert not is_even(floor, 0.0305, 0.0235, 0.004)
    assert not is_even(floor, -0.001, 0.0055, 0.0)  # beside the field all is bare, and looked at
    assert is_even(surface(np.zeros((40, 60), np.uint8), 0.001), 0.03, 0.02, 0.004)
    assert not is_even(surface(np.zeros((40, 60), np.uint8), 0.001), 0.002, 0.002, 0.004)


def spot_seen(x, y, heading=0.0, robot=EV3):
    """What `seen` gives, as fits see it: the spot averaged on the way."""
    cos, sin = np.cos(heading), np.sin(heading)
    return spot_reflection(SURFACE, x, y, cos, sin, 0.0, 0.0, robot.physics[0])


@pytest.mark.parametrize("look", [seen, spot_seen])
@pytest.mark.parametrize(
    "shift", [(0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.05), (0.01, -0.02, -0.03)]
)
def test_shifted_course_is_seen_where_it_lies(look, shift):
    dx, dy, angle = shift
    shifted = EV3.with_effects({"line_shift": {"dx_m": dx, "dy_m": dy, "angle_rad": angle}})
    poses = [(0.0815, 0.6, 0.0), (0.083, 0.7, 0.2), (1.2, 0.08, 1.55)]
    there = [
        ((x + 1j * y) * np.exp(1j * angle) + complex(dx, dy), heading + angle) for x, y, heading in poses
    ]
    moved = [look(place.real, place.imag, heading, shifted) for place, heading in there]
    assert moved == pytest.approx([look(*pose) for pose in poses], abs=1e-6)
    unmoved = [look(place.real, place.imag, heading) for place, heading in there]
    assert np.abs(np.subtract(moved, unmoved)).max() > 5.0


@pytest.mark.parametrize("look", [seen, spot_seen])
@pytest.mark.parametrize("size", [0.97, 1.05])
def test_a_course_of_another_size_is_seen_where_it_is_printed(look, size):
    printed = EV3.with_effects({"line_scale": {"scale": size}})
    course = load_course("paper")
    middle, ahead = complex(course.width_m, course.height_m) / 2.0, EV3.colour_sensor.ahead
    poses = [(0.0815, 0.6, 0.0), (0.083, 0.7, 0.2), (1.2, 0.08, 1.55)]
    seen_at = [complex(x, y) + ahead * np.exp(1j * heading) for x, y, heading in poses]
    axles = [
        middle + size * (spot - middle) - ahead * np.exp(1j * heading)
        for spot, (_, _, heading) in zip(seen_at, poses, strict=True)
    ]
    there = [(axle.real, axle.imag, heading) for axle, (_, _, heading) in zip(axles, poses, strict=True)]
    # the sensor's spot stays as large as it is
    assert [look(*pose, printed) for pose in there] == pytest.approx([look(*pose) for pose in poses], abs=3.0)
    assert np.abs(np.subtract([look(*pose) for pose in there], [look(*pose) for pose in poses])).max() > 10.0


@pytest.mark.parametrize("look", [seen, spot_seen])
def test_a_sensor_mounted_elsewhere_sees_what_is_there(look):
    moved = EV3.with_effects(
        {"sensor_position": {"ahead_m": EV3.colour_sensor.ahead + 0.01, "left_m": -0.02}}
    )
    at, heading = 0.13, 1.3  # nearly along the line, so that both shifts count
    there = complex(at, 0.6) + complex(0.01, -0.02) * np.exp(1j * heading)
    assert look(at, 0.6, heading, moved) == pytest.approx(look(there.real, there.imag, heading), abs=1e-6)
    ahead_only = complex(at, 0.6) + 0.01 * np.exp(1j * heading)
    for other in (complex(at, 0.6), ahead_only):
        assert abs(look(at, 0.6, heading, moved) - look(other.real, other.imag, heading)) > 5.0


@pytest.mark.parametrize("offset_mm", [-9.0, -5.0, 6.0, 9.0])
def test_a_larger_spot_blurs_the_edge_in_drives_and_in_fits(offset_mm):
    large = EV3.with_effects({"spot_size": {"diameter_m": 0.024}})
    x = 0.1625 + offset_mm / 1000.0 - EV3.colour_sensor.ahead
    expected = pytest.approx(100.0 * (1.0 - covered(offset_mm / 1000.0, 0.012)), abs=1.6)
    state, floor = np.zeros(1, STATE), World(large, PAPER).floor
    place(state[0], large.physics[0], x, 0.6, 0.0)
    assert glance(floor.averaged, floor.pitch, state[0], 0.0, 0.0, large.physics[0]) == expected
    assert spot_seen(x, 0.6, 0.0, large) == expected


def crossing(robot, seconds=0.6, dt=0.002):
    """Predicted readings of a sensor that is carried over the line at 0.25 m/s, from white to black to white."""
    t = np.arange(0.0, seconds, dt)
    path = np.column_stack([0.02 + 0.25 * t, np.full_like(t, 0.6), np.zeros_like(t)])
    return readings_along(t, path, 0.0, 1e-3, SURFACE, robot.physics, np.zeros(3))


def test_a_late_sensor_is_predicted_to_report_what_it_saw_before():
    now, late = crossing(EV3), crossing(EV3.with_effects({"sensor_delay": {"time_s": 0.04}}))
    assert late[20:] == pytest.approx(now[:-20], abs=1e-6)


def test_a_lagging_sensor_is_predicted_to_lose_its_time_constant_at_an_edge():
    # the area between a step and a first-order lag's answer is the step times the time constant
    now, lags = crossing(EV3), crossing(EV3.with_effects({"sensor_lag": {"time_constant_s": 0.01}}))
    to_black = slice(0, int(np.argmin(now)) + 25)
    assert (lags - now)[to_black].sum() * 0.002 == pytest.approx(100.0 * 0.01, rel=0.01)


def test_gain_and_offset_are_predicted():
    now, other = crossing(EV3), crossing(EV3.with_effects({"sensor_gain": {"gain": 0.5, "offset_pct": 10.0}}))
    assert other == pytest.approx(0.5 * now + 10.0, abs=0.01)


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


def test_normal_numbers_stay_within_their_bounds():
    for u in (2.0**-54, 1e-6, 0.0007, 0.00071, 0.3, 0.5, 0.7, 0.9992, 0.9994, 1.0 - 2.0**-53):
        z, most = normal_quantile(u), normal_bound(u)
        assert min(most, 0.0) <= z <= max(most, 0.0)
