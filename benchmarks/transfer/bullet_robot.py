"""The nominal EV3 in PyBullet: a chassis, two wheels on geared motors, and a caster."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import pybullet

from benchmarks.transfer.variations import NOMINAL, Variation

Pose = tuple[float, float, float]

# The nominal robot's constants, copied by hand: no code is shared with gecar or with benchmarks/concealed.
MASS, YAW_INERTIA = 0.75, 0.0040  # kg, kg m^2 about the centre of mass: everything
COM_AHEAD, COM_HEIGHT = -0.0322, 0.050  # m, centre of mass of everything, ahead of the axle, above the floor
TRACK, RADIUS, CASTER_AHEAD = 0.120, 0.028, -0.085  # m
KT, KE, RESISTANCE = 0.2746, 0.4731, 5.50  # N m / A, V s / rad, ohm
ROTOR_INERTIA, DRY_FRICTION = 0.00248, 0.0165  # kg m^2 and N m at the shaft
SUPPLY_V, DUTY_CAP, GRAVITY = 8.67, 0.80, 9.81  # V, share, m / s^2

# What a planar model has no need of.
WHEEL_MASS, CASTER_RADIUS = 0.02, 0.010  # kg, m
ROLL_INERTIA, PITCH_INERTIA = 0.0018, 0.0028  # kg m^2, of the chassis; hardly felt on a level floor

# The floor as a spring and damper under each contact: the robot sinks by 0.1 mm, and does not bounce.
CONTACT_STIFFNESS, CONTACT_DAMPING = 2.0e4, 100.0  # N / m, N s / m
STEP_S = 0.0005  # at 0.001 a program on the edge of two ways to follow the line can take the other one
_WHEELS = (0, 1)


class BulletRobot:
    """One robot in a PyBullet world of its own.

    Rotor and gears are part of the wheel that they turn, so that the engine knows what inertia a tyre pushes against;
    Bullet's friction opposes the slip only if that is alike along and across the wheel. But a geared rotor does not
    pitch the chassis when it speeds up, nor roll it in a bend, as so heavy a wheel does: that moment is given back.

    Parameters
    ----------
    variation
        How the robot differs from the nominal one.
    step_s
        The engine's step [s].
    """

    def __init__(self, variation: Variation = NOMINAL, step_s: float = STEP_S) -> None:
        self.step_s = step_s
        gains = (1.0 - variation.motor_difference / 2.0, 1.0 + variation.motor_difference / 2.0)
        self._stalls = [KT * SUPPLY_V * variation.battery / RESISTANCE * gain for gain in gains]
        self._client = pybullet.connect(pybullet.DIRECT)
        self._body = self._build(variation)
        self.place(0.0, 0.0, 0.0)

    def close(self) -> None:
        """Take the world down; PyBullet has room for about a thousand."""
        pybullet.disconnect(self._client)

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest, the springs of the floor loaded."""
        ahead, up = _chassis()
        middle = (x + ahead * math.cos(heading), y + ahead * math.sin(heading), RADIUS + up)
        turn = pybullet.getQuaternionFromEuler((0.0, 0.0, heading))
        pybullet.resetBasePositionAndOrientation(self._body, middle, turn, self._client)
        pybullet.resetBaseVelocity(self._body, (0, 0, 0), (0, 0, 0), self._client)
        for wheel in _WHEELS:
            pybullet.resetJointState(self._body, wheel, 0.0, 0.0, self._client)
        self._speeds, self._turning = (0.0, 0.0), 0.0
        for _ in range(round(0.3 / self.step_s)):
            self.step((0.0, 0.0))

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""
        (x, y, _), turn = pybullet.getBasePositionAndOrientation(self._body, self._client)
        i, j, k, w = turn
        heading = math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))
        return x - _AHEAD * math.cos(heading), y - _AHEAD * math.sin(heading), heading

    def shafts(self) -> tuple[float, float]:
        """Return how fast the left and the right shaft turn [rad/s]."""
        return self._speeds

    def advance(self, duties_pct: Sequence[float]) -> None:
        """Drive for a millisecond with a left and a right duty [%]."""
        for _ in range(round(0.001 / self.step_s)):
            self.step(duties_pct)

    def step(self, duties_pct: Sequence[float]) -> None:
        """Drive for one of the engine's steps with a left and a right duty [%]."""
        torques = [self._torque(side, duties_pct[side] / 100.0) for side in _WHEELS]
        pybullet.setJointMotorControlArray(
            self._body, _WHEELS, pybullet.TORQUE_CONTROL, forces=torques, physicsClientId=self._client
        )
        pybullet.stepSimulation(self._client)
        (left, right) = pybullet.getJointStates(self._body, _WHEELS, self._client)
        self._speeds = (left[1], right[1])
        self._give_back()

    def _torque(self, side: int, duty: float) -> float:
        """Motor equation Kt (u V - Ke w) / R [N m]; dry friction is the joint's."""
        duty = min(max(duty, -DUTY_CAP), DUTY_CAP)
        return self._stalls[side] * duty - KT * KE / RESISTANCE * self._speeds[side]

    def _give_back(self) -> None:
        """Take from the chassis, in the next step, what the rotors' change of angular momentum has put on it.

        d/dt (J w y) = J w' y + J w (Omega x y), with y along the axle, w a wheel's speed against the floor and Omega
        the chassis' angular velocity; on a level floor y = (-sin, cos, 0) of the heading, and Omega is the yaw rate.
        """
        heading = self.pose()[2]
        cos, sin = math.cos(heading), math.sin(heading)
        across, along, yaw_rate = pybullet.getBaseVelocity(self._body, self._client)[1]
        turning = sum(self._speeds) + 2.0 * (along * cos - across * sin)
        gained, self._turning = turning - self._turning, turning
        pitch, roll = ROTOR_INERTIA * gained / self.step_s, ROTOR_INERTIA * turning * yaw_rate
        moment = (-pitch * sin - roll * cos, pitch * cos - roll * sin, 0.0)
        pybullet.applyExternalTorque(self._body, -1, moment, pybullet.WORLD_FRAME, self._client)

    def _build(self, variation: Variation) -> int:
        client = self._client
        pybullet.setGravity(0, 0, -GRAVITY, client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self.step_s,
            numSolverIterations=200,
            solverResidualThreshold=1e-10,
            physicsClientId=client,
        )
        shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        plane = pybullet.createMultiBody(0, shape, physicsClientId=client)
        pybullet.changeDynamics(plane, -1, lateralFriction=1.0, physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(_urdf(), encoding="utf-8")
            body: int = pybullet.loadURDF(
                str(file), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
            )
        # Bullet multiplies the coefficients of both that touch; the floor's is 1.
        for link, rub in ((-1, 0.0), (0, variation.grip), (1, variation.grip)):
            _rub(body, link, rub, client)
        # In a call of its own: together with this, Bullet 3.2.7 gives every setting to the base.
        awake = pybullet.ACTIVATION_STATE_DISABLE_SLEEPING
        pybullet.changeDynamics(body, -1, activationState=awake, physicsClientId=client)
        # A joint motor that wants rest and is as strong as dry friction is dry friction (PyBullet's guide).
        pybullet.setJointMotorControlArray(
            body,
            _WHEELS,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=(0.0, 0.0),
            forces=[DRY_FRICTION * variation.dry_friction] * 2,
            physicsClientId=client,
        )
        return body


def _rub(body: int, link: int, friction: float, client: int) -> None:
    """Set how a link meets the floor; Bullet's own drag on everything that moves is none of this robot's."""
    pybullet.changeDynamics(
        body,
        link,
        lateralFriction=friction,
        rollingFriction=0.0,
        spinningFriction=0.0,
        contactStiffness=CONTACT_STIFFNESS,
        contactDamping=CONTACT_DAMPING,
        linearDamping=0.0,
        angularDamping=0.0,
        jointDamping=0.0,
        physicsClientId=client,
    )


def _chassis() -> tuple[float, float]:
    """Where the chassis without wheels has its centre of mass, from the axle's centre [m]: ahead, up."""
    mass = MASS - 2.0 * WHEEL_MASS
    return MASS * COM_AHEAD / mass, (MASS * COM_HEIGHT - 2.0 * WHEEL_MASS * RADIUS) / mass - RADIUS


_AHEAD = _chassis()[0]


def _urdf() -> str:
    """Describe the robot such that everything together has the nominal mass, centre of mass and yaw inertia."""
    ahead, up = _chassis()
    mass = MASS - 2.0 * WHEEL_MASS
    spin = 0.5 * WHEEL_MASS * RADIUS**2 + ROTOR_INERTIA
    wheels_yaw = 2.0 * (0.5 * spin + WHEEL_MASS * (COM_AHEAD**2 + TRACK**2 / 4.0))
    yaw = YAW_INERTIA - wheels_yaw - mass * (ahead - COM_AHEAD) ** 2
    wheels = "".join(
        f'<link name="{side}"><inertial><mass value="{WHEEL_MASS}"/>'
        f'<inertia ixx="{0.5 * spin}" ixy="0" ixz="0" iyy="{spin}" iyz="0" izz="{0.5 * spin}"/></inertial>'
        f'<collision><geometry><sphere radius="{RADIUS}"/></geometry></collision></link>'
        f'<joint name="{side}_shaft" type="continuous"><parent link="chassis"/><child link="{side}"/>'
        f'<origin xyz="{-ahead} {beside} {-up}"/><axis xyz="0 1 0"/></joint>'
        for side, beside in (("left", TRACK / 2.0), ("right", -TRACK / 2.0))
    )
    caster = f'<origin xyz="{CASTER_AHEAD - ahead} 0 {CASTER_RADIUS - RADIUS - up}"/>'
    return (
        f'<robot name="ev3"><link name="chassis"><inertial><mass value="{mass}"/><inertia ixx="{ROLL_INERTIA}" '
        f'ixy="0" ixz="0" iyy="{PITCH_INERTIA}" iyz="0" izz="{yaw}"/></inertial><collision>{caster}<geometry>'
        f'<sphere radius="{CASTER_RADIUS}"/></geometry></collision></link>{wheels}</robot>'
    )
