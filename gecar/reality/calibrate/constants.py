"""The robot's own constants that recordings can calibrate: which there are, and how a robot takes new ones.

Beside them stands what the camera that filmed it has of its own: where its mark sits on the robot, and where its frame
has the course. That is fitted so that it cannot bend the robot's constants, and goes into no robot file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.reality.residuals.of_case import Residuals
from gecar.world.effects import BY_ID
from gecar.world.robot import Robot, robot_from

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Constant:
    """One number of a robot file, or of the camera.

    Attributes
    ----------
    section, field
        Where it stands in the file; ``camera``: nowhere.
    kernel
        Its field in the `PHYSICS` record, or one of `MARK`.
    words, unit
        What it is, for people, and its SI unit.
    low, high
        Bounds.
    step
        A change that matters: the coordinate fits count in.
    sensor
        Whether it is fitted to what the colour sensor reads, and to nothing else.
    usual
        Whether it is freed unless others are asked for.
    """

    section: str
    field: str
    kernel: str
    words: str
    unit: str
    low: float
    high: float
    step: float
    sensor: bool = False
    usual: bool = True

    @property
    def name(self) -> str:
        """Its name in a robot file: ``battery.voltage``."""
        return f"{self.section}.{self.field}"


MARK = ("mark_ahead", "mark_left", "mark_turn")  # of a camera's mark on the robot

# In the order in which they are trusted: of constants that recordings cannot tell apart, the first is fitted. Steps
# are the smallest changes worth a name (`gecar.world.effects`); bounds are what a small robot could have.
CONSTANTS = (
    Constant("battery", "voltage", "voltage", "battery voltage", "V", 3.0, 13.0, 0.05),
    Constant("motor", "inertia", "inertia", "inertia of rotor and gears", "kg m^2", 2e-4, 0.012, 1.2e-4),
    Constant("motor", "coulomb_friction", "coulomb_friction", "dry friction", "N m", 0.0, 0.12, 0.002),
    Constant("body", "wheel_radius", "wheel_radius", "wheel radius", "m", 0.015, 0.06, 2.8e-4),
    Constant("body", "track_width", "track_width", "track width", "m", 0.05, 0.30, 1.2e-3),
    Constant("battery", "resistance", "battery_resistance", "battery resistance", "ohm", 0.0, 4.0, 0.1),
    Constant("tyre", "friction", "tyre_friction", "grip of the tyres", "-", 0.03, 1.5, 0.15),
    Constant("effects.friction_asymmetry", "gain_ratio", "direction_gain", "forward stronger than backward", "-",
             -0.3, 0.3, 0.005),
    Constant("effects.motor_gain_asymmetry", "right_minus_left", "gain_difference", "right motor stronger than left",
             "-", -0.4, 0.4, 0.005),
    Constant("camera", "ahead", "mark_ahead", "camera's mark ahead of the axle", "m", -0.3, 0.3, 1.5e-3),
    Constant("camera", "left", "mark_left", "camera's mark left of the middle", "m", -0.3, 0.3, 1.5e-3),
    Constant("camera", "turn", "mark_turn", "camera's mark turned", "rad", -0.6, 0.6, 5e-3),
    Constant("motor", "back_emf_constant", "back_emf_constant", "back-EMF constant", "V s/rad", 0.1, 1.5, 0.005,
             usual=False),
    Constant("motor", "torque_constant", "torque_constant", "torque constant", "N m/A", 0.05, 1.0, 0.005, usual=False),
    Constant("motor", "resistance", "resistance", "motor resistance", "ohm", 1.0, 15.0, 0.05, usual=False),
    Constant("body", "mass", "mass", "mass", "kg", 0.2, 3.0, 0.02, usual=False),
    Constant("body", "yaw_inertia", "yaw_inertia", "yaw inertia", "kg m^2", 5e-4, 0.05, 2e-4, usual=False),
    Constant("body", "com_ahead", "com_ahead", "centre of mass ahead of the axle", "m", -0.084, 0.0, 0.004,
             usual=False),
    Constant("colour_sensor", "white", "white", "reading on white", "%", 0.0, 100.0, 1.0, sensor=True),
    Constant("colour_sensor", "black", "black", "reading on black", "%", 0.0, 100.0, 1.0, sensor=True),
    Constant("colour_sensor", "ahead", "sensor_ahead", "sensor ahead of the axle", "m", 0.0, 0.16, 1.5e-3, sensor=True),
    Constant("colour_sensor", "left", "sensor_left", "sensor left of the middle", "m", -0.08, 0.08, 1.5e-3,
             sensor=True),
    Constant("colour_sensor", "spot_diameter", "spot_diameter", "diameter of the sensor's spot", "m", 0.001, 0.05, 2e-3,
             sensor=True),
    Constant("camera", "course_x", "line_dx", "course along the camera's x", "m", -0.12, 0.12, 2e-3, sensor=True),
    Constant("camera", "course_y", "line_dy", "course along the camera's y", "m", -0.12, 0.12, 2e-3, sensor=True),
    Constant("camera", "course_turn", "line_angle", "course turned in the camera's frame", "rad", -0.1, 0.1, 2e-3,
             sensor=True),
)  # fmt: skip
BY_NAME = {constant.name: constant for constant in CONSTANTS}


def chosen(names: Sequence[str] = ()) -> tuple[Constant, ...]:
    """Return constants by name in the order they are trusted; those usually freed where none is named.

    Raises
    ------
    InputError
        If there is no such constant.
    """
    for name in names:
        if name not in BY_NAME:
            raise expected("--constants", repr(name), f"some of {', '.join(BY_NAME)}")
    return tuple(c for c in CONSTANTS if (c.name in names if names else c.usual))


@dataclass(frozen=True)
class FreeConstants:
    """Free constants of a robot: maps vectors, in steps from the robot as it stands, to physics records."""

    robot: Robot
    constants: tuple[Constant, ...]

    @property
    def standing(self) -> Array:
        """Values in the robot as it stands, shape (k,)."""
        record = self.robot.physics
        return np.array([0.0 if c.kernel in MARK else float(record[c.kernel][0]) for c in self.constants])

    @property
    def steps(self) -> Array:
        """What one coordinate is, shape (k,)."""
        return np.array([c.step for c in self.constants])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest vectors."""
        low, high = np.array([self._ends(c) for c in self.constants], float).reshape(-1, 2).T
        return (low - self.standing) / self.steps, (high - self.standing) / self.steps

    def _ends(self, constant: Constant) -> tuple[float, float]:
        """Return the lowest and highest value of a constant in this robot."""
        if constant.kernel == "com_ahead":
            return self.robot.bounds(BY_ID["com_offset"].parameters[0])
        if constant.name == "battery.voltage":
            low, high = self.robot.battery.range(constant.low, constant.high)
            scale = float(self.robot.physics["supply_scale"][0])
            return max(low, low / scale), min(high, high / scale)
        return constant.low, constant.high

    def values(self, z: Array) -> Array:
        """Return the constants at a vector, shape (k,)."""
        return np.asarray(self.standing + z * self.steps)

    def physics(self, z: Array) -> npt.NDArray[Any]:
        """Return the physics records of m vectors, shape (m, k) to (m,)."""
        records = np.repeat(self.robot.physics, len(z))
        for constant, column in zip(self.constants, self.values(z).T, strict=True):
            if constant.kernel not in MARK:
                records[constant.kernel] = column
        return records

    def errors(self, residuals: Residuals, z: Array) -> Array:
        """Return residuals at a vector, shape (k,) to (n,), or at m of them, (m, k) to (m, n).

        Those of motion are of the poses as the vector's mark has them.
        """
        vectors = np.atleast_2d(z)
        if residuals.sensor:
            found = residuals.errors_of_each(self.physics(vectors))
        else:
            marks = np.zeros((len(vectors), len(MARK)))
            for constant, column in zip(self.constants, self.values(vectors).T, strict=True):
                if constant.kernel in MARK:
                    marks[:, MARK.index(constant.kernel)] = column
            found = np.empty((len(vectors), len(residuals.index.t_s)))
            for mark in np.unique(marks, axis=0):
                alike = (marks == mark).all(axis=1)
                found[alike] = residuals.with_mark(mark).errors_of_each(self.physics(vectors[alike]))
        return found if z.ndim == 2 else found[0]


def with_constants(robot: Robot, values: Mapping[str, float], name: str | None = None) -> Robot:
    """Return a robot with other constants, by their names in a robot file; the camera's are none of a robot.

    Where an effect of the robot holds the same number, the effect takes it.

    Raises
    ------
    InputError
        If the robot would not stand, or a value is out of range.
    """
    table = robot.model_dump()
    table["name"] = name or robot.name
    for each, value in values.items():
        constant = BY_NAME[each]
        holder = _effect_holding(robot, constant.kernel)
        if holder:
            table["effects"][holder[0]][holder[1]] = float(value) / holder[2]
        elif constant.section.startswith("effects."):
            table["effects"].setdefault(constant.section.removeprefix("effects."), {})[constant.field] = (
                float(value)
            )
        elif constant.section != "camera":
            table[constant.section][constant.field] = float(value)
    return robot_from(table, "the calibrated robot")


def _effect_holding(robot: Robot, kernel: str) -> tuple[str, str, float] | None:
    """Return (effect, label, SI of one unit) of the robot's effect that holds a field of the kernel's record."""
    for effect_id, held in robot.effects.items():
        for p in BY_ID[effect_id].parameters:
            if p.field == kernel and p.label in held:
                return effect_id, p.label, p.si
    return None
