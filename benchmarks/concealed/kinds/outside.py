"""Draw physics that no row of the catalogue describes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.concealed.effects import Rng, strength
from benchmarks.concealed.robot import NEUTRAL, Concealed

# One robot per recording: weather and radio differ from run to run, everything else is the same.
Drawn = tuple[list[Concealed], dict[str, Any]]
Draw = Callable[[Rng, int, float], Drawn]


@dataclass(frozen=True)
class Outside:
    """A kind of physics outside the catalogue.

    Parameters
    ----------
    words
        What an honest report would have to describe.
    draw
        From randomness, a number of recordings and the least strength, as a share of the log range, to robots and
        the label's numbers.
    needs
        Columns without which it leaves no trace.
    last
        Whether it is kept for a last examination; of ``FINAL`` and every later set, every one.
    """

    words: str
    draw: Draw
    needs: tuple[str, ...] = ()
    last: bool = False


def some_phase(rng: Rng) -> float:
    """Draw an angle [rad]."""
    return float(rng.uniform(-math.pi, math.pi))


def some_side(rng: Rng) -> int:
    """Draw the left wheel (0) or the right one (1)."""
    return int(rng.integers(2))


def some_sign(rng: Rng) -> float:
    """Draw 1 or -1."""
    return 1.0 if rng.random() < 0.5 else -1.0


def same_in_all(change: Callable[[Rng, float], tuple[dict[str, Any], dict[str, Any]]]) -> Draw:
    """Make a draw of one robot for all recordings from a draw of its fields and of the label's numbers."""

    def draw(rng: Rng, runs: int, least: float) -> Drawn:
        changes, numbers = change(rng, least)
        return _same(runs, numbers, **changes)

    return draw


def _same(runs: int, numbers: dict[str, Any], **changes: Any) -> Drawn:
    return [replace(NEUTRAL, **changes)] * runs, numbers


def _off_centre(rng: Rng, runs: int, least: float) -> Drawn:
    offset = strength(rng, 0.002, 0.006, least)
    return _same(runs, {"offset_m": offset}, off_centre=(offset, some_phase(rng), some_phase(rng)))


def _oval(rng: Rng, runs: int, least: float) -> Drawn:
    half = strength(rng, 0.0008, 0.003, least)
    return _same(runs, {"half_axes_differ_m": 2.0 * half}, oval=(half, some_phase(rng), some_phase(rng)))


def _tether(rng: Rng, runs: int, least: float) -> Drawn:
    x, y = float(rng.uniform(0.4, 2.0)), float(rng.uniform(0.2, 1.0))
    stiffness = strength(rng, 0.4, 2.5, least)
    return _same(runs, {"x_m": x, "y_m": y, "n_per_m": stiffness}, tether=(x, y, stiffness))


def _magnet(rng: Rng, runs: int, least: float) -> Drawn:
    x, y, core = float(rng.uniform(0.9, 1.5)), float(rng.uniform(0.45, 0.75)), float(rng.uniform(0.10, 0.25))
    pull = strength(rng, 0.4, 2.5, least)
    return _same(runs, {"x_m": x, "y_m": y, "core_m": core, "pull_n": pull}, magnet=(x, y, core, pull))


def _waves(rng: Rng, runs: int, least: float) -> Drawn:
    slope, length = strength(rng, 0.015, 0.10, least), float(rng.uniform(0.2, 0.5))
    return _same(
        runs,
        {"slope_rad": slope, "length_m": length},
        waves=(slope, length, some_phase(rng), some_phase(rng)),
    )


def _gusts(rng: Rng, runs: int, least: float) -> Drawn:
    """Draw eight gusts a run, each from anywhere."""
    force = strength(rng, 0.4, 2.5, least)

    def gust() -> tuple[float, float, float, float]:
        way, length = some_phase(rng), float(rng.uniform(0.15, 0.6))
        return float(rng.uniform(0.3, 11.5)), length, force * math.cos(way), force * math.sin(way)

    robots = [replace(NEUTRAL, gusts=tuple(gust() for _ in range(8))) for _ in range(runs)]
    return robots, {"force_n": force}


def _air_drag(rng: Rng, runs: int, least: float) -> Drawn:
    drag = strength(rng, 2.0, 20.0, least)
    return _same(runs, {"n_s2_per_m2": drag}, air_drag=drag)


def _bump(rng: Rng, runs: int, least: float) -> Drawn:
    """Lay a ridge where line followers pass and no recording starts."""
    height, x, angle = (
        strength(rng, 0.0012, 0.004, least),
        float(rng.uniform(0.5, 0.7)),
        float(rng.uniform(-0.3, 0.3)),
    )
    return _same(runs, {"height_m": height, "x_m": x, "angle_rad": angle}, bump=(height, x, angle))


def _lens(rng: Rng, runs: int, least: float) -> Drawn:
    """Bend the picture: at 1 m from the middle a pose is off by that many metres."""
    bend = some_sign(rng) * strength(rng, 0.03, 0.2, least)
    return _same(runs, {"per_m2": bend}, lens=bend)


def _ambient(rng: Rng, runs: int, least: float) -> Drawn:
    loss, source = strength(rng, 0.05, 0.4, least), some_phase(rng)
    return _same(runs, {"loss": loss, "heading_rad": source}, ambient=(loss, source))


def _pose_drift(rng: Rng, runs: int, least: float) -> Drawn:
    rate = some_sign(rng) * strength(rng, 0.1, 1.0, least)
    return _same(runs, {"deg_per_s": rate}, pose_drift_deg=rate)


def _dropouts(rng: Rng, runs: int, least: float) -> Drawn:
    """Lose the radio link a few times a run."""
    length, count = strength(rng, 0.05, 0.3, least), int(rng.integers(4, 10))
    robots = []
    for _ in range(runs):
        starts = np.sort(rng.uniform(0.3, 11.5, count))
        robots.append(replace(NEUTRAL, dropouts=tuple((float(start), length) for start in starts)))
    return robots, {"seconds": length, "per_run": count}


_POSE = ("x_m", "y_m", "heading_deg")

OUTSIDE: dict[str, Outside] = {
    "off_centre_wheels": Outside(
        "the wheels' tread is off-centre: it repeats with the wheel's angle", _off_centre
    ),
    "oval_wheels": Outside("the wheels are oval: their radius varies twice a turn", _oval),
    "tether": Outside("a spring-like cable pulls towards one point", _tether),
    "magnet": Outside("something pulls towards one place on the floor, and only near it", _magnet),
    "wavy_floor": Outside("the floor's slope changes from place to place", _waves),
    "gusts": Outside("pushes that come and go with time, unlike from run to run", _gusts),
    "air_drag": Outside("a drag on the body that grows with the square of the speed", _air_drag),
    "floor_ridge": Outside("a ridge across the floor that wheels and caster climb", _bump),
    "camera_lens": Outside(
        "the pose is wrong by an amount that grows towards the field's edge", _lens, _POSE
    ),
    "ambient_light": Outside("the reading depends on the heading", _ambient, ("reflection_pct",)),
    "pose_drift": Outside("the pose's frame turns slowly", _pose_drift, _POSE),
    "radio_dropouts": Outside("commands are lost for moments", _dropouts),
}
