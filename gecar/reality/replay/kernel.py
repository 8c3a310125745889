"""The compiled replay: recorded commands open loop through the one dynamics, re-based on what was measured.

Commands are held from row to row, at uneven times; a step of the simulation takes their mean over its span, so that
delays and clock rates act smoothly. Velocities are never corrected: they follow from the commands alone. What merely
adds them up, wheel angles and pose, drifts for ever once it is wrong, so it is drawn towards the measurement: the
wheel angles with a fixed memory, the pose by a Kalman filter on (x, y, heading), whose normalised innovations are
the whitened residual. With an endless memory the replay is open loop from start to end.

Robots with the same timing of commands and poses are replayed in lock step (`gecar.world.kernel.lock_step`).

Source: prediction-error identification, Ljung, System Identification (2nd ed.), ch. 7.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import LANES, any_integer, kernel, lane_access
from gecar.reality.replay.kernel_input import Kept, KernelInput
from gecar.reality.replay.pose_filter import (
    FILTER,
    POSE,
    UNKNOWN,
    begin_filter,
    correct,
    grow,
    move,
    predict_pose,
    rebase,
)
from gecar.world.kernel.dynamics import bench_step_with_terms, drift, has_terms, is_light, step_with_terms
from gecar.world.kernel.laws import N_STORES, SUPPLY_ASKED
from gecar.world.kernel.lock_step import (
    N_FIELDS,
    advance_lanes,
    advance_lanes_with_terms,
    lane_memory,
    load_acting,
    load_derived,
    load_physics,
    load_state,
    store_acting,
    store_derived,
    store_physics,
    store_state,
)
from gecar.world.kernel.motor import bench_step, supply
from gecar.world.kernel.state import ALL, LIGHT, derive, place
from gecar.world.kernel.terms import (
    PORT_ENCODER,
    PORT_GYRO,
    PORT_POSE_X,
    WHOLE,
    reading_error,
)
from gecar.world.ports import PORT
from gecar.world.terms import formulas_of

Array = npt.NDArray[np.float64]

# Columns of what a replay predicts at each row; angles, voltage and rate before the row's own measurement corrects it.
LEFT_ANGLE, RIGHT_ANGLE, BATTERY, YAW_RATE, X, Y, HEADING, LEFT_SPEED, RIGHT_SPEED, AHEAD, ASIDE = range(11)
ROW_COLUMNS = 11
MOST_STEPS = 100_000_000
_LEFT, _RIGHT, _ZERO = any_integer(0), any_integer(1), any_integer(0)

TIMING = ("clock_skew", "actuation_delay", "pose_delay", "duty_cap")
"""What robots must share to be replayed in lock step, fields of the `PHYSICS` record."""

_ROW = (
    "left_error right_error battery_error yaw_error "
    "left_angle right_angle battery yaw_rate x y heading left_speed right_speed ahead aside "
    "yaw_1_ago yaw_2_ago yaw_3_ago left_off right_off battery_off yaw_off"
)
ROW = np.dtype([(field, np.float64) for field in _ROW.split()])
"""Normalised residuals at a row; what is predicted there, in the order of the columns above; yaw rates steps ago; what
terms add to what is measured."""

_OF_ROW = N_FIELDS + len(FILTER.descr)
_OF_POSE = _OF_ROW + len(ROW.descr)
N_REPLAY_FIELDS = _OF_POSE + len(POSE.descr)
_load_filter, _store_filter = lane_access(FILTER, N_FIELDS)
_load_row, _store_row = lane_access(ROW, _OF_ROW)
_load_pose, _store_pose = lane_access(POSE, _OF_POSE)


@kernel
def _held(commands: Array, t: Array, motor: int, at: int, start: float, end: float, cap: float) -> float:
    """Return a motor's mean command between two times; ``at`` is the last of them before ``start``, -1 for none."""
    if at >= 0 and (at + 1 == t.shape[0] or t[at + 1] >= end):  # one holds throughout: nearly always
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


@kernel
def _predict_row(s: Any, p: Any, back: float, r: Any) -> None:
    """Predict what was measured some time ago."""
    r.left_angle = s.left_angle - s.left_speed * back
    r.right_angle = s.right_angle - s.right_speed * back
    r.battery = supply(s, p)
    r.x = s.x - p.com_ahead * s.cos - (s.vx + s.yaw_rate * p.com_ahead * s.sin) * back
    r.y = s.y - p.com_ahead * s.sin - (s.vy - s.yaw_rate * p.com_ahead * s.cos) * back
    r.heading = s.heading - s.yaw_rate * back
    r.left_speed = s.left_speed
    r.right_speed = s.right_speed
    r.ahead = s.vx * s.cos + s.vy * s.sin
    r.aside = s.vy * s.cos - s.vx * s.sin - s.yaw_rate * p.com_ahead


