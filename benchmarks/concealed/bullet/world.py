"""Drive a concealed robot through PyBullet and remember everything, free of noise."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pybullet

from benchmarks.concealed.bullet.body import (
    HUBS,
    SIDE_DAMPING,
    SIDE_STIFFNESS,
    WHEEL_INERTIA,
    WHEELS,
    Body,
    build,
)
from benchmarks.concealed.colour_sensor import FIELD, ColourSensor
from benchmarks.concealed.continuous import chassis, drive
from benchmarks.concealed.continuous.firmware import Firmware
from benchmarks.concealed.continuous.numbers import Numbers, gusts, numbers
from benchmarks.concealed.history import ROW_TICKS, TICK_S, Array, Controller, History, Pose, ToppledError
from benchmarks.concealed.robot import GRAVITY, Concealed

_STEPS = 2  # of Bullet in a tick
_DRIVE_STEPS = 5  # of motors and gears in one of Bullet's
_SETTLE_STEPS = 600  # 0.3 s on level ground
_UPRIGHT = math.cos(math.radians(20.0))
_ROLLING_BLEND = 0.2  # rad/s: below this rolling resistance fades out
_JOINTS = [*HUBS, *WHEELS]


class Truth:
    """One concealed robot, ready to be driven any number of times.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    """

    def __init__(self, concealed: Concealed) -> None:
        self.concealed = concealed
        plain = numbers(concealed)
        self._numbers = plain._replace(shaft_inertia=plain.shaft_inertia - WHEEL_INERTIA)
        self._gusts = gusts(concealed)

    def run(
        self,
        start: Pose,
        controller: Controller,
        seconds: float,
        reading_noise: Array | None = None,
        turn_ticks: int = ROW_TICKS,
        ended: Callable[[float, float], bool] | None = None,
    ) -> History:
        """Drive from rest, as `benchmarks.concealed.worlds.Truth.run`."""
        count = round(seconds / TICK_S) + 1
        noise = np.zeros(count) if reading_noise is None else reading_noise
        log, robot = History.blank(count), _Robot(self.concealed, start)
        firmware, sensor = Firmware(self.concealed), ColourSensor(self.concealed)
        command: tuple[int, int] | None = (0, 0)
        try:
            for tick in range(count):
                time_s = tick * TICK_S
                x, y, turn = log.pose[tick] = robot.pose(time_s)
                log.angles[tick], log.yaw_rate[tick] = robot.angles, robot.yaw_rate
                log.terminal_v[tick] = robot.terminal_v
                log.light[tick] = light = sensor.look(x, y, turn)
                log.readings[tick] = reading = min(max(round(light + noise[tick]), 0), 100)
                if tick % turn_ticks == 0:
                    command = controller(time_s, int(reading))
                    if command is None or (ended is not None and ended(x, y)):
                        return _finished(log.until(tick + 1))
                log.commands[tick] = command
                shares = np.array([*firmware.duties(command or (0, 0), time_s), firmware.alike])
                robot.advance(self._numbers, self._gusts, shares, time_s)
                log.terminal_v[tick] = robot.terminal_v
        finally:
            robot.leave()
        return _finished(log)


class _Robot:
    """One robot in one of Bullet's worlds."""

    def __init__(self, concealed: Concealed, start: Pose) -> None:
        self._hidden = concealed
        self._client = pybullet.connect(pybullet.DIRECT)
        self._step = TICK_S / _STEPS / (1.0 + concealed.clock_skew)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._step,
            numSolverIterations=20,
            solverResidualThreshold=0.0,
            contactERP=0.1,
            enableConeFriction=1,
            deterministicOverlappingPairs=1,
            physicsClientId=self._client,
        )
        self._lean(0.0, 0.0)
        self._body = build(self._client, concealed)
        self._settle(start)
        self._train, self._memory = np.zeros(drive.SIZE), chassis.start(numbers(concealed), *start)
        self._train[drive.TERMINAL] = concealed.base.supply * concealed.supply_scale
        self._grips = [concealed.tyre_friction] * 2
        self._look()
        self._origin = self._angles
        self._lean(*concealed.tilt)
        still = (concealed.air_drag, concealed.yaw_pull) == (0.0, 0.0)
        pulls = (concealed.tether, concealed.magnet, concealed.pile, concealed.swivel, concealed.trailer)
        pulls += (concealed.hair, concealed.grooves, concealed.fan, concealed.fin)
        self._pushed = (
            not still
            or concealed.twist > 0.0
            or concealed.scrub > 0.0
            or concealed.brush is not None
            or concealed.turret is not None
            or bool(concealed.gusts)
            or any(pull is not None for pull in pulls)
        )
        self.yaw_rate = 0.0

    @property
    def angles(self) -> Array:
        """Both shafts' angles [rad]."""
        return self._train[drive.ANGLE : drive.ANGLE + 2]

    @property
    def terminal_v(self) -> float:
        """Voltage at the battery's terminals [V]."""
        return float(self._train[drive.TERMINAL])

    def pose(self, time_s: float) -> Pose:
        """Give the pose of the axle's centre [m, m, rad].

        Raises
        ------
        ToppledError
            If the robot leans by more than 20 degrees.
        """
        place, way = pybullet.getBasePositionAndOrientation(self._body.robot, physicsClientId=self._client)
        x, y, z, w = way
        if 1.0 - 2.0 * (x * x + y * y) < _UPRIGHT:
            message = f"the robot fell over at {time_s:.2f} s"
            raise ToppledError(message)
        axle, _ = pybullet.multiplyTransforms(place, way, self._body.axle, [0.0, 0.0, 0.0, 1.0])
        return axle[0], axle[1], math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    def advance(self, n: Numbers, blows: Array, shares: Array, time_s: float) -> None:
        """Advance by one tick: motors and gears five times as often as Bullet."""
        x, y, turn = self.pose(time_s)
        velocity, rates = pybullet.getBaseVelocity(self._body.robot, physicsClientId=self._client)
        tick_s = TICK_S / _STEPS / _DRIVE_STEPS
        self._surround(n, x, y)
        brakes, push = self._brakes(n, x, y, turn), (0.0, 0.0, 0.0)
        if n.frame_rub > 0.0:
            ahead = math.cos(turn) * velocity[0] + math.sin(turn) * velocity[1]
            for side in range(2):
                held = chassis.rubbing(n, side, ahead, rates[2])
                brakes[side] += held * math.tanh(self._speeds[side] / _ROLLING_BLEND)
        if self._pushed:
            # The stated velocity is that of the chassis' centre of mass.
            back = self._body.axle[0]
            vx = velocity[0] - back * math.sin(turn) * rates[2]
            vy = velocity[1] + back * math.cos(turn) * rates[2]
            push = chassis.pushes(n, self._memory, x, y, turn, vx, vy, rates[2], blows, time_s, TICK_S)
        for step in range(_STEPS):
            angles, now = self._angles - self._origin, time_s + TICK_S * step / _STEPS
            torques = drive.drive_on(
                n,
                self._train,
                shares,
                angles,
                self._speeds,
                now,
                tick_s,
                self._step / _DRIVE_STEPS,
                _DRIVE_STEPS,
            )
            pybullet.setJointMotorControlArray(
                self._body.robot,
                _JOINTS,
                pybullet.TORQUE_CONTROL,
                forces=[*self._flexing, *(torques - brakes).tolist()],
                physicsClientId=self._client,
            )
            self._push(push)
            pybullet.stepSimulation(physicsClientId=self._client)
            self._look()
        self.yaw_rate = pybullet.getBaseVelocity(self._body.robot, physicsClientId=self._client)[1][2]

    def leave(self) -> None:
        """Give the world back."""
        pybullet.disconnect(physicsClientId=self._client)

    def _look(self) -> None:
        """Read the joints: wheels' angles and speeds, and the forces of the springs along the axle."""
        joints = pybullet.getJointStates(self._body.robot, _JOINTS, physicsClientId=self._client)
        self._angles = np.array([joint[0] for joint in joints[2:]])
        self._speeds = np.array([joint[1] for joint in joints[2:]])
        self._flexing = [-SIDE_STIFFNESS * hub[0] - SIDE_DAMPING * hub[1] for hub in joints[:2]]

    def _settle(self, start: Pose) -> None:
        """Let tyres and caster take their loads, then put the robot, at rest, at its start."""
        body: Body = self._body
        for _ in range(_SETTLE_STEPS):
            pybullet.stepSimulation(physicsClientId=self._client)
        place, way = pybullet.getBasePositionAndOrientation(body.robot, physicsClientId=self._client)
        turn = pybullet.getQuaternionFromEuler([0.0, 0.0, start[2]])
        axle, _ = pybullet.multiplyTransforms(place, way, body.axle, [0.0, 0.0, 0.0, 1.0])
        arm = [place[0] - axle[0], place[1] - axle[1], 0.0]
        arm, _ = pybullet.multiplyTransforms([0.0, 0.0, 0.0], turn, arm, [0.0, 0.0, 0.0, 1.0])
        _, way = pybullet.multiplyTransforms([0.0, 0.0, 0.0], turn, [0.0, 0.0, 0.0], way)
        put = [start[0] + arm[0], start[1] + arm[1], place[2]]
        pybullet.resetBasePositionAndOrientation(body.robot, put, way, physicsClientId=self._client)
        none = [0.0, 0.0, 0.0]
        pybullet.resetBaseVelocity(body.robot, none, none, physicsClientId=self._client)

    def _surround(self, n: Numbers, x: float, y: float) -> None:
        """Set what depends on the place: the floor's slope and the tyres' grip."""
        hidden, memory = self._hidden, self._memory
        if hidden.waves is not None or hidden.curl is not None:
            slope, length, phase_x, phase_y = hidden.waves or (0.0, 1.0, 0.0, 0.0)
            wave = 2.0 * math.pi / length
            curl_x = n.curl * chassis.curled(x, FIELD[0], n.curl_width)
            curl_y = n.curl * chassis.curled(y, FIELD[1], n.curl_width)
            self._lean(
                hidden.tilt[0] + slope * math.sin(wave * x + phase_x) + curl_x,
                hidden.tilt[1] + slope * math.sin(wave * y + phase_y) + curl_y,
            )
        if hidden.rocking is not None:
            slope, _, way, _ = hidden.rocking
            leaning = slope * chassis.tip(n, memory, x, y, TICK_S)
            self._lean(hidden.tilt[0] + leaning * math.cos(way), hidden.tilt[1] + leaning * math.sin(way))
        if hidden.patch is None and hidden.dust is None and hidden.hop is None:
            return
        memory[chassis.WHEEL : chassis.WHEEL + 2] = self._angles - self._origin
        memory[chassis.WHEEL_SPEED : chassis.WHEEL_SPEED + 2] = self._speeds
        memory[chassis.ROLLED] += TICK_S * float(np.abs(self._speeds).sum()) * n.radius_left / 2.0
        for side, link in enumerate(WHEELS):
            grip = chassis.grip(n, memory, side, x, y)
            if grip != self._grips[side]:
                self._grips[side] = grip
                pybullet.changeDynamics(
                    self._body.robot, link, lateralFriction=grip, physicsClientId=self._client
                )

    def _brakes(self, n: Numbers, x: float, y: float, turn: float) -> Array:
        """Give what holds the tyres [N m]: rolling resistance (coefficient x load x radius), a strip, patches."""
        brakes = np.zeros(2)
        if (n.rolling, n.strip, n.patches) == (0.0, 0.0, 0.0):
            return brakes
        for side, radius in enumerate((n.radius_left, n.radius_right)):
            touching = pybullet.getContactPoints(
                self._body.robot, linkIndexA=WHEELS[side], physicsClientId=self._client
            )
            load = sum(contact[9] for contact in touching)
            holding = n.rolling * load * radius + chassis.sticking(n, side, x, y, turn)
            brakes[side] = holding * math.tanh(self._speeds[side] / _ROLLING_BLEND)
        return brakes

    def _push(self, push: tuple[float, float, float]) -> None:
        if not self._pushed:
            return
        robot, frame = self._body.robot, pybullet.WORLD_FRAME
        place, _ = pybullet.getBasePositionAndOrientation(robot, physicsClientId=self._client)
        force, torque = [push[0], push[1], 0.0], [0.0, 0.0, push[2]]
        pybullet.applyExternalForce(robot, -1, force, place, frame, physicsClientId=self._client)
        pybullet.applyExternalTorque(robot, -1, torque, frame, physicsClientId=self._client)

    def _lean(self, along_x: float, along_y: float) -> None:
        """Gravity's components along a floor that is not level."""
        across = math.sin(along_x), math.sin(along_y)
        down = -math.sqrt(max(1.0 - across[0] ** 2 - across[1] ** 2, 0.0))
        pybullet.setGravity(
            GRAVITY * across[0], GRAVITY * across[1], GRAVITY * down, physicsClientId=self._client
        )


def _finished(log: History) -> History:
    log.pose[:, 2] = np.unwrap(log.pose[:, 2])
    return log
