"""Programs of a robot seen in a mirror: left and right exchanged."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, TypeVar

from gecar.language.statements import Motor, MotorUntil
from gecar.language.values import Sensor

T = TypeVar("T")

_SIDES = {Sensor.LEFT: Sensor.RIGHT, Sensor.RIGHT: Sensor.LEFT}


def mirror(part: T) -> T:
    """Exchange left and right in statements, or any part of them: duties and side sensors."""
    return _mirrored(part)


def _mirrored(part: Any) -> Any:
    if isinstance(part, tuple):
        return tuple(map(_mirrored, part))
    if isinstance(part, Sensor):
        return _SIDES.get(part, part)
    if not hasattr(part, "__dataclass_fields__"):
        return part
    if isinstance(part, Motor | MotorUntil):
        part = replace(part, left=part.right, right=part.left)
    return replace(part, **{field.name: _mirrored(getattr(part, field.name)) for field in fields(part)})
