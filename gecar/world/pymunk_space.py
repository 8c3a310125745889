"""A pymunk space for a course: the robot's outline, walls, and obstacles that drag on the floor."""

from __future__ import annotations

import pymunk

from gecar.world.course.course import Course
from gecar.world.course.obstacle import Obstacle
from gecar.world.kernel.chipmunk import Engine, make_engine
from gecar.world.kernel.state import GRAVITY
from gecar.world.robot import Robot

WALL_RADIUS_M = 0.005
ROBOT_FRICTION = 0.4  # plastic on plastic
WALL_FRICTION = 0.5


def build_engine(
    robot: Robot, course: Course, x: float, y: float, heading: float
) -> tuple[Engine, list[pymunk.Body]]:
    """Make a fresh space with the robot's axle centre at a pose [m, m, rad].

    Returns
    -------
    tuple
        The engine, and the obstacles' bodies in the course's order.
    """
    space = pymunk.Space()
    space.iterations = 20
    space.collision_slop = 0.0005
    space.collision_bias = 0.2**60
    space.sleep_time_threshold = 0.1  # resting obstacles sleep, and cost nothing
    body = _robot_body(robot)
    body.angle = heading
    body.position = pymunk.Vec2d(x, y) + pymunk.Vec2d(robot.physics["com_ahead"][0], 0.0).rotated(heading)
    space.add(body, *body.shapes)
    for x0, y0, x1, y1 in course.walls:
        wall = pymunk.Segment(space.static_body, (x0, y0), (x1, y1), WALL_RADIUS_M)
        wall.friction = WALL_FRICTION
        space.add(wall)
    obstacles = [_add_obstacle(space, obstacle) for obstacle in course.obstacles]
    return make_engine(space, body), obstacles


def _robot_body(robot: Robot) -> pymunk.Body:
    """Return the robot's body: a box from behind the caster to ahead of the wheels, origin at the centre of mass."""
    physics = robot.physics[0]
    body = pymunk.Body(float(physics["mass"]), float(physics["yaw_inertia"] * physics["yaw_inertia_scale"]))
    half = 0.5 * robot.body.width
    # The caster is under the rear end; the rest of the length reaches ahead of the axle.
    behind = robot.body.caster_ahead - 0.015
    rear = behind - float(physics["com_ahead"])
    front = rear + robot.body.length
    outline = pymunk.Poly(body, [(rear, -half), (front, -half), (front, half), (rear, half)], radius=0.001)
    outline.friction = ROBOT_FRICTION
    return body


def _add_obstacle(space: pymunk.Space, obstacle: Obstacle) -> pymunk.Body:
    """Add an obstacle; one that can move is held by friction with the floor, as a joint of limited force."""
    if obstacle.kind == "disc":
        moment = pymunk.moment_for_circle(obstacle.mass, 0.0, obstacle.radius)
    else:
        moment = pymunk.moment_for_box(obstacle.mass, (obstacle.length, obstacle.width))
    movable = obstacle.movable
    body = pymunk.Body(obstacle.mass, moment) if movable else pymunk.Body(body_type=pymunk.Body.STATIC)
    body.position = (obstacle.x, obstacle.y)
    body.angle = obstacle.heading
    if obstacle.kind == "disc":
        shape: pymunk.Shape = pymunk.Circle(body, obstacle.radius)
        reach = 2.0 / 3.0 * obstacle.radius
    else:
        shape = pymunk.Poly.create_box(body, (obstacle.length, obstacle.width), radius=0.001)
        reach = 0.25 * (obstacle.length + obstacle.width)
    shape.friction = obstacle.friction
    space.add(body, shape)
    if movable:
        weight = obstacle.friction * obstacle.mass * GRAVITY
        slide = pymunk.PivotJoint(space.static_body, body, (0, 0), (0, 0))
        spin = pymunk.GearJoint(space.static_body, body, 0.0, 1.0)
        slide.max_bias = spin.max_bias = 0.0  # friction resists motion, it does not pull back
        slide.max_force = weight
        spin.max_force = weight * reach
        space.add(slide, spin)
    return body
