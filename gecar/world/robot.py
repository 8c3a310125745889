"""The robot: constants of a two-wheel EV3 with a caster and a colour sensor, read from a TOML file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from gecar.compiled import numbers
from gecar.errors import InputError, first_fault, one_of
from gecar.files import is_file, read_toml, write_whole
from gecar.world.effects import BY_ID, CATALOGUE, PHYSICS, Parameter
from gecar.world.ports import N_TERMS
from gecar.world.terms import Term, rows_of

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Percent = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]
_SHIPPED = Path(__file__).parent
LEAST_BACK_EMF = 1e-9  # V s/rad: a drive that has none, controlled in current


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class Body(_Section):
    """Rigid body: masses [kg, kg m^2] and lengths [m], ahead and left of the axle's centre."""

    mass: Positive
    yaw_inertia: Positive
    com_ahead: Finite
    com_height: NotNegative
    track_width: Positive
    wheel_radius: Positive
    caster_ahead: Finite
    length: Positive
    width: Positive

    @model_validator(mode="after")
    def _stands(self) -> Body:
        share = self.com_ahead / self.caster_ahead if self.caster_ahead else -1.0
        if not 0.0 <= share < 1.0:
            raise ValueError(
                "a centre of mass between the axle and the caster (com_ahead / caster_ahead in [0, 1))"
            )
        return self


class Motor(_Section):
    """DC motor with gearbox, at the output shaft [N m/A, V s/rad, ohm, kg m^2, N m, rad]."""

    torque_constant: Positive
    back_emf_constant: Positive
    resistance: Positive
    inertia: Positive
    coulomb_friction: NotNegative
    backlash: NotNegative = 0.0


class Battery(_Section):
    """Voltage source [V] behind a resistance [ohm]; the voltages it can have [V], empty and full, where known."""

    voltage: Positive
    resistance: NotNegative = 0.0
    voltage_low: Positive | None = None
    voltage_high: Positive | None = None

    @model_validator(mode="after")
    def _can_be(self) -> Battery:
        low, high = self.range(0.0, math.inf)
        if not low <= self.voltage <= high:
            raise ValueError(
                f"found voltage = {self.voltage:g}, expected voltage_low to voltage_high, {low:g} to {high:g} V"
            )
        return self

    def range(self, low: float, high: float) -> tuple[float, float]:
        """Return the lowest and highest voltage it can have [V]; those given where it does not say."""
        return self.voltage_low or low, self.voltage_high or high


class Drive(_Section):
    """How commands become voltage: the cap on duty, and open loop ("duty") or regulated ("speed")."""

    duty_cap: Annotated[float, Field(gt=0, le=1)] = 1.0
    mode: Literal["duty", "speed"] = "duty"


class Tyre(_Section):
    """Coulomb coefficient of each wheel's friction circle."""

    friction: NotNegative


class ColourSensor(_Section):
    """Reflected-light sensor: place [m], spot [m], readings on bare floor and on the line [%].

    ``side_left`` is how far the left and right sensors, where a grammar uses them, sit beside this one.
    """

    ahead: Finite
    left: Finite = 0.0
    spot_diameter: Positive
    white: Percent = 100.0
    black: Percent = 0.0
    side_left: Finite = 0.03


