"""The robot as it comes: ten draws of how one differs from the next, made once from a seed of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SEED = 20_231_107
COUNT = 10


@dataclass(frozen=True)
class Variation:
    """How a robot, its floor and its start differ from the nominal ones; the defaults are nominal.

    Attributes
    ----------
    motor_difference
        Right motor's gain minus the left one's, over their mean.
    dry_friction, battery
        Of the nominal friction torque and voltage.
    grip
        The tyres' coefficient of friction.
    white_pct, black_pct
        What the colour sensor reads on bare floor and on the line [%].
    noise_pct
        Standard deviation of a reading before rounding [%].
    start
        How far the start lies ahead [m], to the left [m] and turned to the left [rad].
    seed
        Of the readings' noise.
    """

    motor_difference: float = 0.0
    dry_friction: float = 1.0
    battery: float = 1.0
    grip: float = 0.9
    white_pct: float = 100.0
    black_pct: float = 0.0
    noise_pct: float = 0.0
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    seed: int = 0


NOMINAL = Variation()


def draw(count: int = COUNT, seed: int = SEED) -> list[Variation]:
    """Draw variations; the first few are the same whatever their number.

    Parameters
    ----------
    count
        How many.
    seed
        Of the draw.
    """
    return [_drawn(np.random.default_rng([seed, k]), k) for k in range(count)]


def _drawn(rng: np.random.Generator, k: int) -> Variation:
    """Motors 2 %, battery 4 %, start 5 mm and 2 degrees (standard deviations); friction, grip and levels uniform."""
    return Variation(
        motor_difference=0.02 * rng.standard_normal(),
        dry_friction=rng.uniform(0.6, 1.6),
        battery=1.0 + 0.04 * rng.standard_normal(),
        grip=rng.uniform(0.6, 0.9),
        white_pct=rng.uniform(85.0, 100.0),
        black_pct=rng.uniform(0.0, 8.0),
        noise_pct=1.0,
        start=(
            0.005 * rng.standard_normal(),
            0.005 * rng.standard_normal(),
            np.radians(2.0) * rng.standard_normal(),
        ),
        seed=k + 1,
    )
