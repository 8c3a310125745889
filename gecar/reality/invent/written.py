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
from gecar.reality.selection.stepwise import Explanation, left_by
from gecar.reality.selection.thresholds import SEVERAL
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
    """Return laws with one more, all constants fitted together anew, and what is left then."""
    effects = library.model.effects
    parameters = free(first.problem.estimator.robot, effects)
    terms, start = (*written.terms, *law.terms), law.minimum.z[: parameters.size]
    return written_with(written, first, together(first, library.problem, terms, effects, start))


class Together(NamedTuple):
    """Laws and effects whose constants were fitted together: both, the effects' values, and what they cost."""

    terms: tuple[Term, ...]
    effects: tuple[str, ...]
    values: Effects
    cost: float


def together(
    first: Explanation, under: Problem, terms: tuple[Term, ...], effects: Sequence[str], start: Array
) -> Together:
    """Fit all constants of laws and effects; these begin at the vector ``start``, under a problem's discrepancy."""
    parameters = free(first.problem.estimator.robot, effects)
    together = FreeTerms(parameters, start, terms)
    residual = under.estimator.residual(together)
    found = least_squares(residual, together.z, together.bounds, together.probes, ROUNDS)
    values = parameters.values(found.z[: parameters.size])
    return Together(together.fitted(found.z), tuple(effects), values, found.cost)


def written_with(
    written: Written, first: Explanation, fitted: Together, under: Problem | None = None
) -> Written:
    """Return laws as they were fitted together with effects, and what is left then; ``under`` as `_explained_with`."""
    explained = _explained_with(first, fitted.terms, fitted.effects, fitted.values, under)
    return replace(written, explained=explained, terms=fitted.terms)


def fitted_without(written: Written, first: Explanation, step: Step) -> Together:
    """Fit laws and effects without one of these, beginning with what they are, under the same discrepancy."""
    here = written.explained
    rest = [effect for effect in here.taken.effects if effect != step.effect]
    start = free(first.problem.estimator.robot, rest).vector(here.taken.values)
    return together(first, here.problem, written.terms, rest, start)


def _explained_with(
    first: Explanation,
    terms: Sequence[Term],
    effects: Sequence[str],
    values: Effects,
    under: Problem | None = None,
) -> Explanation:
    """Return an explanation of a robot that has more terms, with some of the effects; ``under`` another's discrepancy.

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
    before = first.problem.sizes.left(first.problem.known.physics, repeatedly=True)
    now, was = (problem.material.times(size) for size in (left, before))
    return replace(
        first,
        problem=problem,
        taken=model,
        steps=tuple(step for step in first.steps if step.effect in effects),
        minor=(),
        whole=model,
        left=left,
        unexplained=now > SEVERAL and now / max(was, 1.0) > LAWS_LEAVE,
    )


def with_constants_of(written: Written, first: Explanation) -> tuple[Invented, ...]:
    """Return what the verdict says of laws, with their constants and intervals as they were fitted together last."""
    model, problem = written.explained.taken, written.explained.problem
    parameters = free(first.problem.estimator.robot, model.effects)
    together = FreeTerms(parameters, model.z, written.terms)
    residual = problem.estimator.residual(together)
    slopes = jacobian(residual, together.z, model.errors, together.probes, together.bounds[1])
    half = half_widths_of(slopes, model.errors, problem.estimator.blocks)[parameters.size :]
    intervals: list[dict[str, Interval]] = [{} for _ in written.terms]
    for c, reach in zip(together.constants, half.tolist(), strict=True):
        ends = sorted(float(c.at(side * min(reach, FARTHEST))) for side in (-1.0, 1.0))
        intervals[c.term][c.name] = Interval(c.value, ends[0], ends[1], "")
    for term, known in zip(written.terms, intervals, strict=True):
        fixed = {name: value for name, value in term.constants.items() if name not in known}
        known |= {name: Interval(value, value, value, "") for name, value in fixed.items()}
    told = zip(written.invented, written.terms, intervals, strict=True)
    return tuple(
        replace(law, term=term, parameters=found, looks_like=looks_like(term)) for law, term, found in told
    )
