"""Laws written on top of an explanation, their constants fitted together with those of effects beside them.

``first`` is everywhere the explanation without any law: of the robot as it is known, with the effects named so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Effects, Model, Step
from gecar.reality.fitting.parameters import free
from gecar.reality.invent.free_terms import FARTHEST, FreeTerms
from gecar.reality.invent.looks import looks_like
from gecar.reality.invent.search import Law, Library
from gecar.reality.optimisation.least_squares import jacobian, least_squares
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.stepwise import Explanation, is_much, left_before, left_by
from gecar.reality.uncertainty.intervals import half_widths_of
from gecar.reality.verdict import Interval, Invented
from gecar.world.terms import Term

Array = npt.NDArray[np.float64]

LAWS_LEAVE = 0.15  # share of the error without any: a law has not the cause's own form
ROUNDS = 6


@dataclass(frozen=True)
class Written:
    """Laws written on top of an explanation.

    Attributes
    ----------
    explained
        The explanation with the robot that has them, and what is left then.
    terms
        The laws, their constants fitted together.
    invented
        What the verdict says of each.
    """

    explained: Explanation
    terms: tuple[Term, ...]
    invented: tuple[Invented, ...]


def added(written: Written, first: Explanation, library: Library, law: Law) -> Written:
    """Return the laws with one more, all constants fitted again together, and what they leave unexplained."""
    terms, start = (*written.terms, *law.terms), law.minimum.z[: law.parameters.model.size]
    return written_with(written, first, together(first, library.problem, terms, library.model.effects, start))


class Together(NamedTuple):
    """Laws and effects that were fitted together: the effects' values, and the whitened residuals with their cost."""

    terms: tuple[Term, ...]
    effects: tuple[str, ...]
    values: Effects
    errors: Array
    cost: float


def together(
    first: Explanation, under: Problem, terms: tuple[Term, ...], effects: Sequence[str], start: Array
) -> Together:
    """Fit the constants of laws and effects under a problem's discrepancy; those of effects begin at ``start``."""
    parameters = free(first.problem.estimator.robot, effects)
    both = FreeTerms(parameters, start, terms)
    found = least_squares(under.estimator.residual(both), both.z, both.bounds, both.probes, ROUNDS)
    values = parameters.values(found.z[: parameters.size])
    return Together(both.fitted(found.z), tuple(effects), values, found.errors, found.cost)


def written_with(
    written: Written, first: Explanation, fitted: Together, under: Problem | None = None
) -> Written:
    """Return laws and effects as they were fitted, and what they leave; ``under`` as in `_explained_with`."""
    explained = _explained_with(first, fitted.terms, fitted.effects, fitted.values, under)
    return replace(written, explained=explained, terms=fitted.terms)


def fitted_without(written: Written, first: Explanation, step: Step) -> Together:
    """Fit laws and effects again without one of the effects, from their present values, under the same discrepancy."""
    here = written.explained
    rest = [effect for effect in here.taken.effects if effect != step.effect]
    start = free(first.problem.estimator.robot, rest).vector(here.taken.values)
    return together(first, here.problem, written.terms, rest, start)


def fitted_with(written: Written, first: Explanation, terms: tuple[Term, ...]) -> Together:
    """Fit other laws beside the same effects, from their present values, under the same discrepancy."""
    here = written.explained
    return together(first, here.problem, terms, here.taken.effects, here.taken.z)


def _explained_with(
    first: Explanation,
    terms: Sequence[Term],
    effects: Sequence[str],
    values: Effects,
    under: Problem | None = None,
) -> Explanation:
    """Return the explanation by a robot with laws and some of the effects, under its own discrepancy or ``under``'s.

    What was too small for a name beside the unexplained is not looked at again.
    """
    problem = first.problem
    robot = problem.estimator.robot
    robot = robot.with_terms([*robot.term, *terms])
    estimator = Estimator(problem.residuals, robot, problem.estimator.rng)
    others = under.estimator.discrepancy if under else None
    problem = replace(problem, estimator=estimator.under(others), place=(), kept={})
    parameters = free(robot, effects)
    bare = replace(first.taken, effects=tuple(effects), parameters=parameters)
    model: Model = problem.estimator.at(bare, parameters.vector(values))
    problem = problem if under else problem.under(model)
    model = problem.estimator.at(model, model.z)
    left = left_by(problem, model)
    return replace(
        first,
        problem=problem,
        taken=model,
        steps=tuple(step for step in first.steps if step.effect in effects),
        minor=(),
        whole=model,
        left=left,
        unexplained=is_much(problem, problem.material.times(left), left_before(first.problem), LAWS_LEAVE),
    )


def with_constants_of(written: Written, first: Explanation) -> tuple[Invented, ...]:
    """Return what the verdict says of laws, with the constants of their last fit and their intervals."""
    model, problem = written.explained.taken, written.explained.problem
    parameters = free(first.problem.estimator.robot, model.effects)
    both = FreeTerms(parameters, model.z, written.terms)
    half = half_widths_of_constants(problem, both, both.z, model.errors)
    intervals: list[dict[str, Interval]] = [{} for _ in written.terms]
    for c, reach in zip(both.constants, half.tolist(), strict=True):
        ends = sorted(float(c.at(side * min(reach, FARTHEST))) for side in (-1.0, 1.0))
        intervals[c.term][c.name] = Interval(c.value, ends[0], ends[1], "")
    for term, known in zip(written.terms, intervals, strict=True):
        fixed = {name: value for name, value in term.constants.items() if name not in known}
        known |= {name: Interval(value, value, value, "") for name, value in fixed.items()}
    told = zip(written.invented, written.terms, intervals, strict=True)
    return tuple(
        replace(_as_written(law, term, written), term=term, parameters=found, looks_like=looks_like(term))
        for law, term, found in told
    )


def half_widths_of_constants(problem: Problem, free: FreeTerms, z: Array, errors: Array) -> Array:
    """Return half the 95 % intervals of laws' constants, in coordinates, shape (constants,).

    ``z`` is the vector of the fit, and ``errors`` are its whitened residuals.
    """
    slopes = jacobian(problem.estimator.residual(free), z, errors, free.probes, free.bounds[1])
    return half_widths_of(slopes, errors, problem.estimator.blocks)[free.model.size :]


def _as_written(law: Invented, term: Term, written: Written) -> Invented:
    """Return a law's entry with the ranges of the variables it still uses, and with what it does to the robot now.

    When it was added it may have taken the place of an effect, and have changed little.
    """
    problem, model = written.explained.problem, written.explained.taken
    robot = problem.estimator.robot
    rest = robot.with_terms([each for each in robot.term if each != term]).with_effects(model.values)
    seen = {name: law.range[name] for name in term.parsed.variables}
    return replace(law, range=seen, size=problem.sizes.apart(model.physics, rest.physics))
