"""What these recordings cannot tell apart: effects that do as well in each other's place."""

from __future__ import annotations

import numpy as np

from gecar.reality.fitting.model import Effects, Model, Step
from gecar.reality.optimisation.least_squares import costs
from gecar.reality.selection.acceptance import imitates_dry_friction, is_worthwhile
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.stepwise import Explanation
from gecar.reality.selection.thresholds import CERTAIN, CLOSE, PRICE

LATE_SENSOR, LATE_MOTION = "sensor_delay", "actuation_delay"  # both have the parameter ``time_s``
# What tells of the motion by the log's clock.
ON_THE_ROBOT = {"left_angle_rad", "right_angle_rad", "yaw_rate_rad_s"}


def alternatives(explained: Explanation, step: Step) -> dict[str, Model]:
    """Return the effects that could stand in an effect's place: models by effect."""
    taken, estimator = explained.taken, explained.problem.estimator
    out = {}
    for other in explained.tried[step.stage]:
        if other.effect in taken.effects or other.gain < (1.0 - 2.0 * CLOSE) * step.gain:
            continue
        rest = [e for e in taken.effects if e != step.effect]
        swapped = estimator.fit((*rest, other.effect), {**taken.values, **other.model.values})
        loss = costs(swapped.errors) - costs(taken.errors)
        spans = np.bincount(estimator.blocks.spans, loss)
        close = loss.sum() < min(CLOSE * step.gain, PRICE)
        uncertain = loss.sum() < CERTAIN * np.sqrt(np.sum((spans - spans.mean()) ** 2))
        if imitates_dry_friction(explained.problem, swapped):
            continue
        if close and uncertain and is_worthwhile(swapped, other.effect, explained.problem.share):
            out[other.effect] = swapped
    return out


def late_as_well(motion: Problem, step: Step) -> Effects:
    """Return what a late colour sensor may be instead, where only the camera, by fitted clocks, tells of the motion.

    All motion may be as late: then the clocks were fitted to be late by that, and the sensor seems late beside them.
    """
    measured = {name for run in motion.recordings for name in run.measured}
    if step.effect != LATE_SENSOR or not motion.clocks_fitted or measured & ON_THE_ROBOT:
        return {}
    return {LATE_MOTION: dict(step.model.values[LATE_SENSOR])}