@kernel
def _roll_along(angle_sd: float, flat: Array, lanes: int) -> None:
    """Move every lane's robot as if its wheels had turned as encoders of noise ``angle_sd`` [rad] say."""
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        c = load_derived(flat, lanes, lane)
        r = _load_row(flat, lanes, lane)
        left = 0.0 if math.isnan(r.left_error) else r.left_error * angle_sd * c.left_radius
        right = 0.0 if math.isnan(r.right_error) else r.right_error * angle_sd * c.right_radius
        ahead, turn = 0.5 * (left + right), 0.5 * (right - left) / c.half_track
        middle = s.heading + 0.5 * turn
        move(s, p, ahead * math.cos(middle), ahead * math.sin(middle), turn)
        store_state(flat, lanes, lane, s)


@kernel
def _compare_row(
    i: int, back: float, inputs: KernelInput, weights: Array, flat: Array, lanes: int, terms: bool
) -> None:
    """Predict and compare at a row, and draw the wheel angles towards it; ``weights`` as in `_weigh`."""
    measured, sd = inputs.measured, inputs.sd
    left, right, battery = measured[i, 0], measured[i, 1], measured[i, 2]
    angle_sd, battery_sd = sd[0], sd[1]
    left_weight, right_weight = weights[0], weights[1]
    endless = math.isinf(inputs.memory)
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        r = _load_row(flat, lanes, lane)
        _predict_row(s, p, back, r)
        if terms:
            r.left_angle += r.left_off
            r.right_angle += r.right_off
            r.battery += r.battery_off
        r.left_error = (left - r.left_angle) / angle_sd
        r.right_error = (right - r.right_angle) / angle_sd
        r.battery_error = (battery - r.battery) / battery_sd
        if not endless or inputs.rolls:
            s.left_angle += 0.0 if math.isnan(r.left_error) else r.left_error * angle_sd / left_weight
            s.right_angle += 0.0 if math.isnan(r.right_error) else r.right_error * angle_sd / right_weight
        store_state(flat, lanes, lane, s)
        _store_row(flat, lanes, lane, r)
    if inputs.rolls:
        _roll_along(angle_sd, flat, lanes)


@kernel
def _compare_yaw_rates(
    i: int,
    now: float,
    dt: float,
    stretch: float,
    inputs: KernelInput,
    kept: Kept,
    flat: Array,
    lanes: int,
    robots: npt.NDArray[Any],
    reads: bool,
) -> int:
    """Predict, compare and keep the yaw rates of rows up to one and a half steps ago; return the row after them.

    They begin with row ``i``. Velocities are those of the middle of a step, and rows lie between two middles. Taken as
    they are, rows on the edge of two steps would jump from one to the other as a clock is a little faster or slower.
    """
    while i < inputs.t.shape[0] and inputs.t[i] * stretch <= now - 1.5 * dt + 1e-9:
        share = 2.5 - (now - inputs.t[i] * stretch) / dt
        if reads:
            _set_off_of_yaw_rate(flat, lanes, robots)
        for lane in range(lanes):
            s = load_state(flat, lanes, lane)
            r = _load_row(flat, lanes, lane)
            rate = _between(r.yaw_3_ago, r.yaw_2_ago, r.yaw_1_ago, s.yaw_rate, share)
            if reads:
                rate += r.yaw_off
            kept.row_errors[i, 3 * lanes + lane] = (inputs.measured[i, 3] - rate) / inputs.sd[2]
            if kept.rows.shape[0] > 0:
                kept.rows[i, YAW_RATE * lanes + lane] = rate
        i += 1
    return i


@kernel
def _between(a: float, b: float, c: float, d: float, share: float) -> float:
    """Return a value so far from ``b`` to ``c``, of four at equal distances.

    Where a command changes, rates have a kink. It lies in one of the three intervals, and two of the three lines, the
    middle one and those continued from either side, do not cross it: the median is one of them (limiters of Harten,
    Engquist, Osher, Chakravarthy, J. Computational Physics 71 (1987) 231, choose among lines to the same end).
    """
    from_left, middle = b + share * (b - a), b + share * (c - b)
    from_right = c - (1.0 - share) * (d - c)
    return max(min(from_left, middle), min(max(from_left, middle), from_right))


