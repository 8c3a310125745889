"""Whether an effect has one size in all recordings, at all times and in all regimes: a cause has, an imitation drifts.

Each group of residuals asks for a share of the effect as it was fitted: 1 where it is right (`share`). The shares'
spread is tested by Cochran's Q, as effect sizes of several studies are, and measured by what exceeds sampling noise.

Sources: Cochran, Biometrics 10 (1954) 101 (Q); DerSimonian and Laird, Controlled Clinical Trials 7 (1986) 177 (the
variance that exceeds sampling noise).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc

from gecar.reality.fitting.gain_offset import EFFECT as GAIN
from gecar.reality.fitting.gain_offset import on_even_floor
from gecar.reality.fitting.model import Model, Step
from gecar.reality.fitting.parameters import free
from gecar.reality.residuals.of_case import Physics, Residuals
from gecar.reality.residuals.regimes import HEADINGS
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import shares_of_groups
from gecar.reality.selection.thresholds import DRIFTING, NEGLIGIBLE, SIGNIFICANCE

Array = npt.NDArray[np.float64]
Groups = npt.NDArray[np.intp]

THIRDS = 3
MOMENT_S = 0.25  # in which light that waxes and wanes once a second keeps its strength
OF_MANY = 0.25  # of an equal part of the information: what one of many groups must have
BESIDE_CHANGES = 0.12  # relative spread beside the most likely small changes; imitations mostly 0.15 to 0.9
REGIMES = (("slow", "fast"), ("straight", "turning"), ("backward",), ("change of command",))
"""Each splits the residuals into those of its regimes, and the others."""


class Heterogeneity(NamedTuple):
    """How an effect's size differs between groups.

    Attributes
    ----------
    relative
        Standard deviation of the size between groups beyond sampling noise, as a share of the size.
    p
        p-value of Cochran's Q.
    """

    relative: float
    p: float


def drifts(problem: Problem, model: Model, step: Step) -> bool:
    """Whether the size of one of a model's effects differs between recordings, times or regimes: surely, and by much.

    It must differ where small changes of all other constants are unknown, as noise; and by an eighth beside the most
    likely ones, for as noise they may hide all of an effect but an odd little: a colour sensor's lag had up to 61 % of
    spread beside the first, and 10 % beside the second.

    Parameters
    ----------
    problem
        Under the discrepancy the model leaves, so that no small change of the effect itself is noise.
    model, step
        The model, and the step that took the effect.
    """
    if step.effect == GAIN and flickers(problem.residuals, step.base.physics, step.model.physics):
        return True
    unknown = tuple(model.errors for model in problem.estimator.models_of(step))
    known = _beside_small_changes(problem, model, step.effect)
    splits = list(_splits(problem, model))
    return _differs_in_any(splits, unknown, DRIFTING) and _differs_in_any(splits, known, BESIDE_CHANGES)


def mark_differs(problem: Problem, with_mark: Problem, model: Model) -> bool:
    """Whether the camera's mark, as it was fitted, differs between recordings, times or regimes: then it is none."""
    whitened, physics = problem.estimator.whitened, model.physics
    errors = tuple(whitened(each.residuals.errors(physics)) for each in (problem, with_mark))
    return _differs_in_any(list(_splits(problem, model)), errors, DRIFTING)


def _differs_in_any(splits: Sequence[Groups], errors: tuple[Array, ...], least: float) -> bool:
    """Whether a size differs in one of several splits; ``errors`` are whitened, without what has it and with it."""
    chance = SIGNIFICANCE / len(splits)  # Bonferroni
    return any(_differs(heterogeneity(groups, *errors), least, chance) for groups in splits)


def _differs(found: Heterogeneity, least: float, chance: float) -> bool:
    return found.relative > least and found.p < chance


def _beside_small_changes(problem: Problem, model: Model, effect: str) -> tuple[Array, Array]:
    """Return the residuals without an effect of a model and with it, beside the model's most likely small changes."""
    left = problem.estimator.discrepancy
    values = problem.small_changes(model)
    rest = {each: of for each, of in values.items() if each != effect}
    parameters = free(problem.estimator.robot, tuple(rest))
    physics = np.concatenate([parameters.physics(parameters.vector(rest)), problem.with_small_changes(model)])
    errors = problem.residuals.errors_of_each(physics)
    without, with_effect = errors if left is None else left.whitened_beside_parameters(errors)
    return without, with_effect


def heterogeneity(groups: Groups, without: Array, with_effect: Array) -> Heterogeneity:
    """Return how the share of an effect that residuals ask for differs between groups.

    Groups that hardly show the effect say nothing of its size.

    Parameters
    ----------
    groups
        Of each residual, shape (n,).
    without, with_effect
        Whitened residuals of the two models, shape (n,).
    """
    shares, information = shares_of_groups(groups, without, with_effect)
    shown = information > min(NEGLIGIBLE, OF_MANY / max(len(shares), 1)) * information.sum()
    shares, information = shares[shown], information[shown]
    if len(shares) < 2:
        return Heterogeneity(0.0, 1.0)
    mean = np.average(shares, weights=information)
    q, freedom = float(information @ (shares - mean) ** 2), len(shares) - 1
    of_all = float(information.sum() - information @ information / information.sum())
    return Heterogeneity(float(np.sqrt(max(q - freedom, 0.0) / of_all)), float(chdtrc(freedom, q)))


def _splits(problem: Problem, model: Model) -> Iterator[Groups]:
    """Yield groups of the residuals: by recording, by thirds of the time, and by regimes of the motion or headings."""
    index = problem.residuals.index
    yield index.recording.astype(np.intp)
    yield np.minimum(THIRDS * index.t_s / max(float(index.t_s.max()), 1e-9), THIRDS - 1).astype(np.intp)
    masks = problem.residuals.regimes(model.physics)
    # Light from one side makes readings depend on the heading, and looks like a gain.
    for names in (*REGIMES, HEADINGS) if problem.residuals.sensor else REGIMES:
        yield np.select([masks[name] for name in names], range(1, len(names) + 1)).astype(np.intp)


def flickers(residuals: Residuals, without: Physics, with_it: Physics) -> bool:
    """Whether a gain differs from moment to moment on even floor: light that waxes and wanes is one on the mean.

    In units of the sensor's noise, as what a flicker leaves would count as noise otherwise.

    Parameters
    ----------
    residuals
        Of the colour sensor.
    without, with_it
        Physics records without what changes readings and with it, shape (1,).
    """
    index = residuals.index
    moment = (index.t_s / MOMENT_S).astype(np.intp)
    moments = index.recording.astype(np.intp) * (int(moment.max(initial=0)) + 1) + moment
    even = on_even_floor(residuals)
    before, after = (residuals.errors(physics)[even] for physics in (without, with_it))
    return _differs(heterogeneity(moments[even], before, after), DRIFTING, SIGNIFICANCE)
