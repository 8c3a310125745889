"""A step judged by leave-one-recording-out cross-validation, against the null distribution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import Minimum, costs, left_out_costs
from gecar.reality.selection.null_distribution import largest_gains
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import NEGLIGIBLE, ONE_FOLD
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]


def judged(problem: Problem, step: Step) -> Step:
    """Return a step with its gain on left-out recordings, and with what the null distribution says of that."""
    gains = left_out_gains(problem.estimator, step)
    nulls = largest_gains(problem.estimator, problem.catalogue, step.model)
    p = float((1 + np.sum(nulls >= gains.sum())) / (1 + len(nulls)))
    return replace(step, left_out=gains, null_95=float(np.quantile(nulls, 0.95)), p=p)


def left_out_gains(estimator: Estimator, step: Step) -> Array:
    """Return what a step gains on each fold when that is left out, shape (folds,)."""
    new, folds = step.model, estimator.blocks.folds
    gained = np.bincount(folds, costs(step.base.errors) - costs(new.errors))
    # What one recording alone shows cannot be left out. Wholly explained it counts: an imitation leaves something.
    alone = gained.max() > ONE_FOLD * step.gain and step.energy_after < NEGLIGIBLE * step.energy_before
    if alone or len(np.unique(folds)) < 2:
        return np.array([step.gain])
    if not BY_ID[step.effect].differentiable:  # no Newton step tells what it would be without a recording
        others = gained.sum() - gained
        return np.where(others > NEGLIGIBLE * gained.sum(), gained, np.minimum(gained, 0.0))
    return _predicted_gains(estimator, step.base, new)


def _predicted_gains(estimator: Estimator, base: Model, new: Model) -> Array:
    """Return what a model gains on each fold under parameters fitted to the others, shape (folds,).

    The model below is asked to predict, too: what it fitted to the left-out recording would flatter it. But leaving
    out may cost it no more than it costs the new one; else a base that falls apart would let everything pass.
    """
    folds = estimator.blocks.folds
    before, after = _left_out_costs(estimator, base), _left_out_costs(estimator, new)
    lost = np.maximum(after - np.bincount(folds, costs(new.errors)), 0.0)
    out: Array = np.minimum(before, np.bincount(folds, costs(base.errors)) + lost) - after
    return out


def _left_out_costs(estimator: Estimator, model: Model) -> Array:
    """Return each fold's cost under parameters fitted without it (one Newton step back), shape (folds,)."""
    if not len(model.z):
        return np.bincount(estimator.blocks.folds, costs(model.errors)).astype(float)
    minimum = Minimum(model.z, model.errors, model.cost)
    # A parameter that one recording alone determines is not known without it: it stays neutral.
    return left_out_costs(
        minimum,
        estimator.own_sensitivities(model),
        model.parameters.bounds,
        estimator.residual(model.parameters),
        estimator.blocks.folds,
        NEGLIGIBLE,
    )
