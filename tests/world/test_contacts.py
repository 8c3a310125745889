"""What the robot touches: walls and fixed things stop it, movable ones are pushed, what is beside it does nothing."""

from __future__ import annotations

import numpy as np
import pytest
from support.courses import make_course

from gecar.language.program import parse_program
from gecar.world.kernel.state import GRAVITY
from gecar.world.pymunk_space import WALL_RADIUS_M
from gecar.world.robot import load_robot
from gecar.world.rollout import Drive, Driver, Outcome, World, simulate

EV3 = load_robot("ev3")
BODY, MOTOR = EV3.body, EV3.motor
FRONT = BODY.caster_ahead - 0.015 + BODY.length + 0.001  # of the outline, ahead of the axle [m]
AHEAD = parse_program("motor(50,50,1000)").opcodes
WALL = "[[walls]]\nfrom_m = [0.9, {low}]\nto_m = [0.9, {high}]\n"
CRATE = """[[obstacles]]
kind = '{kind}'
{size}
at_m = [0.9, {y}]
movable = {movable}
mass_kg = {mass}
friction = 0.4
"""


def crate(
    movable: bool = True, mass: float = 0.1, y: float = 0.15, kind: str = "box", size_m: float = 0.1
) -> str:
    size = f"size_m = [{size_m}, {size_m}]" if kind == "box" else f"diameter_m = {size_m}"
    return CRATE.format(kind=kind, size=size, y=y, movable=str(movable).lower(), mass=mass)


def lane(things: str = "") -> World:
    """Ten tiles of straight line along y = 0.15 m, with things on them."""
    course = make_course("-" * 10, start="[0, 0]", goal="[9, 0]", heading='"right"', start_more=things)
    return World(EV3, course, time_limit_s=6.0)


def ahead(things: str = "") -> Drive:
    return simulate(lane(things), AHEAD, trace=True)


def place(drive: Drive) -> float:
    """Where the axle came to [m]."""
    return float(drive.trace["x_m"][-1])


def wheel_speed(drive: Drive) -> float:
    """Mean speed of the left wheel's rim in the last half second [m/s]."""
    angle = drive.trace["left_angle_rad"]
    return float(angle[-1] - angle[-51]) / 0.5 * BODY.wheel_radius


def test_a_wall_stops_the_robot_at_its_front_while_the_wheels_turn_on() -> None:
    drive = ahead(WALL.format(low=0.01, high=0.29))
    assert place(drive) == pytest.approx(0.9 - WALL_RADIUS_M - FRONT, abs=0.002)
    assert drive.trace["x_m"].max() < 0.9 - FRONT
    rolled = drive.trace["left_angle_rad"][-1] * BODY.wheel_radius
    assert rolled > place(drive) - drive.trace["x_m"][0] + 0.1


@pytest.mark.parametrize("kind", ["box", "disc"])
def test_a_fixed_thing_stops_the_robot(kind: str) -> None:
    drive = ahead(crate(movable=False, kind=kind))
    assert place(drive) == pytest.approx(0.85 - FRONT, abs=0.003)
    assert np.ptp(drive.obstacles, axis=0).max() == 0.0


def test_a_box_stands_turned_as_the_course_has_it() -> None:
    turned = crate(movable=False) + "heading_deg = 45\n"
    assert place(ahead(turned)) == pytest.approx(0.9 - 0.05 * 2.0**0.5 - FRONT, abs=0.003)


@pytest.mark.parametrize("kind", ["box", "disc"])
def test_a_movable_thing_is_pushed_along(kind: str) -> None:
    drive = ahead(crate(kind=kind))
    assert place(drive) > 1.2
    assert drive.obstacles[-1, 0, 0] == pytest.approx(place(drive) + FRONT + 0.05, abs=0.003)


def test_pushing_costs_the_friction_of_what_is_pushed() -> None:
    # settled: Kt (duty V - Ke w) / R = T + F r / 2, F = friction x mass x g
    drag = 0.4 * 0.5 * GRAVITY * 0.5 * BODY.wheel_radius
    torque = (
        MOTOR.torque_constant * 0.5 * EV3.battery.voltage / MOTOR.resistance - MOTOR.coulomb_friction - drag
    )
    w = torque * MOTOR.resistance / (MOTOR.torque_constant * MOTOR.back_emf_constant)
    pushing = wheel_speed(ahead(crate(mass=0.5)))
    assert pushing == pytest.approx(w * BODY.wheel_radius, rel=0.003)
    assert pushing < 0.95 * wheel_speed(ahead())


@pytest.mark.parametrize("y", [0.15, 0.21])
def test_what_was_pushed_comes_to_rest_where_friction_stops_it(y: float) -> None:
    there_and_back = parse_program("motor(50,50,4500)motor(-50,-50,9000)").opcodes
    moved = simulate(lane(crate(y=y)), there_and_back, trace=True).obstacles[:, 0]
    gone = 0.3**2 / (2.0 * 0.4 * GRAVITY)  # at no more than 0.3 m/s
    assert moved[450, 0] > 0.95
    assert moved[-1, 0] - moved[450, 0] < gone + 0.005
    assert np.ptp(moved[-50:], axis=0).max() < 1e-6


@pytest.mark.parametrize(
    "things", [crate(y=0.26, kind="disc", size_m=0.06), WALL.format(low=0.24, high=0.29)]
)
def test_what_stands_beside_the_way_changes_nothing(things: str) -> None:
    assert np.abs(ahead(things).trace["x_m"] - ahead().trace["x_m"]).max() < 1e-9


@pytest.mark.parametrize(("gap_m", "outcome"), [(0.145, Outcome.OUT_OF_TIME), (0.185, Outcome.GOAL)])
def test_the_robot_passes_a_gate_that_is_wider_than_it(gap_m: float, outcome: Outcome) -> None:
    low, high = 0.15 - 0.5 * gap_m, 0.15 + 0.5 * gap_m
    gate = WALL.format(low=0.01, high=low) + WALL.format(low=high, high=0.29)
    course = make_course("-" * 5, start="[0, 0]", goal="[4, 0]", heading='"right"', start_more=gate)
    assert simulate(World(EV3, course, time_limit_s=10.0), AHEAD).outcome is outcome


def test_a_second_drive_finds_everything_where_the_course_has_it() -> None:
    driver = Driver(lane(crate()))
    first, second = (driver.simulate(AHEAD, trace=True) for _ in range(2))
    assert first.obstacles[-1, 0, 0] > first.obstacles[0, 0, 0] + 0.3
    assert np.array_equal(first.obstacles, second.obstacles)


def test_a_push_off_the_middle_turns_both() -> None:
    drive = ahead(crate(y=0.21, mass=0.5))
    assert drive.trace["heading_rad"].max() > 0.02
    assert abs(drive.obstacles[-1, 0, 2]) > 0.02
