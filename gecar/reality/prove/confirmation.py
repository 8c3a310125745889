"""Whether the recordings set aside confirm each effect, against the others refitted without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.acceptance import worsens
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import UNSEEN, Share, share_asked_for
from gecar.reality.selection.stepwise import Explanation, concluded
from gecar.reality.selection.thresholds import MAIN_SHARE
from gecar.world.effects import BY_ID

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
    it was fitted, predicts worse than none (`share_asked_for`). A place on the floor that none of them passes stays.
    Whole drives must not come out worse with the effect; where much is left that nothing explains, they must come out
    better.

    Parameters
    ----------
    explained
        Of the recordings fitted on.
    held
        Residuals of the same kind, of the recordings set aside.
    """
    candidates = list[Step]()
    while explained.steps and held.recordings:
        with_all = _held_errors(explained, held, explained.taken, explained.taken)
        without = {s.effect: _without(explained.problem, explained.taken, s) for s in explained.steps}
        judged = [_judged(explained, held, step, without[step.effect], with_all) for step in explained.steps]
        explained = replace(explained, steps=tuple(step for step, _ in judged))
        shown = [(s, share) for s, share in judged if not (share is UNSEEN and BY_ID[s.effect].at_a_place)]
        failing = [pair for pair in shown if pair[1].margin <= 0.0]
        if failing:
            worst, _ = min(failing, key=lambda pair: pair[1].margin)
        else:
            useless = [step for step, _ in shown if not _helps(explained, held, without[step.effect])]
            if not useless:
                break
            worst = useless[0]
        candidates.append(worst)
        explained = dropped(explained, worst)
    return Confirmation(explained, tuple(candidates))


def _judged(
    explained: Explanation, held: Residuals, step: Step, without: Model, with_all: Array
) -> tuple[Step, Share]:
    """Return a step with what it gains on recordings set aside, and the share of it they ask for.

    Without the effect, all other constants may differ a little as with it, or as they would without it: in the first
    case what they make up for would speak for the effect, in the second what they make up would. The less counts.
    ``without`` is the model without it; ``with_all`` are the residuals under all steps, shape (n,).
    """
    left = [_held_errors(explained, held, without, beside) for beside in (explained.taken, without)]
    gain = cost(left[0]) - cost(with_all)
    shares = [share_asked_for(held.index, errors, with_all) for errors in left]
    unseen = shares[0] is UNSEEN
    return replace(step, holdout_gain=gain), UNSEEN if unseen else min(shares, key=lambda share: share.margin)


def _helps(explained: Explanation, held: Residuals, without: Model) -> bool:
    """Whether whole drives set aside come out no worse with an effect; or much better, where much is unexplained."""
    problem, sizes = explained.problem, explained.problem.sizes.of(held)
    if not explained.unexplained:
        return not worsens(problem, without, explained.taken, sizes)
    beside = (problem.with_small_changes(model, explained.taken) for model in (explained.taken, without))
    now, before = (problem.material.times(sizes.left(physics)) for physics in beside)
    return now**2 < (1.0 - MAIN_SHARE) * before**2


def dropped(explained: Explanation, step: Step) -> Explanation:
    """Return an explanation without an effect, the others refitted; the robot's own value of it comes back."""
    steps = [s for s in (*explained.steps, *explained.minor) if s.effect != step.effect]
    model = _without(explained.problem, explained.whole, step)
    return concluded(explained.problem, model, steps, explained.tried)


def _without(problem: Problem, model: Model, step: Step) -> Model:
    rest = [effect for effect in model.effects if effect != step.effect]
    return problem.under(model, rest).estimator.fit(rest, model.values)


def _held_errors(explained: Explanation, held: Residuals, model: Model, beside: Model) -> Array:
    """Return a model's residuals of recordings set aside, with small changes as a model asks for."""
    physics = explained.problem.with_small_changes(model, beside)
    if explained.problem.clocks_fitted and not held.sensor:
        held = with_fitted_clocks(held, physics)[0]
    return held.errors(physics)
