"""Whether the recordings set aside confirm each effect, against the others refitted without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import Share, share_asked_for
from gecar.reality.selection.stepwise import Explanation, concluded
from gecar.reality.selection.thresholds import MAIN_SHARE

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Confirmation:
    """What of an explanation the recordings set aside confirm.

    Attributes
    ----------
    explained
        The explanation with the effects asked for there; each step has its ``holdout_gain``.
    candidates
        Effects that are not: proved where they were fitted, and no findings.
    """

    explained: Explanation
    candidates: tuple[Step, ...]


def confirmed(explained: Explanation, held: Residuals) -> Confirmation:
    """Drop, one by one, the effects the recordings set aside do not ask for, and refit the others.

    They must ask for a share of the effect that is surely more than none, and not surely so small that the effect, as
    it was fitted, predicts worse than none (`share_asked_for`). Where much is left that nothing explains, whole drives
    must come out better with the effect, too.

    Parameters
    ----------
    explained
        Of the recordings fitted on.
    held
        Residuals of the same kind, of the recordings set aside.
    """
    candidates = list[Step]()
    while explained.steps and held.recordings:
        with_all = _held_errors(explained, held, explained.taken)
        judged = [_judged(explained, held, step, with_all) for step in explained.steps]
        explained = replace(explained, steps=tuple(step for step, _ in judged))
        worst, share = min(judged, key=lambda pair: pair[1].margin)
        if share.margin > 0.0:
            useless = [s for s in explained.steps if explained.unexplained and not _helps(explained, held, s)]
            if not useless:
                break
            worst = useless[0]
        candidates.append(worst)
        explained = dropped(explained, worst)
    return Confirmation(explained, tuple(candidates))


def _judged(explained: Explanation, held: Residuals, step: Step, with_all: Array) -> tuple[Step, Share]:
    """Return a step with what it gains on recordings set aside, and the share of it they ask for.

    ``with_all`` are their residuals under all steps, shape (n,).
    """
    without = _held_errors(explained, held, _without(explained.problem, explained.taken, step))
    share = share_asked_for(held.index, without, with_all)
    return replace(step, holdout_gain=cost(without) - cost(with_all)), share


def _helps(explained: Explanation, held: Residuals, step: Step) -> bool:
    """Whether an effect explains a good part of what whole drives set aside leave without it."""
    problem, sizes = explained.problem, explained.problem.sizes.of(held)
    models = explained.taken, _without(problem, explained.taken, step)
    now, before = (
        problem.material.times(sizes.left(problem.with_small_changes(model, explained.taken)))
        for model in models
    )
    return now**2 < (1.0 - MAIN_SHARE) * before**2


def dropped(explained: Explanation, step: Step) -> Explanation:
    """Return an explanation without an effect, the others refitted; the robot's own value of it comes back."""
    steps = [s for s in (*explained.steps, *explained.minor) if s.effect != step.effect]
    model = _without(explained.problem, explained.whole, step)
    return concluded(explained.problem, model, steps, explained.tried)


def _without(problem: Problem, model: Model, step: Step) -> Model:
    rest = [effect for effect in model.effects if effect != step.effect]
    return problem.under(model, rest).estimator.fit(rest, model.values)


def _held_errors(explained: Explanation, held: Residuals, model: Model) -> Array:
    """Return residuals of recordings set aside, with the small changes that recordings fitted to ask for."""
    physics = explained.problem.with_small_changes(model, explained.taken)
    if explained.problem.clocks_fitted and not held.sensor:
        held = with_fitted_clocks(held, physics)[0]
    return held.errors(physics)
