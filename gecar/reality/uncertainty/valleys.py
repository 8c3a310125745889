"""Valleys: effects of a motor on a bench that recordings tell apart only if everything else is known exactly.

More voltage, more friction and less inertia turn a shaft nearly alike. A fit of some of them with all others at their
known values is sharp, and wrong by as much as the others are: motors of one kind differ, and what is too small for a
name may be there. So the effects found are fitted once more beside changes of all other parameters by as much, as noise
(`gecar.reality.fitting.discrepancy`); an interval then reaches from one end of the valley to the other.

The value between its ends remains that of the fit without these changes: the robot found has none of them.

Source: intervals over nuisance parameters with a prior, Raue et al., Bioinformatics 25 (2009) 1923 (valleys of a
profile likelihood: practical non-identifiability).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import weights
from gecar.reality.selection.problem import Problem, small_sensitivities, unnamed
from gecar.reality.selection.thresholds import UNNAMED
from gecar.reality.uncertainty.intervals import alike, half_widths
from gecar.reality.verdict import Interval

Spans = Mapping[str, Mapping[str, Interval]]


def along_valleys(problem: Problem, model: Model, spans: Spans) -> dict[str, dict[str, Interval]]:
    """Return intervals that hold what the effects would be if all others were off by what a bench leaves open.

    Parameters
    ----------
    problem, model
        The effects found on a bench, fitted with all other parameters at their known values.
    spans
        Their intervals, by effect and label.
    """
    beside = problem.beside_unnamed(model).estimator
    joint = beside.fit(model.effects, model.values)
    low, high = model.parameters.bounds
    half = half_widths(beside, joint)
    out = {effect: dict(of) for effect, of in spans.items()}
    for k, c in enumerate(joint.parameters.coordinates):
        ends = [
            c.value(float(np.clip(z, low[k], high[k]))) for z in (joint.z[k] - half[k], joint.z[k] + half[k])
        ]
        out[c.effect.id][c.parameter.label] = out[c.effect.id][c.parameter.label].reaching(*ends)
    return out


def valleys(problem: Problem, model: Model) -> tuple[tuple[str, ...], ...]:
    """Return sets of effects, at least one of them the model's, that these recordings hardly tell apart.

    Two are in one set if their estimates beside all others are correlated by more than `ALIKE`.
    """
    slopes = small_sensitivities(problem, model, unnamed)
    names = [effect for effect, of in slopes.items() for _ in range(of.shape[1])]
    columns = np.concatenate(list(slopes.values()), axis=1) * np.sqrt(weights(model.errors))[:, None]
    prior = [0.0 if name in model.effects else UNNAMED**-2 for name in names]
    covariance = np.linalg.pinv(columns.T @ columns + np.diag(prior), hermitian=True)
    return tuple(dict.fromkeys(_sets(names, alike(covariance), model)))


def _sets(names: list[str], alike: np.ndarray, model: Model) -> Iterator[tuple[str, ...]]:
    for effect in model.effects:
        rows = [k for k, name in enumerate(names) if name == effect]
        beside = {names[k] for k in np.flatnonzero(alike[rows].any(axis=0)) if names[k]}
        if len(beside) > 1:
            yield tuple(sorted(beside))