@kernel
def _remember_yaw(flat: Array, lanes: int) -> None:
    """Keep every lane's yaw rates before a step."""
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        r = _load_row(flat, lanes, lane)
        r.yaw_3_ago, r.yaw_2_ago, r.yaw_1_ago = r.yaw_2_ago, r.yaw_1_ago, s.yaw_rate
        _store_row(flat, lanes, lane, r)


@kernel
def _weigh(i: int, inputs: KernelInput, weights: Array) -> None:
    """Age what was seen of each wheel angle, and add a row: weights, shape (2,), and times they are of [s], (2,).

    A young mean weighs all it has seen alike; an old one forgets.
    """
    if inputs.anew[i]:
        weights[0] = weights[1] = 0.0
    for k in range(2):
        if not math.isnan(inputs.measured[i, k]):
            keep = 0.0 if inputs.rolls else math.exp(-(inputs.t[i] - weights[2 + k]) / inputs.memory)
            weights[k] = 1.0 + weights[k] * keep
            weights[2 + k] = inputs.t[i]


@kernel
def _compare_pose(
    j: int, back: float, elapsed: float, inputs: KernelInput, flat: Array, lanes: int, terms: bool
) -> None:
    """Predict and compare at a pose, and move the robot towards it."""
    x, y, heading = inputs.pose[j, 0], inputs.pose[j, 1], inputs.pose[j, 2]
    place_sd, turn_sd = inputs.sd[3], inputs.sd[4]
    place = inputs.walk[0] * inputs.walk[0] * elapsed
    turn = inputs.walk[1] * inputs.walk[1] * elapsed
    if inputs.pose_anew[j]:
        place = turn = UNKNOWN
    endless, over_x, over_y = math.isinf(inputs.memory), inputs.camera[0], inputs.camera[1]
    for lane in range(lanes):
        s = load_state(flat, lanes, lane)
        p = load_physics(flat, lanes, lane)
        f = _load_filter(flat, lanes, lane)
        r = _load_pose(flat, lanes, lane)
        predict_pose(s, p, back, r)
        r.x += (p.pose_scale - 1.0) * (r.x - over_x)
        r.y += (p.pose_scale - 1.0) * (r.y - over_y)
        if terms:
            r.x += r.x_off
            r.y += r.y_off
            r.heading += r.heading_off
        if endless:
            r.x_error = (x - r.x) / place_sd
            r.y_error = (y - r.y) / place_sd
            r.heading_error = (heading - r.heading) / turn_sd
        else:
            grow(f, r, place, turn)
            correct(f, r, x, y, heading, place_sd, turn_sd)
            rebase(s, p, f)
        store_state(flat, lanes, lane, s)
        _store_filter(flat, lanes, lane, f)
        _store_pose(flat, lanes, lane, r)


@kernel
def _begin(physics: npt.NDArray[Any], start: Array, over: Array, dt: float, flat: Array, lanes: int) -> None:
    """Put every lane's robot at rest where a camera above the point ``over`` sees it at the start pose."""
    for lane in range(lanes):
        p = physics[lane]
        store_physics(flat, lanes, lane, p)
        c = load_derived(flat, lanes, lane)
        derive(p, dt, c)
        store_derived(flat, lanes, lane, c)
        s = load_state(flat, lanes, lane)
        farther = 1.0 / p.pose_scale - 1.0
        x, y = start[0] + farther * (start[0] - over[0]), start[1] + farther * (start[1] - over[1])
        place(s, p, x, y, start[2])
        store_state(flat, lanes, lane, s)
        f = _load_filter(flat, lanes, lane)
        begin_filter(f, start[0], start[1])
        _store_filter(flat, lanes, lane, f)


@kernel
def _act(left: float, right: float, flat: Array, lanes: int) -> None:
    """Let the same commands act in every lane."""
    for lane in range(lanes):
        a = load_acting(flat, lanes, lane)
        a.left, a.right = left, right
        store_acting(flat, lanes, lane, a)