class Robot(_Section):
    """A robot: its constants, and the catalogue effects it has.

    ``effects`` maps an effect's id to its parameters by label, as in
    ``[effects.backlash]`` / ``angle_deg = 5.6``. ``term`` holds physics of no catalogue, as laws: ``[[term]]``.
    """

    name: str
    body: Body
    motor: Motor
    battery: Battery
    drive: Drive
    tyre: Tyre
    colour_sensor: ColourSensor
    effects: Mapping[str, Mapping[str, float]] = {}
    term: Annotated[tuple[Term, ...], Field(max_length=N_TERMS)] = ()

    @model_validator(mode="after")
    def _known_effects(self) -> Robot:
        for effect_id, values in self.effects.items():
            self._check_effect(effect_id, values)
        return self

    @property
    def physics(self) -> npt.NDArray[np.void]:
        """The kernel's record of all constants and effects, dtype `PHYSICS`, shape (1,); SI."""
        record = np.zeros(1, PHYSICS)
        own = self._own_constants()
        for effect in CATALOGUE:
            for p in effect.parameters:
                if p.neutral is not None:
                    own.setdefault(p.field, p.neutral * p.si)
        for effect_id, values in self.effects.items():
            labels = {p.label: p for p in BY_ID[effect_id].parameters}
            own.update({labels[label].field: value * labels[label].si for label, value in values.items()})
        own["n_terms"] = len(self.term)
        for field in numbers(PHYSICS):
            record[field] = own[field]
        record["terms"] = rows_of(self.term)
        return record

    def _own_constants(self) -> dict[str, float]:
        own: dict[str, float] = {**self.body.model_dump(), **self.motor.model_dump()}
        own["voltage"] = self.battery.voltage
        own["battery_resistance"] = self.battery.resistance
        own["duty_cap"] = self.drive.duty_cap
        own["regulated"] = 1.0 if self.drive.mode == "speed" else 0.0
        own["tyre_friction"] = self.tyre.friction
        sensor = self.colour_sensor
        own |= {
            "sensor_ahead": sensor.ahead,
            "sensor_left": sensor.left,
            "spot_diameter": sensor.spot_diameter,
        }
        own |= {"white": sensor.white, "black": sensor.black, "side_sensor_left": sensor.side_left}
        return own

    def nominal(self, parameter: Parameter) -> float:
        """Return a parameter's neutral value for this robot, in the parameter's unit."""
        if parameter.neutral is not None:
            return parameter.neutral
        return self._own_constants()[parameter.field] / parameter.si

    def bounds(self, parameter: Parameter) -> tuple[float, float]:
        """Return the lowest and highest value a parameter can have in this robot, in the parameter's unit."""
        if parameter.field == "com_ahead":  # between the axle and the caster, or the robot falls over
            short_of_caster = self.body.caster_ahead - math.copysign(0.001, self.body.caster_ahead)
            return min(round(short_of_caster, 6), 0.0), max(round(short_of_caster, 6), 0.0)
        if parameter.field == "supply_scale":
            low, high = self.battery.range(
                parameter.low * self.battery.voltage, parameter.high * self.battery.voltage
            )
            return low / self.battery.voltage, high / self.battery.voltage
        if parameter.unit.startswith("N m"):  # bounds are an EV3's; a larger drive has larger ones
            return -math.inf if parameter.low < 0.0 else parameter.low, math.inf
        return parameter.low, parameter.high

    def with_effects(self, effects: Mapping[str, Mapping[str, float]]) -> Robot:
        """Return this robot with effects added or replaced.

        Raises
        ------
        InputError
            If an effect or label is unknown, or a value out of bounds.
        """
        for effect_id, values in effects.items():
            try:
                self._check_effect(effect_id, values)
            except ValueError as error:
                raise InputError(f"effect {effect_id}: {error}") from None
        return self.model_copy(update={"effects": {**self.effects, **effects}})

    def with_terms(self, terms: Sequence[Term]) -> Robot:
        """Return this robot with other terms, at most `N_TERMS`."""
        return self.model_copy(update={"term": tuple(terms)})

    def _check_effect(self, effect_id: str, values: Mapping[str, float]) -> None:
        if effect_id not in BY_ID:
            raise ValueError(f"found effect '{effect_id}', expected one of the catalogue: {', '.join(BY_ID)}")
        labels = {p.label: p for p in BY_ID[effect_id].parameters}
        for label, value in values.items():
            if label not in labels:
                raise ValueError(
                    f"found '{label}' in effect {effect_id}, expected one of {', '.join(labels)}"
                )
            low, high = self.bounds(labels[label])
            if math.isnan(value) or not low <= value <= high:
                wanted = f"{low:g} to {high:g} {labels[label].unit}"
                raise ValueError(f"found {effect_id}.{label} = {value:g}, expected {wanted}")


def robot_from(table: Mapping[str, Any], where: str | Path) -> Robot:
    """Make a robot from a parsed TOML table.

    Raises
    ------
    InputError
        If a field is missing, unknown or out of range; names the file and field.
    """
    try:
        return Robot.model_validate(table)
    except ValidationError as error:
        raise first_fault(error, where, "one of the fields of a robot file") from None


def read_robot(path: Path) -> Robot:
    """Read a robot file (TOML, SI units).

    A file of a motor alone, as for a bench, has neither body nor tyre nor colour sensor: those of the EV3 stand in.

    Raises
    ------
    InputError
        If the file is missing, not TOML, or a field is wrong.
    """
    table = read_toml(path, "a robot file")
    if not {"body", "tyre", "colour_sensor"} & table.keys() and "motor" in table:
        table = _with_body(table)
    return robot_from(table, path)


def _with_body(table: Mapping[str, Any]) -> dict[str, Any]:
    """Add the EV3's body, tyre and sensor to a motor alone; in current control it has hardly any back-EMF."""
    nominal = read_robot(_SHIPPED / "ev3.toml").model_dump(include={"body", "tyre", "colour_sensor"})
    whole = nominal | dict(table)
    motor = whole["motor"]
    if isinstance(motor, dict):
        whole["motor"] = motor | {"back_emf_constant": motor.get("back_emf_constant") or LEAST_BACK_EMF}
    return whole


def list_robots() -> list[str]:
    """Return the names of the robots that ship with gecar, the nominal one first."""
    names = sorted(path.stem for path in _SHIPPED.glob("*.toml"))
    return sorted(names, key=lambda name: name != "ev3")


def robot_file(name_or_path: str | Path) -> Path:
    """Return the file of a robot: the one given, or the one of a robot that ships with gecar.

    Raises
    ------
    InputError
        If it is neither a robot file's name nor one of `list_robots`.
    """
    path = Path(name_or_path)
    if path.suffix == ".toml" or is_file(path):
        return path
    if str(name_or_path) not in list_robots():
        raise one_of("--robot", str(name_or_path), list_robots(), "a robot file (.toml)")
    return _SHIPPED / f"{name_or_path}.toml"


def load_robot(name_or_path: str | Path) -> Robot:
    """Load a robot by file, or by the name of one that ships with gecar (`list_robots`).

    Raises
    ------
    InputError
        If there is no such robot, or its file is wrong.
    """
    return read_robot(robot_file(name_or_path))


def write_robot(robot: Robot, path: Path) -> None:
    """Write a robot file that `read_robot` reads back to an equal robot."""
    table = robot.model_dump(exclude={"term"}, exclude_none=True)
    if not table["effects"]:
        del table["effects"]
    terms = [f"\n[[term]]\n{tomli_w.dumps(term.as_table())}" for term in robot.term]
    write_whole(path, tomli_w.dumps(table) + "".join(terms))
