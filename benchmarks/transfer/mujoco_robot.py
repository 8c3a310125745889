"""The robot of `benchmarks/concealed` in MuJoCo, driven a millisecond at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco

from benchmarks.concealed.body import build
from benchmarks.concealed.drive_train import TICK_S, DriveTrain
from benchmarks.concealed.robot import Concealed
from benchmarks.transfer.variations import NOMINAL, Variation

Pose = tuple[float, float, float]

_SETTLE_STEPS = 800  # until tyres and caster carry their loads


class MujocoRobot:
    """One robot in a MuJoCo world of its own: body, contacts and drive train are those of `benchmarks/concealed`.

    Parameters
    ----------
    variation
        How the robot differs from the nominal one.
    """

    def __init__(self, variation: Variation = NOMINAL) -> None:
        self._hidden = _concealed(variation)
        self._model = build(self._hidden)
        self._steps = round(TICK_S / self._model.opt.timestep)
        self._shafts_at = [int(self._model.joint(side).dofadr[0]) for side in ("left", "right")]
        self._model.pair_friction[
            [self._model.pair(f"{side}_floor").id for side in ("left", "right")], :2
        ] = variation.grip
        self._settled = mujoco.MjData(self._model)
        mujoco.mj_step(self._model, self._settled, nstep=_SETTLE_STEPS)
        self.place(0.0, 0.0, 0.0)

    def close(self) -> None:
        """Do nothing: MuJoCo's worlds go when nobody uses them."""

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the axle's centre at a pose [m, m, rad], at rest, tyres and caster carrying their loads."""
        self._state, self._train = mujoco.MjData(self._model), DriveTrain(self._hidden)
        self._state.qpos[:] = self._settled.qpos
        self._state.qpos[:2] = x, y
        turn = (math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0))
        mujoco.mju_mulQuat(self._state.qpos[3:7], turn, self._settled.qpos[3:7])
        mujoco.mj_forward(self._model, self._state)

    def pose(self) -> Pose:
        """Return the axle's centre [m, m, rad]."""
        x, y, _, w, i, j, k = self._state.qpos[:7].tolist()
        return x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))

    def shafts(self) -> tuple[float, float]:
        """Return how fast the left and the right shaft turn [rad/s]."""
        left, right = self._state.qvel[self._shafts_at].tolist()
        return left, right

    def advance(self, duties_pct: Sequence[float]) -> None:
        """Drive for a millisecond with a left and a right duty [%]."""
        duties = self._train.duties((duties_pct[0], duties_pct[1]), 0.0)
        self._state.qfrc_applied[self._shafts_at] = self._train.drive(
            duties, self.shafts(), (0.0, 0.0), 0.0
        ).torques
        mujoco.mj_step(self._model, self._state, nstep=self._steps)


def _concealed(variation: Variation) -> Concealed:
    return Concealed(
        gain_difference=variation.motor_difference,
        coulomb_friction=Concealed.coulomb_friction * variation.dry_friction,
        supply_scale=variation.battery,
        tyre_friction=variation.grip,
    )
