"""Values of an effect's parameters from which fits of it start.

Most effects are found from a few sizes on both sides of neutral, or from values their entry in the catalogue lists.
Where the cost has many local minima, starting values are scanned: a slippery patch by place, a ripple by its cycles,
a dead band by its edge. A replay of all recordings takes milliseconds, so that a scan may replay.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.parameters import Coordinate, free, torque_scale
from gecar.reality.optimisation.least_squares import cost, cost_of_each, residuals_of_each, weights
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.kernel import TIMING
from gecar.world.effects import BY_ID, DUTY_LEVELS, SHAFT_CYCLES
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
Single = npt.NDArray[np.float32]
Values = Mapping[str, float]
Errors = Callable[[Sequence[Values]], Array]

LEAST_CYCLES = 2.0
SPEED_OVER_S = 0.1
_SIZES = (0.5, 3.0, 12.0)  # in steps worth a name; where less is material, fits begin at less
_TIMES = (
    0.5,
    1.5,
    3.0,
    5.0,
    7.5,
    12.0,
)  # of what moves commands against steps: fits of it end at the next small dip
PHASE_COUNTS = 0.9  # of a ripple's gain: what its opposite may gain, too, by slowing motors down
CYCLES = (*range(1, 25), 30, 36, 42, 48)  # a fit moves them by hundredths only; fast ones are hardly seen
BEST_CYCLES = 8
PATCH_PITCH_M, MOST_CELLS, BEST_CELLS, BEST_SHAPES = 0.1, 300, 4, 4
PATCH_RADII_M = (0.07, 0.1, 0.15, 0.2, 0.3)
SCANNED_RADIUS_M = 0.1
MOUNTS_M = (-0.02, -0.01, -0.003, 0.0, 0.003, 0.01, 0.02)  # from nominal: an edge is 8 mm wide
LEAST_GAIN = 2.0  # log-likelihood: of noise in a hundred cells; a name costs more
PATCH_GRIPS = (0.06, 0.15, 0.3, 0.45, 0.65)
SCANNED_GRIPS = (0.15, 0.3, 0.6)


class Wave(NamedTuple):
    """A torque ripple, and how residuals respond to it.

    Attributes
    ----------
    cycles
        Cycles a turn of a shaft.
    amplitude_nm
        Amplitude [N m].
    columns
        What a sine and a cosine of it on either shaft add to residuals, shape (n, 4).
    """

    cycles: int
    amplitude_nm: float
    columns: npt.NDArray[Any]


def initial_values(
    effect_id: str,
    robot: Robot,
    recordings: Sequence[Recording],
    errors: Errors,
    waves: Sequence[Wave] = (),
) -> list[Values]:
    """Return values of an effect's parameters to start from, by label.

    Parameters
    ----------
    effect_id
        Of the effect.
    robot
        As far as it is known.
    recordings
        Of that robot.
    errors
        Returns the residuals under the effect with several values, shape (values, n).
    waves
        What ripples add to those residuals (`ripples`), where that is known.
    """
    effect = BY_ID[effect_id]
    if effect.starts:
        return list(effect.starts)
    if effect.scan == SHAFT_CYCLES:
        return list(_shaft_cycles(errors, waves or ripples(robot, recordings, errors)))
    if effect.scan:
        return list(_SCANS[effect.scan](robot, recordings, errors))
    return list(_both_sides(effect_id, robot))


def responses(
    effect_id: str, robot: Robot, recordings: Sequence[Recording], errors: Errors
) -> Iterator[Single]:
    """Yield what residuals do in every direction that a search from these starting values looks in, shape (n, k).

    A single column is an effect at certain values, less nothing: residuals fall by a multiple of it, 0 or more. Several
    are fitted together. Sizes on both sides of neutral are left out: derivatives there tell as much. Those of a ripple
    are its waves (`ripples`).
    """
    effect = BY_ID[effect_id]
    values: Sequence[Values] = ()
    if effect.at_a_place:
        larger = [r for r in PATCH_RADII_M if r > SCANNED_RADIUS_M]
        values = [_patch(*cell, radius, SCANNED_GRIPS[0]) for cell in _cells(recordings) for radius in larger]
        values += [_patch(*cell, SCANNED_RADIUS_M, SCANNED_GRIPS[1]) for cell in _cells(recordings, reach=1)]
    elif effect.starts or effect.scan:
        values = initial_values(effect_id, robot, recordings, errors)
    if values:
        bare = errors([{}])[0]
        yield from ((bare - each)[:, None].astype(np.float32) for each in residuals_of_each(errors, values))


def _both_sides(effect_id: str, robot: Robot) -> Iterator[Values]:
    for c in free(robot, [effect_id]).coordinates:
        for value in _sizes(c):
            yield {c.parameter.label: value}


def _sizes(c: Coordinate) -> Iterator[float]:
    if c.parameter.worthwhile <= 0.0:
        return
    for z in _TIMES if c.parameter.field in TIMING else _SIZES:
        for side in (z, -z):
            if c.parameter.low <= c.neutral + side * c.step <= c.parameter.high * c.scale:
                yield c.value(side)


def _slow_speeds(robot: Robot, recordings: Sequence[Recording]) -> Iterator[Values]:
    """Begin within the speeds recorded: above them breakaway friction is dry friction, and slopes lead nowhere.

    Where no shaft was recorded turning, any speed will do.
    """
    top = max(top_speed(r) for r in recordings) or math.inf
    for speed, share in ((0.3, 0.25), (1.0, 0.5), (3.0, 1.0)):
        for torque in (0.005, 0.02):
            yield {"extra_torque_nm": torque * torque_scale(robot), "speed_rad_s": min(speed, share * top)}


def top_speed(recording: Recording) -> float:
    """Return the fastest a shaft turned over `SPEED_OVER_S` [rad/s]."""
    every = max(int(np.searchsorted(recording.t_s, recording.t_s[0] + SPEED_OVER_S)), 1)
    angles, t = _wheel_angles(recording)[::every], recording.t_s[::every]
    return float(np.max(np.abs(np.diff(angles, axis=0)) / np.diff(t)[:, None], initial=0.0))


def _duty_levels(recordings: Sequence[Recording]) -> Iterator[Values]:
    for duty in (0.3, 2.0, 5.0, 10.0, 15.0, 20.0):
        yield {"duty_pct": duty, "offset_share": 1.0}
    levels = np.unique(np.abs(np.concatenate([r.commands.ravel() for r in recordings]))) * 100.0
    edges = (levels[1:] + levels[:-1]) / 2.0
    edges = edges[(edges > 1.0) & (edges < 40.0)]
    for edge in edges[np.unique(np.linspace(0, len(edges) - 1, 12).astype(int))] if len(edges) else ():
        yield {"duty_pct": float(edge), "offset_share": 0.0}


def _shaft_cycles(errors: Errors, waves: Iterable[Wave]) -> Iterator[Values]:
    """Yield the ripples that lower the cost most, to start from.

    Nothing ties the two motors' phases together, but sines add up: least squares gives both phases at once, and which
    cycles are worth trying.
    """
    bare = _unrippled(errors)
    w, least = np.sqrt(weights(bare)), cost(bare)
    fits = []
    for cycles, size, basis in waves:
        weighted = w[:, None] * basis
        a, b, c, d = sines = -np.linalg.lstsq(weighted, w * bare, rcond=None)[0]
        most = size * max(math.hypot(a, b), math.hypot(c, d))
        phases = (math.atan2(b, a), math.atan2(d, c)), (math.atan2(-b, -a), math.atan2(-d, -c))
        fits.append((float(np.linalg.norm(weighted @ sines)), cycles, phases, most))
    fits.sort(reverse=True)
    # Least squares asks for too little: a ripple runs out of step with the simulation.
    tried = [
        _rippled(cycles, *pair, share * most)
        for _, cycles, phases, most in fits[:BEST_CYCLES]
        for share in (1.0, 2.0, 4.0)
        for pair in phases
    ]
    gains = least - cost_of_each(errors, tried)
    for found, gain, opposite in zip(tried[::2], gains[::2], gains[1::2], strict=True):
        if opposite < PHASE_COUNTS * gain:
            yield found


def _unrippled(errors: Errors) -> Array:
    """Return the residuals of a ripple of no size, shape (n,)."""
    return errors([_rippled(1, 0.0, 0.0, 0.0)])[0]


def ripples(robot: Robot, recordings: Sequence[Recording], errors: Errors) -> Iterator[Wave]:
    """Replay torque ripples of every number of cycles a turn that the shafts turned through two cycles of.

    Fewer could be any force along the way. Four replays tell what a sine and a cosine on either shaft do.
    """
    turned = max(_turned(r, robot) for r in recordings)
    size, quarter, bare = 0.01 * torque_scale(robot), 0.5 * math.pi, _unrippled(errors)
    pairs = ((0.0, 0.0), (math.pi, 0.0), (quarter, quarter), (-quarter, quarter))
    scanned = [cycles for cycles in CYCLES if cycles * turned >= LEAST_CYCLES]
    for two in (scanned[first : first + 2] for first in range(0, len(scanned), 2)):
        waves = errors([_rippled(cycles, *pair, size) for cycles in two for pair in pairs]) - bare
        for cycles, (sines, sine, cosines, cosine) in zip(two, np.split(waves, len(two)), strict=True):
            columns = np.stack([sines - sine, cosines - cosine, sines + sine, cosines + cosine], axis=1)
            yield Wave(cycles, size, (0.5 * columns).astype(np.float32))


def _rippled(cycles: int, left: float, right: float, amplitude: float) -> dict[str, float]:
    lead = math.remainder(right - left, math.tau) / cycles
    return {
        "amplitude_nm": amplitude,
        "cycles_per_rev": float(cycles),
        "phase_rad": left,
        "right_lead_rad": lead,
    }


def _turned(recording: Recording, robot: Robot) -> float:
    """Return how far a shaft has turned at least [revolutions], by its angles or else by the path."""
    angles = np.ptp(_wheel_angles(recording), axis=0).max()
    path = np.column_stack([recording.x_m, recording.y_m])
    driven = np.hypot(*np.diff(path[~np.isnan(path).any(axis=1)], axis=0).T).sum()
    return float(angles or driven / robot.physics["wheel_radius"][0]) / math.tau


def _wheel_angles(recording: Recording) -> Array:
    """Return the wheel angles [rad] without gaps, shape (rows, 2); 0 where there are none."""
    return np.nan_to_num(np.column_stack([recording.left_angle_rad, recording.right_angle_rad]))


def _floor_cells(recordings: Sequence[Recording], errors: Errors) -> Iterator[Values]:
    """Scan the floor where the robot has been, on a grid a patch cannot slip through; then sizes and grips there.

    The best of those are begun with between the places of the grid, too.

    A patch that grips too little costs more than none: a cell counts by the multiple of what a patch does there that
    lowers residuals most (a matched filter: Kay, Fundamentals of Statistical Signal Processing II, 1998, ch. 4).
    """
    tried = _scanned(recordings)
    if not tried:
        return
    bare = errors([{**tried[0], "radius_m": 0.0}])[0]
    gains = np.array([_gain_of_multiple(bare, each - bare) for each in residuals_of_each(errors, tried)])
    kept = (k for k in np.argsort(-gains, kind="stable") if gains[k] > LEAST_GAIN)
    best = list(dict.fromkeys((tried[k]["x_m"], tried[k]["y_m"]) for k in kept))
    half = 0.5 * PATCH_PITCH_M
    for x, y in best[:BEST_CELLS]:
        shapes = [*itertools.product(PATCH_RADII_M, PATCH_GRIPS)]
        found = cost_of_each(errors, [_patch(x, y, *shape) for shape in shapes])
        for k in np.argsort(found, kind="stable")[:BEST_SHAPES]:
            for dx, dy in ((0.0, 0.0), (half, 0.0), (-half, 0.0), (0.0, half), (0.0, -half)):
                yield _patch(x + dx, y + dy, *shapes[k])


def _gain_of_multiple(errors: Array, response: Array) -> float:
    """Return by how much the best multiple of a response, 0 or more, lowers the residuals' cost."""
    weighted = weights(errors) * response
    asked, power = -float(weighted @ errors), float(weighted @ response)
    return 0.5 * max(asked, 0.0) ** 2 / power if power > 0.0 else 0.0


