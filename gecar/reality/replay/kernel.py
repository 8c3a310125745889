"""The compiled replay: recorded commands open loop through the one dynamics, re-based on what was measured.

Commands are held from row to row, at uneven times; a step of the simulation takes their mean over its span, so that
delays and clock rates act smoothly. Velocities are never corrected: they follow from the commands alone. What merely
adds them up, wheel angles and pose, drifts for ever once it is wrong, so it is drawn towards the measurement: the
wheel angles with a fixed memory, the pose by a Kalman filter on (x, y, heading), whose normalised innovations are
the whitened residual. With an endless memory the replay is open loop from start to end.

Sources: prediction-error identification, Ljung, System Identification (2nd ed.), ch. 7; extended Kalman filter with
sequential scalar updates, Bar-Shalom, Li, Kirubarajan, Estimation with Applications (2001), ch. 5 and 10.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.world.kernel.dynamics import drift, step
from gecar.world.kernel.motor import bench_step, supply
from gecar.world.kernel.state import derive, place

Array = npt.NDArray[np.float64]

# Columns of what a replay predicts at each row; angles, voltage and rate before the row's own measurement corrects it.
LEFT_ANGLE, RIGHT_ANGLE, BATTERY, YAW_RATE, X, Y, HEADING, LEFT_SPEED, RIGHT_SPEED, AHEAD, ASIDE = range(11)
ROW_COLUMNS = 11


class KernelInput(NamedTuple):
    """A recording as the kernel reads it.

    Attributes
    ----------
    t
        Time of each row from the start of the simulation [s], shape (rows,).
    commands
        Duty of both motors, before the cap, shape (rows, 2).
    measured
        Left angle, right angle [rad], battery [V], yaw rate [rad/s]; nan where absent, shape (rows, 4).
    pose_t, pose
        Time of each pose [s], shape (poses,), and x, y [m], heading [rad], nan where absent, shape (poses, 3).
    sd
        Noise: one encoder's [rad], battery [V], yaw rate [rad/s], x and y [m], heading [rad], shape (5,).
    walk
        Process noise of the pose, a random walk: position [m/sqrt(s)], heading [rad/sqrt(s)], shape (2,).
    memory
        Over which wheel angles are re-based [s]; inf: never, and neither is the pose.
    bench
        Whether the wheels hang in the air.
    """

    t: Array
    commands: Array
    measured: Array
    pose_t: Array
    pose: Array
    sd: Array
    walk: Array
    memory: float
    bench: bool


@compiled
def _held(commands: Array, t: Array, motor: int, at: int, start: float, end: float, cap: float) -> float:
    """Return a motor's mean command between two times; ``at`` is the last row before ``start``, -1 for none."""
    if at >= 0 and (at + 1 == t.shape[0] or t[at + 1] >= end):  # one row holds throughout: nearly always
        return min(max(commands[at, motor], -cap), cap) * (end - start)
    total = 0.0
    while start < end:
        stop = end
        if at + 1 < t.shape[0]:
            stop = min(end, t[at + 1])
        if at >= 0:
            total += min(max(commands[at, motor], -cap), cap) * (stop - start)
        start = stop
        at += 1
    return total


