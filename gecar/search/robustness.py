"""How far conditions may go from nominal, one at a time, until a program misses GOAL."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.search.chance import times_to_goal
from gecar.world.kernel.conditions import Conditions, conditions, joined
from gecar.world.perturbation import drawn_conditions
from gecar.world.rollout import World

DRAWS = 60
"""Drives at each level."""
ENOUGH = 0.9
"""Share of drives that counts as arriving."""

Floats = npt.NDArray[np.float64]


class _Varied(NamedTuple):
    """What a condition's level changes: physics, starts [m, m, rad] and noise [%], all of n rows."""

    physics: npt.NDArray[np.void]
    start: Floats
    noise_pct: Floats


class Condition(NamedTuple):
    """One condition that may differ.

    Attributes
    ----------
    id, title, unit
        Its name in tables and on pictures, and the unit of its levels.
    levels
        What is tried, rising.
    nominal
        The level that the simulation assumes, from the world.
    put
        Puts a level in the place of what was drawn.
    """

    id: str
    title: str
    unit: str
    levels: tuple[float, ...]
    nominal: Callable[[World], float]
    put: Callable[[World, _Varied, float], None]


class Sweep(NamedTuple):
    """Shares of drives that arrive, 0..1, at each level of a condition, shape (levels,)."""

    condition: Condition
    nominal: float
    shares: Floats

    @property
    def range(self) -> tuple[float, float] | None:
        """The levels about the nominal one between which `ENOUGH` drives arrive; None where they do not even there."""
        levels = np.array(self.condition.levels)
        middle = int(np.abs(levels - self.nominal).argmin())
        if self.shares[middle] < ENOUGH:
            return None
        low = high = middle
        while low > 0 and self.shares[low - 1] >= ENOUGH:
            low -= 1
        while high < len(levels) - 1 and self.shares[high + 1] >= ENOUGH:
            high += 1
        return float(levels[low]), float(levels[high])


def robustness(
    world: World, opcodes: npt.NDArray[np.int32], draws: int = DRAWS, seed: int = 1
) -> list[Sweep]:
    """Drive a program with one condition after the other at fixed levels, the others drawn.

    Parameters
    ----------
    world
        What the simulation assumes.
    opcodes
        Program, shape (rows, 6).
    draws
        Drives at each level; the same drawn conditions at all levels, `gecar.world.perturbation.drawn_conditions`.
    seed
        Where they come from.
    """
    drawn = drawn_conditions(world, draws, seed)
    return [_sweep(world, opcodes, drawn, condition) for condition in CONDITIONS]


def _sweep(world: World, opcodes: npt.NDArray[np.int32], drawn: Conditions, condition: Condition) -> Sweep:
    under = joined([_at(world, drawn, condition, level) for level in condition.levels])
    streams = np.tile(np.arange(len(drawn)) + 1, len(condition.levels))
    times = times_to_goal(world, [opcodes], under, streams[None])[0]
    shares = np.isfinite(times).reshape(len(condition.levels), -1).mean(axis=1)
    return Sweep(condition, condition.nominal(world), shares)


def _at(world: World, drawn: Conditions, condition: Condition, level: float) -> Conditions:
    """Return drawn conditions with one of them at a level."""
    varied = _Varied(drawn.physics.copy(), drawn.start.copy(), drawn.sensor_noise_pct.copy())
    condition.put(world, varied, level)
    steps = drawn.derived["dt"]
    return conditions(
        varied.physics, steps, varied.start, world.time_limit_s, drawn.phase_ms, varied.noise_pct,
        drawn.motor_noise, drawn.statement_ms,
    )  # fmt: skip


def _beside(forward: float, left: float) -> Callable[[World, _Varied, float], None]:
    """Return what starts the robot so much ahead and to the left of START, for each millimetre of a level."""

    def put(world: World, varied: _Varied, mm: float) -> None:
        x, y, heading = world.start
        cos, sin = np.cos(heading), np.sin(heading)
        varied.start[:, 0] = x + 0.001 * mm * (forward * cos - left * sin)
        varied.start[:, 1] = y + 0.001 * mm * (forward * sin + left * cos)

    return put


def _turned(world: World, varied: _Varied, deg: float) -> None:
    varied.start[:, 2] = world.start[2] + np.radians(deg)


def _charged(world: World, varied: _Varied, pct: float) -> None:
    varied.physics["supply_scale"] = 0.01 * pct * world.robot.physics["supply_scale"]


def _uneven(world: World, varied: _Varied, pct: float) -> None:
    varied.physics["gain_difference"] = 0.01 * pct + world.robot.physics["gain_difference"]


def _grips(world: World, varied: _Varied, coefficient: float) -> None:  # noqa: ARG001
    varied.physics["tyre_friction"] = coefficient


def _noisy(world: World, varied: _Varied, pct: float) -> None:  # noqa: ARG001
    varied.noise_pct[:] = pct


def _evenly(low: float, high: float, count: int = 13) -> tuple[float, ...]:
    return tuple(np.linspace(low, high, count).round(6).tolist())


def _zero(world: World) -> float:  # noqa: ARG001
    return 0.0


CONDITIONS: Sequence[Condition] = (
    Condition("start_left_mm", "Start to the left", "mm", _evenly(-60, 60), _zero, _beside(0.0, 1.0)),
    Condition("start_heading_deg", "Start turned to the left", "deg", _evenly(-30, 30), _zero, _turned),
    Condition("battery_pct", "Battery, share of its voltage", "%", _evenly(70, 130), lambda _: 100.0, _charged),
    Condition("motor_difference_pct", "Right motor stronger", "%", _evenly(-30, 30), _zero, _uneven),
    Condition("grip", "Grip of the tyres", "", _evenly(0.1, 1.3),
              lambda world: float(world.robot.physics["tyre_friction"][0]), _grips),
    Condition("sensor_noise_pct", "Noise of each reading", "%", _evenly(0, 12),
              lambda world: world.noise.sensor_pct, _noisy),
)  # fmt: skip
"""What is varied, and how far: beyond what a classroom has, so that the edge is seen."""
