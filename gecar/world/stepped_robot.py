"""A simulated robot under external control: commands in, sensor readings out."""

from __future__ import annotations

import numpy as np

from gecar.random_streams import normal
from gecar.world.kernel.drive import hold_duties
from gecar.world.kernel.eyes import read_sensor
from gecar.world.rollout import Driver, World


class SteppedRobot:
    """The simulated robot on its course, for controllers that are not programs of gecar.

    Parameters
    ----------
    world
        Robot, course and step.
    seed
        Seed of the noise, where the world has any.
    """

    def __init__(self, world: World, seed: int = 0) -> None:
        self._driver = Driver(world)
        self._driver.reset()
        self._setup = self._driver.setup
        self._setup.eyes["used"] = True
        self._setup.eyes["stream"] = seed
        self._step, self._due_ms = 0, 0.0
        self._duties = (0.0, 0.0)
        hold_duties(0, 0, 0.0, 0.0, self._setup)  # puts the robot at START, and the sensors' memory with it

    def set_duty(self, left: float, right: float) -> None:
        """Command duties [-1..1], held until the next command; each has noise of its own, where the world has any."""
        eyes = self._setup.eyes[0]
        if eyes["motor_noise"] > 0.0:
            left *= 1.0 + eyes["motor_noise"] * normal(eyes)
            right *= 1.0 + eyes["motor_noise"] * normal(eyes)
        self._duties = (left, right)

    def advance(self, ms: float) -> None:
        """Let time pass [ms]; what a step rounds off is made up for later."""
        self._due_ms += ms
        due = round(self._due_ms / (1000.0 * self._driver.world.step_s))
        hold_duties(self._step, due, *self._duties, self._setup)
        self._step = due

    @property
    def time_s(self) -> float:
        """Time since the start [s]."""
        return self._step * self._driver.world.step_s

    @property
    def reflection_pct(self) -> float:
        """What the colour sensor reports now, whole percent."""
        s, step_s = self._setup, self._driver.step_s
        return float(read_sensor(0, self._step, s.state[0], s.physics[0], step_s, s.floor, s.eyes[0]))

    @property
    def angles_deg(self) -> tuple[float, float]:
        """Left and right motor angle [deg]."""
        state = self._setup.state[0]
        return float(np.degrees(state["left_angle"])), float(np.degrees(state["right_angle"]))

    @property
    def pose(self) -> tuple[float, float, float]:
        """Pose of the axle's centre [m, m, rad]."""
        state, ahead = self._setup.state[0], float(self._setup.physics["com_ahead"][0])
        return (
            float(state["x"] - ahead * state["cos"]),
            float(state["y"] - ahead * state["sin"]),
            float(state["heading"]),
        )

    @property
    def battery_v(self) -> float:
        """The battery's terminal voltage [V]."""
        return float(self._setup.state["voltage"][0]) or float(self._setup.physics["voltage"][0])
