"""What these recordings cannot tell apart: effects that do as well in each other's place."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gecar.reality.fitting.model import Effects, Model, Step
from gecar.reality.optimisation.least_squares import costs
from gecar.reality.selection.acceptance import imitates_dry_friction, is_at_the_caster, is_worthwhile
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.stepwise import Explanation
from gecar.reality.selection.thresholds import CERTAIN, CLOSE, PRICE

LATE_SENSOR, LATE_MOTION = "sensor_delay", "actuation_delay"  # both have the parameter ``time_s``
# What tells of the motion by the log's clock.
ON_THE_ROBOT = {"left_angle_rad", "right_angle_rad", "yaw_rate_rad_s"}


def alternatives(explained: Explanation, step: Step) -> dict[str, Model]:
    """Return the effects that could stand in an effect's place: models by effect.

    They are judged by what an alternative would leave: one that was taken may fit what is more of a model's error.
    """
    taken, problem = explained.taken, explained.problem
    rest = [e for e in taken.effects if e != step.effect]
    rivals, out = _rivals(explained, step, rest), dict[str, Model]()
    if not rivals:
        return out
    left = problem.residuals.errors(taken.physics)
    for effect, other in rivals.items():
        swapped = problem.estimator.fit((*rest, effect), {**taken.values, **other.model.values})
        if imitates_dry_friction(problem, swapped) or not is_worthwhile(swapped, effect, problem.share):
            continue
        estimator = problem.under(swapped).estimator
        errors = problem.residuals.errors(swapped.physics)
        loss = costs(estimator.whitened(errors)) - costs(estimator.whitened(left))
        spans = np.bincount(estimator.blocks.spans, loss)
        # What fits far better was refused, but for what drags at the caster's place, which goes by the caster's name.
        most = min(CLOSE * step.gain, PRICE)
        close = loss.sum() < most and (loss.sum() > -most or is_at_the_caster(problem, swapped))
        if close and loss.sum() < CERTAIN * np.sqrt(np.sum((spans - spans.mean()) ** 2)):
            out[effect] = swapped
    return out


def _rivals(explained: Explanation, step: Step, rest: Sequence[str]) -> dict[str, Step]:
    """Return the steps of other effects that gained about as much as one did, by effect.

    Those of its own stage, and of stages that had no effects but ``rest``, which are left beside it: others that were
    taken before it may have been refused since.
    """
    out = dict[str, Step]()
    for number, stage in enumerate(explained.tried):
        own = next((each.gain for each in stage if each.effect == step.effect), math.inf)
        if number == step.stage:
            own = step.gain
        elif not all(set(each.base.effects) <= set(rest) for each in stage):
            continue
        for other in stage:
            if other.effect not in explained.taken.effects and other.gain >= (1.0 - 2.0 * CLOSE) * own:
                out.setdefault(other.effect, other)
    return out


def late_as_well(motion: Problem, step: Step) -> Effects:
    """Return what a late colour sensor may be instead, where only the camera, by fitted clocks, tells of the motion.

    All motion may be as late: then the clocks were fitted to be late by that, and the sensor seems late beside them.
    """
    measured = {name for run in motion.recordings for name in run.measured}
    if step.effect != LATE_SENSOR or not motion.clocks_fitted or measured & ON_THE_ROBOT:
        return {}
    return {LATE_MOTION: dict(step.model.values[LATE_SENSOR])}
