"""The compiled drive: program, sensors, motors and body, step by step, to an outcome."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import kernel, on_stack
from gecar.world.kernel.chipmunk import SPACE, EngineArrays, engine_step
from gecar.world.kernel.dynamics import drift, has_terms, step, step_with_terms, turn
from gecar.world.kernel.eyes import Floor, look, see
from gecar.world.kernel.interpreter import first_step_after, run_program
from gecar.world.kernel.motor import battery_current
from gecar.world.kernel.sensing import RING, delayed
from gecar.world.kernel.state import place

# Outcome codes; `gecar.world.rollout.Outcome` names them.
RUNNING, GOAL, OFF_COURSE, OUT_OF_TIME, STUCK, MISSED_CHECKPOINT = range(6)


class Setup(NamedTuple):
    """A robot set up to drive: one row of `gecar.world.kernel.conditions.Conditions`, a floor, and what kernels write.

    Attributes
    ----------
    physics, derived
        Of dtypes `PHYSICS` and `DERIVED`, shape (1,).
    start
        Pose of the axle's centre [m, m, rad], shape (3,).
    phase_ms, limit, patience
        When the program begins [ms]; steps until the time is out, and until a drive without a further tile is given up.
    floor
        The course.
    state, control, eyes
        Of dtypes `STATE`, `CONTROL` and `EYES`, shape (1,).
    commands
        Commands remembered for the actuation delay, shape (2 RING,).
    stores
        Of the robot's terms, shape (`gecar.world.kernel.laws.N_STORES`,).
    engine
        pymunk's, or `NO_ENGINE`.
    energy
        What the motors have taken from the battery, the sum of V I dt [J], shape (1,).
    """

    physics: npt.NDArray[Any]
    derived: npt.NDArray[Any]
    start: npt.NDArray[np.float64]
    phase_ms: float
    limit: int
    patience: int
    floor: Floor
    state: npt.NDArray[Any]
    control: npt.NDArray[Any]
    eyes: npt.NDArray[Any]
    commands: npt.NDArray[np.float64]
    stores: npt.NDArray[np.float64]
    engine: EngineArrays
    energy: npt.NDArray[np.float64]


@kernel
def advance(
    n: int,
    s: Any,
    left_duty: float,
    right_duty: float,
    p: Any,
    c: Any,
    commands: npt.NDArray[np.float64],
    engine: EngineArrays,
) -> None:
    """Advance robot (and engine, if any) from step ``n`` to the next under the commands issued now.

    ``commands``, shape (2 RING,), remembers commands for the actuation delay, and for the half step that velocities
    lag positions in `gecar.world.kernel.dynamics.step`. The cap on duty acts here. Terms do not: see
    `advance_with_terms`.
    """
    left, right = _acting(n, left_duty, right_duty, p, c, commands)
    step(s, left, right, p, c)
    _move(s, c, engine)


@kernel
def advance_with_terms(
    n: int, s: Any, left_duty: float, right_duty: float, p: Any, c: Any, setup: Setup
) -> None:
    """Do the same for a robot with terms."""
    left, right = _acting(n, left_duty, right_duty, p, c, setup.commands)
    step_with_terms(s, left, right, setup.physics, c, setup.stores)
    _move(s, c, setup.engine)


@kernel
def _acting(
    n: int, left_duty: float, right_duty: float, p: Any, c: Any, commands: npt.NDArray[np.float64]
) -> tuple[float, float]:
    """Return the commands that act in a step, after cap and delay."""
    if n == 0:
        commands[:] = 0.0
    commands[n & (RING - 1)] = min(max(left_duty, -p.duty_cap), p.duty_cap)
    commands[RING + (n & (RING - 1))] = min(max(right_duty, -p.duty_cap), p.duty_cap)
    return delayed(commands, 0, n, c.late), delayed(commands, RING, n, c.late)


@kernel
def _move(s: Any, c: Any, engine: EngineArrays) -> None:
    """Move the body with its new velocity: by the engine, if there is any."""
    if engine.addresses[SPACE] != 0:
        turn(s, engine_step(s, c.dt, engine) - s.half_turn)
    else:
        drift(s, c)


@kernel
def tile_at(x: float, y: float, floor: Floor) -> int:
    """Return the index of the tile a point lies on, -1 outside the field."""
    column = int(np.floor(x * floor.per_tile))
    row = int(np.floor(y * floor.per_tile))
    if column < 0 or row < 0 or column >= floor.columns or row >= floor.rows:
        return -1
    return row * floor.columns + column


@kernel
def arrive(
    tile: int, passed: int, time: float, floor: Floor, arrival: npt.NDArray[np.float64]
) -> tuple[int, int]:
    """Return (outcome, tiles of the sequence passed) on entering a tile."""
    if tile < 0 or not floor.drivable[tile]:
        return OFF_COURSE, passed
    last = floor.sequence.shape[0] - 1
    if tile == floor.sequence[passed]:
        arrival[passed] = time
        return (GOAL if passed == last else RUNNING), passed + 1
    if tile == floor.sequence[last]:
        return MISSED_CHECKPOINT, passed
    return RUNNING, passed


@kernel
def begin_program(k: Any, phase_ms: float, dt: float, s: Any, p: Any, floor: Floor) -> None:
    """Set a program back to its first row, to begin ``phase_ms`` after the start, on the tile the robot stands on."""
    k.row = k.line = 0
    k.until = -1
    k.due_ms = phase_ms
    k.due_step = first_step_after(phase_ms, dt)
    k.left_duty = k.right_duty = 0.0
    k.turned, k.turned_ms = -1, -1.0
    k.changed = k.timer_ms = 0
    k.registers[:] = 0
    k.previous[:] = 0
    k.tile = tile_at(s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin, floor)


@kernel
def _sample(
    trace: npt.NDArray[np.float64], sample: int, time: float, s: Any, k: Any, p: Any, floor: Floor
) -> None:
    trace[sample, 0] = time
    trace[sample, 1] = s.x - p.com_ahead * s.cos
    trace[sample, 2] = s.y - p.com_ahead * s.sin
    trace[sample, 3] = s.heading
    trace[sample, 4] = k.left_duty
    trace[sample, 5] = k.right_duty
    trace[sample, 6] = s.left_angle
    trace[sample, 7] = s.right_angle
    trace[sample, 8] = see(0, s, p, floor)
    trace[sample, 9] = k.line


@kernel
def enter_tile(
    n: int, s: Any, p: Any, c: Any, k: Any, floor: Floor, passed: int, arrival: npt.NDArray[np.float64]
) -> tuple[int, int]:
    """Look which tile the robot is on at step ``n``; return (outcome, tiles of the sequence passed)."""
    tile = tile_at(s.x - p.com_ahead * s.cos, s.y - p.com_ahead * s.sin, floor)
    if tile == k.tile:
        return RUNNING, passed
    k.tile = tile
    return arrive(tile, passed, n * c.dt, floor, arrival)


def _drive_on_kernel(terms: bool) -> Any:  # noqa: C901
    """Return the compiled drive of robots with terms, or without, whose state ``s`` is the caller's."""

    def drive_on(
        program: npt.NDArray[np.int32], setup: Setup, s: Any, first: int, last: int, passed: int,
        arrival: npt.NDArray[np.float64], trace: npt.NDArray[np.float64], every: int,
    ) -> tuple[int, int, int]:  # fmt: skip
        p, c, k, e, floor = setup.physics[0], setup.derived[0], setup.control[0], setup.eyes[0], setup.floor
        if first == 0:
            place(s, p, setup.start[0], setup.start[1], setup.start[2])
            begin_program(k, setup.phase_ms, c.dt, s, p, floor)
            setup.energy[0] = 0.0
        remembers = p.sensor_lag > 0.0 or p.sensor_delay > 0.0
        reached = int(np.rint(arrival[passed - 1] / c.dt)) if passed > 0 else 0
        for n in range(first, last):
            k.step = n
            before = passed
            outcome, passed = enter_tile(n, s, p, c, k, floor, passed, arrival)
            reached = n if passed > before else reached
            if outcome == RUNNING and n >= min(setup.limit, reached + setup.patience):
                outcome = OUT_OF_TIME
            if outcome == RUNNING:
                if remembers:
                    look(n, s, p, c.dt, floor, e)
                waits = n < k.due_step and k.until < 0
                if not waits and not run_program(program, k, s, p, c.dt, floor, e):
                    outcome = STUCK
            if trace.shape[0] > 0 and (n % every == 0 or outcome != RUNNING):
                _sample(trace, (n + every - 1) // every, n * c.dt, s, k, p, floor)
            if outcome != RUNNING:
                return outcome, n, passed
            if terms:
                advance_with_terms(n, s, k.left_duty, k.right_duty, p, c, setup)
            else:
                advance(n, s, k.left_duty, k.right_duty, p, c, setup.commands, setup.engine)
            setup.energy[0] += s.voltage * battery_current(s, p) * c.dt
        return RUNNING, last, passed

    return kernel(drive_on)


_drive_on_without, _drive_on_with = _drive_on_kernel(terms=False), _drive_on_kernel(terms=True)


def _drive_kernel(terms: bool) -> Any:
    """Return the compiled drive of robots with terms, or without; compiled when first called."""

    def drive(
        program: npt.NDArray[np.int32], setup: Setup, first: int, last: int, passed: int,
        arrival: npt.NDArray[np.float64], trace: npt.NDArray[np.float64], every: int,
    ) -> tuple[int, int, int]:  # fmt: skip
        s = on_stack(setup.state[0])
        if terms:
            result = _drive_on_with(program, setup, s, first, last, passed, arrival, trace, every)
        else:
            result = _drive_on_without(program, setup, s, first, last, passed, arrival, trace, every)
        setup.state[0] = s
        return result

    return kernel(drive)


def _hold_kernel(terms: bool) -> Any:
    """Return the compiled `hold_duties` of robots with terms, or without."""

    def hold(first: int, last: int, left_duty: float, right_duty: float, setup: Setup) -> None:
        p, c, s, e = setup.physics[0], setup.derived[0], setup.state[0], setup.eyes[0]
        for n in range(first, last):
            look(n, s, p, c.dt, setup.floor, e)
            if terms:
                advance_with_terms(n, s, left_duty, right_duty, p, c, setup)
            else:
                advance(n, s, left_duty, right_duty, p, c, setup.commands, setup.engine)
        look(last, s, p, c.dt, setup.floor, e)

    return kernel(hold)


_drive_without, _drive_with = _drive_kernel(terms=False), _drive_kernel(terms=True)
_hold_without, _hold_with = _hold_kernel(terms=False), _hold_kernel(terms=True)


def drive(
    program: npt.NDArray[np.int32],
    setup: Setup,
    first: int,
    last: int,
    passed: int,
    arrival: npt.NDArray[np.float64],
    trace: npt.NDArray[np.float64],
    every: int,
) -> tuple[int, int, int]:
    """Drive from step ``first`` until an outcome, or step ``last``.

    Returns
    -------
    tuple
        (outcome, step it ended at, tiles of the sequence passed).
    """
    chosen = _drive_with if has_terms(setup.physics)[0] else _drive_without
    if first == 0:
        setup.stores.fill(0)
    result: tuple[int, int, int] = chosen(program, setup, first, last, passed, arrival, trace, every)
    return result


def hold_duties(first: int, last: int, left_duty: float, right_duty: float, setup: Setup) -> None:
    """Hold two commands from step ``first`` to step ``last``, whoever gave them; at step 0 from the start pose."""
    if first == 0:
        setup.stores.fill(0)
        place(setup.state[0], setup.physics[0], *setup.start)
    hold = _hold_with if has_terms(setup.physics)[0] else _hold_without
    hold(first, last, left_duty, right_duty, setup)
