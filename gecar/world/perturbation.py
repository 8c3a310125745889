"""Conditions as they may be: a robot, a start and a clock, each a little different from what the simulation assumes.

Nobody knows these numbers before a drive, so a program has to drive under all of them: the noise envelope of Jakobi
(Adaptive Behavior 6(2), 1997), today called domain randomisation.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from gecar.errors import expected
from gecar.world.kernel.conditions import Conditions, conditions, select
from gecar.world.rollout import Drive, Driver, World

MOST = 10_000
_STEPS = 1_000_081

Floats = npt.NDArray[np.float64]


def drawn_conditions(world: World, count: int, seed: int | tuple[int, ...] = 0) -> Conditions:
    """Draw conditions a world's programs may meet.

    Spreads (standard deviations, or ranges): motors 2 % apart, dry friction 0.6 to 1.6 of the robot's, battery 4 %
    around its level, grip 2/3 to 1 of the robot's, white read as 85 to 100 % of itself and black as up to 8 % more,
    readings noisy by 1 %, start 5 mm and 2 degrees off, the program begins within 10 ms, a motor statement takes 0.4
    to 1 ms beside its own time (in a quarter of the draws none, as in eq. 1), steps of 2 to 4 ms.
    Sources: step fits of five EV3 motors (gain 6.7 to 12 deg/s per percent, Coulomb friction 13 to 50 deg/s, here
    within one robot's life), 7.4 to 9 V over a charge with the mean recalibrated, white 50 to 98 and black 2 to 10 %
    before, and within this after, calibration. Phase, statement time and step are the simulation's own freedom: what a
    program gains by one of them is no gain. (A statement of 0 ms would only be overwritten by the next one.)

    Each number is drawn by Latin hypercube sampling (McKay, Beckman and Conover, Technometrics 21(2), 1979), so that
    every set of conditions covers weak and strong batteries, low and high grip alike.

    Parameters
    ----------
    world
        What the simulation assumes.
    count
        How many.
    seed
        Where they come from.

    Raises
    ------
    InputError
        If the count is not 0 to 10,000.
    """
    if not 0 <= count <= MOST:
        raise expected("drawn conditions", count, f"0 to {MOST}")
    u = _latin_hypercube(count, 12, np.random.default_rng(seed))
    physics = np.repeat(world.robot.physics, count)
    physics["gain_difference"] += np.clip(0.02 * ndtri(u[0]), -0.1, 0.1)
    physics["coulomb_friction"] *= 0.6 + u[1]
    physics["supply_scale"] *= np.clip(1.0 + 0.04 * ndtri(u[2]), 0.8, 1.2)
    physics["tyre_friction"] *= (2.0 + u[3]) / 3.0
    lifted = 8.0 * u[5]
    gain = 0.85 + 0.15 * u[4] - 0.01 * lifted
    physics["sensor_gain"] *= gain
    physics["sensor_offset"] = gain * physics["sensor_offset"] + lifted
    shifts = np.stack([0.005 * ndtri(u[6]), 0.005 * ndtri(u[7]), np.radians(2.0) * ndtri(u[8])], axis=1)
    return conditions(
        physics,
        0.002 + 0.002 * u[9],
        world.start + shifts,
        world.time_limit_s,
        10.0 * u[10],
        max(world.noise.sensor_pct, 1.0),
        world.noise.motor_share,
        np.where(u[11] < 0.25, 0.0, 0.2 + 0.8 * u[11]),
    )


def drawn_steps_s(seed: int | tuple[int, ...] = 0) -> list[float]:
    """Draw four steps for the nominal robot, 0.7 to 4.2 ms [s]: log-uniform, one in each quarter of that range."""
    rng = np.random.default_rng((*np.atleast_1d(seed).tolist(), _STEPS))
    quarter = (np.arange(4) + rng.uniform(size=4)) / 4.0
    return [0.0007 * 6.0 ** float(share) for share in quarter]


def under_drawn_conditions(
    world: World, opcodes: npt.NDArray[np.int32], count: int, seed: int | tuple[int, ...] = 0
) -> list[Drive]:
    """Drive a program under drawn conditions, and keep the traces."""
    under = drawn_conditions(world, count, seed)
    return [
        Driver(world, select(under, [k])).simulate(opcodes, seed=k + 1, trace=True) for k in range(len(under))
    ]


def _latin_hypercube(count: int, dimensions: int, rng: np.random.Generator) -> Floats:
    """Return points in the open unit cube, shape (dimensions, count), one in each of ``count`` slices of every axis."""
    slices = rng.permuted(np.tile(np.arange(count, dtype=float), (dimensions, 1)), axis=1)
    inside = rng.uniform(1e-9, 1.0, (dimensions, count))
    points: Floats = (slices + inside * (1.0 - 1e-9)) / max(count, 1)
    return points
