"""Goals of robot programs: time, arrival, energy and length; all are better if lower."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.evolution.scores import UNSOLVED, Scores
from gecar.world.rollout import World

GoalName = Literal["time", "arrival", "energy", "length"]
Floats = npt.NDArray[np.float64]

LEAST_SHARE = 0.5
"""Share of drives in which a program has to arrive where arrival is a goal: below it the median drive has no time."""
MOST_TIME, MOST_W, LONGEST = 3.0, 4.0, 40.0
"""Ends of an archive's ranges: time in multiples of the lower bound; power during twice the lower bound [W], where
winners took 1.8 to 3.8 W; instructions."""


class Goal(NamedTuple):
    """A goal, as tables and pictures name it.

    Attributes
    ----------
    name
        As on the command line.
    field
        Column of front.csv.
    label
        Axis of a picture.
    scale
        Factor that makes the column's values those of the axis.
    """

    name: GoalName
    field: str
    label: str
    scale: float = 1.0


GOALS = {
    goal.name: goal
    for goal in (
        Goal("time", "time_s", "time to GOAL [s]"),
        Goal("arrival", "missed", "drives that miss GOAL [%]", 100.0),
        Goal("energy", "energy_j", "electrical energy [J]"),
        Goal("length", "length", "length [instructions]"),
    )
}


def goals_of(scores: Scores, names: Sequence[str]) -> Floats:
    """Return what programs reach of each goal, inf where they fail (programs, goals).

    Parameters
    ----------
    scores
        Of dtype `gecar.search.fitness.score_type`, with costs (programs,).
    names
        Of `GOALS`. ``time``: merit [s]; ``arrival``: share of the drives so far that miss GOAL; ``energy``: of the
        nominal drive [J]; ``length``: instructions.
    """
    driven = ~np.isnan(scores["drawn_s"])
    missed = np.isinf(scores["drawn_s"]).sum(axis=1) / (1 + driven.sum(axis=1))
    known = {
        "time": scores["merit"],
        "arrival": missed,
        "energy": scores["costs"][:, 0],
        "length": scores["costs"][:, 1],
    }
    values = np.column_stack([known[name] for name in names])
    return np.where((scores["merit"] < UNSOLVED)[:, None], values, np.inf)


def ranges_of(world: World, names: Sequence[str]) -> tuple[tuple[float, float], ...]:
    """Return the range of each goal in an archive (goals,)."""
    bound_s = world.course.lower_bound_s(world.robot)
    ends = {
        "time": (bound_s, MOST_TIME * bound_s),
        "arrival": (0.0, 1.0 - LEAST_SHARE),
        "energy": (0.0, 2.0 * MOST_W * bound_s),
        "length": (0.0, LONGEST),
    }
    return tuple(ends[name] for name in names)
