"""Forces on the robot that depend on where it is, how fast it goes, and what time it is."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import numpy.typing as npt

from benchmarks.concealed.body import radii
from benchmarks.concealed.robot import GRAVITY, Concealed

_ROLLING_BLEND = 0.2  # rad/s: below this rolling resistance fades out, so that it cannot drive the robot


class Surroundings:
    """Floor, air and cables around one robot.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    model
        The compiled robot, whose gravity and friction this class rewrites as the robot moves.
    """

    def __init__(self, concealed: Concealed, model: mujoco.MjModel) -> None:
        self._hidden, self._model = concealed, model
        self._chassis = model.body("chassis").id
        self._tyres = [model.pair("left_floor").id, model.pair("right_floor").id]
        self._geoms = {int(model.geom(side).id): index for index, side in enumerate(("left", "right"))}
        self._wheels = [int(model.geom_bodyid[geom]) for geom in self._geoms]
        self._radii = radii(concealed)
        self._scratch = np.zeros(6)
        self._pushed = bool(concealed.tether or concealed.magnet or concealed.gusts or concealed.air_drag)
        self.idle = not (self._pushed or concealed.patch or concealed.waves or concealed.rolling_resistance)
        self._inside = False

    def settle(self) -> None:
        """Set what does not change while driving, and undo what the last drive left behind."""
        self._lean(*self._hidden.tilt)
        self._model.pair_friction[self._tyres, :2] = self._hidden.tyre_friction

    def act(self, state: mujoco.MjData, time_s: float) -> None:
        """Set the forces of one tick.

        Parameters
        ----------
        state
            The robot now; its applied forces are overwritten.
        time_s
            Time since the recording began [s].
        """
        x, y = float(state.qpos[0]), float(state.qpos[1])
        if self._hidden.patch is not None:
            self._grip(x, y)
        if self._hidden.waves is not None:
            slope, length, phase_x, phase_y = self._hidden.waves
            turn = 2.0 * math.pi / length
            self._lean(slope * math.sin(turn * x + phase_x), slope * math.sin(turn * y + phase_y))
        if self._pushed:
            state.xfrc_applied[self._chassis, :2] = self._push(x, y, state.qvel, time_s)
        if self._hidden.rolling_resistance > 0.0:
            self._resist(state)

    def _lean(self, along_x: float, along_y: float) -> None:
        """Gravity's components along a floor that is not level."""
        down = -math.sqrt(max(1.0 - math.sin(along_x) ** 2 - math.sin(along_y) ** 2, 0.0))
        self._model.opt.gravity[:] = [
            GRAVITY * math.sin(along_x),
            GRAVITY * math.sin(along_y),
            GRAVITY * down,
        ]

    def _grip(self, x: float, y: float) -> None:
        """Both tyres lose grip while the axle's centre is inside the disc."""
        centre_x, centre_y, radius, coefficient = self._hidden.patch or (0.0, 0.0, 0.0, 0.0)
        inside = math.hypot(x - centre_x, y - centre_y) < radius
        if inside != self._inside:
            self._inside = inside
            self._model.pair_friction[self._tyres, :2] = coefficient if inside else self._hidden.tyre_friction

    def _push(
        self, x: float, y: float, velocity: npt.NDArray[np.float64], time_s: float
    ) -> tuple[float, float]:
        """Horizontal force on the chassis [N]."""
        hidden, force_x, force_y = self._hidden, 0.0, 0.0
        if hidden.tether is not None:
            post_x, post_y, stiffness = hidden.tether
            force_x, force_y = stiffness * (post_x - x), stiffness * (post_y - y)
        if hidden.magnet is not None:
            post_x, post_y, core, most = hidden.magnet
            # Greatest at core / sqrt(3), fading with the cube of the distance.
            away = math.hypot(x - post_x, y - post_y) / core
            pull = most * 3.08 / core / (1.0 + away**2) ** 2
            force_x, force_y = force_x + pull * (post_x - x), force_y + pull * (post_y - y)
        for start, length, gust_x, gust_y in hidden.gusts:
            if start <= time_s < start + length:
                force_x, force_y = force_x + gust_x, force_y + gust_y
        if hidden.air_drag > 0.0:
            drag = hidden.air_drag * math.hypot(velocity[0], velocity[1])
            force_x, force_y = force_x - drag * velocity[0], force_y - drag * velocity[1]
        return float(force_x), float(force_y)

    def _resist(self, state: mujoco.MjData) -> None:
        """Torque against each wheel's turning: coefficient x load x radius."""
        loads = self._loads(state)
        axle = state.xmat[self._chassis].reshape(3, 3)[:, 1]
        turning = state.qvel[[6, -1]] if state.qvel.size == 8 else state.qvel[[6, 8]] + state.qvel[[7, 9]]
        for side, body in enumerate(self._wheels):
            brake = self._hidden.rolling_resistance * loads[side] * self._radii[side]
            state.xfrc_applied[body, 3:] = -brake * math.tanh(turning[side] / _ROLLING_BLEND) * axle

    def _loads(self, state: mujoco.MjData) -> list[float]:
        """Read the normal force under the left and the right wheel in the step before [N]."""
        loads = [0.0, 0.0]
        for index, touching in enumerate(state.contact.geom):
            side = self._geoms.get(int(touching[0]), self._geoms.get(int(touching[1])))
            if side is not None:
                mujoco.mj_contactForce(self._model, state, index, self._scratch)
                loads[side] += self._scratch[0]
        return loads
