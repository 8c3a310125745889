"""How far an adversary gets: commands found by search that carry the outer wheel as far as they can."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.reference_times import UNREACHED, Search
from gecar.compiled import compiled
from gecar.reality.optimisation.cma_es import cma_es
from gecar.world.course.course import Course
from gecar.world.course.lower_bound.fastest_time import sprint, travelled
from gecar.world.kernel.chipmunk import NO_ENGINE
from gecar.world.kernel.drive import advance
from gecar.world.kernel.sensing import RING
from gecar.world.kernel.state import DERIVED, STATE, derive, place
from gecar.world.robot import Robot


@compiled
def _outer_wheel(duties, hold, half_track, p, c, s, dt, commands, engine):
    derive(p, dt, c)
    place(s, p, 0.0, 0.0, 0.0)
    x, y, heading, outer = 0.0, 0.0, 0.0, 0.0
    for n in range(duties.shape[0] * hold):
        advance(n, s, duties[n // hold, 0], duties[n // hold, 1], p, c, commands, engine)
        dx, dy = s.x - p.com_ahead * s.cos - x, s.y - p.com_ahead * s.sin - y
        middle = 0.5 * (s.heading + heading)
        outer += abs(dx * math.cos(middle) + dy * math.sin(middle)) + half_track * abs(s.heading - heading)
        x, y, heading = x + dx, y + dy, s.heading
    return outer, math.sqrt(x * x + y * y)


def beyond_the_bound(robot: Robot, duties, seconds: float, dt: float = 0.002) -> tuple[float, float]:
    """Return how much farther than the bound allows the outer wheel, and the robot, come under commands [m].

    `duties` are held one after the other, shape (k, 2).
    """
    hold = max(1, round(seconds / dt / len(duties)))
    time_s = hold * len(duties) * dt
    fast, p = sprint(robot, time_s), robot.physics
    half_track = 0.5 * p["track_width"][0] * p["track_scale"][0] * max(1.0 - fast.exchange, 0.0)
    outer, away = _outer_wheel(
        np.clip(np.asarray(duties, float), -1.0, 1.0), hold, half_track, p[0], np.zeros(1, DERIVED)[0],
        np.zeros(1, STATE)[0], dt, np.zeros(2 * RING), NO_ENGINE,
    )  # fmt: skip
    allowed = travelled(fast, time_s) + fast.play_m
    return outer - allowed, away - allowed


def farthest(robot: Robot, seed: int, seconds: float = 0.6, pieces: int = 5) -> tuple[float, float]:
    """Return the same, the most a search over commands finds of each."""
    return _most(robot, 0, seed, seconds, pieces), _most(robot, 1, seed, seconds, pieces)


def _most(robot: Robot, which: int, seed: int, seconds: float, pieces: int) -> float:
    rng, one = np.random.default_rng(seed), np.ones(2 * pieces)
    found = [
        cma_es(
            lambda vs: np.array([-beyond_the_bound(robot, v.reshape(pieces, 2), seconds)[which] for v in vs]),
            np.tile(start, pieces), 0.5 * one, (-one, one), rng, generations=6, least_gain=1e-4,
        )[1]
        for start in ((1.0, 1.0), (1.0, -0.9), (-1.0, 0.0))
    ]  # fmt: skip
    return -min(found)


def fastest_found(robot: Robot, course: Course, seed: int = 1) -> float:
    """Return the time to GOAL [s] of the fastest drive a short search finds; infinite if it finds none."""
    found = Search(robot, course, longest_s=4.0).best_of(seed, generations=10, wider=1)[0]
    return found if found < UNREACHED else math.inf
