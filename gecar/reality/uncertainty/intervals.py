"""Intervals: what other recordings, other noise, and the simulation's own faults would have made of a parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri, stdtrit

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.gain_offset import gain_intervals
from gecar.reality.fitting.model import Model, Step
from gecar.reality.fitting.parameters import Coordinate
from gecar.reality.fitting.profile import RISE_95, reaches
from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.optimisation.least_squares import FLAT, weights
from gecar.reality.residuals.of_recording import DISC_SPREAD
from gecar.reality.selection.problem import SPOT_SIZE
from gecar.reality.selection.thresholds import ALIKE
from gecar.reality.uncertainty.mcmc import TOLERANCE, walked_quantiles
from gecar.reality.verdict import Interval
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]

NORMAL_95 = 1.96
# Half 95 % intervals from neutral at which one of all effects of the catalogue is by chance in one robot of twenty
# (Bonferroni's correction).
BY_CHANCE = float(ndtri(1.0 - 0.025 / len(BY_ID))) / NORMAL_95
KNOWN = 3.0  # times its lower end, the upper end of a radius that is known
FLAT_RISE = TOLERANCE * RISE_95  # of cost: a profile along a flat parameter ends there


def half_widths(estimator: Estimator, model: Model) -> Array:
    """Return half the 95 % intervals of a model's coordinates, shape (k,).

    The largest of three: what the noise as it is known to be makes of them, which is without bound along a valley; a
    sandwich over half-second spans, which holds whatever the noise's correlation; and the jackknife over recordings,
    or parts of one, with Student's t, which also holds what no noise model knows.

    Sources: White, Econometrica 48 (1980) 817; Efron and Tibshirani, An Introduction to the Bootstrap (1993), ch. 11.
    """
    return half_widths_of(estimator.own_sensitivities(model), model.errors, estimator.blocks)


def half_widths_of(slopes: Array, errors: Array, blocks: Blocks) -> Array:
    """Return the same of any fit, from its residuals, shape (n,), and their sensitivities, (n, k)."""
    if not slopes.shape[1]:  # a law may have no constants
        return np.zeros(0)
    w = weights(errors)
    normal = slopes.T @ (w[:, None] * slopes)
    inverse = np.linalg.pinv(normal + 1e-9 * np.diag(np.diag(normal)), hermitian=True)
    scores = np.stack([np.bincount(blocks.spans, s * w * errors) for s in slopes.T], axis=1)
    variances = np.maximum(np.diag(inverse @ (scores.T @ scores) @ inverse), np.diag(inverse))
    leaps = []
    for k in np.unique(blocks.parts):
        rows = blocks.parts == k
        part = slopes[rows].T @ (w[rows, None] * slopes[rows])
        leaps.append(
            np.linalg.pinv(normal - part, hermitian=True) @ (slopes[rows].T @ (w[rows] * errors[rows]))
        )
    parts = len(leaps)
    if parts < 2:
        return NORMAL_95 * np.sqrt(variances)
    jack = (parts - 1) / parts * np.sum((np.array(leaps) - np.mean(leaps, axis=0)) ** 2, axis=0)
    return np.maximum(NORMAL_95 * np.sqrt(variances), stdtrit(parts - 1, 0.975) * np.sqrt(jack))


def model_error(c: Coordinate, z: float) -> float:
    """Return the standard deviation of a coordinate that is fitted at ``z``, because the simulation is not reality.

    It is half of what the parameter may be off by (`gecar.world.effects.Parameter`).
    """
    counts = c.parameter.worthwhile > 0.0 or c.parameter.shape_step > 0.0
    step = c.parameter.model_error_steps if counts else 0.0
    # A parameter that acts by its ratio has its logarithm for a coordinate: a share of it is a difference there.
    return 0.5 * (c.parameter.model_error * (1.0 if c.ratio else abs(z)) + step)


def contains_neutral(
    model: Model,
    effect: str,
    spans: Mapping[str, Mapping[str, Interval]],
    doubtful: bool = False,
    times: float = BY_CHANCE,
) -> bool:
    """Whether an effect may as well be absent: its interval holds the neutral value, or would ``times`` as long.

    Several sizes may each be neutral while not all of them are (gain and offset, where readings are clipped): of those,
    what they gain together decides. Where that is ``doubtful``, one of them at least must not be, and be worth a name.
    """
    if BY_ID[effect].at_a_place:
        return not _is_place(model, spans[effect])
    sizes = [
        (k, c, spans[effect][c.parameter.label])
        for k, c in enumerate(model.parameters.coordinates)
        if c.effect.id == effect and (c.parameter.worthwhile > 0.0 or c.inverse)
    ]
    if len(sizes) > 1:
        return doubtful and all(
            abs(model.z[k]) < 1.0 or span.low <= c.value(0.0) <= span.high for k, c, span in sizes
        )
    ((_, c, span),) = sizes
    return _is_near_neutral(c, span, times)


def _is_near_neutral(c: Coordinate, span: Interval, times: float) -> bool:
    """Whether a parameter's interval holds its neutral value, or would if it were so many times as long.

    A size that is known by its product with another parameter has the first alone: its interval runs along a valley,
    which may never come to neutral.
    """
    neutral = c.value(0.0)
    if span.low <= neutral <= span.high:
        return True
    if len(c.effect.parameters) > 1:
        return False
    z, end = c.at(span.value), c.at(span.low if span.value > neutral else span.high)
    return abs(z) < times * abs(z - end)


def weakest_absent(
    model: Model,
    steps: Sequence[Step],
    spans: Mapping[str, Mapping[str, Interval]],
    doubtful: bool = False,
    on_bench: bool = False,
) -> Step | None:
    """Return the effect that gains least of those whose intervals hold their neutral values; None if there is none.

    A bench's effects are its motor's constants: none is one of many that come to something by chance.
    """
    times = 1.0 if on_bench else BY_CHANCE
    absent = [step for step in steps if contains_neutral(model, step.effect, spans, doubtful, times)]
    return min(absent, key=lambda step: step.gain, default=None)


def _is_place(model: Model, spans: Mapping[str, Interval]) -> bool:
    """Whether a patch has edges, or surely grips less than half as much as elsewhere.

    One that grips little less, within a radius that may as well be three times as large, is as likely something else:
    tyres that got dusty.
    """
    radius, grip = spans["radius_m"], spans["coefficient"]
    elsewhere = float(model.parameters.robot.physics["tyre_friction"][0])
    return radius.high < KNOWN * radius.low or grip.high < 0.5 * elsewhere


def _is_one_of_several(model: Model, k: int) -> bool:
    """Whether a coordinate is the size of an effect that has other parameters.

    A size and the share of it that counts may be known by their product alone: a straight line along that valley goes
    through neutral, and the valley does not.
    """
    coordinate = model.parameters.coordinates[k]
    return coordinate.parameter.worthwhile > 0.0 and len(coordinate.effect.parameters) > 1


def _in_a_valley(model: Model, slopes: Array) -> list[bool]:
    """Return, for each coordinate, whether it can hardly be told from another one of the same effect."""
    w, effects = weights(model.errors), np.array([c.effect.id for c in model.parameters.coordinates])
    inverse = np.linalg.pinv(slopes.T @ (w[:, None] * slopes), hermitian=True)
    return ((alike(inverse) & (effects[:, None] == effects)).sum(axis=1) > 1).tolist()


def alike(covariance: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.bool_]:
    """Return which estimates are correlated by more than `ALIKE`, each with itself too, shape (k, k)."""
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    out: npt.NDArray[np.bool_] = np.abs(covariance) > ALIKE * np.outer(deviation, deviation)
    return out


def intervals(estimator: Estimator, model: Model, seed: int = 0) -> dict[str, dict[str, Interval]]:
    """Return 95 % intervals of every parameter of a model, by effect and label."""
    if not model.effects:
        return {}
    out: dict[str, dict[str, Interval]] = {}
    low, high = model.parameters.bounds
    spans = gain_intervals(estimator, model)
    for k, (left, right) in walked_quantiles(estimator, model, seed).items():
        spans[k] = (max(float(model.z[k]) - left, 0.0), max(right - float(model.z[k]), 0.0))
    everything, residual = np.arange(len(model.z)), estimator.residual(model.parameters)
    slopes = estimator.own_sensitivities(model)
    halves, curved = half_widths_of(slopes, model.errors, estimator.blocks), _in_a_valley(model, slopes)
    for k, (c, half) in enumerate(zip(model.parameters.coordinates, halves, strict=True)):
        z = float(model.z[k])
        if k in spans:
            down, up = spans[k]
        elif half > NORMAL_95 * FLAT or (abs(z) <= half and _is_one_of_several(model, k)):
            down, up = reaches(residual, model, k, everything[everything != k], FLAT_RISE)
        elif curved[k] or c.is_threshold:
            profile = reaches(residual, model, k, everything[everything != k], FLAT_RISE)
            down, up = (max(float(half), reach) for reach in profile)
        else:
            down = up = float(half)
        reach = NORMAL_95 * model_error(c, z)
        edges = np.clip((z - np.hypot(down, reach), z + np.hypot(up, reach)), low[k], high[k])
        ends = sorted(c.value(float(end)) for end in edges)
        if c.effect.id == SPOT_SIZE:
            ends[1] = min(_along_surer_paths(estimator, ends[1]), c.value(float(high[k])))
        out.setdefault(c.effect.id, {})[c.parameter.label] = Interval(
            c.value(z), ends[0], ends[1], c.parameter.unit
        )
    return out


def _along_surer_paths(estimator: Estimator, diameter_m: float) -> float:
    """Return the diameter of a spot that would fit as well if the paths had no slow noise [m].

    What a model of the motion leaves counts as slow noise of the camera, and need not be; edges are then wide because
    the spot is, and not because the path is uncertain.
    """
    paths = [run.nuisances.path for run in estimator.residuals.recordings]
    smeared = np.mean([path.blur_m**2 - path.least_blur_m**2 for path in paths if path is not None])
    return math.sqrt(diameter_m**2 + DISC_SPREAD**2 * max(float(smeared), 0.0))


def hulls(one: Mapping[str, Interval], named: Mapping[str, Interval]) -> dict[str, Interval]:
    """Return intervals that hold those of two fits of an effect, by label, with the values of the second."""
    return {label: other.reaching(one[label].low, one[label].high) for label, other in named.items()}
