"""Steady-state speed of a motor on a bench, under duty commands or speed commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.world.kernel.motor import bench_step
from gecar.world.kernel.state import DERIVED, STATE, derive, place
from gecar.world.robot import Robot
from gecar.world.rollout import STEP_S

HOLD_S = 2.0
"""How long each level is held, as in the paper's section 4.1 [s]; the shaft settles within 0.5 s."""

Floats = npt.NDArray[np.float64]


def altered(robot: Robot, mode: str, duty_cap: float | None = None) -> Robot:
    """Return the robot with another ``drive.mode``, and optionally another cap on commands [0..1]."""
    drive = robot.drive.model_copy(update={"mode": mode, "duty_cap": duty_cap or robot.drive.duty_cap})
    return robot.model_copy(update={"drive": drive})


def settled_speeds(robot: Robot, levels_pct: Sequence[float]) -> Floats:
    """Return the left motor's steady-state speed at each level, held one after the other.

    Parameters
    ----------
    robot
        Its ``drive`` gives the meaning of a level (``duty``: share of the supply; ``speed``: set-point of 10 deg/s per
        percent) and the cap.
    levels_pct
        Commands before the cap [%].

    Returns
    -------
    numpy.ndarray
        Mean over the second half of each level [deg/s], shape (levels,).
    """
    n = round(HOLD_S / STEP_S)
    angles = shaft_angles(robot, levels_pct)
    return np.degrees(angles[n::n] - angles[n // 2 :: n]) / (HOLD_S / 2.0)


def shaft_angles(robot: Robot, levels_pct: Sequence[float]) -> Floats:
    """Return the left motor's angle at every step of `STEP_S` [rad], shape (levels x steps + 1,)."""
    physics, derived, state = robot.physics, np.zeros(1, DERIVED), np.zeros(1, STATE)
    p, c, s = physics[0], derived[0], state[0]
    derive(p, STEP_S, c)
    place(s, p, 0.0, 0.0, 0.0)
    cap = robot.drive.duty_cap
    commands = np.repeat(np.clip(np.asarray(levels_pct, float) / 100.0, -cap, cap), round(HOLD_S / STEP_S))
    angles = np.zeros(len(commands) + 1)
    for k, command in enumerate(commands):
        bench_step(s, command, command, p, c)
        angles[k + 1] = s["left_angle"]
    return angles
