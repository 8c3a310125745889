"""Sizes of effects in units people use: a battery in volts, a delay in milliseconds, a wheel in millimetres."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from gecar.compiled import numbers
from gecar.reality.fitting.parameters import bounded
from gecar.reality.verdict import Interval
from gecar.world.effects import BY_ID, DEG, Parameter
from gecar.world.robot import Robot

RPM = math.tau / 60.0


class Reading(NamedTuple):
    """A parameter as people read it.

    Attributes
    ----------
    what
        What is measured.
    unit
        Its unit; "" for a bare number.
    of
        From the parameter's SI value and the robot's constants to that unit; default: the value itself.
    """

    what: str
    unit: str = ""
    of: Callable[[float, Mapping[str, float]], float] = lambda value, robot: value  # noqa: ARG005


def _times(factor: float) -> Callable[[float, Mapping[str, float]], float]:
    return lambda value, robot: factor * value  # noqa: ARG005


def _of(field: str, factor: float) -> Callable[[float, Mapping[str, float]], float]:
    """Return what turns a share of a robot's constant into that constant."""
    return lambda value, robot: factor * value * float(robot[field])


def _white(value: float, robot: Mapping[str, float]) -> float:
    return value * float(robot["white"])


_MS, _MM, _PCT, _MNM = _times(1e3), _times(1e3), _times(100.0), _times(1e3)
_READINGS: Mapping[str, Reading] = {
    "coulomb_friction": Reading("torque", "mN m", _MNM),
    "viscous_friction": Reading("torque at 100 turns a minute", "mN m", _times(1e3 * 100.0 * RPM)),
    "static_friction": Reading("extra torque to break away", "mN m", _MNM),
    "stribeck_speed": Reading("gone at", "deg/s", _times(1.0 / DEG)),
    "friction_ratio": Reading("friction forward above backward", "%", _times(200.0)),
    "direction_gain": Reading("power forward above backward", "%", _times(200.0)),
    "viscous_difference": Reading(
        "torque at 100 turns a minute forward above backward", "mN m", _times(1e3 * 100.0 * RPM)
    ),
    "constant_torque": Reading("torque forward", "mN m", _MNM),
    "backlash": Reading("play", "deg", _times(1.0 / DEG)),
    "dead_band": Reading("no torque below", "% duty", _PCT),
    "dead_band_offset": Reading("lost above it, too", "%", _PCT),
    "dead_band_right": Reading("right motor's dead band wider by", "% duty", _PCT),
    "dead_band_forward": Reading("dead band forward wider by", "% duty", _PCT),
    "duty_bulge": Reading(
        "voltage at 50 % duty", "% of full", lambda v, _: 50.0 * (1.0 + v) / (1.0 + 0.5 * v)
    ),
    "full_duty_gain": Reading("more at full duty", "%", _PCT),
    "inertia_scale": Reading("inertia", "kg cm²", _of("inertia", 1e4)),
    "actuation_delay": Reading("delay", "ms", _MS),
    "start_latency": Reading("wait at the start", "ms", _MS),
    "command_slew": Reading("from 0 to 100 % in", "ms", lambda v, _: 1e3 / v if v else math.inf),
    "current_limit": Reading("most current", "A"),
    "gain_difference": Reading("right motor stronger by", "%", _PCT),
    "supply_scale": Reading("battery", "V", _of("voltage", 1.0)),
    "battery_resistance": Reading("volts lost for each ampere", "V"),
    "battery_drain": Reading("battery falls", "V a minute", _times(60.0)),
    "ripple_amplitude": Reading("torque up and down by", "mN m", _MNM),
    "ripple_cycles": Reading("waves a turn"),
    "speed_limit": Reading("top speed", "deg/s", _times(1.0 / DEG)),
    "radius_scale": Reading("wheel radius", "mm", _of("wheel_radius", 1e3)),
    "radius_difference": Reading("right wheel's radius larger by", "mm", _of("wheel_radius", 1e3)),
    "track_scale": Reading("track", "mm", _of("track_width", 1e3)),
    "yaw_inertia_scale": Reading("moment of inertia", "kg cm²", _of("yaw_inertia", 1e4)),
    "tyre_friction": Reading("grip"),
    "patch_radius": Reading("radius", "mm", _MM),
    "patch_x": Reading("at x", "mm", _MM),
    "patch_y": Reading("at y", "mm", _MM),
    "patch_friction": Reading("grip there"),
    "caster_friction": Reading("caster's friction coefficient"),
    "drag_force": Reading("drag", "N"),
    "drag_left": Reading("left of the middle", "mm", _MM),
    "drag_off_axle": Reading("ahead of the axle or behind it", "mm", _MM),
    "rolling_resistance": Reading("force of the weight", "%", _PCT),
    "tilt_x": Reading("tilt along x", "deg", _times(1.0 / DEG)),
    "tilt_y": Reading("tilt along y", "deg", _times(1.0 / DEG)),
    "com_height": Reading("height", "mm", _MM),
    "com_ahead": Reading("ahead of the axle", "mm", _MM),
    "sensor_lag": Reading("two thirds of a change seen after", "ms", _MS),
    "sensor_delay": Reading("delay", "ms", _MS),
    "sensor_gain": Reading("white floor reads", "%", _white),
    "sensor_offset": Reading("all readings higher by", "%"),
    "sensor_ahead": Reading("ahead of the axle", "mm", _MM),
    "sensor_left": Reading("left of the middle", "mm", _MM),
    "spot_diameter": Reading("spot's diameter", "mm", _MM),
    "line_dx": Reading("shifted along x", "mm", _MM),
    "line_dy": Reading("shifted along y", "mm", _MM),
    "line_angle": Reading("turned", "deg", _times(1.0 / DEG)),
    "line_scale": Reading("printed at", "%", _PCT),
    "clock_skew": Reading("clock fast by", "%", _PCT),
    "pose_delay": Reading("delay", "ms", _MS),
    "pose_scale": Reading("lengths appear at", "%", _PCT),
}
_SHAPES = ("ripple_phase", "ripple_lead")  # say nothing to anybody


