"""A step judged by leave-one-recording-out cross-validation, against the null distribution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import (
    Minimum,
    Residual,
    costs,
    least_squares,
    left_out_costs,
    weights,
)
from gecar.reality.selection.null_distribution import largest_gains
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import APART, NEGLIGIBLE, ONE_FOLD, PRICE
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]
REFITS = 3  # iterations of a fit without a fold, which begins close to its end


def judged(problem: Problem, step: Step) -> Step:
    """Return a step with its gain on left-out recordings, and its p-value by the null distribution.

    Small changes of all parameters but its own are noise here. Its own would hide what recordings have in common, the
    more the stronger an effect is, and leave the little that they differ by.
    """
    left_out, null_95, p = problem.once(
        "judged", step.base.key, step.model.key, make=lambda: _judged(problem, step)
    )
    return replace(step, left_out=left_out, null_95=null_95, p=p)


def _judged(problem: Problem, step: Step) -> tuple[Array, float, float]:
    """Return what a step gains on left-out recordings, the 95 % quantile of nulls, and the p-value."""
    estimator = problem.under(step.model).estimator
    base, model = estimator.models_of(step)
    alone = replace(step, base=base, model=model, gain=base.cost - model.cost)
    gains = left_out_gains(estimator, alone, problem.on_bench)
    nulls = largest_gains(estimator, problem.tried, model)
    p = float((1 + np.sum(nulls >= gains.sum())) / (1 + len(nulls)))
    return gains, float(np.quantile(nulls, 0.95)), p


def left_out_gains(estimator: Estimator, step: Step, refits: bool = False) -> Array:
    """Return what a step gains on each fold when that is left out, shape (folds,).

    With ``refits`` the others are fitted anew, where they take milliseconds; without, by one Newton step.
    """
    new, folds = step.model, estimator.blocks.folds
    before, after = (np.bincount(folds, costs(model.errors)) for model in (step.base, new))
    gained, one = before - after, int(np.argmax(before - after))
    # What one recording alone shows cannot be left out. Wholly explained it counts: an imitation leaves something.
    explained = step.energy_after < NEGLIGIBLE * step.energy_before
    if refits:  # others may hold what comes later
        explained |= bool(after[one] < NEGLIGIBLE * before[one])
    if (gained[one] > ONE_FOLD * step.gain and explained) or len(np.unique(folds)) < 2:
        return np.array([step.gain])
    if not BY_ID[step.effect].differentiable:  # no Newton step tells what it would be without a recording
        others = gained.sum() - gained
        return np.where(others > NEGLIGIBLE * gained.sum(), gained, np.minimum(gained, 0.0))
    if not refits:
        return _predicted_gains(
            _left_out_costs(estimator, step.base), _left_out_costs(estimator, new), step, folds
        )
    base, whole = (_refitted_costs(estimator, model, step.effect) for model in (step.base, new))
    # A fold without which the base is not known says nothing of what is built on it.
    return np.where(base > APART * before + PRICE, 0.0, _predicted_gains(base, whole, step, folds))


def _predicted_gains(before: Array, after: Array, step: Step, folds: npt.NDArray[np.int32]) -> Array:
    """Return what a model gains on each fold under parameters fitted to the others, shape (folds,).

    ``before`` and ``after`` are what folds cost then. The model below is asked to predict, too: what it fitted to the
    left-out recording would flatter it. But leaving out may cost it no more than it costs the new one; else a base that
    falls apart would let everything pass.
    """
    lost = np.maximum(after - np.bincount(folds, costs(step.model.errors)), 0.0)
    out: Array = np.minimum(before, np.bincount(folds, costs(step.base.errors)) + lost) - after
    return out


def _left_out_costs(estimator: Estimator, model: Model) -> Array:
    """Return each fold's cost under parameters fitted without it (one Newton step back), shape (folds,)."""
    if not len(model.z):
        return np.bincount(estimator.blocks.folds, costs(model.errors)).astype(float)
    minimum = Minimum(model.z, model.errors, model.cost)
    # A parameter that one recording alone determines is not known without it: it is neutral. No step tells where on the
    # floor a place would be without it: it stays, or it would lie in the way of other recordings.
    return left_out_costs(
        minimum,
        estimator.own_sensitivities(model),
        model.parameters.bounds,
        estimator.residual(model.parameters),
        estimator.blocks.folds,
        NEGLIGIBLE,
        np.array([not c.effect.differentiable for c in model.parameters.coordinates], bool),
    )


def _refitted_costs(estimator: Estimator, model: Model, effect: str) -> Array:
    """Return each fold's cost under parameters fitted to the others from where they are, shape (folds,)."""
    errors = refitted_errors(estimator, model, _known_without(estimator, model, effect))
    return np.bincount(estimator.blocks.folds, costs(errors)).astype(float)


def refitted_errors(estimator: Estimator, model: Model, known: npt.NDArray[np.bool_] | None = None) -> Array:
    """Return each residual under a model's parameters fitted again to the other folds, from where they are, shape (n,).

    Parameters
    ----------
    estimator
        Of the residuals.
    model
        Fitted to all of them.
    known
        Which coordinates are fitted without each fold, shape (folds, k); the others are neutral. Default: all.
    """
    folds, residual = estimator.blocks.folds, estimator.residual(model.parameters)
    low, high = model.parameters.bounds
    errors = model.errors.copy()
    for k in np.unique(folds) if len(model.z) else ():
        free = np.ones(len(model.z), bool) if known is None else known[k]
        bounds = np.where(free, low, 0.0), np.where(free, high, 0.0)
        others = _only(residual, folds != k)
        found = least_squares(others, model.z, bounds, model.parameters.probes, REFITS, past_jumps=True)
        errors[folds == k] = residual(found.z)[folds == k]
    return errors


def _only(residual: Residual, kept: npt.NDArray[np.bool_]) -> Residual:
    return lambda z: np.ascontiguousarray(residual(z)[..., kept])


def _known_without(estimator: Estimator, model: Model, effect: str) -> npt.NDArray[np.bool_]:
    """Return which coordinates are known without each fold, shape (folds, k): an effect's others stay neutral.

    They are known if other folds' residuals change with them; what was taken before is.
    """
    names, folds = [c.effect.id for c in model.parameters.coordinates], estimator.blocks.folds
    w, known = weights(model.errors), np.ones((int(folds.max()) + 1, len(names)), bool)
    for k in (k for k, name in enumerate(names) if name == effect):
        told = np.bincount(folds, w * estimator.own_sensitivities(model)[:, k] ** 2)
        known[:, k] = told.sum() - told > NEGLIGIBLE * told.sum()
    return known
