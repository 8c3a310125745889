"""Robots as they come: each a little different from the nominal one, and set down a little differently."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gecar.errors import expected
from gecar.world.course import Pose
from gecar.world.rollout import Noise, World

MOST = 10_000


def perturbed(world: World, count: int, seed: int = 0) -> tuple[World, ...]:
    """Return a world's robot and start as they may really be, each drawn on its own.

    Spreads: motors 2 % apart (standard deviation), dry friction 0.6 to 1.6 of nominal, battery 4 % around its level,
    grip 0.6 to 0.9, white read as 85 to 100 and black as 0 to 8 %, readings noisy by 1 %, start 5 mm and 2 degrees off.
    Sources: step fits of five EV3 motors (gain 6.7 to 12 deg/s per percent, Coulomb friction 13 to 50 deg/s, here
    within one robot's life), 7.4 to 9 V over a charge with the mean recalibrated, white 50 to 98 and black 2 to 10 %
    before, and within this after, calibration.

    Parameters
    ----------
    world
        The nominal one.
    count
        How many.
    seed
        Where they come from; the first ones of a seed are always the same.

    Raises
    ------
    InputError
        If the count is not 0 to 10,000.
    """
    if not 0 <= count <= MOST:
        raise expected("perturbed robots", count, f"0 to {MOST}")
    return tuple(_one(world, np.random.default_rng((seed, k))) for k in range(count))


def _one(world: World, rng: np.random.Generator) -> World:
    robot, course = world.robot, world.course
    white, black = rng.uniform(85.0, 100.0), rng.uniform(0.0, 8.0)
    nominal = robot.colour_sensor.white - robot.colour_sensor.black
    gain = (white - black) / nominal
    changed = robot.with_effects(
        {
            "motor_gain_asymmetry": {"right_minus_left": float(np.clip(0.02 * rng.normal(), -0.1, 0.1))},
            "coulomb_friction": {"torque_nm": robot.motor.coulomb_friction * float(rng.uniform(0.6, 1.6))},
            "supply_voltage": {"scale": float(np.clip(1.0 + 0.04 * rng.normal(), 0.8, 1.2))},
            "tyre_friction": {"coefficient": float(rng.uniform(0.6, 0.9))},
            "sensor_gain": {
                "gain": float(gain),
                "offset_pct": float(black - gain * robot.colour_sensor.black),
            },
        }
    )
    x, y = 0.005 * rng.normal(size=2)
    start = Pose(
        course.start.x_m + float(x),
        course.start.y_m + float(y),
        course.start.heading_rad + float(np.radians(2.0) * rng.normal()),
    )
    noise = Noise(max(world.noise.sensor_pct, 1.0), world.noise.motor_share)
    return replace(world, robot=changed, course=course.starting(start), noise=noise)