class Quantity(NamedTuple):
    """A parameter that was found: what, before and now, 95 % interval, unit; before is None where there was none.

    ``or_less`` and ``or_more`` say that an end is only as far as was searched.
    """

    what: str
    before: float | None
    now: float
    low: float
    high: float
    unit: str
    or_less: bool = False
    or_more: bool = False

    def __str__(self) -> str:
        numbers = [self.now, self.low, self.high, *(() if self.before is None else (self.before,))]
        places = _places(self.high - self.low, max(abs(n) for n in numbers if math.isfinite(n)))
        unit = f" {self.unit}" if self.unit else ""
        now, low, high = (f"{n:.{places}f}" for n in (self.now, self.low, self.high))
        was = "" if self.before is None else f"{self.before:.{places}f} → "
        span = f"{low} to {high}"
        if self.or_less != self.or_more:
            span = f"{high} or less" if self.or_less else f"{low} or more"
        return f"{self.what} {was}{now}{unit} ({span})"


def quantities(effect_id: str, parameters: Mapping[str, Interval], robot: Robot) -> list[Quantity]:
    """Return what was found of an effect, as people read it; parameters that only shape it without meaning left out.

    Parameters
    ----------
    effect_id
        Which.
    parameters
        By label, as in a verdict.
    robot
        As it was known.
    """
    physics = robot.physics[0]
    constants = {name: float(physics[name]) for name in numbers(physics.dtype)}
    out = []
    for parameter in BY_ID[effect_id].parameters:
        if parameter.field in _SHAPES or parameter.label not in parameters:
            continue
        found, ends_at = parameters[parameter.label], bounded(robot, parameter)
        reading = _scaled(_READINGS[parameter.field], found.value * parameter.si, constants)
        now = reading.of(found.value * parameter.si, constants)
        ends = ((found.low, ends_at.low), (found.high, ends_at.high))
        (low, or_less), (high, or_more) = sorted(
            (reading.of(end * parameter.si, constants), _only_searched(end, bound, parameter))
            for end, bound in ends
        )
        before = reading.of(constants[parameter.field], constants)
        known = parameter.worthwhile > 0.0 and math.isfinite(before) and before != 0.0
        was = before if known else None
        out.append(Quantity(reading.what, was, now, low, high, reading.unit, or_less, or_more))
    return out


def _only_searched(end: float, bound: float, parameter: Parameter) -> bool:
    """Whether an interval ends where the search does, and neither at nothing nor where the effect vanishes."""
    return bound not in (0.0, parameter.neutral) and math.isclose(end, bound, rel_tol=1e-6)


def _scaled(reading: Reading, value: float, constants: Mapping[str, float]) -> Reading:
    """Return a reading in units a thousand times larger where its number is that large."""
    if reading.unit != "mN m" or abs(reading.of(value, constants)) < 1e3:
        return reading
    return Reading(reading.what, "N m", lambda v, robot: 1e-3 * reading.of(v, robot))


def smallest(parameter: Parameter, size: float, robot: Robot) -> str:
    """Say the smallest size of an effect that would have been seen: a change from what is known."""
    physics = robot.physics[0]
    constants = {name: float(physics[name]) for name in numbers(physics.dtype)}
    known = constants[parameter.field]
    reading = _scaled(_READINGS[parameter.field], size * parameter.si, constants)
    if math.isinf(parameter.neutral or 0.0):
        change = reading.of(size * parameter.si, constants)
    else:
        change = abs(reading.of(known + size * parameter.si, constants) - reading.of(known, constants))
    digits = f"{change:.2g}" if change < 100.0 else f"{change:.0f}"
    return f"{digits} {reading.unit}".strip()


def amount(value: float, unit: str) -> str:
    """Say an amount: 84 mm, 3.2 mm, 0.31 degrees."""
    words = {"deg": "°", "%": " %"}.get(unit, f" {unit}")
    return f"{value:.{0 if abs(value) >= 9.95 else 1 if abs(value) >= 0.95 else 2}f}{words}"


def _places(span: float, size: float) -> int:
    """Return how many decimal places tell an interval's ends apart, and show at least two digits."""
    finest = min(span if span > 0.0 else size, size) or 1.0
    return min(max(1 - math.floor(math.log10(finest)), 0), 6)
