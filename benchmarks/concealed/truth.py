"""Drive a concealed robot and remember everything, free of noise."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np

from benchmarks.concealed.body import build
from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.drive_train import DriveTrain
from benchmarks.concealed.history import ROW_TICKS, TICK_S, Array, Controller, History, Pose, ToppledError
from benchmarks.concealed.robot import GRAVITY, Concealed
from benchmarks.concealed.surroundings import Surroundings

_STEPS_PER_TICK = 2
_SETTLE_STEPS = 800  # 0.4 s on level ground, until tyres and caster carry their loads
_UPRIGHT = math.cos(math.radians(20.0))

mujoco.set_mju_user_warning(lambda _: None)  # or it writes a log file into whatever folder this runs in


class Truth:
    """One concealed robot, ready to be driven any number of times.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.
    """

    def __init__(self, concealed: Concealed) -> None:
        self.concealed = concealed
        self._model = build(concealed)
        joints = [self._model.joint(side) for side in ("left", "right")]
        self._angle_at = [int(joint.qposadr[0]) for joint in joints]
        self._speed_at = [int(joint.dofadr[0]) for joint in joints]
        self._settled = self._settle()

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
        log = History.blank(count)
        state, train = self._placed(start), DriveTrain(self.concealed)
        around, sensor = Surroundings(self.concealed, self._model), ColourSensor(self.concealed)
        around.settle()
        command: tuple[int, int] | None = (0, 0)
        for tick in range(count):
            time_s = tick * TICK_S
            self._remember(log, tick, state)
            log.light[tick] = sensor.look(*log.pose[tick])
            log.readings[tick] = min(max(round(log.light[tick] + noise[tick]), 0), 100)
            if tick % turn_ticks == 0:
                command = controller(time_s, int(log.readings[tick]))
                if command is None or (ended is not None and ended(log.pose[tick, 0], log.pose[tick, 1])):
                    log.terminal_v[tick] = log.terminal_v[
                        max(tick - 1, 0)
                    ]  # nothing is asked of the battery any more
                    return _finished(log.until(tick + 1))
            log.commands[tick] = command
            log.terminal_v[tick] = self._push(train, state, command, time_s)
            if not around.idle:
                around.act(state, time_s)
            mujoco.mj_step(self._model, state, nstep=_STEPS_PER_TICK)
        return _finished(log)

    def _settle(self) -> mujoco.MjData:
        state = mujoco.MjData(self._model)
        self._model.opt.gravity[:] = [0.0, 0.0, -GRAVITY]
        mujoco.mj_step(self._model, state, nstep=_SETTLE_STEPS)
        return state

    def _placed(self, start: Pose) -> mujoco.MjData:
        """Put the settled robot, at rest, at its start; it settled on level ground, so any heading is as good."""
        state = mujoco.MjData(self._model)
        state.qpos[:] = self._settled.qpos
        state.qpos[:2] = start[:2]
        turn = np.array([math.cos(start[2] / 2.0), 0.0, 0.0, math.sin(start[2] / 2.0)])
        mujoco.mju_mulQuat(state.qpos[3:7], turn, self._settled.qpos[3:7])
        mujoco.mj_forward(self._model, state)
        return state

    def _remember(self, log: History, tick: int, state: mujoco.MjData) -> None:
        w, x, y, z = state.qpos[3:7]
        if 1.0 - 2.0 * (x * x + y * y) < _UPRIGHT:
            message = f"the robot fell over at {log.time_s[tick]:.2f} s"
            raise ToppledError(message)
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        log.pose[tick] = (state.qpos[0], state.qpos[1], heading)
        log.angles[tick] = state.qpos[self._angle_at]
        log.yaw_rate[tick] = state.qvel[5]

    def _push(
        self, train: DriveTrain, state: mujoco.MjData, command: tuple[int, int] | None, time_s: float
    ) -> float:
        """Set the motors' torques; return the terminal voltage."""
        duties = train.duties(command or (0, 0), time_s)
        left, right = self._speed_at
        speeds = (float(state.qvel[left]), float(state.qvel[right]))
        angles = (float(state.qpos[self._angle_at[0]]), float(state.qpos[self._angle_at[1]]))
        drive = train.drive(duties, speeds, angles, time_s)
        state.qfrc_applied[left], state.qfrc_applied[right] = drive.torques
        if self.concealed.static_friction > 0.0:
            self._model.dof_frictionloss[left], self._model.dof_frictionloss[right] = drive.friction
        return drive.terminal_v


def _finished(log: History) -> History:
    log.pose[:, 2] = np.unwrap(log.pose[:, 2])
    log.angles[:] -= log.angles[0]
    return log
