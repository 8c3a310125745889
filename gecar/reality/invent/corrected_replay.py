"""A formula added to a replay: what it gains where nothing in the catalogue explains what is left.

The formula says by how much a speed is off, in the replay's own states. Dynamics hardly know where the robot stands,
so the speeds are corrected after the replay and added up anew; the robot file stays as it is, for a description is no
cause and no part of a robot.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid

from gecar.reality.invent.formula import NAMES, TARGETS, Formula, state_terms
from gecar.reality.replay.kernel import AHEAD, ASIDE, HEADING, LEFT_ANGLE, RIGHT_ANGLE, X, Y
from gecar.reality.replay.replayer import Film

Array = npt.NDArray[np.float64]
PASSES = 3  # the formula reads angles that it moves itself
Change = Callable[[Film, Array, Array], tuple[Array, Array]]


def with_formulas(formulas: Sequence[Formula]) -> Change:
    """Return what formulas make of an open-loop replay: from (film, rows, poses) to rows and poses.

    Parameters
    ----------
    formulas
        At most one for each speed.
    """

    def change(film: Film, rows: Array, poses: Array) -> tuple[Array, Array]:
        moved, off = rows.copy(), _speeds_off(formulas, film, rows)
        for _ in range(PASSES):
            moved[:, LEFT_ANGLE] = rows[:, LEFT_ANGLE] + _added_up(off[0], film.t)
            moved[:, RIGHT_ANGLE] = rows[:, RIGHT_ANGLE] + _added_up(off[1], film.t)
            off = _speeds_off(formulas, film, moved)
        heading = rows[:, HEADING] + _added_up(off[4], film.t)
        now = _floor_velocity(rows[:, AHEAD] + off[2], rows[:, ASIDE] + off[3], heading)
        was = _floor_velocity(rows[:, AHEAD], rows[:, ASIDE], rows[:, HEADING])
        moved[:, HEADING] = heading
        moved[:, X] += _added_up(now[0] - was[0], film.t)
        moved[:, Y] += _added_up(now[1] - was[1], film.t)
        shift = moved[:, [X, Y, HEADING]] - rows[:, [X, Y, HEADING]]
        felt = [np.interp(film.reel.pose_t, film.t, column) for column in shift.T]
        return moved, _aligned(poses + np.stack(felt, axis=1), film.reel.pose)

    return change


def _speeds_off(formulas: Sequence[Formula], film: Film, rows: Array) -> list[Array]:
    """Return by how much each target's speed is off at every row."""
    terms = state_terms(rows, film.t, film.recording.commands)
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


def _aligned(poses: Array, measured: Array) -> Array:
    """Turn and shift a path onto the poses seen: its start is a nuisance, as in every replay that is judged.

    Source: Kabsch's rotation in the plane, Umeyama, IEEE T-PAMI 13(4), 1991.
    """
    seen = ~np.isnan(measured[:, :2]).any(axis=1)
    if seen.sum() < 3:
        return poses
    centre, goal = poses[seen, :2].mean(axis=0), measured[seen, :2].mean(axis=0)
    a, b = poses[seen, :2] - centre, measured[seen, :2] - goal
    angle = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    turned = _floor_velocity(poses[:, 0] - centre[0], poses[:, 1] - centre[1], np.full(len(poses), angle))
    return np.column_stack([turned[0] + goal[0], turned[1] + goal[1], poses[:, 2] + angle])
