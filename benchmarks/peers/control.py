"""What every simulated peer shares: Table 3's programs, the colour sensor and the motors, in plain Python."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from gecar.language.opcodes import JUMP, MOTOR, TEST
from gecar.world.course.course import Course
from gecar.world.kernel.sensing import spot_average
from gecar.world.robot import Robot

Pose = tuple[float, float, float]


class Peer(Protocol):
    """A robot in somebody's engine."""

    step_s: float

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest."""

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""

    def advance(self, left: float, right: float) -> None:
        """Go on by a step with these shares of the supply [-1..1]."""


class Eye:
    """The colour sensor: the floor averaged over its spot, looked up between four cells."""

    def __init__(self, course: Course, robot: Robot) -> None:
        self.pitch, self.ahead = course.pitch_m, robot.colour_sensor.ahead
        averaged = spot_average(course.raster(), self.pitch, robot.colour_sensor.spot_diameter)
        self.rows: list[list[float]] = (
            averaged / 255.0 * 100.0
        ).tolist()  # lists are quicker than arrays, one by one

    def read(self, x: float, y: float, heading: float) -> int:
        """Return the reflected light [%]."""
        column = (x + self.ahead * math.cos(heading)) / self.pitch - 0.5
        row = (y + self.ahead * math.sin(heading)) / self.pitch - 0.5
        j, i = math.floor(column), math.floor(row)
        if not (0 <= j < len(self.rows[0]) - 1 and 0 <= i < len(self.rows) - 1):
            return 100
        right, up = column - j, row - i
        low, high = self.rows[i], self.rows[i + 1]
        level = (1 - up) * ((1 - right) * low[j] + right * low[j + 1])
        return round(level + up * ((1 - right) * high[j] + right * high[j + 1]))


class Motors:
    """Both motors' equations: torque from duty and speed, Kt (u V - Ke w) / R, without dry friction."""

    def __init__(self, robot: Robot) -> None:
        motor = robot.motor
        self.stall = motor.torque_constant * robot.battery.voltage / motor.resistance
        self.damping = motor.torque_constant * motor.back_emf_constant / motor.resistance
        self.coulomb, self.inertia, self.cap = motor.coulomb_friction, motor.inertia, robot.drive.duty_cap

    def torque(self, duty: float, speed: float, step_s: float) -> float:
        """Return a shaft's torque [N m] over a step, dry friction included: at most what stops the shaft."""
        free = self.stall * min(max(duty, -self.cap), self.cap) - self.damping * speed
        stop = -(free + speed * self.inertia / step_s)
        return free + min(max(stop, -self.coulomb), self.coulomb)


def drive(peer: Peer, eye: Eye, opcodes: np.ndarray[Any, Any], start: Pose, seconds: float) -> Pose:
    """Drive a program for some time; return where it ended."""
    program: Sequence[Sequence[int]] = opcodes.tolist()
    peer.place(*start)
    row, due, left, right = 0, 0.0, 0.0, 0.0
    for step in range(round(seconds / peer.step_s)):
        here = peer.pose()
        while step * peer.step_s >= due - 1e-9:
            op, a, b, c, target = program[row][:5]
            if op == MOTOR:
                left, right, due = a / 100.0, b / 100.0, due + c / 1000.0
                row = (row + 1) % len(program)
            elif op == TEST:
                row = row + 1 if eye.read(*here) > c / 1000.0 else target
            elif op == JUMP:
                row = target
            row %= len(program)
        peer.advance(left, right)
    return peer.pose()
