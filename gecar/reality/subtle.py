"""Changes too small for a name, which no simulation is free of, and what they explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fits import NO_SHIFT, Fits
from gecar.reality.fitting import weights
from gecar.reality.freedom import free
from gecar.reality.model import Model

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
    out = {}
    for effect in (*catalogue, ""):
        rest = np.flatnonzero((owner != effect) & ~np.isin(owner, model.effects))
        ridge = np.eye(len(rest)) / SUBTLE**2
        sizes = np.linalg.solve(normal[np.ix_(rest, rest)] + ridge, pull[rest])
        out[effect] = g[:, rest] @ np.clip(sizes, -1.0, 1.0)
    return out


def rid_of_subtle(fits: Fits, catalogue: Sequence[str], model: Model) -> Model:
    """Return a model whose residuals are rid of what changes too small for a name explain."""
    shift = shifts(fits, catalogue, model)[""]
    return fits.shifted(model, shift)


def subtle_slopes(fits: Fits, catalogue: Sequence[str], model: Model) -> list[Array]:
    """Return how residuals feel every size worth a name, a column each; what vanishes is left out."""
    out = []
    raw = model.fit.errors + model.shift
    for effect in catalogue:
        freedom = free(fits.robot, (*(e for e in model.effects if e != effect), effect))
        z = freedom.vector(model.values)
        columns = []
        for k, c in enumerate(freedom.coordinates):
            if c.effect.id == effect and c.parameter.worthwhile > 0.0:
                moved = z.copy()
                step = 0.5 if moved[k] + 0.5 <= freedom.bounds[1][k] else -0.5
                moved[k] += step
                columns.append((fits.residual(freedom)(moved) - raw) / step)
        out.append(np.stack(columns, axis=1) if columns else np.zeros((len(raw), 0)))
    return out
