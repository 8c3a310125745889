"""What changes too small for a name explain: no simulation is free of them, so no effect is credited with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import NOTHING_TOLERATED, Model
from gecar.reality.optimisation.least_squares import weights
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import LOUD, TOLERATED
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]


def tolerated(problem: Problem, model: Model) -> dict[str, Array]:
    """Return, for each effect, what all others explain by changes too small for a name, each of shape (n,).

    Under ``""``: what all effects explain together.
    """
    everything = (*problem.catalogue, "")
    # Clipped readings do not add up; beside a large misfit, small changes would only imitate it.
    if problem.residuals.sensor or model.excess_energy > LOUD * problem.blocks:
        return dict.fromkeys(everything, NOTHING_TOLERATED)
    raw = model.errors + model.tolerated
    columns = dict(
        zip(problem.catalogue, small_sensitivities(problem.estimator, problem.catalogue, model), strict=True)
    )
    w = weights(raw)
    owner = np.concatenate([[e] * g.shape[1] for e, g in columns.items()])
    g = np.concatenate(list(columns.values()), axis=1)
    normal, pull = g.T @ (w[:, None] * g), g.T @ (w * raw)
    sizes = np.zeros((g.shape[1], len(everything)))
    for k, effect in enumerate(everything):
        rest = np.flatnonzero((owner != effect) & ~np.isin(owner, model.effects))
        ridge = np.eye(len(rest)) / TOLERATED**2
        sizes[rest, k] = np.clip(np.linalg.solve(normal[np.ix_(rest, rest)] + ridge, pull[rest]), -1.0, 1.0)
    return dict(zip(everything, (g @ sizes).T, strict=True))


def without_tolerated(problem: Problem, model: Model) -> Model:
    """Return a model whose residuals are rid of what changes too small for a name explain."""
    return problem.estimator.tolerating(model, tolerated(problem, model)[""])


def small_sensitivities(estimator: Estimator, catalogue: Sequence[str], model: Model) -> list[Array]:
    """Return the derivatives by every size worth a name, a column each, by effect."""
    found = estimator.sensitivities(model, catalogue)
    named = ([p.worthwhile > 0.0 for p in BY_ID[effect].parameters] for effect in catalogue)
    return [slopes[:, columns] for slopes, columns in zip(found, named, strict=True)]
