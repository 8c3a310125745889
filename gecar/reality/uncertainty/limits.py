"""Limits: the smallest size of each effect that recordings would have shown, as upper limits are given in physics.

An effect of a certain size is added to the robot found. What that changes in the recordings' residuals, beside small
changes of all constants and in units of the noise, is what it would gain: half its square, give or take a normal number
times its root. The limit is the size at which that passes the price of a name in 95 of 100 cases, and which is worth a
name and material. A patch's holds for nine of ten places where the robot has been.

Sources: Feldman and Cousins, Physical Review D 57 (1998) 3873 (sensitivity: the limit where nothing is there); the
noncentral chi-square of a matched filter, Kay, Fundamentals of Statistical Signal Processing II (1998), ch. 4.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.initial_values import initial_values, patches
from gecar.reality.fitting.model import Model
from gecar.reality.fitting.parameters import Parameters, free
from gecar.reality.optimisation.least_squares import costs
from gecar.reality.selection.acceptance import worthwhile
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import PRICE
from gecar.reality.verdict import Limit
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]

LARGEST = 60.0  # of the catalogue's sizes: more than any bound
TRIED = 12  # sizes
SURE = 1.645  # 95 % quantile of a normal distribution
NEEDED = np.sqrt(2.0 * PRICE) + SURE
MOST_PLACES = 10  # on the floor, where an effect has one
SEEN_PLACES = 0.9  # share of them that must show it
MARGIN = 1.15  # on the size: what a limit is computed with is a little off, too


def limits(problem: Problem, model: Model) -> dict[str, Limit | None]:
    """Return the limit of every effect of a problem that a model does not hold; None where any size would pass unseen.

    Parameters
    ----------
    problem, model
        The problem, under the discrepancy the model leaves.
    """
    return {
        effect: _limit(problem, model, effect) for effect in problem.catalogue if effect not in model.effects
    }


def _limit(problem: Problem, model: Model, effect: str) -> Limit | None:
    parameters = free(problem.estimator.robot, (*model.effects, effect))
    k = next(k for k, c in enumerate(parameters.coordinates) if c.effect.id == effect)
    c, low, high = parameters.coordinates[k], *(float(bound[k]) for bound in parameters.bounds)
    sides = [side for side, room in ((1.0, high), (-1.0, -low)) if room > problem.share(c.parameter)]
    found = [
        max((_smallest(problem, parameters, shape, k, side) for side in sides), key=abs)
        for shape in _shapes(problem, model, parameters, effect)
    ]
    z = sorted(found, key=abs)[math.ceil(SEEN_PLACES * len(found)) - 1]
    if math.isinf(z):
        return None
    return Limit(float(c.value(z) if c.inverse else abs(c.value(z) - c.neutral)), c.parameter.unit)


def _shapes(problem: Problem, model: Model, parameters: Parameters, effect: str) -> list[Array]:
    """Return a model's coordinates with an effect's shape: as searches begin, or at several places on the floor."""
    tried: Sequence[Mapping[str, float]] = ()
    if BY_ID[effect].at_a_place:
        tried = patches(problem.recordings, MOST_PLACES)
    elif any(p.worthwhile == 0.0 for p in BY_ID[effect].parameters[1:]):
        trial = problem.estimator.trial(model, effect)
        tried = list(initial_values(effect, problem.estimator.robot, problem.recordings, trial))[:1]
    return [parameters.vector({**model.values, effect: values}) for values in tried or ({},)]


def _smallest(problem: Problem, parameters: Parameters, start: Array, k: int, side: float) -> float:
    """Return the smallest value of a coordinate, on one side of neutral, that would be named; infinite: none would."""
    coordinate, (low, high) = parameters.coordinates[k], parameters.bounds
    scale = 1.0 if not coordinate.inverse else high[k] / LARGEST
    sizes = np.geomspace(problem.share(coordinate.parameter), LARGEST, TRIED)
    vectors = np.tile(start, (TRIED + 1, 1))
    vectors[:, k] = np.clip(side * scale * np.r_[0.0, sizes], low[k], high[k])
    none, *some = problem.estimator.residual(parameters)(vectors)
    shown = np.array([_shown(errors - none) for errors in some])
    enough = np.flatnonzero(shown >= NEEDED)
    if not len(enough):
        return math.inf
    for n in range(int(enough[0]), TRIED):
        if worthwhile(parameters, vectors[n + 1], coordinate.effect.id, problem.share) and _material(
            problem, parameters, vectors[0], vectors[n + 1]
        ):
            z = side * scale * _between(sizes, shown, n) if n == enough[0] else vectors[n + 1, k]
            return float(np.clip(MARGIN * z, low[k], high[k]))
    return math.inf


def _between(sizes: Array, shown: Array, n: int) -> float:
    """Return the size at which `NEEDED` is reached, interpolated between the n-th size and the one before."""
    if n == 0 or shown[n] <= shown[n - 1]:
        return float(sizes[n])
    share = np.log(NEEDED / max(shown[n - 1], 1e-9)) / np.log(shown[n] / max(shown[n - 1], 1e-9))
    return float(sizes[n - 1] * (sizes[n] / sizes[n - 1]) ** np.clip(share, 0.0, 1.0))


def _shown(change: Array) -> float:
    """Return how far two robots' residuals part, in standard deviations; large residuals count as in costs."""
    return float(np.sqrt(2.0 * np.sum(costs(change))))


def _material(problem: Problem, parameters: Parameters, without: Array, with_it: Array) -> bool:
    size = problem.sizes.apart(parameters.physics(without), parameters.physics(with_it))
    return problem.material.times(size) >= 1.0
