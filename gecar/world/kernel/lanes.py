"""Many drives in lock step: `LANES` robots at once, so that the compiler's vector instructions serve all of them.

Every lane holds one drive: a program under its own conditions (robot, start, step, noise). All lanes go through a step
together (`gecar.world.kernel.lock_step`); one whose drive has ended takes the next. What happens seldom, a program's
statement or a new tile, is done lane by lane.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import LANES, kernel, lane_access
from gecar.world.kernel.conditions import Conditions
from gecar.world.kernel.drive import OUT_OF_TIME, RUNNING, STUCK, begin_program, enter_tile
from gecar.world.kernel.eyes import EYES, Floor, look
from gecar.world.kernel.interpreter import CONTROL, run_program
from gecar.world.kernel.lock_step import (
    N_FIELDS,
    advance_lanes,
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
from gecar.world.kernel.sensing import RING, delayed
from gecar.world.kernel.state import ALL, PLAIN, place

# What a lane carries beside its robot: the commands of this step and the one before, after the cap; the tile; the step,
# the one the program or the time limit waits for, and whether something has to be done now: then, or on another tile.
_CARRIED = (
    "left_command", "right_command", "left_before", "right_before", "column", "row", "step", "wake", "due",
)  # fmt: skip
CARRIED = np.dtype([(field, np.float64) for field in _CARRIED])
_DUE, _LEFT, _RIGHT, _COLUMN, _ROW, _WAKE = (
    (N_FIELDS + _CARRIED.index(field)) * LANES
    for field in ("due", "left_command", "right_command", "column", "row", "wake")
)
_load_carried, _store_carried = lane_access(CARRIED, N_FIELDS)


class Jobs(NamedTuple):
    """Drives to make.

    Attributes
    ----------
    rows
        All programs' opcodes, one after the other, shape (rows, 6).
    first_row
        Where each program begins, and where the last ends, shape (programs + 1,).
    used
        Which sensors each program reads, shape (programs, 3).
    program, condition
        Which program drives, and under which conditions, shape (jobs,).
    stream
        Seed of each drive's noise, shape (jobs,).
    """

    rows: npt.NDArray[np.int32]
    first_row: npt.NDArray[np.int64]
    used: npt.NDArray[np.bool_]
    program: npt.NDArray[np.int64]
    condition: npt.NDArray[np.int64]
    stream: npt.NDArray[np.uint64]


class Ends(NamedTuple):
    """How drives ended: outcome codes, steps and tiles passed, shape (jobs,); arrival times [s], shape (jobs, k)."""

    outcome: npt.NDArray[np.int8]
    steps: npt.NDArray[np.int64]
    passed: npt.NDArray[np.int32]
    arrival_s: npt.NDArray[np.float64]


class Memory(NamedTuple):
    """Working memory of the lanes; see `make_memory`."""

    flat: npt.NDArray[np.float64]
    control: npt.NDArray[Any]
    eyes: npt.NDArray[Any]
    commands: npt.NDArray[np.float64]
    job: npt.NDArray[np.int64]
    passed: npt.NDArray[np.int32]
    limit: npt.NDArray[np.int64]


def make_memory() -> Memory:
    """Return the working memory `drive_lanes` needs."""
    return Memory(
        lane_memory(N_FIELDS + len(_CARRIED), LANES),
        np.zeros(LANES, CONTROL),
        np.zeros(LANES, EYES),
        np.zeros(LANES * 2 * RING),
        np.full(LANES, -1, np.int64),
        np.zeros(LANES, np.int32),
        np.zeros(LANES, np.int64),
    )


def _drive_lanes_kernel(effects: int) -> Any:  # noqa: C901
    """Return the compiled `drive_lanes` for robots with effects, or for plain ones; compiled when first called.

    All loops over the lanes stand in this one function, with ``effects`` a constant: LLVM makes them vector code.
    """

    def drive_lanes(  # noqa: C901, PLR0912
        jobs: Jobs, under: Conditions, floor: Floor, late: bool, remembers: bool, m: Memory, ends: Ends
    ) -> None:
        flat = m.flat
        waiting = 0
        for lane in range(LANES):
            waiting = _take(lane, waiting, jobs, under, floor, late, m)
        due = True
        while True:
            if remembers:
                for lane in range(LANES):
                    if m.job[lane] >= 0:
                        _look_from(lane, floor, m)
            if due:
                going = False
                for lane in range(LANES):
                    if m.job[lane] >= 0 and flat[_DUE + lane] != 0.0:
                        while m.job[lane] >= 0 and not _attend(lane, jobs, under, floor, m, ends):
                            waiting = _take(lane, waiting, jobs, under, floor, late, m)
                    going = going or m.job[lane] >= 0
                if not going:
                    return
            if late:
                _act_late(m)
            else:
                for lane in range(LANES):
                    k = _load_carried(flat, LANES, lane)
                    a = load_acting(flat, LANES, lane)
                    a.left = 0.5 * k.left_command + 0.5 * k.left_before
                    a.right = 0.5 * k.right_command + 0.5 * k.right_before
                    k.left_before, k.right_before = k.left_command, k.right_command
                    store_acting(flat, LANES, lane, a)
                    _store_carried(flat, LANES, lane, k)
            advance_lanes(flat, LANES, effects)
            asking = 0
            for lane in range(LANES):
                s = load_state(flat, LANES, lane)
                p = load_physics(flat, LANES, lane)
                k = _load_carried(flat, LANES, lane)
                k.step += 1.0
                column = np.floor((s.x - p.com_ahead * s.cos) * floor.per_tile)
                row = np.floor((s.y - p.com_ahead * s.sin) * floor.per_tile)
                asks = k.step >= k.wake or column != k.column or row != k.row
                k.due = 1.0 if asks else 0.0
                asking += 1 if asks else 0
                _store_carried(flat, LANES, lane, k)
            due = asking > 0

    return kernel(drive_lanes)


_drive_plain, _drive_any = _drive_lanes_kernel(PLAIN), _drive_lanes_kernel(ALL)


def drive_lanes(jobs: Jobs, under: Conditions, floor: Floor, memory: Memory, ends: Ends) -> None:
    """Make all drives, from START to their outcomes.

    Parameters
    ----------
    jobs
        Which drives.
    under
        The conditions they name.
    floor
        The course.
    memory
        Working memory; its content does not matter.
    ends
        Filled; ``arrival_s`` where a tile was reached.
    """
    physics = under.physics
    late = bool(physics["actuation_delay"].any())
    remembers = bool(physics["sensor_lag"].any() or physics["sensor_delay"].any())
    drive = _drive_plain if under.plain.all() else _drive_any
    drive(jobs, under, floor, late, remembers, memory, ends)


@kernel
def _take(lane: int, waiting: int, jobs: Jobs, under: Conditions, floor: Floor, late: bool, m: Memory) -> int:
    """Put the next job into a lane, at rest at its start; return the number of the one after it."""
    if waiting >= jobs.program.shape[0]:
        m.job[lane] = -1
        return waiting
    m.job[lane] = waiting
    m.passed[lane] = 0
    condition = jobs.condition[waiting]
    m.limit[lane] = min(under.limit[condition], under.patience[condition])
    p = under.physics[condition]
    store_physics(m.flat, LANES, lane, p)
    store_derived(m.flat, LANES, lane, under.derived[condition])
    s = load_state(m.flat, LANES, lane)
    place(s, p, under.start[condition, 0], under.start[condition, 1], under.start[condition, 2])
    store_state(m.flat, LANES, lane, s)
    k = _load_carried(m.flat, LANES, lane)
    k.left_command = k.right_command = k.left_before = k.right_before = k.step = 0.0
    k.due = 1.0
    _store_carried(m.flat, LANES, lane, k)
    if late:
        m.commands[2 * RING * lane : 2 * RING * (lane + 1)] = 0.0
    begin_program(m.control[lane], under.phase_ms[condition], under.derived[condition].dt, s, p, floor)
    e = m.eyes[lane]
    for sensor in range(3):
        e.used[sensor] = jobs.used[jobs.program[waiting], sensor]
        e.asked[sensor] = -1
    e.noise_pct = under.sensor_noise_pct[condition]
    e.motor_noise = under.motor_noise[condition]
    e.statement_ms = under.statement_ms[condition]
    e.stream = jobs.stream[waiting]
    _look_from(lane, floor, m)
    return waiting + 1


@kernel
def _look_from(lane: int, floor: Floor, m: Memory) -> None:
    """Feed the sensors' memories of a lane, where they lag or are late."""
    p = load_physics(m.flat, LANES, lane)
    if p.sensor_lag > 0.0 or p.sensor_delay > 0.0:
        s = load_state(m.flat, LANES, lane)
        k = _load_carried(m.flat, LANES, lane)
        c = load_derived(m.flat, LANES, lane)
        look(int(k.step), s, p, c.dt, floor, m.eyes[lane])


