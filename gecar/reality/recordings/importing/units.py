"""Units of foreign columns: those that exist, and those the numbers must be in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from gecar.errors import InputError
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.duty_cap import no_load_speed
from gecar.world.kernel.motor import FULL_SPEED
from gecar.world.robot import Robot

_DEG = 180.0 / np.pi

# Factor from each unit a foreign column may have to the unit of the recording's column; NaN: the robot says.
_ROBOTS = np.nan
UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType({
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "px": 1.0},  # px: as long as the encoders say
    "heading": {"deg": 1.0, "rad": _DEG, "rev": 360.0},
    "angle": {"deg": 1.0, "rad": _DEG, "rev": 360.0, "count": _ROBOTS, "m": _ROBOTS, "cm": _ROBOTS, "mm": _ROBOTS},
    "speed": {"dps": 1.0, "rad_s": _DEG, "rpm": 6.0, "rev_s": 360.0, "count_s": _ROBOTS, "m_s": _ROBOTS,
              "cm_s": _ROBOTS, "mm_s": _ROBOTS},
    "duty": {"pct": 1.0, "fraction": 100.0, "pwm255": 100.0 / 255.0, "pwm1023": 100.0 / 1023.0,
             "pwm4095": 100.0 / 4095.0, "v": _ROBOTS, "dps": _ROBOTS, "rad_s": _ROBOTS, "rpm": _ROBOTS,
             "m_s": _ROBOTS, "mm_s": _ROBOTS},
    "share": {"pct": 1.0, "fraction": 100.0},
    "voltage": {"v": 1.0, "mv": 1e-3},
    "rate": {"dps": 1.0, "rad_s": _DEG},
})  # fmt: skip
UNIT_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {key: tuple(units) for key, units in UNITS.items()}
)
QUANTITY: Mapping[str, str] = MappingProxyType({
    "t_s": "time",
    "left_duty_pct": "duty",
    "right_duty_pct": "duty",
    "left_angle_deg": "angle",
    "right_angle_deg": "angle",
    "reflection_pct": "share",
    "x_m": "length",
    "y_m": "length",
    "heading_deg": "heading",
    "battery_v": "voltage",
    "yaw_rate_dps": "rate",
    "left_speed_dps": "speed",
    "right_speed_dps": "speed",
})  # fmt: skip
"""What a column of a file may become: a recording's columns, and wheels' speeds, which add up to angles."""


@dataclass(frozen=True)
class Machine:
    """What of the robot tells the units of its log.

    Attributes
    ----------
    name
        The robot's.
    dps_per_pct
        Speed of its motors per percent of duty [deg/s]; infinite if nothing limits it.
    wheel_radius_m, track_width_m
        For wheels logged as distances, and for gyros [m].
    voltage
        What 100 % duty is [V].
    regulated
        Whether commands are speeds.
    counts
        Counts of an encoder per turn of its wheel; ``None``: not known.
    """

    name: str
    dps_per_pct: float
    wheel_radius_m: float
    track_width_m: float
    voltage: float
    regulated: bool
    counts: float | None = None

    @classmethod
    def of(cls, robot: Robot, counts: float | None = None) -> Machine:
        """Take from a robot what units depend on."""
        body, regulated = robot.body, robot.drive.mode == "speed"
        rate = float(np.rad2deg(0.01 * FULL_SPEED)) if regulated else no_load_speed(robot)
        return cls(
            robot.name, rate, body.wheel_radius, body.track_width, robot.battery.voltage, regulated, counts
        )

    def factor(self, where: str, quantity: str, unit: str) -> float:
        """Return the factor from a unit to that of the recording's column.

        Raises
        ------
        InputError
            If it depends on what is not known of the robot.
        """
        fixed = UNITS[quantity][unit]
        if not np.isnan(fixed):
            return fixed
        if quantity == "duty":
            return self._duty(where, unit)
        if unit in ("count", "count_s"):
            if self.counts is None:
                raise InputError(
                    f"{where}: encoder counts: --counts N says how many make a turn of the wheel"
                )
            return 360.0 / self.counts
        return UNITS["length"][unit.removesuffix("_s")] / self.wheel_radius_m * _DEG

    def _duty(self, where: str, unit: str) -> float:
        if unit == "v":
            return 100.0 / self.voltage
        if not self.regulated:
            raise InputError(
                f"{where}: a command in {unit} is a speed, and robot {self.name} takes a duty: "
                'a robot file with drive.mode = "speed" takes speeds'
            )
        fixed = UNITS["speed"][unit]
        rate = self.factor(where, "speed", unit) if np.isnan(fixed) else fixed
        return 100.0 * rate / float(np.rad2deg(FULL_SPEED))


def time_unit(time: Series, named: str | None) -> tuple[str, str]:
    """Return the unit of times, by their steps, and why.

    Logs are taken every 0.5 ms to 0.5 s. A named unit is kept if that makes it so.
    """
    steps = np.abs(np.diff(time[~np.isnan(time)]))
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    for unit in (named, "s", "ms", "us", "ns"):
        if unit and 4e-4 <= step * UNITS["time"][unit] < 0.5:
            return unit, f"steps of {step:g}"
    raise InputError(f"times in steps of {step:g} are in no unit that logs are taken in (s, ms, us, ns)")


def duty_unit(duties: Series, names: Sequence[str], pwm: bool, sure: bool) -> tuple[str, str]:
    """Return the unit of duties, by the values of both motors, and why.

    Parameters
    ----------
    duties
        Of both motors, any shape.
    names
        The columns' names, for messages.
    pwm
        Whether the names speak of pulse widths: then 0 to 100 may be percent or the lower part of 0 to 255.
    sure
        Whether the names say that they are duties: then few small whole numbers are no modes.

    Raises
    ------
    InputError
        If the values can not tell.
    """
    values = np.unique(np.abs(duties[~np.isnan(duties)]))
    most, whole = float(values.max(initial=0.0)), bool((values == np.round(values)).all())
    where, say = ", ".join(names), f"--column {names[0]}=left_duty_pct:"
    if pwm and whole and 100.0 < most <= 255.0:
        return "pwm255", f"at most {most:g}, named pwm"
    if most > 100.0:
        raise InputError(
            f"{where}: duties up to {most:g} are no percentages: name their unit, for instance {say}pwm255"
        )
    if pwm and most > 1.0:
        raise InputError(
            f"{where}: at most {most:g}, of 100 or of 255? {say}pct or {say}pwm255 says it, for each wheel"
        )
    if whole and 1.0 < most <= 5.0 and not sure:
        held = ", ".join(f"{value:g}" for value in values)
        raise InputError(
            f"{where}: holds only {held}: a mode? {say}pct says it is a duty, {names[0]}=- passes it over"
        )
    return ("fraction" if 0.0 < most <= 1.0 else "pct"), f"at most {most:g}"


def share_unit(values: Series) -> tuple[str, str]:
    """Return the unit of reflected light, by the largest, and why."""
    most = float(np.nanmax(values, initial=0.0))
    whole = bool(np.all(np.nan_to_num(values) == np.round(np.nan_to_num(values))))
    return ("fraction" if most <= 1.0 and not whole else "pct"), f"at most {most:g}"


def voltage_unit(values: Series) -> tuple[str, str]:
    """Return the unit of the battery's voltage, by its middle, and why."""
    middle = float(np.nanmedian(values))
    return ("mv" if middle > 100.0 else "v"), f"around {middle:g}"


