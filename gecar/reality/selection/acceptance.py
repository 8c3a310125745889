"""Which steps are accepted: of a size worth a name, proved on left-out recordings, and no imitation of a cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gecar.reality.fitting.model import Model, Step
from gecar.reality.fitting.parameters import Parameters
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import spread_of_size
from gecar.reality.selection.thresholds import (
    COMPETING,
    LEAST_INVERSE,
    MAIN_SHARE,
    MORE_SHARE,
    SIGNIFICANCE,
    STEADY,
    STOPPED,
    WHOLE_SHARE,
)
from gecar.world.effects import BY_ID

Array = np.ndarray[tuple[int], np.dtype[np.float64]]

AT_BOUND = 0.01  # coordinates
RUNNERS_UP = 4  # effects of a stage that are judged, and tried in the place of what was taken


def worthwhile(parameters: Parameters, z: Array, effect: str) -> bool:
    """Whether an effect's size at a vector of parameters is worth a name."""
    if BY_ID[effect].worth:
        found = parameters.values(z)[effect]
        return any(
            all(found[label] >= size for label, size in worth.items()) for worth in BY_ID[effect].worth
        )
    low, high = parameters.bounds
    for k, c in enumerate(parameters.coordinates):
        if c.effect.id == effect and (c.parameter.worthwhile > 0.0 or c.inverse):
            # A cause has a size; what grows until a bound stops it imitates another.
            at_bound = z[k] != 0.0 and (z[k] > high[k] - AT_BOUND or z[k] < low[k] + AT_BOUND)
            stopped = at_bound and abs(z[k]) > STOPPED
            if not stopped and abs(z[k]) >= (LEAST_INVERSE if c.inverse else 1.0):
                return True
    return False


def is_worthwhile(model: Model, effect: str) -> bool:
    """Whether an effect's size in a model is worth a name."""
    return worthwhile(model.parameters, model.z, effect)


def candidates(problem: Problem, stage: Sequence[Step]) -> list[Step]:
    """Return the best steps of a stage that explain enough, with every effect of a size worth a name."""
    return [
        step
        for step in stage[:RUNNERS_UP]
        if all(is_worthwhile(step.model, effect) for effect in step.model.effects)
        and step.drop >= problem.limits.least_drop * problem.blocks
        and step.gain >= COMPETING * stage[0].gain
    ]


def proved(step: Step) -> bool:
    """Whether a judged step gains more on left-out recordings than the null distribution allows."""
    return bool(step.left_out.sum() > step.null_95 and step.p < SIGNIFICANCE)


def number_accepted(problem: Problem, steps: Sequence[Step]) -> int:
    """Return how many steps of a chain are accepted.

    Together they must explain nearly all excess energy; then each must explain a good part of what the others leave,
    or be needed to get there.
    """
    if not steps:
        return 0
    limits, before = problem.limits, steps[0].energy_before
    floor = limits.floor * problem.blocks
    excess = max(before - floor, limits.least_drop * problem.blocks)
    accepted, whole_before = 0, False
    for number, step in enumerate(steps, start=1):
        whole = before - step.energy_after >= WHOLE_SHARE * excess
        main = step.drop >= MAIN_SHARE * step.energy_before
        if whole_before and not problem.on_bench:
            main &= step.drop >= MORE_SHARE * (step.energy_before - floor)
        if whole and main and (not whole_before or accepted == number - 1):
            accepted = number
        whole_before = whole_before or whole
    return accepted


def number_beside_the_unexplained(problem: Problem, steps: Sequence[Step]) -> int:
    """Return how many steps of a chain are accepted though together they leave much that nothing explains.

    Each must explain a good part of what the others leave, and be of one size in all recordings: imitations are not.
    """
    folds = problem.estimator.blocks.folds
    for number, step in enumerate(steps):
        steady = spread_of_size(folds, step.base.errors, step.model.errors) < STEADY
        if not steady or step.drop < MAIN_SHARE * step.energy_before:
            return number
    return len(steps)
