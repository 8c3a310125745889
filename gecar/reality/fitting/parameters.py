"""Free parameters: vectors near 0 that stand for changes of a robot's physics, one coordinate a parameter.

A coordinate counts in sizes worth a name, from neutral. A parameter that vanishes at infinity (a ramp's rate, a limit)
runs as its inverse; a rate that only shapes an effect runs as its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.world.effects import BY_ID, DUTY_LEVELS, Effect, Parameter
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]

_FAR_LOW = 1e-9
EV3_STALL_TORQUE, EV3_INERTIA = 0.433, 0.00248  # N m, kg m^2: the catalogue's bounds are meant for these
ALIKE = 4.0  # a drive at most so many times stronger or weaker keeps the EV3's bounds


@dataclass(frozen=True)
class Coordinate:
    """One free parameter.

    Attributes
    ----------
    effect, parameter
        Which.
    neutral
        Its value in the robot as it is known, in the parameter's unit.
    scale
        How many times larger than an EV3's the robot's torques of this kind are; it stretches bounds and steps.
    """

    effect: Effect
    parameter: Parameter
    neutral: float
    scale: float = 1.0

    @property
    def inverse(self) -> bool:
        """Whether the parameter vanishes at infinity."""
        return math.isinf(self.parameter.neutral or 0.0)

    @property
    def ratio(self) -> bool:
        """Whether it acts by its ratio."""
        return self.parameter.by_ratio

    @property
    def is_threshold(self) -> bool:
        """Whether it is a duty below which nothing happens: between two commanded levels it may lie anywhere."""
        return self.effect.scan == DUTY_LEVELS and self.parameter.worthwhile > 0.0

    @property
    def step(self) -> float:
        """What one coordinate is, in the parameter's unit (finite neutrals)."""
        p = self.parameter
        return p.worthwhile * self.scale if p.worthwhile > 0.0 else p.shape_step

    def value(self, z: float) -> float:
        """Return the parameter's value at a coordinate."""
        p = self.parameter
        if self.inverse:
            return p.neutral or math.inf if z <= 0.0 else max((p.start or p.low) / z, p.low)
        if self.ratio:
            return min(max(self.neutral * math.exp(z), p.low), p.high)
        return min(max(self.neutral + z * self.step, p.low * self.scale), p.high * self.scale)

    def at(self, value: float) -> float:
        """Return the coordinate of a value."""
        if self.inverse:
            return 0.0 if math.isinf(value) else (self.parameter.start or self.parameter.low) / value
        if self.ratio:
            return math.log(value / self.neutral)
        return (value - self.neutral) / self.step

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest coordinate."""
        low = self.parameter.low * self.scale
        ends = [self.at(max(low, _FAR_LOW) if self.ratio else low)]
        ends.append(self.at(self.parameter.high * self.scale))
        return min(ends), max(ends)

    @property
    def probe(self) -> float:
        """Step of finite differences."""
        if self.inverse:
            return 0.05
        return 0.1 if self.ratio else 0.4


@dataclass(frozen=True)
class Parameters:
    """The free parameters of some effects of a robot: maps vectors to physics records.

    Attributes
    ----------
    robot
        What the coordinates are counted from.
    coordinates
        One for each entry of the vector.
    """

    robot: Robot
    coordinates: tuple[Coordinate, ...]

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return len(self.coordinates)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest vectors."""
        low, high = zip(*(c.bounds for c in self.coordinates), strict=True) if self.coordinates else ((), ())
        return np.array(low, float), np.array(high, float)

    @property
    def probes(self) -> Array:
        """Steps of finite differences, shape (size,)."""
        return np.array([c.probe for c in self.coordinates], float)

    def physics(self, z: Array) -> npt.NDArray[Any]:
        """Return the physics records of a vector, shape (size,), or of m of them, (m, size); shape (1,) or (m,)."""
        vectors = np.atleast_2d(z)
        records = np.repeat(self.robot.physics, len(vectors))
        for c, column in zip(self.coordinates, vectors.T, strict=True):
            records[c.parameter.field] = [c.value(at) * c.parameter.si for at in column.tolist()]
        return records

    def values(self, z: Array) -> dict[str, dict[str, float]]:
        """Return a vector as effects of a robot file."""
        effects: dict[str, dict[str, float]] = {}
        for c, at in zip(self.coordinates, z, strict=True):
            effects.setdefault(c.effect.id, {})[c.parameter.label] = c.value(float(at))
        return effects

    def vector(self, effects: Mapping[str, Mapping[str, float]]) -> Array:
        """Return the vector of effects' values; 0 where one is not named."""
        z = np.zeros(self.size)
        for k, c in enumerate(self.coordinates):
            value = effects.get(c.effect.id, {}).get(c.parameter.label)
            z[k] = 0.0 if value is None else c.at(value)
        return z


def free(robot: Robot, effect_ids: Sequence[str]) -> Parameters:
    """Free every parameter of some effects."""
    return Parameters(
        robot,
        tuple(
            Coordinate(
                BY_ID[i], bounded(robot, p), _known_value(robot, BY_ID[i], p), torque_scale(robot, p.unit)
            )
            for i in effect_ids
            for p in BY_ID[i].parameters
        ),
    )


def bounded(robot: Robot, parameter: Parameter) -> Parameter:
    """Return a parameter with the bounds that this robot's body and battery set."""
    low, high = robot.bounds(parameter)
    return parameter if math.isinf(high) else replace(parameter, low=low, high=high)


def torque_scale(robot: Robot, unit: str = "N m") -> float:
    """Return how many times larger than an EV3's a robot's torques are: by stall torque; per speed, by inertia."""
    m = robot.motor
    if unit == "N m":
        ratio = m.torque_constant * robot.battery.voltage / m.resistance / EV3_STALL_TORQUE
    elif unit == "N m s/rad":
        ratio = m.inertia / EV3_INERTIA
    else:
        return 1.0
    return ratio if not 1.0 / ALIKE < ratio < ALIKE else 1.0


def _known_value(robot: Robot, effect: Effect, parameter: Parameter) -> float:
    """Return a parameter's value of a robot as it is known, in the parameter's unit."""
    return float(robot.effects.get(effect.id, {}).get(parameter.label, robot.nominal(parameter)))
