"""What every real robot has a little of: three to six small things, the same in all recordings of a case.

The effects of the catalogue and the kinds outside it are drawn on top of this, and it is no effect: a report that
names it is wrong. What moves the robot is scaled so that all of it together moves a 12 s drive by 1 to 6 mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.concealed.robot import Base, Concealed
from benchmarks.concealed.worlds import holds

Rng = np.random.Generator
FEWEST, MOST = 3, 6


@dataclass(frozen=True)
class Background:
    """What one robot, its floor and its recorder have a little of.

    Parameters
    ----------
    moving
        By kind, the fields of ``Concealed`` that move the robot, at full size, as differences from neutral.
    seen
        Fields of ``Concealed`` that sensors alone feel.
    recorder
        Fields of ``Conditions``.
    """

    moving: dict[str, dict[str, Any]]
    seen: dict[str, dict[str, Any]]
    recorder: dict[str, dict[str, Any]]

    def on(self, neutral: Concealed, amounts: Mapping[str, float]) -> Concealed:
        """Give a robot its background.

        Parameters
        ----------
        neutral
            The nominal robot.
        amounts
            Share of each kind that moves the robot; kinds not named are left out.

        Returns
        -------
        Concealed
        """
        changes: dict[str, Any] = {}
        for kind, amount in amounts.items():
            for field, difference in self.moving[kind].items():
                if field == "base":
                    changes["base"] = _scaled_base(neutral.base, difference, amount)
                elif isinstance(difference, tuple):
                    size, *rest = difference
                    changes[field] = _sized(field, size * amount, rest)
                else:
                    changes[field] = getattr(neutral, field) + amount * difference
        for kind_seen in self.seen.values():
            changes |= kind_seen
        return replace(neutral, **changes)

    def as_label(self, amounts: Mapping[str, float]) -> dict[str, Any]:
        """Say it in a label's words: at full size, and which share of that there is."""
        return {**self.moving, **self.seen, **self.recorder, "amounts": dict(amounts)}


def draw_background(rng: Rng, world: str) -> Background:
    """Draw three to six kinds.

    Parameters
    ----------
    rng
        Source of randomness.
    world
        Of those it holds.

    Returns
    -------
    Background
    """
    chosen: list[dict[str, dict[str, Any]]] = [{}, {}, {}]
    count = int(rng.integers(FEWEST, MOST + 1))
    for place in rng.permutation(len(_KINDS)).tolist():
        name, part, draw = _KINDS[place]
        changes = draw(rng)
        if part == _RECORDER or holds(world, changes):
            chosen[part][name] = changes
        if sum(map(len, chosen)) == count:
            break
    return Background(*chosen)


def _sized(field: str, size: float, rest: list[float]) -> tuple[float, ...]:
    """Put a scaled size where a field of several numbers has it."""
    if field == "tilt":
        return size * math.cos(rest[0]), size * math.sin(rest[0])
    if field == "tether":
        return rest[0], rest[1], size
    return size, *rest


def _scaled_base(base: Base, differences: dict[str, float], amount: float) -> Base:
    return replace(
        base, **{name: getattr(base, name) * (1.0 + amount * share) for name, share in differences.items()}
    )


def _either(rng: Rng, low: float, high: float) -> float:
    """Draw a size of either sign."""
    return float(rng.uniform(low, high)) * (1.0 if rng.random() < 0.5 else -1.0)


def _phase(rng: Rng) -> float:
    return float(rng.uniform(-math.pi, math.pi))


def _half_or_twice(rng: Rng) -> float:
    """Draw a factor between a half and two, less one."""
    return float(2.0 ** rng.uniform(-1.0, 1.0)) - 1.0


_MOVING, _SEEN, _RECORDER = range(3)
_KINDS: list[tuple[str, int, Callable[[Rng], dict[str, Any]]]] = [
    ("track", _MOVING, lambda rng: {"track_scale": _either(rng, 0.001, 0.005)}),
    (
        "wheels",
        _MOVING,
        lambda rng: {
            "radius_scale": _either(rng, 0.0005, 0.005),
            "radius_difference": _either(rng, 0.0005, 0.005),
        },
    ),
    ("motors", _MOVING, lambda rng: {"gain_difference": _either(rng, 0.001, 0.005)}),
    ("battery", _MOVING, lambda rng: {"supply_scale": _either(rng, 0.001, 0.005)}),
    (
        "weight",
        _MOVING,
        lambda rng: {"base": {"mass": _either(rng, 0.001, 0.005), "yaw_inertia": _either(rng, 0.001, 0.005)}},
    ),
    ("rotor", _MOVING, lambda rng: {"inertia_scale": _either(rng, 0.002, 0.01)}),
    ("centre_of_mass", _MOVING, lambda rng: {"com_ahead": _either(rng, 0.001, 0.002)}),
    ("direction", _MOVING, lambda rng: {"direction_gain": _either(rng, 0.001, 0.003)}),
    ("floor_tilt", _MOVING, lambda rng: {"tilt": (float(rng.uniform(0.001, 0.003)), _phase(rng))}),
    (
        "floor_waves",
        _MOVING,
        lambda rng: {
            "waves": (
                float(rng.uniform(0.001, 0.003)),
                float(rng.uniform(0.3, 0.8)),
                _phase(rng),
                _phase(rng),
            )
        },
    ),
    (
        "cable",
        _MOVING,
        lambda rng: {
            "tether": (
                float(rng.uniform(0.01, 0.03)),
                float(rng.uniform(0.4, 2.0)),
                float(rng.uniform(0.2, 1.0)),
            )
        },
    ),
    ("presliding", _MOVING, lambda rng: {"presliding_scale": _half_or_twice(rng)}),
    ("inductance", _MOVING, lambda rng: {"inductance_scale": _half_or_twice(rng)}),
    ("creep", _MOVING, lambda rng: {"creep_scale": _half_or_twice(rng)}),
    (
        "encoder_eccentricity",
        _SEEN,
        lambda rng: {"encoder_wave_deg": (float(rng.uniform(0.2, 0.8)), _phase(rng), _phase(rng))},
    ),
    ("camera_lens", _SEEN, lambda rng: {"lens": _either(rng, 0.0005, 0.002)}),
    ("camera_askew", _SEEN, lambda rng: {"camera_turn_deg": _either(rng, 0.05, 0.2)}),
    (
        "gyro",
        _SEEN,
        lambda rng: {
            "gyro_scale": 1.0 + _either(rng, 0.002, 0.01),
            "gyro_bias_dps": _either(rng, 0.05, 0.2),
        },
    ),
    ("sensor_curve", _SEEN, lambda rng: {"gamma": 1.0 + _either(rng, 0.01, 0.03)}),
    (
        "paper_gloss",
        _SEEN,
        lambda rng: {
            "gloss": (float(rng.uniform(0.003, 0.01)), float(rng.uniform(0.3, 0.9)), _phase(rng), _phase(rng))
        },
    ),
    ("row_times", _RECORDER, lambda rng: {"jitter_s": float(rng.uniform(0.0002, 0.001))}),
    ("dropped_rows", _RECORDER, lambda rng: {"dropped_share": float(rng.uniform(0.002, 0.01))}),
]
