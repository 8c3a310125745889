"""The recording to make next: from a library of command sequences a robot can drive, the one that tells most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.comparison import Comparison
from gecar.reality.fitting import cost
from gecar.reality.freedom import Freedom
from gecar.reality.noise import Noise
from gecar.reality.selection import Model, Selection
from gecar.reality.verdict import Found, NextRecording
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
Commands = tuple[tuple[float, float, float], ...]


def _holds(length_s: float, *duties: tuple[float, float]) -> Commands:
    return tuple(
        (round(k * length_s, 2), left, right) for k, (left, right) in enumerate((*duties, (0.0, 0.0)))
    )


LIBRARY: dict[str, Commands] = {
    "straight at rising speeds": _holds(
        1.5, (15, 15), (25, 25), (40, 40), (55, 55), (-40, -40), (-55, -55), (-20, -20)
    ),
    "reversals": _holds(0.6, *((d, d) for d in (40, -40, 30, -30, 50, -50, 20, -20, 60, -60) for _ in (0,))),
    "spins at rising speeds": _holds(1.2, (15, -15), (30, -30), (50, -50), (70, -70), (-30, 30), (-60, 60)),
    "starts from rest at small duties": _holds(
        0.8, *(d for k in (6, 8, 10, 12, 16, 20) for d in ((k, k), (0, 0)))
    ),
    "arcs to both sides": _holds(1.5, (50, 20), (20, 50), (60, 30), (30, 60), (-50, -20), (-20, -50)),
    "full steps": _holds(0.7, *(d for k in (80, -80, 80, -80) for d in ((k, k), (0, 0), (k, -k), (0, 0)))),
    "long and slow, then long and fast": _holds(4.0, (25, 25), (-25, -25), (60, 60), (-60, -60)),
    "the line, crossed to and fro": _holds(0.8, *((d, d) for d in (25, -25, 25, -25, 40, -40, 40, -40))),
}


def suggest(
    robot: Robot, taken: Model, motion: Selection, found: Sequence[Found], noise: Noise, unexplained: bool
) -> NextRecording:
    """Return what to record next, and why."""
    confused = next(((f.id, f.alternatives) for f in found if f.alternatives), None)
    if confused is not None:
        why = f"tells {confused[0]} from {' and '.join(confused[1])}"
        name = (
            "full steps"
            if "rotor_inertia" in confused[1] or "actuation_delay" in confused[1]
            else _for(confused[0])
        )
        return NextRecording(f"{name}: {why}", LIBRARY[name])
    if unexplained:
        name = "long and slow, then long and fast"
        return NextRecording(
            f"{name}: shows whether what is left depends on speed, way or time", LIBRARY[name]
        )
    if found:
        name = _for(found[0].id)
        return NextRecording(f"{name}: narrows the interval of {found[0].id} further", LIBRARY[name])
    return NextRecording(
        "reversals: nothing is missing so far; this asks most of gears, friction and grip",
        LIBRARY["reversals"],
    )


_FOR = {
    "backlash": "reversals", "static_friction": "starts from rest at small duties",
    "dead_band": "starts from rest at small duties", "track_width": "spins at rising speeds",
    "wheel_radius": "straight at rising speeds", "caster_drag": "spins at rising speeds",
    "com_offset": "arcs to both sides", "rotor_inertia": "full steps", "actuation_delay": "full steps",
    "command_slew": "full steps", "battery_drain": "long and slow, then long and fast",
}  # fmt: skip


def _for(effect: str) -> str:
    return _FOR.get(
        effect,
        "the line, crossed to and fro"
        if effect.startswith(("sensor", "spot", "line"))
        else "straight at rising speeds",
    )


_ = (Comparison, cost, Freedom)
