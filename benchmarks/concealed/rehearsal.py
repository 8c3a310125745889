"""Drive a case's tasks without writing anything, to learn how much a robot differs from another."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.detectability import visibility
from benchmarks.concealed.history import Array, History, Pose, replayed
from benchmarks.concealed.recording import CHANNELS, Conditions, channels, even_ticks
from benchmarks.concealed.robot import Concealed
from benchmarks.concealed.sizes import size
from benchmarks.concealed.worlds import truth

_WEAKEST, _STRONGEST = -3.5, 1.0  # shares of the log range within which a strength is sought
_LOG_RANGE = math.log(12.0)  # of a typical effect, for the first step
_CLOSE = 0.15  # of the logarithm of d'
_TRIES = 6
_TRACELESS = 1.0  # d' that counts as none


@dataclass(frozen=True)
class Act:
    """One recording's commands, given to a robot that conceals nothing."""

    start: Pose
    commands: Array
    camera_offset_s: float


class Rehearsal:
    """Some of a case's tasks, and what the robot that conceals nothing makes of them.

    Parameters
    ----------
    world
        Name of the world.
    absent
        The robot that conceals nothing.
    acts
        What it is told to do.
    seconds
        Length of each.
    conditions
        Noise, columns and rates by which differences are judged.
    """

    def __init__(
        self, world: str, absent: Concealed, acts: Sequence[Act], seconds: float, conditions: Conditions
    ) -> None:
        self._world, self._absent, self._acts, self._seconds = world, absent, acts, seconds
        self._conditions = conditions
        self._without = [self._driven(absent, act) for act in acts]

    @property
    def histories(self) -> list[History]:
        """The runs of the robot that conceals nothing, one an act."""
        return self._without

    def d_prime(self, robots: Sequence[Concealed]) -> float:
        """Give the size of the difference that one robot an act makes, as the best linear detector has it."""
        worlds: dict[str, Array] = {}
        for k, (there, absent) in enumerate(self.pairs(robots)):
            worlds |= {f"run{k}_on": there, f"run{k}_off": absent}
        return visibility(worlds, "on", "off", self._conditions).d_prime

    def size(self, robots: Sequence[Concealed]) -> dict[str, float]:
        """Give the same difference in millimetres, degrees and percent."""
        return size(self.pairs(robots))

    def pairs(self, robots: Sequence[Concealed]) -> list[tuple[Array, Array]]:
        """Give the channels with and without what is concealed, of one robot an act."""
        found = []
        for act, robot, without in zip(self._acts, robots, self._without, strict=True):
            history = self._driven(robot, act)
            light = along(history, self._absent)
            there = self._channels(history, robot, act)
            found.append((there, self._channels(replace(without, light=light), self._absent, act)))
        return found

    def _driven(self, robot: Concealed, act: Act) -> History:
        ticks = self._conditions.row_ticks
        commands = replayed(act.commands, ticks)
        return truth(self._world, robot).run(act.start, commands, self._seconds, turn_ticks=ticks)

    def _channels(self, history: History, robot: Concealed, act: Act) -> Array:
        rows = even_ticks(history, self._conditions.row_ticks)
        return stacked(channels(history, robot, act.camera_offset_s, rows))


def along(history: History, other: Concealed) -> Array:
    """Let another robot's sensor look along this run's path, so that sensor and motion effects stay apart."""
    sensor = ColourSensor(other)
    return np.array([sensor.look(*pose) for pose in history.pose.tolist()])


def stacked(clean: dict[str, Array]) -> Array:
    """Put channels side by side (rows, channels), in the order of ``CHANNELS``."""
    return np.column_stack([clean[name] for name in CHANNELS])


def tuned(d_prime: Callable[[float], float], target: float) -> float:
    """Find a strength that is about as visible as wanted.

    Parameters
    ----------
    d_prime
        From a share of the strengths' log range to d'.
    target
        The d' wanted.

    Returns
    -------
    float
        Of the shares tried, none stronger than the range's upper end, the one that came closest. The secant method,
        as d' is roughly a power of the strength; halving between a share too weak and one too strong where it is not:
        a limit that is never reached leaves no trace at all.
    """
    share, slope, tried = 0.5, _LOG_RANGE, dict[float, float]()
    for _ in range(_TRIES):
        off = math.log(max(d_prime(share), _TRACELESS) / target)
        if tried:
            last, off_last = next(reversed(tried.items()))
            slope = min(max((off - off_last) / (share - last), _LOG_RANGE / 4.0), _LOG_RANGE * 4.0)
        tried[share] = off
        if abs(off) < _CLOSE:
            break
        weaker = max((one for one, miss in tried.items() if miss < 0.0), default=_WEAKEST)
        stronger = min((one for one, miss in tried.items() if miss > 0.0), default=_STRONGEST)
        share = share - off / slope
        if not weaker < share < stronger:
            share = (
                (weaker + stronger) / 2.0
                if {weaker, stronger} <= set(tried)
                else min(max(share, weaker), stronger)
            )
        if share in tried:
            break
    seen = {one: miss for one, miss in tried.items() if miss > math.log(1.5 * _TRACELESS / target)}
    return min(seen, key=lambda one: abs(seen[one])) if seen else _STRONGEST
