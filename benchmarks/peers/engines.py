"""The robot in three engines: a box, two driven wheels and a caster that slides without friction."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.peers.control import Motors, Pose
from gecar.world.robot import Robot

WHEEL_MASS = 0.02  # kg, a 56 mm wheel
CASTER_RADIUS = 0.010  # m
GRAVITY = 9.81  # m/s^2


class PyBulletRobot:
    """PyBullet at its own step of 1/240 s, as the paper's authors used it."""

    step_s = 1.0 / 240.0

    def __init__(self, robot: Robot) -> None:
        import pybullet  # noqa: PLC0415

        self.bullet, self.motors, self.radius = pybullet, Motors(robot), robot.body.wheel_radius
        pybullet.connect(pybullet.DIRECT)
        pybullet.setGravity(0, 0, -GRAVITY)
        pybullet.setTimeStep(self.step_s)
        plane = pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
        pybullet.changeDynamics(plane, -1, lateralFriction=1.0)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(_urdf(robot))
            self.body = pybullet.loadURDF(str(file), flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        self.ahead = _chassis_ahead(robot)
        pybullet.changeDynamics(self.body, -1, linearDamping=0, angularDamping=0, lateralFriction=0)
        for wheel in (0, 1):
            rubs = {"lateralFriction": robot.tyre.friction, "jointDamping": 0.0, "rollingFriction": 0.0}
            pybullet.changeDynamics(self.body, wheel, linearDamping=0, angularDamping=0, **rubs)
            pybullet.setJointMotorControl2(self.body, wheel, pybullet.VELOCITY_CONTROL, force=0)

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest."""
        turn = self.bullet.getQuaternionFromEuler((0, 0, heading))
        centre = x + self.ahead * math.cos(heading), y + self.ahead * math.sin(heading), self.radius
        self.bullet.resetBasePositionAndOrientation(self.body, centre, turn)
        self.bullet.resetBaseVelocity(self.body, (0, 0, 0), (0, 0, 0))
        for wheel in (0, 1):
            self.bullet.resetJointState(self.body, wheel, 0.0, 0.0)

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""
        (x, y, _), turn = self.bullet.getBasePositionAndOrientation(self.body)
        heading = self.bullet.getEulerFromQuaternion(turn)[2]
        return x - self.ahead * math.cos(heading), y - self.ahead * math.sin(heading), heading

    def advance(self, left: float, right: float) -> None:
        """Go on by a step with these shares of the supply [-1..1]."""
        states = self.bullet.getJointStates(self.body, (0, 1))
        duties = zip((left, right), states, strict=True)
        torques = [self.motors.torque(duty, state[1], self.step_s) for duty, state in duties]
        mode = self.bullet.TORQUE_CONTROL
        self.bullet.setJointMotorControlArray(self.body, (0, 1), mode, forces=torques)
        self.bullet.stepSimulation()


class MuJoCoRobot:
    """MuJoCo at gecar's step of 2 ms."""

    step_s = 0.002

    def __init__(self, robot: Robot) -> None:
        import mujoco  # noqa: PLC0415

        self.mujoco, self.motors = mujoco, Motors(robot)
        self.model = mujoco.MjModel.from_xml_string(_mjcf(robot, self.step_s))
        self.state = mujoco.MjData(self.model)

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest."""
        self.mujoco.mj_resetData(self.model, self.state)
        self.state.qpos[:2] = x, y
        self.state.qpos[3:7] = math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""
        x, y, _, w, i, j, k = self.state.qpos[:7].tolist()
        return x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))

    def advance(self, left: float, right: float) -> None:
        """Go on by a step with these shares of the supply [-1..1]."""
        speeds = self.state.qvel[6:8].tolist()
        self.state.qfrc_applied[6] = self.motors.torque(left, speeds[0], self.step_s)
        self.state.qfrc_applied[7] = self.motors.torque(right, speeds[1], self.step_s)
        self.mujoco.mj_step(self.model, self.state)


class PymunkRobot:
    """Plain pymunk from Python at gecar's step: the engine moves the body, Python turns wheels and rubs tyres."""

    step_s = 0.002

    def __init__(self, robot: Robot) -> None:
        import pymunk  # noqa: PLC0415

        self.motors, self.robot, body = Motors(robot), robot, robot.body
        self.space = pymunk.Space()
        self.body = pymunk.Body(body.mass, body.yaw_inertia)
        self.space.add(self.body)
        self.half, self.axle, self.radius = body.track_width / 2, -body.com_ahead, body.wheel_radius
        wheel_load = body.mass * GRAVITY * (1.0 - body.com_ahead / body.caster_ahead) / 2.0
        self.grip = robot.tyre.friction * wheel_load * self.step_s
        reach = self.radius**2 / robot.motor.inertia
        self.rolling = 1.0 / (1.0 / body.mass + self.half**2 / body.yaw_inertia + reach)
        self.sliding = 0.5 / (1.0 / body.mass + self.axle**2 / body.yaw_inertia)
        self.speeds = [0.0, 0.0]

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest."""
        self.body.position = x - self.axle * math.cos(heading), y - self.axle * math.sin(heading)
        self.body.angle, self.body.velocity, self.body.angular_velocity = heading, (0.0, 0.0), 0.0
        self.speeds = [0.0, 0.0]

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""
        (x, y), angle = self.body.position, self.body.angle
        return x + self.axle * math.cos(angle), y + self.axle * math.sin(angle), angle

    def advance(self, left: float, right: float) -> None:
        """Go on by a step with these shares of the supply [-1..1]."""
        inertia = self.robot.motor.inertia
        for k, duty in enumerate((left, right)):
            self.speeds[k] += self.motors.torque(duty, self.speeds[k], self.step_s) * self.step_s / inertia
        for _ in range(2):
            for k, beside in enumerate((self.half, -self.half)):
                self._rub(k, beside, inertia)
        self.space.step(self.step_s)

    def _rub(self, k: int, beside: float, inertia: float) -> None:
        """Give one tyre the impulse that ends its slip, within its friction circle."""
        u, w = self.body.velocity.rotated(-self.body.angle)
        turn = self.body.angular_velocity
        ahead = self.rolling * (self.speeds[k] * self.radius - (u - turn * beside))
        aside = -self.sliding * (w + turn * self.axle)
        size = math.hypot(ahead, aside)
        if size > self.grip:
            ahead, aside = ahead * self.grip / size, aside * self.grip / size
        self.body.apply_impulse_at_local_point((ahead, aside), (self.axle, beside))
        self.speeds[k] -= ahead * self.radius / inertia


ENGINES: dict[str, Any] = {"PyBullet": PyBulletRobot, "MuJoCo": MuJoCoRobot, "pymunk": PymunkRobot}


def _chassis_ahead(robot: Robot) -> float:
    """Return where the chassis' centre of mass is, such that everything together has the robot's [m]."""
    return robot.body.mass * robot.body.com_ahead / (robot.body.mass - 2.0 * WHEEL_MASS)


def _urdf(robot: Robot) -> str:
    body, ahead = robot.body, _chassis_ahead(robot)
    # A rotor as a rigid wheel: Bullet wants the other two moments to add up to this one; the chassis has so much less.
    half = 0.5 * robot.motor.inertia
    yaw = body.yaw_inertia - 2.0 * (half + WHEEL_MASS * (0.25 * body.track_width**2 + body.com_ahead**2))
    wheels = "".join(
        f'<link name="{side}"><inertial><mass value="{WHEEL_MASS}"/>'
        f'<inertia ixx="{half}" ixy="0" ixz="0" iyy="{robot.motor.inertia}" iyz="0" izz="{half}"/></inertial>'
        f'<collision><geometry><sphere radius="{body.wheel_radius}"/></geometry></collision></link>'
        f'<joint name="{side}_shaft" type="continuous"><parent link="box"/><child link="{side}"/>'
        f'<origin xyz="{-ahead} {beside} 0"/><axis xyz="0 1 0"/></joint>'
        for side, beside in (("left", body.track_width / 2), ("right", -body.track_width / 2))
    )
    caster = f'<origin xyz="{body.caster_ahead - ahead} 0 {CASTER_RADIUS - body.wheel_radius}"/>'
    return (
        f'<robot name="ev3"><link name="box"><inertial><mass value="{body.mass - 2.0 * WHEEL_MASS}"/>'
        f'<inertia ixx="0.0015" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="{yaw}"/></inertial>'
        f'<collision>{caster}<geometry><sphere radius="{CASTER_RADIUS}"/></geometry></collision></link>{wheels}</robot>'
    )


def _mjcf(robot: Robot, step_s: float) -> str:
    body, ahead = robot.body, _chassis_ahead(robot)
    wheels = "".join(
        f'<body pos="0 {beside} 0"><joint type="hinge" axis="0 1 0" armature="{robot.motor.inertia}"/>'
        f'<geom type="sphere" size="{body.wheel_radius}" mass="{WHEEL_MASS}" '
        f'friction="{robot.tyre.friction} 0 0"/></body>'
        for beside in (body.track_width / 2, -body.track_width / 2)
    )
    return (
        f'<mujoco><option timestep="{step_s}" integrator="implicitfast" cone="elliptic" impratio="10"/>'
        '<worldbody><geom type="plane" size="9 9 1" friction="0 0 0" priority="0"/>'
        f'<body pos="0 0 {body.wheel_radius}"><freejoint/><inertial pos="{ahead} 0 0.02" '
        f'mass="{body.mass - 2.0 * WHEEL_MASS}" diaginertia="0.0015 0.003 {body.yaw_inertia}"/>'
        f'<geom type="sphere" size="{CASTER_RADIUS}" friction="0 0 0" condim="1" priority="1" '
        f'pos="{body.caster_ahead} 0 {CASTER_RADIUS - body.wheel_radius}"/>{wheels}</body></worldbody></mujoco>'
    )
