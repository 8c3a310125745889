"""A motor's own constants on a bench: found together, before anything else, and as few of them as do.

The voltage, two frictions and the inertia give a shaft that carries nothing three numbers: acceleration by duty,
damping and dry friction. Taken one by one, the first would stand in for the others, and what comes later be bent to
make up for it. So all are tried together. Of sets that fit alike the most plausible is taken: motors of one kind, and
batteries, differ by so much (`Parameter.differs`), a normal prior.

Source: penalised choice of one among all subsets, Hastie, Tibshirani, Friedman, The Elements of Statistical Learning
(2nd ed.), ch. 3.3.1 and 7.7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from gecar.reality.fitting.model import Effects, Model
from gecar.reality.selection.acceptance import at_a_bound, is_worthwhile
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import PRICE
from gecar.world.effects import CATALOGUE

CONSTANTS = tuple(effect.id for effect in CATALOGUE if any(p.differs > 0.0 for p in effect.parameters))


def with_constants(problem: Problem, model: Model) -> Model:
    """Return a model with the set of motor constants that costs least, names and prior included.

    Sets of which a bound stopped one, or one is of a size not worth a name, are left out.
    """
    others = [effect for effect in model.effects if effect not in CONSTANTS]
    together = problem.estimator.fit([*_observable(problem), *others], model.values)
    found = [
        fitted
        for names in _subsets(_observable(problem))
        for fitted in _fits(problem, [*names, *others], (together.values, model.values))
        if not at_a_bound(fitted) and all(is_worthwhile(fitted, name) for name in names)
    ]
    return min(found, key=total, default=model)


def total(model: Model) -> float:
    """Return what a model costs with its names, and with its constants as far off as motors differ seldom."""
    return model.cost + PRICE * len(model.effects) + implausibility(model)


def implausibility(model: Model) -> float:
    """Return minus the log of the prior of a model's constants: half their squares, in standard deviations."""
    return sum(
        0.5 * (z * c.parameter.worthwhile / c.parameter.differs) ** 2
        for c, z in zip(model.parameters.coordinates, model.z.tolist(), strict=True)
        if c.parameter.differs > 0.0
    )


def _observable(problem: Problem) -> list[str]:
    return [name for name in CONSTANTS if name in problem.catalogue]


def _subsets(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    for size in range(len(names) + 1):
        yield from combinations(names, size)


def _fits(problem: Problem, effects: Sequence[str], starts: Sequence[Effects]) -> Iterator[Model]:
    """Yield fits of effects from several starts, the robot's own values wherever a start has none."""
    for start in starts:
        yield problem.estimator.fit(effects, start)
