"""Sparse regression on differentiated residuals (SINDy: Brunton, Proctor, Kutz, PNAS 113(15), 2016).

Speeds and accelerations are taken from the recordings by differentiation, and what the nominal robot's equations of
motion leave over is regressed, by sequentially thresholded least squares, on a library of terms. Each term is the law
of an effect in closed form, counted in sizes worth a name; the threshold is 1. Effects without such a law, and those
that slip or play, have no term: it can not name them, and it can not abstain. Nor has inertia: noise in an acceleration
on both sides of an equation would make everything vanish.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from gecar.reality.discovery import MEMORY_S
from gecar.reality.fitting.parameters import Coordinate, free
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.prove.holdout import Contender, judge
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.recordings.split import hold_out
from gecar.reality.residuals.of_case import motion_residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.residuals.threads import Threads
from gecar.reality.uncertainty.intervals import NORMAL_95
from gecar.reality.verdict import Interval, Judgement
from gecar.world.effects import CATALOGUE
from gecar.world.robot import Robot, load_robot

Array = npt.NDArray[np.float64]
Terms = dict[str, Array]  # by the parameter's field: what one SI unit of it adds to the left side
Equation = tuple[
    Array, Terms, float
]  # what is left over, what it is regressed on, and the unit it is counted in

ROW_S = 0.01
SMOOTH_ROWS = (
    4.0  # of the normal weights all series are smoothed with, so that both sides of an equation stay equal
)
RESTING = 0.3  # rad/s: where friction has no sign
GRAVITY = 9.81
# What noise leaves of each equation on the practice case that conceals nothing, about.
TORQUE_NM, SPEED_M_S, TURN_RAD_S, READING_PCT = 0.02, 0.01, 0.1, 3.0


def sparse_regression(case: Case, holdout: Sequence[str]) -> dict[str, Any]:
    """Return a verdict in the form of ``verdict.json``."""
    parts = hold_out(case, holdout)
    robot = load_robot(parts.fitted[0].setup.robot)
    noise = estimate_noise(parts.fitted, robot.physics, MEMORY_S)
    known = {c.parameter.field: c for e in CATALOGUE for c in free(robot, [e.id]).coordinates}
    fitted, held = (
        motion_residuals(some, noise, MEMORY_S, Threads()).with_paths(robot.physics)
        for some in (parts.fitted, parts.held)
    )
    looked = [_sensor(run, robot) for run in fitted.recordings]
    equations = [e for r in parts.fitted for e in (*_torques(r, robot), *_rolling(r, robot))] + looked
    effects: dict[str, dict[str, Interval]] = {}
    for field, (size, sd) in _thresholded([_counted(*e, known) for e in equations if len(e[0])]).items():
        effects.setdefault(known[field].effect.id, {})[known[field].parameter.label] = _interval(
            known[field], size, sd
        )
    after = robot.with_effects({e: {label: i.value for label, i in p.items()} for e, p in effects.items()})
    judged = Judgement(
        (), False, judge(Contender(robot, held), Contender(after, held.with_paths(after.physics)))
    )
    return {
        "verdict": "missing" if effects else "nothing",
        "effects": [
            {"id": e, "or": [], "parameters": {k: vars(i) for k, i in p.items()}} for e, p in effects.items()
        ],
        "located": [],
        "holdout": {"before": judged.before, "after": judged.after, "gap_closed": judged.gap_closed},
    }


def _interval(c: Coordinate, size: float, sd: float) -> Interval:
    low, high = sorted(c.value(size + side * NORMAL_95 * sd) for side in (-1.0, 1.0))
    return Interval(c.value(size), low, high, c.parameter.unit)


def _counted(left: Array, terms: Terms, unit: float, known: Mapping[str, Coordinate]) -> tuple[Array, Terms]:
    """Count an equation in a unit of its own, so that all weigh alike, and its terms in sizes worth a name."""
    return left / unit, {f: g * known[f].step * known[f].parameter.si / unit for f, g in terms.items()}


def _thresholded(equations: Sequence[tuple[Array, Terms]]) -> dict[str, tuple[float, float]]:
    """Return size and standard deviation, in sizes worth a name, of the terms that stay above 1."""
    names = sorted({name for _, terms in equations for name in terms})
    left = np.concatenate([residual for residual, _ in equations]) if equations else np.zeros(0)
    library = np.concatenate(
        [np.stack([terms.get(n, np.zeros(len(r))) for n in names], axis=1) for r, terms in equations]
    ) if equations else np.zeros((0, 0))  # fmt: skip
    kept = [k for k in range(len(names)) if np.any(library[:, k])]
    while kept:
        chosen = library[:, kept]
        sizes = np.linalg.lstsq(chosen, left, rcond=None)[0]
        variance = float(np.mean((left - chosen @ sizes) ** 2))
        spread = np.sqrt(variance * np.diag(np.linalg.pinv(chosen.T @ chosen)))
        worth = np.abs(sizes) / np.maximum(1.0, NORMAL_95 * spread)
        if worth.min() >= 1.0:
            return {names[k]: (float(sizes[i]), float(spread[i])) for i, k in enumerate(kept)}
        kept.pop(int(np.argmin(worth)))  # one at a time: of two that are alike, one stays
    return {}


def _torques(recording: Recording, robot: Robot) -> list[Equation]:
    """Return what torque is left over at each shaft that moves [N m], and what effects would add to it."""
    p, t = robot.physics[0], even(recording.t_s, recording.t_s)
    angles = np.column_stack([recording.left_angle_rad, recording.right_angle_rad])
    if np.isnan(angles).all():
        return []
    angles = np.column_stack([even(recording.t_s, a) for a in angles.T])
    duty = np.column_stack([np.interp(t, recording.t_s, u) for u in recording.commands.T])
    left = leftover_torques(angles, duty, robot)
    duty = np.clip(duty, -p["duty_cap"], p["duty_cap"])
    w, duty, du = slope(angles), slope(duty, 0), slope(duty)
    gain, sign = p["torque_constant"] / p["resistance"], np.sign(w) * (np.abs(w) > RESTING)
    drive = gain * (duty * p["voltage"] - p["back_emf_constant"] * w)
    drawn = np.sum(np.abs(duty * drive) / p["torque_constant"], axis=1)
    full = gain * p["voltage"]
    heading = even(recording.t_s, recording.heading_rad)
    # Both wheels share a pull along the floor; without a heading there is none to see.
    pull = np.full(2, 0.5 * p["mass"] * GRAVITY * p["wheel_radius"] * np.any(heading))
    columns = {
        "coulomb_friction": -sign, "viscous_friction": -w, "static_friction": -sign * np.exp(-(w**2)),
        "friction_ratio": -p["coulomb_friction"] * np.abs(sign), "direction_gain": full * np.abs(duty),
        "dead_band": -full * np.sign(duty), "actuation_delay": -full * du,
        "gain_difference": full * duty * np.array([-0.5, 0.5]), "supply_scale": full * duty,
        "battery_resistance": -gain * duty * drawn[:, None], "battery_drain": -gain * duty * t[:, None],
        "tilt_x": np.cos(heading)[:, None] * pull, "tilt_y": np.sin(heading)[:, None] * pull,
    }  # fmt: skip
    moving = (np.abs(w) > RESTING).ravel()
    return [(left.ravel()[moving], {f: g.ravel()[moving] for f, g in columns.items()}, TORQUE_NM)]


def leftover_torques(angles: Array, duty: Array, robot: Robot) -> Array:
    """Return what torque is left over at each shaft [N m] by the nominal motor, robot and friction, shape (n, 2).

    M dw/dt = K (u V - Ke w) - c sign(w), K = Kt / R; M couples both shafts through the robot's mass and yaw inertia;
    a centre of mass behind the axle pulls in turns.

    Parameters
    ----------
    angles, duty
        Of both shafts, at even times 10 ms apart [rad, -1..1], shape (n, 2).
    robot
        The robot as it is known.
    """
    p = robot.physics[0]
    w, dw = slope(angles), slope(angles, 2)
    duty = slope(np.clip(duty, -p["duty_cap"], p["duty_cap"]), 0)
    ahead = p["mass"] * p["wheel_radius"] ** 2 / 4.0
    mount = p["mass"] * p["com_ahead"]
    aside = (p["yaw_inertia"] + mount * p["com_ahead"]) * p["wheel_radius"] ** 2 / p["track_width"] ** 2
    own, other = p["inertia"] + ahead + aside, ahead - aside
    gain, sign = p["torque_constant"] / p["resistance"], np.sign(w) * (np.abs(w) > RESTING)
    drive = gain * (duty * p["voltage"] - p["back_emf_constant"] * w)
    left = own * dw + other * dw[:, ::-1] - drive + p["coulomb_friction"] * sign
    turn = p["wheel_radius"] * (w[:, 1] - w[:, 0]) / p["track_width"]
    swing = mount * p["wheel_radius"] ** 2 / p["track_width"] * turn * w.mean(axis=1)
    out: Array = (
        left - (0.5 * p["wheel_radius"] * mount * turn**2)[:, None] + swing[:, None] * np.array([-1.0, 1.0])
    )
    return out


def _rolling(recording: Recording, robot: Robot) -> list[Equation]:
    """Return what speed ahead [m/s] and turning rate [rad/s] are left over by wheels that roll."""
    p, at = robot.physics[0], recording.t_s
    x, y, heading = (even(at, c) for c in (recording.x_m, recording.y_m, recording.heading_rad))
    angles = np.column_stack([even(at, a) for a in (recording.left_angle_rad, recording.right_angle_rad)])
    if not (np.any(x) and np.any(angles)):
        return []
    v = slope(x) * np.cos(heading) + slope(y) * np.sin(heading)
    wheels, turn = slope(angles) * p["wheel_radius"], slope(heading)
    ahead, turned = wheels.mean(axis=1), (wheels[:, 1] - wheels[:, 0]) / p["track_width"]
    straight = {"radius_scale": ahead, "pose_delay": -slope(ahead)}
    turning = {
        "radius_scale": turned, "radius_difference": ahead / p["track_width"], "track_scale": -turned,
        "pose_delay": -slope(turned),
    }  # fmt: skip
    return [(v - ahead, straight, SPEED_M_S), (turn - turned, turning, TURN_RAD_S)]


def _sensor(run: RecordingResiduals, robot: Robot) -> Equation:
    """Return what reading is left over [%] along the measured path."""
    told = run.readings(robot.physics)
    seen = ~np.isnan(told) & ~np.isnan(run.recording.reflection_pct)
    if not seen.any():
        return np.zeros(0), {}, 1.0
    columns = {"sensor_gain": told, "sensor_offset": np.ones(len(told)), "sensor_delay": -slope(told)}
    left = run.recording.reflection_pct - told
    return left[seen], {f: g[seen] for f, g in columns.items()}, READING_PCT


def even(t: Array, values: Array) -> Array:
    """Return values at even times 10 ms apart, gaps bridged; 0 where there are none."""
    seen = ~np.isnan(values)
    grid = np.arange(t[0], t[-1], ROW_S)
    return np.interp(grid, t[seen], values[seen]) if seen.any() else np.zeros(len(grid))


def slope(values: Array, order: int = 1) -> Array:
    """Return the first or second derivative of the smoothed values; the values themselves for order 0.

    The second is a derivative of differences: the second derivative of a normal weight that is cut off has a mean, and
    gives an angle of many turns an acceleration.
    """
    if order == 2:
        return slope(np.gradient(values, ROW_S, axis=0))
    return np.asarray(gaussian_filter1d(values, SMOOTH_ROWS, axis=0, order=order) / ROW_S**order)
