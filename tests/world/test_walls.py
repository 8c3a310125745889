"""Walls and crates alone: where they stand, their friction, and how a robot that nothing drives meets them."""

from __future__ import annotations

import numpy as np
import pymunk
import pytest
from support.courses import make_course

from gecar.language.program import parse_program
from gecar.world.kernel.state import GRAVITY
from gecar.world.pymunk_space import build_engine
from gecar.world.robot import load_robot
from gecar.world.rollout import Drive, World, simulate

EV3 = load_robot("ev3")
BODY = EV3.body
MASS, INERTIA, COM_AHEAD = (float(EV3.physics[name][0]) for name in ("mass", "yaw_inertia", "com_ahead"))
ROUNDING, WALL = 0.001, 0.005  # of the robot's outline, half a wall's thickness [m]
BEHIND = 0.015 - BODY.caster_ahead + ROUNDING  # from the axle [m]
FRONT = BODY.length - 0.015 + BODY.caster_ahead + ROUNDING
FLANK = 0.5 * BODY.width + ROUNDING
ROBOT_FRICTION, WALL_FRICTION = 0.4, 0.5
DT = 0.001
FIELD = "\n".join([*["." * 5] * 4, "-" * 5])


def wall(start: complex, end: complex) -> str:
    """The lines of a wall between two points [m]."""
    return f"[[walls]]\nfrom_m = [{start.real}, {start.imag}]\nto_m = [{end.real}, {end.imag}]\n"


def obstacle(kind: str, movable: bool) -> str:
    """The lines of a box of 0.2 m by 0.06 m, or a disc of 0.1 m, in the middle of the field."""
    size = "size_m = [0.2, 0.06]" if kind == "box" else "diameter_m = 0.1"
    return (
        f"[[obstacles]]\nkind = '{kind}'\n{size}\nat_m = [0.75, 0.75]\nmovable = {str(movable).lower()}\n"
        "mass_kg = 0.3\nfriction = 0.6\n"
    )


def put(
    things: str, place: complex, heading: float = 0.0
) -> tuple[pymunk.Space, pymunk.Body, list[pymunk.Body]]:
    """Put a robot's axle centre on a field of 1.5 m squared; return the space, the robot and the obstacles."""
    course = make_course(FIELD, start="[0, 0]", goal="[4, 0]", heading='"right"', start_more=things)
    engine, obstacles = build_engine(EV3, course, place.real, place.imag, heading)
    return engine.space, engine.body, obstacles


def pushed(space: pymunk.Space, body: pymunk.Body, force: complex, seconds: float) -> np.ndarray:
    """Push at the centre of mass [N]; return the body's velocity after each step, shape (steps, 2)."""
    speeds = []
    for _ in range(round(seconds / DT)):
        body.apply_force_at_world_point((force.real, force.imag), body.position)
        space.step(DT)
        speeds.append(body.velocity)
    return np.array(speeds)


def axle(body: pymunk.Body) -> complex:
    return complex(*body.position) - COM_AHEAD * np.exp(1j * body.angle)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("wall_deg", [0, 30, 90, 135])
@pytest.mark.parametrize(
    ("quarter", "reach"),
    [(0, FRONT), (1, FLANK), (2, BEHIND), (3, FLANK)],
    ids=["front", "right", "rear", "left"],
)
def test_every_side_of_a_robot_rests_on_a_wall_where_the_course_has_it(
    quarter: int, reach: float, wall_deg: float, side: int
) -> None:
    along = np.exp(1j * np.radians(wall_deg))
    towards, middle = side * 1j * along, 0.75 + 0.75j
    heading = float(np.angle(towards)) + 0.5 * np.pi * quarter
    space, body, _ = put(wall(middle - 0.3 * along, middle + 0.3 * along), middle - 0.25 * towards, heading)
    assert axle(body) == pytest.approx(middle - 0.25 * towards)
    pushed(space, body, 2.0 * towards, 2.0)
    away = middle - axle(body)
    assert (away * towards.conjugate()).real == pytest.approx(reach + WALL, abs=0.0007)


@pytest.mark.parametrize("end", [0.5, 1.0], ids=["lower", "upper"])
@pytest.mark.parametrize(("clearance", "passes"), [(0.001, True), (-0.003, False)])
def test_a_wall_ends_where_the_course_has_it(end: float, clearance: float, passes: bool) -> None:
    beyond = np.sign(end - 0.75) * (FLANK + WALL + clearance)
    space, body, _ = put(wall(0.75 + 0.5j, 0.75 + 1j), 0.4 + (end + beyond) * 1j)
    body.velocity = (0.5, 0.0)
    while body.velocity.x == 0.5 and axle(body).real < 1.2:
        space.step(DT)
    assert axle(body).real == pytest.approx(1.2 if passes else 0.75 - WALL - FRONT, abs=0.0015)


def test_a_robot_pushed_into_a_corner_rests_on_both_walls() -> None:
    corner = 1.0 + 1.0j
    space, body, _ = put(wall(0.5 + 1j, corner) + wall(corner, 1 + 0.5j), 0.7 + 0.75j)
    pushed(space, body, 2.0 + 2.0j, 3.0)
    rest = corner - axle(body)
    assert (rest.real, rest.imag) == pytest.approx((FRONT + WALL, FLANK + WALL), abs=0.0007)