@kernel
def _attend(lane: int, jobs: Jobs, under: Conditions, floor: Floor, m: Memory, ends: Ends) -> bool:
    """Do what is due in a lane: a tile entered, a statement; return whether its drive goes on."""
    job = m.job[lane]
    s = load_state(m.flat, LANES, lane)
    p = load_physics(m.flat, LANES, lane)
    c = load_derived(m.flat, LANES, lane)
    k = _load_carried(m.flat, LANES, lane)
    control = m.control[lane]
    n = int(k.step)
    control.step = n
    before = m.passed[lane]
    outcome, m.passed[lane] = enter_tile(n, s, p, c, control, floor, before, ends.arrival_s[job])
    if m.passed[lane] > before:
        condition = jobs.condition[job]
        m.limit[lane] = min(under.limit[condition], n + under.patience[condition])
    limit = m.limit[lane]
    if outcome == RUNNING and n >= limit:
        outcome = OUT_OF_TIME
    if outcome == RUNNING and (n >= control.due_step or control.until >= 0):
        first, end = jobs.first_row[jobs.program[job]], jobs.first_row[jobs.program[job] + 1]
        if not run_program(jobs.rows[first:end], control, s, p, c.dt, floor, m.eyes[lane]):
            outcome = STUCK
    if outcome != RUNNING:
        ends.outcome[job], ends.steps[job], ends.passed[job] = outcome, n, m.passed[lane]
        return False
    _change(m.flat, _LEFT + lane, min(max(control.left_duty, -p.duty_cap), p.duty_cap))
    _change(m.flat, _RIGHT + lane, min(max(control.right_duty, -p.duty_cap), p.duty_cap))
    _change(m.flat, _COLUMN + lane, np.floor((s.x - p.com_ahead * s.cos) * floor.per_tile))
    _change(m.flat, _ROW + lane, np.floor((s.y - p.com_ahead * s.sin) * floor.per_tile))
    wake = n + 1 if control.until >= 0 else min(control.due_step, limit)
    # Any step up to the next one asks again then: a lane that polls has nothing to store.
    if wake > n + 1 or m.flat[_WAKE + lane] > n + 1:
        m.flat[_WAKE + lane] = wake
    return True


@kernel
def _change(flat: npt.NDArray[np.float64], at: int, value: float) -> None:
    """Store a lane's number if it is another: a vector load soon after a scalar store waits for it."""
    if flat[at] != value:
        flat[at] = value


@kernel
def _act_late(m: Memory) -> None:
    """Set the commands that act in this step, lane by lane: each with a delay of its own."""
    for lane in range(LANES):
        k, a = _load_carried(m.flat, LANES, lane), load_acting(m.flat, LANES, lane)
        c = load_derived(m.flat, LANES, lane)
        n, ring = int(k.step), 2 * RING * lane
        m.commands[ring + (n & (RING - 1))] = k.left_command
        m.commands[ring + RING + (n & (RING - 1))] = k.right_command
        a.left = delayed(m.commands, ring, n, c.late)
        a.right = delayed(m.commands, ring + RING, n, c.late)
        store_acting(m.flat, LANES, lane, a)