def _cells(recordings: Sequence[Recording], reach: int = 0) -> list[tuple[float, float]]:
    """Return places on a grid where the robot has been, and so many cells around [m]; none where no camera looked."""
    places = np.concatenate([np.column_stack([r.x_m, r.y_m])[~np.isnan(r.x_m)] for r in recordings])
    around = range(-reach, reach + 1)
    been = np.round(places / PATCH_PITCH_M).astype(int)
    cells = np.unique(np.concatenate([been + each for each in itertools.product(around, around)]), axis=0)
    kept = cells[np.unique(np.linspace(0, len(cells) - 1, MOST_CELLS).astype(int))] if len(cells) else cells
    return [(float(x), float(y)) for x, y in kept * PATCH_PITCH_M]


def patches(recordings: Sequence[Recording], most: int) -> list[Values]:
    """Return so many patches at most, spread over where the robot has been."""
    cells = _cells(recordings)
    every = math.ceil(len(cells) / most)
    return [_patch(x, y, SCANNED_RADIUS_M, SCANNED_GRIPS[1]) for x, y in cells[:: max(every, 1)]]


def _scanned(recordings: Sequence[Recording]) -> list[Values]:
    """Return the patches scanned for; their centres may lie beside the robot's path."""
    cells = _cells(recordings, reach=1)
    return [_patch(*cell, SCANNED_RADIUS_M, grip) for cell in cells for grip in SCANNED_GRIPS]


