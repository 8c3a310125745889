"""The robot and its floor as PyBullet bodies: chassis with a ball under it, two wheels, a plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pybullet

from benchmarks.concealed.robot import (
    CASTER_RADIUS,
    CHASSIS_PITCH_INERTIA,
    CHASSIS_ROLL_INERTIA,
    WHEEL_MASS,
    Concealed,
)

HUBS, WHEELS = (0, 2), (1, 3)  # links, left and right; Bullet counts depth first
# Wheels can shift along their axle against stiff springs, as tyres flex. Were they rigid, Bullet would let the wheel
# it looks at first carry all of the sideways force, and slip.
SIDE_STIFFNESS = 2.0e4  # N / m
SIDE_DAMPING = 12.0  # N s / m
# The wheel of a gear with play, or of a tyre that slips, must not be lighter than the step allows; what it has too
# much is taken off the shaft.
WHEEL_INERTIA = 3.0e-5  # kg m^2
_RIDGE_RADIUS = 0.20  # m


@dataclass(frozen=True)
class Body:
    """What was built, by Bullet's numbers, and where the axle's centre is in the chassis' own frame [m]."""

    robot: int
    axle: tuple[float, float, float]
    height: float


def build(client: int, concealed: Concealed) -> Body:
    """Put floor and robot into a world; the robot heads along +x, its axle over the origin.

    Parameters
    ----------
    client
        A connection to Bullet.
    concealed
        What differs from the nominal robot.

    Returns
    -------
    Body
    """
    floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    _surfaced(client, pybullet.createMultiBody(0.0, floor, physicsClientId=client), -1, 1.0)
    if concealed.bump is not None:
        _lay_ridge(client, *concealed.bump)
    base, half = concealed.base, concealed.radius_difference / 2.0
    mean = base.wheel_radius * concealed.radius_scale
    radii = (mean * (1.0 - half), mean * (1.0 + half))
    lever = base.track_width * concealed.track_scale / 2.0
    mass = base.mass - 2.0 * WHEEL_MASS
    ahead = base.mass * concealed.com_ahead / mass
    up = (base.mass * concealed.com_height - 2.0 * WHEEL_MASS * mean) / mass - mean
    wheels = 2.0 * WHEEL_MASS * (concealed.com_ahead**2 + lever**2) + WHEEL_INERTIA
    yaw = base.yaw_inertia * concealed.yaw_inertia_scale - wheels - mass * (ahead - concealed.com_ahead) ** 2
    offset = concealed.off_centre or (0.0, 0.0, 0.0)
    height = mean + offset[0]
    ball = pybullet.createCollisionShape(
        pybullet.GEOM_SPHERE,
        radius=CASTER_RADIUS,
        collisionFramePosition=[base.caster_ahead - ahead, 0.0, CASTER_RADIUS - mean - up],
        physicsClientId=client,
    )
    tyres = [
        pybullet.createCollisionShape(
            pybullet.GEOM_SPHERE,
            radius=radius,
            collisionFramePosition=[offset[0] * math.cos(phase), 0.0, -offset[0] * math.sin(phase)],
            physicsClientId=client,
        )
        for radius, phase in zip(radii, offset[1:], strict=True)
    ]
    none = [0.0, 0.0, 0.0]
    robot = pybullet.createMultiBody(
        baseMass=mass,
        baseCollisionShapeIndex=ball,
        basePosition=[ahead, 0.0, height + up],
        linkMasses=[WHEEL_MASS / 2.0] * 4,
        linkCollisionShapeIndices=[-1, tyres[0], -1, tyres[1]],
        linkVisualShapeIndices=[-1] * 4,
        linkPositions=[[-ahead, lever, -up], none, [-ahead, -lever, -up], none],
        linkOrientations=[[0.0, 0.0, 0.0, 1.0]] * 4,
        linkInertialFramePositions=[none] * 4,
        linkInertialFrameOrientations=[[0.0, 0.0, 0.0, 1.0]] * 4,
        linkParentIndices=[0, 1, 0, 3],
        linkJointTypes=[pybullet.JOINT_PRISMATIC, pybullet.JOINT_REVOLUTE] * 2,
        linkJointAxis=[across for axle in _axles(concealed) for across in ([0.0, 1.0, 0.0], axle)],
        physicsClientId=client,
    )
    _freed(client, robot)
    _surfaced(client, robot, -1, concealed.caster_friction)
    for link in (*HUBS, *WHEELS):
        if link in WHEELS:
            _surfaced(client, robot, link, concealed.tyre_friction)
        pybullet.changeDynamics(robot, link, jointDamping=0.0, maxJointVelocity=1e4, physicsClientId=client)
        pybullet.setJointMotorControl2(
            robot, link, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client
        )
    # Last, and in calls of their own: other changes make Bullet take inertias from the shapes again.
    across = WHEEL_INERTIA / 2.0
    inertias = {link: [across, WHEEL_INERTIA, across] for link in WHEELS}
    inertias |= {link: [1e-7] * 3 for link in HUBS}
    inertias[-1] = [CHASSIS_ROLL_INERTIA, CHASSIS_PITCH_INERTIA, yaw]
    for link, inertia in inertias.items():
        pybullet.changeDynamics(robot, link, localInertiaDiagonal=inertia, physicsClientId=client)
    return Body(robot, (-ahead, 0.0, -up), height)


def _axles(concealed: Concealed) -> list[list[float]]:
    """Give the directions of the left and the right wheel's axle in the chassis' frame."""
    toes = [0.0, 0.0]
    if concealed.toe is not None:
        toes[concealed.toe[1]] = concealed.toe[0]
    return [[0.0 - math.sin(toe), math.cos(toe), 0.0] for toe in toes]


def _freed(client: int, body: int) -> None:
    """Take away every drag that Bullet adds of its own; given with a link, it would be the base's call."""
    pybullet.changeDynamics(
        body,
        -1,
        linearDamping=0.0,
        angularDamping=0.0,
        activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )


def _surfaced(client: int, body: int, link: int, friction: float) -> None:
    """Set how one surface rubs: Bullet multiplies the two that touch."""
    pybullet.changeDynamics(
        body,
        link,
        lateralFriction=friction,
        spinningFriction=0.0,
        rollingFriction=0.0,
        restitution=0.0,
        physicsClientId=client,
    )


def _lay_ridge(client: int, height: float, x: float, angle: float) -> None:
    """Lay a threshold strip across the floor: the cap of a cylinder that lies below it."""
    cylinder = pybullet.createCollisionShape(
        pybullet.GEOM_CAPSULE, radius=_RIDGE_RADIUS, height=6.0, physicsClientId=client
    )
    lying = pybullet.getQuaternionFromEuler([math.pi / 2.0, 0.0, angle])
    ridge = pybullet.createMultiBody(
        0.0, cylinder, -1, [x, 0.6, height - _RIDGE_RADIUS], lying, physicsClientId=client
    )
    _surfaced(client, ridge, -1, 1.0)
