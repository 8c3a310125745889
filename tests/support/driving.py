"""Drive the bare dynamics from Python: what several tests of the world share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gecar.compiled import compiled
from gecar.world.kernel.dynamics import drift, step
from gecar.world.kernel.state import DERIVED, STATE, derive, place
from gecar.world.robot import Robot, load_robot

NOMINAL = load_robot("ev3")


@compiled
def _run(duties, p, c, s, dt, start, history):
    derive(p[0], dt, c[0])
    place(s[0], p[0], start[0], start[1], start[2])
    for n in range(duties.shape[0]):
        step(s[0], duties[n, 0], duties[n, 1], p[0], c[0])
        drift(s[0], c[0])
        history[n] = s[0]


def run(
    duties: Sequence[tuple[float, float]],
    robot: Robot = NOMINAL,
    dt: float = 0.002,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """Return the state after every step, dtype STATE, shape (steps,)."""
    duties = np.ascontiguousarray(duties, dtype=float)
    history = np.zeros(len(duties), STATE)
    _run(
        duties,
        robot.physics,
        np.zeros(1, DERIVED),
        np.zeros(1, STATE),
        dt,
        np.array(start, dtype=float),
        history,
    )
    return history


def hold(left: float, right: float, seconds: float, dt: float = 0.002) -> np.ndarray:
    """Return constant duties for a time."""
    return np.tile([left, right], (round(seconds / dt), 1))


def axle(history: np.ndarray, robot: Robot = NOMINAL) -> np.ndarray:
    """Return the axle centre's path, shape (steps, 2)."""
    ahead = robot.physics["com_ahead"][0]
    return np.column_stack([history["x"] - ahead * history["cos"], history["y"] - ahead * history["sin"]])


def wild_duties(seed: int, seconds: float = 4.0, dt: float = 0.002) -> np.ndarray:
    """Return random commands held for 20 to 300 ms each."""
    rng = np.random.default_rng(seed)
    pieces = []
    while sum(map(len, pieces)) * dt < seconds:
        pieces.append(hold(*rng.integers(-8, 9, 2) / 10.0, rng.integers(2, 31) * 0.01, dt))
    return np.concatenate(pieces)