@kernel
def _advance(left: float, right: float, bench: bool, light: bool, flat: Array, lanes: int) -> None:
    """Advance every lane by one step under the same commands; ``light`` says whether all lanes' robots are light."""
    if bench:
        for lane in range(lanes):
            s = load_state(flat, lanes, lane)
            bench_step(s, left, right, load_physics(flat, lanes, lane), load_derived(flat, lanes, lane))
            store_state(flat, lanes, lane, s)
        return
    _act(left, right, flat, lanes)
    if light and lanes > 1:
        advance_lanes(flat, lanes, LIGHT)
    else:
        advance_lanes(flat, lanes, ALL)


@kernel
def _keep(flat: Array, first: int, predicted: Array, errors: Array, row: int) -> None:
    """Keep what all lanes found at a row: residuals, and predictions where they are wanted."""
    for k in range(errors.shape[1]):
        errors[row, k] = flat[first + k]
    if predicted.shape[0] > 0:
        for k in range(predicted.shape[1]):
            predicted[row, k] = flat[first + errors.shape[1] + k]


@kernel
def _advance_one_with_terms(
    left: float,
    right: float,
    bench: bool,
    robots: npt.NDArray[Any],
    stores: Array,
    flat: Array,
) -> None:
    """Do the same for one robot with terms."""
    s, c = load_state(flat, 1, 0), load_derived(flat, 1, 0)
    if bench:
        bench_step_with_terms(s, left, right, robots, c, stores)
    else:
        step_with_terms(s, left, right, robots, c, stores)
        drift(s, c)
    store_state(flat, 1, 0, s)
    store_derived(flat, 1, 0, c)


@kernel
def _advance_several_with_terms(
    left: float,
    right: float,
    robots: npt.NDArray[Any],
    alike: bool,
    stores: Array,
    flat: Array,
) -> None:
    """Do the same for `LANES` robots with terms, on the floor."""
    _act(left, right, flat, LANES)
    advance_lanes_with_terms(flat, LANES, robots, alike, stores)


@kernel
def _at_readings(laws: Any) -> bool:
    """Whether any term of a robot acts on what is measured."""
    found = False
    for k in range(int(laws.n_terms)):
        found = found or laws.terms[k, PORT] >= PORT_ENCODER
    return found


@kernel
def _set_off_of_row(flat: Array, lanes: int, robots: npt.NDArray[Any], stores: Array, reads: bool) -> None:
    """Set what terms add to a row's angles and battery."""
    for lane in range(lanes):
        r = _load_row(flat, lanes, lane)
        r.battery_off = stores[SUPPLY_ASKED * lanes + lane]
        if reads:
            s, p = load_state(flat, lanes, lane), robots[lane]
            r.left_off = reading_error(PORT_ENCODER, _LEFT, s, p, p)
            r.right_off = reading_error(PORT_ENCODER, _RIGHT, s, p, p)
        _store_row(flat, lanes, lane, r)


@kernel
def _set_off_of_yaw_rate(flat: Array, lanes: int, robots: npt.NDArray[Any]) -> None:
    """Set what terms add to a yaw rate."""
    for lane in range(lanes):
        r, p = _load_row(flat, lanes, lane), robots[lane]
        r.yaw_off = reading_error(PORT_GYRO, WHOLE, load_state(flat, lanes, lane), p, p)
        _store_row(flat, lanes, lane, r)


@kernel
def _set_off_of_pose(flat: Array, lanes: int, robots: npt.NDArray[Any]) -> None:
    """Set what terms add to a pose."""
    for lane in range(lanes):
        s, p, r = load_state(flat, lanes, lane), robots[lane], _load_pose(flat, lanes, lane)
        r.x_off = reading_error(PORT_POSE_X, WHOLE, s, p, p)
        r.y_off = reading_error(PORT_POSE_X + 1, WHOLE, s, p, p)
        r.heading_off = reading_error(PORT_POSE_X + 2, WHOLE, s, p, p)
        _store_pose(flat, lanes, lane, r)