@compiled
def _compare_rows(
    i: int,
    now: float,
    stretch: float,
    inputs: KernelInput,
    s: Any,
    p: Any,
    rows: Array,
    errors: Array,
    last: Array,
) -> int:
    """Predict, compare and re-base at every row up to now; return the next row."""
    endless = math.isinf(inputs.memory)
    while i < inputs.t.shape[0] and inputs.t[i] * stretch <= now + 1e-9:
        back = now - inputs.t[i] * stretch
        rows[i, 0] = s.left_angle - s.left_speed * back
        rows[i, 1] = s.right_angle - s.right_speed * back
        rows[i, 2] = supply(s, p)
        rows[i, 3] = s.yaw_rate
        rows[i, 4] = s.x - p.com_ahead * s.cos - (s.vx + s.yaw_rate * p.com_ahead * s.sin) * back
        rows[i, 5] = s.y - p.com_ahead * s.sin - (s.vy - s.yaw_rate * p.com_ahead * s.cos) * back
        rows[i, 6] = s.heading - s.yaw_rate * back
        rows[i, 7] = s.left_speed
        rows[i, 8] = s.right_speed
        rows[i, 9] = s.vx * s.cos + s.vy * s.sin
        rows[i, 10] = s.vy * s.cos - s.vx * s.sin - s.yaw_rate * p.com_ahead
        for k in range(4):
            errors[i, k] = (inputs.measured[i, k] - rows[i, k]) / inputs.sd[max(k - 1, 0)]
        for k in range(2):
            if not (endless or math.isnan(errors[i, k])):
                # A young mean weighs all it has seen alike; an old one forgets.
                keep = math.exp(-(inputs.t[i] - last[k]) / inputs.memory)
                last[2 + k] = 1.0 + last[2 + k] * keep
                last[k] = inputs.t[i]
                shift = errors[i, k] * inputs.sd[0] / last[2 + k]
                if k == 0:
                    s.left_angle += shift
                else:
                    s.right_angle += shift
        i += 1
    return i


@compiled
def _grow_covariance(before: Array, x: float, y: float, elapsed: float, walk: Array, spread: Array) -> None:
    """Let the pose's uncertainty grow over a stretch driven since the last pose.

    d(x, y) follows the heading's error turned a quarter: F = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]];
    P becomes F P F' + Q.
    """
    dx = x - before[0]
    dy = y - before[1]
    for k in range(3):
        spread[0, k] -= dy * spread[2, k]
        spread[1, k] += dx * spread[2, k]
    for k in range(3):
        spread[k, 0] -= dy * spread[k, 2]
        spread[k, 1] += dx * spread[k, 2]
    spread[0, 0] += walk[0] * walk[0] * elapsed
    spread[1, 1] += walk[0] * walk[0] * elapsed
    spread[2, 2] += walk[1] * walk[1] * elapsed


@compiled
def _compare_poses(
    j: int, now: float, stretch: float, late: float, inputs: KernelInput, s: Any, p: Any,
    poses: Array, errors: Array, before: Array, spread: Array, shift: Array,
) -> int:  # fmt: skip
    """Predict, compare and re-base at every pose up to now; return the next pose."""
    endless = math.isinf(inputs.memory)
    while j < inputs.pose_t.shape[0] and (inputs.pose_t[j] - late) * stretch <= now + 1e-9:
        back = max(now - (inputs.pose_t[j] - late) * stretch, 0.0) if now > 0.0 else 0.0
        axle_x = s.x - p.com_ahead * s.cos
        axle_y = s.y - p.com_ahead * s.sin
        poses[j, 0] = axle_x - (s.vx + s.yaw_rate * p.com_ahead * s.sin) * back
        poses[j, 1] = axle_y - (s.vy - s.yaw_rate * p.com_ahead * s.cos) * back
        poses[j, 2] = s.heading - s.yaw_rate * back
        if endless:
            for k in range(3):
                errors[j, k] = (inputs.pose[j, k] - poses[j, k]) / inputs.sd[3 if k < 2 else 4]
            j += 1
            continue
        _grow_covariance(
            before, poses[j, 0], poses[j, 1], max(inputs.pose_t[j] - before[2], 0.0), inputs.walk, spread
        )
        shift[:] = 0.0
        for k in range(3):
            variance = inputs.sd[3 if k < 2 else 4] ** 2
            innovation = inputs.pose[j, k] - poses[j, k] - shift[k]
            total = spread[k, k] + variance
            errors[j, k] = innovation / math.sqrt(total)
            if math.isnan(innovation):
                continue
            gain_x, gain_y, gain_h = spread[0, k] / total, spread[1, k] / total, spread[2, k] / total
            shift[0] += gain_x * innovation
            shift[1] += gain_y * innovation
            shift[2] += gain_h * innovation
            row_0, row_1, row_2 = spread[k, 0], spread[k, 1], spread[k, 2]
            spread[0, 0] -= gain_x * row_0
            spread[0, 1] -= gain_x * row_1
            spread[0, 2] -= gain_x * row_2
            spread[1, 0] -= gain_y * row_0
            spread[1, 1] -= gain_y * row_1
            spread[1, 2] -= gain_y * row_2
            spread[2, 0] -= gain_h * row_0
            spread[2, 1] -= gain_h * row_1
            spread[2, 2] -= gain_h * row_2
        _rebase(s, p, shift)
        before[0] = poses[j, 0] + shift[0]
        before[1] = poses[j, 1] + shift[1]
        before[2] = inputs.pose_t[j]
        j += 1
    return j


