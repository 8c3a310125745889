"""What was learned, acting inside the simulation: a change of replays by the robot as it is known."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid

from benchmarks.concealed.comparators.sparse import RESTING
from benchmarks.rivals.leftover import lessons, of_body, of_wheels
from benchmarks.rivals.methods import METHODS, Model, learned
from gecar.reality.invent.corrected_replay import aligned, with_formulas
from gecar.reality.invent.formula import describe
from gecar.reality.prove.holdout import Correction
from gecar.reality.replay.kernel import AHEAD, ASIDE, HEADING, LEFT_SPEED, RIGHT_SPEED, YAW_RATE, X, Y
from gecar.reality.replay.replayer import Replayer
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]

NAMES = ("formula", *METHODS)
PASSES = 15  # of a replay under what was learned, each about the path of the one before
DAMPED = 0.7


def correction(method: str, fitted: Sequence[RecordingResiduals], robot: Robot) -> Correction:
    """Return what a method learned on recordings as a change of replays by the robot as it is known.

    Parameters
    ----------
    method
        One of `NAMES`.
    fitted
        The recordings to learn from.
    robot
        The robot as it is known.
    """
    if method == "formula":
        return with_formulas(describe(fitted, robot.physics))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of libraries, on their own future
        torque, ahead, turn = (learned(METHODS[method], some) for some in lessons(fitted, robot))
    return acting(torque, ahead, turn, robot)


def acting(torque: Model, ahead: Model, turn: Model, robot: Robot) -> Correction:
    """Return the change of a replay that what was learned makes, acting inside it."""
    p = robot.physics[0]
    a_duty = float(p["resistance"] / (p["torque_constant"] * p["voltage"]))  # that gives a torque of 1 N m

    def change(replayer: Replayer, rows: Array, poses: Array) -> tuple[Array, Array]:
        cap = replayer.recording.setup.duty_cap or float(p["duty_cap"])
        told = np.clip(replayer.inputs.commands, -cap, cap)
        free = _uncapped(replayer)
        first, t = replayer.first_row, replayer.t
        more, moved, played = np.zeros((len(t), 2)), rows, rows
        for _ in range(PASSES):
            driven = told[first:]
            found = np.column_stack([torque(seen) for seen in of_wheels(moved, driven, t)]) * a_duty
            found[(driven == 0.0) & (np.abs(moved[:, [LEFT_SPEED, RIGHT_SPEED]]) < RESTING)] = 0.0
            more = more + DAMPED * (found - more)
            commands = told.copy()
            commands[first:] += more
            inputs = free.inputs._replace(commands=commands)
            played = replace(free, inputs=inputs).play(robot.physics, rows[0, [X, Y, HEADING]]).rows
            moved = _with_speeds(played, ahead(of_body(moved, t)), turn(of_body(moved, t)), t)
        shift = moved[:, [X, Y, HEADING]] - rows[:, [X, Y, HEADING]]
        moves = np.stack([np.interp(replayer.inputs.pose_t, t, column) for column in shift.T], axis=1)
        return moved, aligned(poses + moves, replayer.inputs.pose, replayer.inputs.sd[3:5])

    return change


def _uncapped(replayer: Replayer) -> Replayer:
    """Return a replayer whose commands, capped already, may carry a torque besides."""
    setup = replace(replayer.recording.setup, duty_cap=10.0)
    return replace(replayer, recording=replace(replayer.recording, setup=setup))


def _with_speeds(rows: Array, ahead: Array, turn: Array, t: Array) -> Array:
    """Return a replay whose body has a speed ahead and a turning rate besides."""
    out = rows.copy()
    out[:, HEADING] += cumulative_trapezoid(turn, t, initial=0)
    out[:, YAW_RATE] += turn
    out[:, AHEAD] += ahead
    heading, v, w = out[:, HEADING], out[:, AHEAD], out[:, ASIDE]
    out[:, X] = rows[0, X] + cumulative_trapezoid(v * np.cos(heading) - w * np.sin(heading), t, initial=0)
    out[:, Y] = rows[0, Y] + cumulative_trapezoid(v * np.sin(heading) + w * np.cos(heading), t, initial=0)
    return out
