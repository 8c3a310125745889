"""Units of foreign columns: those that exist, and those the numbers must be in."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from gecar.errors import InputError
from gecar.reality.recordings.columns import Series

_DEG = 180.0 / np.pi

# Factor from each unit a foreign column may have to the unit of the recording's column.
UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType({
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "px": 1.0},  # px: as long as the encoders say
    "angle": {"deg": 1.0, "rad": _DEG, "rev": 360.0},
    "duty": {"pct": 1.0, "fraction": 100.0, "pwm255": 100.0 / 255.0},
    "share": {"pct": 1.0, "fraction": 100.0},
    "voltage": {"v": 1.0, "mv": 1e-3},
    "rate": {"dps": 1.0, "rad_s": _DEG},
})  # fmt: skip
QUANTITY: Mapping[str, str] = MappingProxyType({
    "t_s": "time",
    "left_duty_pct": "duty",
    "right_duty_pct": "duty",
    "left_angle_deg": "angle",
    "right_angle_deg": "angle",
    "reflection_pct": "share",
    "x_m": "length",
    "y_m": "length",
    "heading_deg": "angle",
    "battery_v": "voltage",
    "yaw_rate_dps": "rate",
})  # fmt: skip


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


def duty_unit(duties: Series) -> tuple[str, str]:
    """Return the unit of duties, by the largest of both motors, and why."""
    most = float(np.nanmax(np.abs(duties), initial=0.0))
    if most > 100.0:
        raise InputError(
            f"duties up to {most:g} are no percentages: name their unit, for instance lm=left_duty_pct:pwm255"
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


def encoder_unit(t_s: Series, angle: Series, duty_pct: Series, expected_dps: float) -> tuple[str | None, str]:
    """Return the unit of wheel angles, by how fast they turn at the duties given, and why.

    Parameters
    ----------
    t_s, angle, duty_pct
        Times [s], angles [any unit] and duties [%], shape (rows,).
    expected_dps
        Speed of the robot's motors per percent of duty [deg/s]; infinite if nothing limits it.

    Returns
    -------
    unit
        ``None`` if the wheel hardly turned, or at no rate that such a motor has in any unit.
    reason
        In words.
    """
    seen = ~np.isnan(angle)
    t_s, angle, duty_pct = t_s[seen], angle[seen], duty_pct[seen]
    speeds, driven = np.abs(np.diff(angle) / np.diff(t_s)), np.abs(duty_pct[:-1]) >= 15.0
    if driven.sum() < 10 or not speeds[driven].any():
        return None, "no drive to tell by"
    rate = float(np.mean(speeds[driven]) / np.mean(np.abs(duty_pct[:-1][driven])))
    for unit, factor in UNITS["angle"].items():
        if 1 / 2.4 < rate * factor / expected_dps < 2.4:
            return unit, f"{rate:.2g} a second per percent of duty"
    return None, f"{rate:.2g} a second per percent of duty"


def length_unit(x: Series, y: Series) -> tuple[str, str]:
    """Return the unit of positions, by the size of the path (a course is metres across), and why."""
    span = float(max(np.nanmax(x) - np.nanmin(x), np.nanmax(y) - np.nanmin(y)))
    unit = "m" if span < 8.0 else "cm" if span < 500.0 else "mm"
    return unit, f"{span:g} across"


def heading_unit(values: Series) -> tuple[str, str]:
    """Return the unit of headings, by their range, and why."""
    most = float(np.nanmax(np.abs(values), initial=0.0))
    return ("rad" if most <= 2.0 * np.pi + 0.1 else "deg"), f"at most {most:.3g}"