def encoder_unit(t_s: Series, angle: Series, duty_pct: Series, machine: Machine) -> tuple[str | None, str]:
    """Return the unit of wheel angles, by how fast they turn at the duties given, and why.

    Parameters
    ----------
    t_s, angle, duty_pct
        Times [s], angles [any unit] and duties [%], shape (rows,).
    machine
        Of the robot: the speed of its motors, and counts per turn where they are known.

    Returns
    -------
    unit
        ``None`` if the wheel hardly turned, or at no rate that such a motor has in any unit. Whole numbers are no
        radians or revolutions.
    reason
        In words.
    """
    seen = ~np.isnan(angle)
    t_s, angle, duty_pct = t_s[seen], angle[seen], duty_pct[seen]
    with np.errstate(over="ignore"):
        speeds, driven = np.abs(np.diff(angle) / np.diff(t_s)), np.abs(duty_pct[:-1]) >= 15.0
    if driven.sum() < 10 or not speeds[driven].any():
        return None, NO_DRIVE
    rate = float(np.mean(speeds[driven]) / np.mean(np.abs(duty_pct[:-1][driven])))
    whole = bool((angle == np.round(angle)).all())
    for unit in ("deg",) if whole else ("deg", "rad", "rev"):
        if 1 / 2.4 < rate * UNITS["angle"][unit] / machine.dps_per_pct < 2.4:
            return unit, f"{rate:.2g} a second per percent of duty"
    return None, f"{rate:.2g} a second per percent of duty"


NO_DRIVE = "no drive to tell by"


def length_unit(x: Series, y: Series) -> tuple[str, str]:
    """Return the unit of positions, by the size of the path (a course is metres across), and why."""
    span = float(max(np.nanmax(x) - np.nanmin(x), np.nanmax(y) - np.nanmin(y)))
    unit = "m" if span < 8.0 else "cm" if span < 500.0 else "mm"
    return unit, f"{span:g} across"


def heading_unit(values: Series) -> tuple[str, str]:
    """Return the unit of headings, by their range, and why; whole numbers are no radians."""
    most = float(np.nanmax(np.abs(values), initial=0.0))
    whole = bool(np.all(np.nan_to_num(values) == np.round(np.nan_to_num(values))))
    return ("rad" if most <= 2.0 * np.pi + 0.1 and not whole else "deg"), f"at most {most:.3g}"


def rate_unit(rate: Series, turning_dps: Series | None) -> tuple[str, str]:
    """Return the unit of yaw rates, by what the wheels tell of turning [deg/s], shape (rows,), and why."""
    if turning_dps is None:
        return "dps", "unless said otherwise"
    seen = ~np.isnan(rate) & ~np.isnan(turning_dps)
    told, read = turning_dps[seen], rate[seen]
    energy = float(np.dot(told, told))
    slope = abs(float(np.dot(told, read))) / energy if energy > 0.0 else np.nan
    if 0.3 / _DEG < slope < 3.0 / _DEG:
        return "rad_s", "by the wheels"
    return "dps", "by the wheels" if 0.3 < slope < 3.0 else "unless said otherwise"
