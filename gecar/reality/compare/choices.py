"""Why an effect was taken and not another: what each, fitted in its place, leaves on the recordings set aside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gecar.reality.compare.side_by_side import (
    READING,
    WHEELS,
    Beside,
    beside,
    measure_of,
    root_mean,
    side_by_side,
)
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost_of_each
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.problem import Problem
from gecar.reality.verdict import Verdict

MOST_RIVALS = 5
LEAST_TAKEN = 0.05  # of what is off: a rival that takes less away needs no bar


class Rival(NamedTuple):
    """What an effect leaves in place of the one that was taken, in the choice's unit."""

    effect: str
    left: float
    taken: bool


class Choice(NamedTuple):
    """One choice: its measure, what was off before, what each candidate leaves, the best first, and of how many."""

    measure: str
    before: float
    rivals: tuple[Rival, ...]
    tried: int

    @property
    def lead(self) -> float:
        """What the best of the others leaves, as a multiple of what the one taken does; 0 if that is not known."""
        taken = [r.left for r in self.rivals if r.taken]
        others = [r.left for r in self.rivals if not r.taken]
        ratio = min(others) / max(taken[0], 1e-9) if taken and others else 0.0
        return ratio if math.isfinite(ratio) else 0.0

    @property
    def telling(self) -> list[Rival]:
        """The one that was taken, and those that take a visible share away."""
        return [r for r in self.rivals if r.taken or r.left < (1.0 - LEAST_TAKEN) * self.before]


class Told(NamedTuple):
    """What was replayed to tell a verdict: recordings beside their simulation, and what candidates leave."""

    shown: tuple[Beside, ...]
    choices: tuple[Choice, ...]


def tell(verdict: Verdict) -> Told:
    """Replay what a verdict's words and pictures show."""
    return Told(side_by_side(verdict), choices(verdict))


def choices(verdict: Verdict) -> tuple[Choice, ...]:
    """Return what candidates leave on the recordings set aside, choice by choice, in the order they were taken.

    In the measure that tells best why: a late camera explains where the robot was seen as well as late motors do, but
    not when the wheels turned. Where nothing was taken and something is left, what the best candidates would leave.
    """
    evidence, out = verdict.evidence, list[Choice]()
    of_motion = measure_of(replace(verdict, effects=(), located=()))
    in_motion = tuple(dict.fromkeys((of_motion, WHEELS)))
    for explained, measures in ((evidence.motion, in_motion), (evidence.sensing, (READING,))):
        if explained is None or not explained.tried:
            continue
        taken = [
            (step, explained.tried[min(step.stage, len(explained.tried) - 1)]) for step in explained.steps
        ]
        if not taken and explained.unexplained:
            taken = [(None, explained.tried[0])]
        for step, tried in taken:
            base, models = _candidates(explained.problem, step, tried)
            told = [_choice(explained.problem, evidence.held, each, step, base, models) for each in measures]
            choice = max(told, key=lambda each: each.lead)  # the first of those that tell as much
            if choice.rivals:
                out.append(choice)
    return tuple(out)


def _candidates(
    problem: Problem, step: Step | None, tried: tuple[Step, ...]
) -> tuple[Model, dict[str, Model]]:
    """Return the model before an effect was taken, and those with it or a runner-up on top, by effect."""
    first = step or (tried[0] if tried else None)
    base = first.base if first else problem.known
    models = {other.effect: other.model for other in tried if set(base.effects) == set(other.base.effects)}
    models |= {step.effect: step.model} if step else {}
    missing = [e for e in problem.catalogue if e not in models and e not in base.effects]
    return base, models | _fitted(problem, base, missing, MOST_RIVALS - len(models))


def _choice(
    problem: Problem,
    held: Residuals,
    measure: str,
    step: Step | None,
    base: Model,
    models: Mapping[str, Model],
) -> Choice:
    """Return what an effect and its runners-up leave by a measure."""
    before = _left(held, base, measure)
    rivals = [
        Rival(effect, _left(held, model, measure), step is not None and effect == step.effect)
        for effect, model in models.items()
    ]
    ordered = tuple(sorted(rivals, key=lambda rival: rival.left)[:MOST_RIVALS])
    return Choice(measure, before, ordered, len(problem.catalogue) - len(base.effects))


def _fitted(problem: Problem, base: Model, effects: list[str], count: int) -> dict[str, Model]:
    """Return the most promising effects fitted on top of a model, with nothing taken for noise but the sensors'."""
    estimator = problem.estimator.under(None)
    estimator.sensitivities(base, effects)  # all at once, in lock step
    gains = {effect: estimator.linear_gain(base, effect) for effect in effects}
    found = {}
    for effect in sorted(effects, key=lambda e: -gains[e])[: max(count, 0)]:
        starts = estimator.starts(base, effect)
        if starts:
            best = starts[int(np.argmin(cost_of_each(estimator.trial(base, effect), starts)))]
            found[effect] = estimator.fit((*base.effects, effect), {**base.values, effect: best})
    return found


def _left(held: Residuals, model: Model, measure: str) -> float:
    """Return what a model is off by on recordings set aside, root mean square over them."""
    shown = [beside(run, run, model.physics, model.physics, True) for run in held.recordings]
    return root_mean(np.array([each.off(measure).after for each in shown if each.has(measure)]))
