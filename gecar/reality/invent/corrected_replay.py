"""A formula added to a replay: what it gains where nothing in the catalogue explains what is left.

The formula says by how much a speed is off, in the replay's own states. Dynamics hardly know where the robot stands,
so the speeds are corrected after the replay and added up anew; the robot file stays as it is, for a description is no
cause and no part of a robot.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid

from gecar.reality.invent.formula import NAMES, TARGETS, Formula, state_terms
from gecar.reality.prove.holdout import Correction
from gecar.reality.replay.kernel import AHEAD, ASIDE, HEADING, LEFT_ANGLE, RIGHT_ANGLE, X, Y
from gecar.reality.replay.replayer import Replayer
from gecar.reality.replay.rigid_alignment import pose_errors

Array = npt.NDArray[np.float64]
FEWEST_POSES = 3
PASSES = 3  # the formula reads angles that it moves itself


def with_formulas(formulas: Sequence[Formula]) -> Correction:
    """Return what formulas make of an open-loop replay: from (replayer, rows, poses) to rows and poses.

    Parameters
    ----------
    formulas
        At most one for each speed.
    """

    def change(replayer: Replayer, rows: Array, poses: Array) -> tuple[Array, Array]:
        moved, off = rows.copy(), _speeds_off(formulas, replayer, rows)
        for _ in range(PASSES):
            moved[:, LEFT_ANGLE] = rows[:, LEFT_ANGLE] + _added_up(off[0], replayer.t)
            moved[:, RIGHT_ANGLE] = rows[:, RIGHT_ANGLE] + _added_up(off[1], replayer.t)
            off = _speeds_off(formulas, replayer, moved)
        heading = rows[:, HEADING] + _added_up(off[4], replayer.t)
        now = _floor_velocity(rows[:, AHEAD] + off[2], rows[:, ASIDE] + off[3], heading)
        was = _floor_velocity(rows[:, AHEAD], rows[:, ASIDE], rows[:, HEADING])
        moved[:, HEADING] = heading
        moved[:, X] += _added_up(now[0] - was[0], replayer.t)
        moved[:, Y] += _added_up(now[1] - was[1], replayer.t)
        shift = moved[:, [X, Y, HEADING]] - rows[:, [X, Y, HEADING]]
        moves = [np.interp(replayer.inputs.pose_t, replayer.t, column) for column in shift.T]
        return moved, aligned(poses + np.stack(moves, axis=1), replayer.inputs.pose, replayer.inputs.sd[3:5])

    return change


def _speeds_off(formulas: Sequence[Formula], replayer: Replayer, rows: Array) -> list[Array]:
    """Return by how much each target's speed is off at every row."""
    terms = state_terms(rows, replayer.t, replayer.recording.commands)
    off = [np.zeros(len(rows)) for _ in TARGETS]
    for formula in formulas:
        number = [name for name, _ in TARGETS].index(formula.target)
        for coefficient, name in formula.terms:
            off[number] = off[number] + coefficient * terms[:, NAMES.index(name)]
    return off


def _added_up(speed: Array, t: Array) -> Array:
    return np.asarray(cumulative_trapezoid(speed, t, initial=0), float)


def _floor_velocity(ahead: Array, aside: Array, heading: Array) -> tuple[Array, Array]:
    cos, sin = np.cos(heading), np.sin(heading)
    return ahead * cos - aside * sin, ahead * sin + aside * cos


def aligned(poses: Array, measured: Array, sd: Array) -> Array:
    """Turn and shift a path onto the poses seen: its start is a nuisance, as in every replay that is judged."""
    seen = ~np.isnan(measured).any(axis=1)
    if seen.sum() < FEWEST_POSES:
        return poses
    out = poses.copy()
    out[seen] = measured[seen] - pose_errors(measured[seen], poses[seen], sd)
    return out