def _replay_kernel(lanes: int, terms: bool) -> Any:  # noqa: C901
    """Return the compiled replay of so many robots, that may have terms or have none.

    Plain robots have no replay of their own: few are among those that are fitted, and it took 20 s to compile.
    """

    def replay(
        inputs: KernelInput, physics: npt.NDArray[Any], start: Array, offset: float, dt: float,
        flat: Array, weights: Array, stores: Array, kept: Kept, alike: bool, light: bool,
    ) -> None:  # fmt: skip
        _begin(physics, start, inputs.camera, dt, flat, lanes)
        shared = physics[0]
        cap, delay = shared.duty_cap, shared.actuation_delay
        stretch = 1.0 / (1.0 + shared.clock_skew)
        late = shared.pose_delay + offset
        before = 0.0
        i = j = g = n = _ZERO
        at = _ZERO - 1
        acts = terms and shared.n_terms > 0.0
        reads = acts and _at_readings(shared)
        while True:
            now = n * dt
            while i < inputs.t.shape[0] and inputs.t[i] * stretch <= now + 1e-9:
                if acts:
                    _set_off_of_row(flat, lanes, physics, stores, reads)
                _weigh(i, inputs, weights)
                _compare_row(i, now - inputs.t[i] * stretch, inputs, weights, flat, lanes, terms)
                _keep(flat, _OF_ROW * lanes, kept.rows, kept.row_errors, i)
                i += 1
            g = _compare_yaw_rates(g, now, dt, stretch, inputs, kept, flat, lanes, physics, reads)
            while j < inputs.pose_t.shape[0] and (inputs.pose_t[j] - late) * stretch <= now + 1e-9:
                back = max(now - (inputs.pose_t[j] - late) * stretch, 0.0) if n > 0 else 0.0
                if reads:
                    _set_off_of_pose(flat, lanes, physics)
                _compare_pose(j, back, max(inputs.pose_t[j] - before, 0.0), inputs, flat, lanes, terms)
                _keep(flat, _OF_POSE * lanes, kept.poses, kept.pose_errors, j)
                before = inputs.pose_t[j]
                j += 1
            if (g == inputs.t.shape[0] and j == inputs.pose_t.shape[0]) or n >= MOST_STEPS:
                return
            # Velocities live at mid-step: commands from the last middle to this one, less delay, on the log's clock.
            begin = ((n - 0.5) * dt - delay) / stretch
            end = ((n + 0.5) * dt - delay) / stretch
            while at + 1 < inputs.command_t.shape[0] and inputs.command_t[at + 1] <= begin:
                at += 1
            share = stretch / dt
            left = _held(inputs.commands, inputs.command_t, _LEFT, at, begin, end, cap) * share
            right = _held(inputs.commands, inputs.command_t, _RIGHT, at, begin, end, cap) * share
            _remember_yaw(flat, lanes)
            if not acts:
                _advance(left, right, inputs.bench, light, flat, lanes)
            elif lanes == 1:
                _advance_one_with_terms(left, right, inputs.bench, physics, stores, flat)
            else:
                _advance_several_with_terms(left, right, physics, alike, stores, flat)
            n += 1

    return kernel(replay)


_replay_one, _replay_lanes, _replay_lanes_with_terms = (
    _replay_kernel(1, terms=True), _replay_kernel(LANES, terms=False), _replay_kernel(LANES, terms=True)
)  # fmt: skip


def replay_rows(
    inputs: KernelInput, physics: npt.NDArray[Any], start: Array, offset: float, dt: float, predictions: bool
) -> Kept:
    """Replay a recording by one robot, or by `LANES` of them in lock step.

    Parameters
    ----------
    inputs
        The recording.
    physics
        Records of dtype `PHYSICS`, shape (1,) or (LANES,); they share `TIMING`.
    start
        Start pose of the axle's centre, as the camera sees it [m, m, rad], shape (3,).
    offset
        How late this recording's camera clock is, besides the robots' ``pose_delay`` [s].
    dt
        Step [s].
    predictions
        Whether to keep what is predicted, not only how far measurements are off.
    """
    lanes, n, m = len(physics), len(inputs.t), len(inputs.pose_t)
    shapes = (n * predictions, ROW_COLUMNS), (n, 4), (m * predictions, 3), (m, 3)
    kept = Kept(*(np.empty((rows, columns * lanes)) for rows, columns in shapes))
    several = _replay_lanes_with_terms if has_terms(physics).any() else _replay_lanes
    play = _replay_one if lanes == 1 else several
    alike = lanes > 1 and len(set(formulas_of(physics))) == 1
    light = lanes > 1 and bool(is_light(physics).all())
    memory = lane_memory(N_REPLAY_FIELDS, lanes), np.zeros(4), np.zeros(N_STORES * lanes)
    play(inputs, np.ascontiguousarray(physics), start, offset, dt, *memory, kept, alike, light)
    return Kept(*(array.reshape(*shape, lanes) for array, shape in zip(kept, shapes, strict=True)))
