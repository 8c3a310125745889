"""Changes too small for a name, which no simulation is free of, and what they explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import NO_SHIFT, Fits
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import weights
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]

LOUD = 2.0  # structure a block above which small changes are not looked at
SUBTLE = 0.4  # of a size worth a name: how far off a robot's constants are expected to be without an effect


def shifts(fits: Fits, catalogue: Sequence[str], model: Model) -> dict[str, Array]:
    """Return, for each effect, what all others explain by changes too small for a name, each of shape (n,).

    No simulation fits reality to the last digit. What an effect must explain is what such changes leave.
    """
    # Clipped readings do not add up; beside something large, small changes would only imitate it.
    if fits.comparison.sight or model.structure > LOUD * fits.blocks.count:
        return dict.fromkeys((*catalogue, ""), NO_SHIFT)
    raw = model.fit.errors + model.shift
    columns = dict(zip(catalogue, subtle_slopes(fits, catalogue, model), strict=True))
    w = weights(raw)
    owner = np.concatenate([[e] * g.shape[1] for e, g in columns.items()])
    g = np.concatenate(list(columns.values()), axis=1)
    normal, pull = g.T @ (w[:, None] * g), g.T @ (w * raw)
    sizes = np.zeros((g.shape[1], len(catalogue) + 1))
    for k, effect in enumerate((*catalogue, "")):
        rest = np.flatnonzero((owner != effect) & ~np.isin(owner, model.effects))
        ridge = np.eye(len(rest)) / SUBTLE**2
        sizes[rest, k] = np.clip(np.linalg.solve(normal[np.ix_(rest, rest)] + ridge, pull[rest]), -1.0, 1.0)
    return dict(zip((*catalogue, ""), (g @ sizes).T, strict=True))


def rid_of_subtle(fits: Fits, catalogue: Sequence[str], model: Model) -> Model:
    """Return a model whose residuals are rid of what changes too small for a name explain."""
    shift = shifts(fits, catalogue, model)[""]
    return fits.shifted(model, shift)


def subtle_slopes(fits: Fits, catalogue: Sequence[str], model: Model) -> list[Array]:
    """Return how residuals feel every size worth a name, a column each; what vanishes is left out."""
    out = []
    for effect in catalogue:
        named = [p.worthwhile > 0.0 for p in BY_ID[effect].parameters]
        out.append(fits.felt(model, effect)[:, named])
    return out
