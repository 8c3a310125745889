"""Whether the recordings set aside ask for each effect, beside the others refitted without it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.model_tolerance import without_tolerated
from gecar.reality.selection.share import Share, share_asked_for
from gecar.reality.selection.stepwise import Explanation, is_unexplained

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
    it was fitted, predicts worse than none (`share_asked_for`).

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
            break
        candidates.append(worst)
        explained = dropped(explained, worst)
    return Confirmation(explained, tuple(candidates))


def _judged(explained: Explanation, held: Residuals, step: Step, with_all: Array) -> tuple[Step, Share]:
    """Return a step with what it gains on recordings set aside, and the share of it they ask for.

    ``with_all`` are their residuals under all steps, shape (n,).
    """
    without = _held_errors(explained, held, _without(explained, step))
    share = share_asked_for(held.index, without, with_all)
    return replace(step, holdout_gain=cost(without) - cost(with_all)), share


def dropped(explained: Explanation, step: Step) -> Explanation:
    """Return an explanation without an effect, the others refitted; the robot's own value of it comes back."""
    problem, taken = explained.problem, _without(explained, step)
    left = without_tolerated(problem, taken)
    steps = tuple(s for s in explained.steps if s.effect != step.effect)
    return replace(explained, taken=taken, left=left, steps=steps, unexplained=is_unexplained(problem, left))


def _without(explained: Explanation, step: Step) -> Model:
    rest = [effect for effect in explained.taken.effects if effect != step.effect]
    return explained.problem.estimator.fit(rest, explained.taken.values)


def _held_errors(explained: Explanation, held: Residuals, model: Model) -> Array:
    if explained.problem.clocks_fitted and not held.sensor:
        held = with_fitted_clocks(held, model.physics)[0]
    return held.errors(model.physics)
