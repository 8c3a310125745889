"""What these recordings can not tell apart: effects that do as well in each other's place."""

from __future__ import annotations

import numpy as np

from gecar.reality.fitting.model import Model, Step, worthwhile
from gecar.reality.optimisation.least_squares import costs
from gecar.reality.selection.selection import Selection
from gecar.reality.selection.stepwise import Explanation

CLOSE = 0.08  # a runner-up that loses more than this share of the gain is told apart
CERTAIN = 2.5  # standard deviations of the difference over spans


def alternatives(selection: Selection, explained: Explanation, step: Step) -> dict[str, Model]:
    """Return what could stand in an effect's place for all these recordings say: models by effect."""
    taken = explained.taken
    number = [s.effect for s in explained.steps].index(step.effect)
    out = {}
    for other in explained.tried[number]:
        if other.effect in taken.effects or other.gain < (1.0 - 2.0 * CLOSE) * step.gain:
            continue
        rest = [e for e in taken.effects if e != step.effect]
        swapped = selection.refit((*rest, other.effect), {**taken.values, **other.model.values})
        loss = costs(swapped.fit.errors) - costs(taken.fit.errors)
        spans = np.bincount(selection.blocks.spans, loss)
        close = loss.sum() < CLOSE * step.gain
        unsure = loss.sum() < CERTAIN * np.sqrt(np.sum((spans - spans.mean()) ** 2))
        if close and unsure and worthwhile(swapped, other.effect):
            out[other.effect] = swapped
    return out