@compiled
def _rebase(s: Any, p: Any, shift: Array) -> None:
    """Move the robot by a small pose; its velocity turns with it."""
    x = s.x - p.com_ahead * s.cos + shift[0]
    y = s.y - p.com_ahead * s.sin + shift[1]
    ahead = s.vx * s.cos + s.vy * s.sin
    aside = s.vy * s.cos - s.vx * s.sin
    s.heading += shift[2]
    s.cos = math.cos(s.heading)
    s.sin = math.sin(s.heading)
    s.x = x + p.com_ahead * s.cos
    s.y = y + p.com_ahead * s.sin
    s.vx = ahead * s.cos - aside * s.sin
    s.vy = ahead * s.sin + aside * s.cos


@compiled
def replay_rows(
    inputs: KernelInput,
    physics: npt.NDArray[Any],
    derived: npt.NDArray[Any],
    state: npt.NDArray[Any],
    start: Array,
    offset: float,
    dt: float,
    rows: Array,
    row_errors: Array,
    poses: Array,
    pose_errors: Array,
) -> None:
    """Replay a recording.

    Parameters
    ----------
    inputs
        The recording.
    physics, derived, state
        Records, shape (1,) each; the last two are overwritten.
    start
        Start pose of the axle's centre [m, m, rad], shape (3,).
    offset
        How late this recording's camera clock is, besides the robot's ``pose_delay`` [s].
    dt
        Step [s].
    rows, row_errors
        Overwritten: predictions, shape (rows, ROW_COLUMNS), and normalised residuals, shape (rows, 4).
    poses, pose_errors
        Overwritten: predicted poses and normalised residuals, shape (poses, 3).
    """
    p, c, s = physics[0], derived[0], state[0]
    derive(p, dt, c)
    place(s, p, start[0], start[1], start[2])
    stretch = 1.0 / (1.0 + p.clock_skew)
    late = p.pose_delay + offset
    last = np.zeros(4)
    before = np.array([start[0], start[1], 0.0])
    spread = np.zeros((3, 3))
    shift = np.zeros(3)
    for k in range(3):
        spread[k, k] = 0.01  # the start pose is known to 0.1 m and 6 degrees: to nothing, beside what follows
    i = _compare_rows(0, 0.0, stretch, inputs, s, p, rows, row_errors, last)
    j = _compare_poses(0, 0.0, stretch, late, inputs, s, p, poses, pose_errors, before, spread, shift)
    at = -1
    n = 0
    while (i < inputs.t.shape[0] or j < inputs.pose_t.shape[0]) and n < 100_000_000:
        # Velocities live at mid-step: commands from the last middle to this one, less the delay, on the log's clock.
        begin = ((n - 0.5) * dt - p.actuation_delay) / stretch
        end = ((n + 0.5) * dt - p.actuation_delay) / stretch
        while at + 1 < inputs.t.shape[0] and inputs.t[at + 1] <= begin:
            at += 1
        share = stretch / dt
        left = _held(inputs.commands, inputs.t, 0, at, begin, end, p.duty_cap) * share
        right = _held(inputs.commands, inputs.t, 1, at, begin, end, p.duty_cap) * share
        if inputs.bench:
            bench_step(s, left, right, p, c)
        else:
            step(s, left, right, p, c)
            drift(s, c)
        n += 1
        if i < inputs.t.shape[0] and inputs.t[i] * stretch <= n * dt + 1e-9:
            i = _compare_rows(i, n * dt, stretch, inputs, s, p, rows, row_errors, last)
        if j < inputs.pose_t.shape[0] and (inputs.pose_t[j] - late) * stretch <= n * dt + 1e-9:
            j = _compare_poses(
                j, n * dt, stretch, late, inputs, s, p, poses, pose_errors, before, spread, shift
            )