def _patch(x_m: float, y_m: float, radius_m: float, grip: float) -> dict[str, float]:
    return {"radius_m": radius_m, "x_m": x_m, "y_m": y_m, "coefficient": grip}


def _top_speeds(robot: Robot, recordings: Sequence[Recording]) -> Iterator[Values]:
    """Begin at shares of a motor's top speed, and just below the fastest recorded: what limits speeds is seen there."""
    top = robot.battery.voltage / max(robot.motor.back_emf_constant, 1e-3) * robot.drive.duty_cap
    seen = max(map(top_speed, recordings), default=0.0)
    for speed in (*(share * top for share in (0.92, 0.8, 0.65, 0.5)), 0.98 * seen, 0.95 * seen):
        yield {"speed_rad_s": max(speed, BY_ID["speed_limit"].parameters[0].low)}


def _currents(robot: Robot) -> Iterator[Values]:
    stall = robot.battery.voltage / robot.motor.resistance * robot.drive.duty_cap
    for share in (0.8, 0.6, 0.4, 0.2):
        yield {"current_a": max(share * stall, BY_ID["current_limit"].parameters[0].low)}


def _mounts(robot: Robot) -> Iterator[Values]:
    sensor = robot.colour_sensor
    for ahead in MOUNTS_M:
        for left in MOUNTS_M:
            yield {"ahead_m": max(sensor.ahead + ahead, 0.0), "left_m": sensor.left + left}


Scan = Callable[[Robot, Sequence[Recording], Errors], Iterable[Values]]
_SCANS: dict[str, Scan] = {
    "slow speeds": lambda robot, recordings, errors: _slow_speeds(robot, recordings),  # noqa: ARG005
    DUTY_LEVELS: lambda robot, recordings, errors: _duty_levels(recordings),  # noqa: ARG005
    "floor cells": lambda robot, recordings, errors: _floor_cells(recordings, errors),  # noqa: ARG005
    "shares of stall current": lambda robot, recordings, errors: _currents(robot),  # noqa: ARG005
    "shares of top speed": lambda robot, recordings, errors: _top_speeds(robot, recordings),  # noqa: ARG005
    "around the mount": lambda robot, recordings, errors: _mounts(robot),  # noqa: ARG005
}