@pytest.mark.parametrize(
    ("things", "friction"),
    [(wall(0.2 + 0.8j, 1.3 + 0.8j), WALL_FRICTION), (obstacle("box", movable=False), 0.6)],
    ids=["wall", "crate"],
)
def test_a_flank_pressed_on_a_wall_or_crate_slows_by_their_friction(things: str, friction: float) -> None:
    face = 0.8 - WALL if "walls" in things else 0.75 - 0.03 - ROUNDING
    space, body, _ = put(things, 0.72 + (face - FLANK) * 1j)
    body.velocity = (0.2, 0.0)
    speed = pushed(space, body, 4.0j, 0.15)[:, 0]
    slowing = (speed[20] - speed[120]) / 0.1
    assert slowing == pytest.approx(ROBOT_FRICTION * friction * 4.0 / MASS, rel=0.02)


@pytest.mark.parametrize("things", [wall(0.75 + 0.5j, 0.75 + 1j), obstacle("box", movable=False)])
def test_a_robot_does_not_bounce_off_a_wall_or_crate(things: str) -> None:
    space, body, _ = put(things, 0.4 + 0.75j)
    body.velocity = (0.5, 0.0)
    speed = pushed(space, body, 0.0, 1.2)
    assert speed[0, 0] == pytest.approx(0.5)
    assert np.abs(speed[-100:]).max() < 0.01


def test_the_end_of_a_wall_turns_a_robot_by_its_inertia() -> None:
    """An inelastic hit without friction at a lever: impulse = v / (1 / m + lever^2 / I)."""
    lever = 0.05
    space, body, _ = put(wall(0.75 + 0.8j, 0.75 + 1j), 0.4 + (0.8 - lever) * 1j)
    for shape in space.shapes:
        shape.friction = 0.0
    body.velocity = (0.5, 0.0)
    while body.angular_velocity == 0.0 and body.position.x < 1.0:
        space.step(DT)
    impulse = 0.5 / (1.0 / MASS + lever**2 / INERTIA)
    assert body.angular_velocity == pytest.approx(impulse * lever / INERTIA, rel=1e-3)
    assert body.velocity.x == pytest.approx(0.5 - impulse / MASS, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "inertia", "reach"),  # per mass [m^2]; mean distance of the floor's friction from the middle [m]
    [("box", (0.2**2 + 0.06**2) / 12.0, 0.25 * 0.26), ("disc", 0.5 * 0.05**2, 2.0 / 3.0 * 0.05)],
)
def test_the_floor_stops_what_slides_and_spins(kind: str, inertia: float, reach: float) -> None:
    space, _, (body,) = put(obstacle(kind, movable=True), 0.2 + 0.2j)
    body.velocity, body.angular_velocity = (0.5, 0.0), 10.0
    before, spin = body.velocity.x, body.angular_velocity
    for _ in range(40):
        space.step(DT)
    assert (before - body.velocity.x) / 0.04 == pytest.approx(0.6 * GRAVITY, rel=0.03)
    assert (spin - body.angular_velocity) / 0.04 == pytest.approx(0.6 * GRAVITY * reach / inertia, rel=0.03)


@pytest.mark.parametrize(("heading", "width"), [(0.0, 0.2), (0.5 * np.pi, 0.06)])
def test_a_box_is_as_long_and_as_wide_as_the_course_has_it(heading: float, width: float) -> None:
    place = 0.75 + 0.75j - 0.3 * np.exp(1j * heading)
    space, body, _ = put(obstacle("box", movable=False), place, heading)
    pushed(space, body, 2.0 * np.exp(1j * heading), 1.5)
    assert abs(0.75 + 0.75j - axle(body)) == pytest.approx(FRONT + 0.5 * width + ROUNDING, abs=0.0007)


def along_a_wall(side: int, walled: bool = True) -> Drive:
    """Drive a lane of ten tiles, turned a little towards a wall beside it: 1 left, -1 right."""
    y = 0.15 + side * 0.12
    things = wall(0.05 + y * 1j, 2.95 + y * 1j) if walled else ""
    lane = make_course("-" * 10, start="[0, 0]", goal="[9, 0]", heading='"right"', start_more=things)
    first = "motor(40,50,500)" if side > 0 else "motor(50,40,500)"
    program = parse_program(first + "motor(50,50,9000)").opcodes
    return simulate(World(EV3, lane, time_limit_s=5.0), program, trace=True)


@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
def test_a_robot_that_meets_a_wall_at_an_angle_turns_along_it(side: int) -> None:
    walled, free = along_a_wall(side), along_a_wall(side, walled=False)
    y, heading = walled.trace["y_m"], walled.trace["heading_rad"]
    assert side * free.trace["heading_rad"][-1] > 0.1
    assert heading[-1] == pytest.approx(0.0, abs=0.003)
    assert side * (y[-1] - 0.15) == pytest.approx(0.12 - WALL - FLANK, abs=0.001)
    assert walled.trace["x_m"][-1] > free.trace["x_m"][-1] + 0.3  # where the free robot left the course


def test_walls_on_the_left_and_on_the_right_act_alike() -> None:
    left, right = along_a_wall(1).trace, along_a_wall(-1).trace
    assert np.abs(left["x_m"] - right["x_m"]).max() < 1e-9
    assert np.abs(left["y_m"] + right["y_m"] - 0.3).max() < 1e-9
