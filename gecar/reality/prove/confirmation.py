"""Whether each effect gains on the recordings set aside, against the others refitted without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.model_tolerance import without_tolerated
from gecar.reality.selection.stepwise import Explanation, is_unexplained


@dataclass(frozen=True)
class Confirmation:
    """What of an explanation the recordings set aside confirm.

    Attributes
    ----------
    explained
        The explanation with the effects that gain there; each step has its ``holdout_gain``.
    candidates
        Effects that do not: proved where they were fitted, and no findings.
    """

    explained: Explanation
    candidates: tuple[Step, ...]


def confirmed(explained: Explanation, held: Residuals) -> Confirmation:
    """Drop, one by one, the effects without which recordings set aside fit as well, and refit the others.

    Parameters
    ----------
    explained
        Of the recordings fitted on.
    held
        Residuals of the same kind, of the recordings set aside.
    """
    candidates = list[Step]()
    while explained.steps and held.recordings:
        with_all = _held_cost(explained, held, explained.taken)
        steps = [
            replace(step, holdout_gain=_held_cost(explained, held, _without(explained, step)) - with_all)
            for step in explained.steps
        ]
        explained = replace(explained, steps=tuple(steps))
        worst = min(steps, key=lambda step: step.holdout_gain)
        if worst.holdout_gain > 0.0:
            break
        candidates.append(worst)
        explained = dropped(explained, worst)
    return Confirmation(explained, tuple(candidates))


def dropped(explained: Explanation, step: Step) -> Explanation:
    """Return an explanation without an effect, the others refitted; the robot's own value of it comes back."""
    problem, taken = explained.problem, _without(explained, step)
    left = without_tolerated(problem, taken)
    steps = tuple(s for s in explained.steps if s.effect != step.effect)
    return replace(explained, taken=taken, left=left, steps=steps, unexplained=is_unexplained(problem, left))


def _without(explained: Explanation, step: Step) -> Model:
    rest = [effect for effect in explained.taken.effects if effect != step.effect]
    return explained.problem.estimator.fit(rest, explained.taken.values)


def _held_cost(explained: Explanation, held: Residuals, model: Model) -> float:
    if explained.problem.clocks_fitted and not held.sensor:
        return with_fitted_clocks(held, model.physics)[1]
    return cost(held.errors(model.physics))
