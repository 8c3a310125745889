"""Which steps are accepted: of a size worth a name, proved on left-out recordings, and no imitation of a cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import chdtri

from gecar.reality.fitting.initial_values import top_speed
from gecar.reality.fitting.model import Model, Step
from gecar.reality.fitting.parameters import Parameters, free
from gecar.reality.materiality import Size
from gecar.reality.replay.kernel import TIMING
from gecar.reality.residuals.parting import Sizes
from gecar.reality.selection.homogeneity import heterogeneity
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import (
    BREAKAWAY_SPEED,
    COMPETING,
    LEAST_INVERSE,
    PRICE,
    PROMISING,
    SIGNIFICANCE,
    STEADY,
    STOPPED,
    WORSE,
)
from gecar.world.effects import BY_ID, Parameter
from gecar.world.rollout import STEP_S

Array = np.ndarray[tuple[int], np.dtype[np.float64]]
Share = Callable[[Parameter], float]  # of a parameter's size in the catalogue that is worth a name

BREAKAWAY, POINT = "static_friction", "point_drag"
NEAR_CASTER_M = 0.02  # a ball and its holder are as wide
AT_BOUND = 0.01  # coordinates
PHASES = 4  # of steps, over which a gain is averaged
RUNNERS_UP = 4  # effects of a stage that are judged, and tried in the place of what was taken
# What an effect is that does not say where it acts, of one that does: grip lost everywhere, a caster that drags. The
# latter must gain more by what its so many parameters of the place gain by chance (likelihood ratio test at 5 %, Wilks,
# Annals of Math. Statistics 9 (1938) 60).
UNPLACED = {"slippery_patch": ("tyre_friction", 3), "point_drag": ("caster_drag", 2)}


def whole(parameter: Parameter) -> float:  # noqa: ARG001
    """Return the whole of a parameter's size in the catalogue: its share that is worth a name by default."""
    return 1.0


def worthwhile(parameters: Parameters, z: Array, effect: str, share: Share = whole) -> bool:
    """Whether an effect's size at a vector of parameters is worth a name: this share of the catalogue's, or more."""
    if BY_ID[effect].worth:
        found, of = parameters.values(z)[effect], {p.label: share(p) for p in BY_ID[effect].parameters}
        return any(
            all(found[label] >= of[label] * size for label, size in worth.items())
            for worth in BY_ID[effect].worth
        )
    return any(
        not _is_stopped(parameters, z, k)
        and abs(z[k]) >= (LEAST_INVERSE if c.inverse else share(c.parameter))
        for k, c in enumerate(parameters.coordinates)
        if c.effect.id == effect and (c.parameter.worthwhile > 0.0 or c.inverse)
    )


def is_worthwhile(model: Model, effect: str, share: Share = whole) -> bool:
    """Whether an effect's size in a model is worth a name."""
    return worthwhile(model.parameters, model.z, effect, share)


def worsens(problem: Problem, without: Model, with_effect: Model, sizes: Sizes | None = None) -> bool:
    """Whether whole drives come out worse with an effect than without, where that is material.

    They do where an effect needs small changes of other constants to make up for it, which no robot file has. Of two
    causes that make up for each other, the first shows as much afterwards as before, in other channels.

    Parameters
    ----------
    problem
        What is material.
    without, with_effect
        The models.
    sizes
        Under the commands of which recordings; default: those fitted on.
    """
    left = (sizes or problem.sizes).left
    return is_worse(*(problem.material.times(left(model.physics)) for model in (without, with_effect)))


def is_worse(before: float, now: float) -> bool:
    """Whether drives are off by a quarter more than before, and by a material amount; in times the material size."""
    return now > max(WORSE * before, 1.0)


def candidates(problem: Problem, stage: Sequence[Step]) -> list[Step]:
    """Return the best steps of a stage that gain enough, and after which whole drives come out no worse.

    On a bench nothing is noise: there, those of a size worth a name.
    """
    stage = [step for step in stage if not is_another(problem, step.model)]
    if problem.on_bench:
        stage = [step for step in stage if step.worthwhile]
    enough = [step for step in competing(stage)[:RUNNERS_UP] if not imitates_a_step(problem, step)]
    if problem.on_bench:
        return [step for step in enough if not stopped(step, own=True)]
    return [step for step in enough if not (stopped(step) or _worsens(problem, step))]


def rank(step: Step) -> float:
    """Return a step's gain, less what it costs to say where an effect acts."""
    return step.gain - _place_costs(step.effect)


def lead(found: Step, rival: str) -> float:
    """Return how much less a rival must cost to replace an effect; negative for the rival that `UNPLACED` gives it."""
    unplaced, _ = UNPLACED.get(found.effect, ("", 0))
    return -_place_costs(found.effect) if unplaced == rival else found.null_95


def _place_costs(effect: str) -> float:
    """Return what it costs to say where an effect acts, in log-likelihood; 0 of one that does not say."""
    _, parameters = UNPLACED.get(effect, ("", 0))
    return 0.5 * float(chdtri(parameters, 0.05)) if parameters else 0.0


def competing(stage: Sequence[Step]) -> list[Step]:
    """Return the steps of a stage, in its order, that gain what a name costs and a good part of the best gain."""
    best = max((step.gain for step in stage), default=0.0)
    return [step for step in stage if step.gain >= max(PRICE, COMPETING * best)]


def _worsens(problem: Problem, step: Step) -> bool:
    """Whether whole drives come out worse. A place on the floor is exempt: a drive slightly off its path misses it."""
    return not BY_ID[step.effect].at_a_place and worsens(problem, step.base, step.model)


def is_another(problem: Problem, model: Model) -> bool:
    """Whether an effect of a model is another one by its shape: dry friction, or a caster that drags."""
    return imitates_dry_friction(problem, model) or is_at_the_caster(problem, model)


def imitates_dry_friction(problem: Problem, model: Model) -> bool:
    """Whether a model's breakaway friction lasts up to speeds at which it must have given way to sliding friction."""
    if BREAKAWAY not in model.effects:
        return False
    fastest = max(map(top_speed, problem.recordings))
    return model.values[BREAKAWAY]["speed_rad_s"] > BREAKAWAY_SPEED * fastest > 0.0


def is_at_the_caster(problem: Problem, model: Model) -> bool:
    """Whether what drags in a model does so where the caster is, or as far ahead of the axle."""
    if POINT not in model.effects:
        return False
    caster_m = abs(float(problem.estimator.robot.physics["caster_ahead"][0]))
    at = model.values[POINT]
    return math.hypot(at["left_m"], at["off_axle_m"] - caster_m) < NEAR_CASTER_M


def imitates_a_step(problem: Problem, step: Step) -> bool:
    """Whether an effect gains only because of where the simulation's steps fall among the commands.

    When a tyre slips or holds again is known to a step only, and what follows depends on it. A clock that is slightly
    fast moves commands and steps against each other, so that some rate of it fits by chance: in one case with nothing
    concealed the same rate gained 51 to -40, depending on where the steps begin.
    """
    if not any(p.field in TIMING for p in BY_ID[step.effect].parameters):
        return False
    gains = [step.gain]
    for later in map(problem.residuals.later, STEP_S * np.arange(1, PHASES) / PHASES):
        before, after = (
            problem.estimator.cost_of(later.errors(model.physics)) for model in (step.base, step.model)
        )
        gains.append(before - after)
    return float(np.mean(gains)) < PRICE


def stopped(step: Step, own: bool = False) -> bool:
    """Whether any size of a step's model grew until a bound stopped it, or any of its own effect alone."""
    return at_a_bound(step.model, step.effect if own else None)


def at_a_bound(model: Model, effect: str | None = None) -> bool:
    """Whether any size of a model, or of one of its effects, grew until a bound stopped it."""
    parameters, z = model.parameters, model.z
    return any(
        _is_stopped(parameters, z, k)
        for k, c in enumerate(parameters.coordinates)
        if (c.parameter.worthwhile > 0.0 or c.inverse) and effect in (None, c.effect.id)
    )


def _is_stopped(parameters: Parameters, z: Array, k: int) -> bool:
    """Whether a coordinate grew until a bound stopped it: a cause has a size, what has none imitates another."""
    low, high = (float(bound[k]) for bound in parameters.bounds)
    return bool(abs(z[k]) > STOPPED and (z[k] > high - AT_BOUND or z[k] < low + AT_BOUND))


def proved(step: Step) -> bool:
    """Whether a judged step gains more on left-out recordings than the null distribution allows.

    As many are judged at a stage as there are runners-up: Bonferroni's correction.
    """
    return bool(step.left_out.sum() > step.null_95 and step.p < SIGNIFICANCE / RUNNERS_UP)


def is_material(problem: Problem, model: Model, step: Step) -> bool:
    """Whether an effect is worth a name, and moves the robot by enough for anyone to mind."""
    worth = is_worthwhile(model, step.effect, problem.share)
    return worth and problem.material.times(size_of(problem, model, step)) >= 1.0


def size_of(problem: Problem, model: Model, step: Step) -> Size:
    """Return what an effect does to the robot under the commands of the recordings."""
    values = {effect: v for effect, v in model.values.items() if effect != step.effect}
    parameters = free(problem.estimator.robot, model.effects)
    return problem.sizes.apart(model.physics, parameters.physics(parameters.vector(values)))


def stands_out(problem: Problem, step: Step) -> bool:
    """Whether an effect has nearly one size in all recordings, as causes have beside physics that nothing explains."""
    return unevenness(problem, step) < STEADY


def most_uneven(problem: Problem, steps: Sequence[Step]) -> Step | None:
    """Return the effect whose size differs most between recordings, of those that do not stand out; None: all do."""
    spreads = [(unevenness(problem, step), step) for step in steps]
    spread, worst = max(spreads, key=lambda pair: pair[0], default=(0.0, None))
    return worst if spread >= STEADY else None


def unevenness(problem: Problem, step: Step) -> float:
    """Return the spread of an effect's size over recordings beyond sampling noise; infinite where it gains too little.

    Relative to the size. What gains less than an effect must to be kept has none.

    Parameters
    ----------
    problem
        Under the discrepancy that the step's model leaves.
    step
        By which the effect was taken.
    """
    without, with_effect = problem.estimator.models_of(step)
    if without.cost - with_effect.cost < PROMISING * PRICE:
        return math.inf
    folds = problem.estimator.blocks.folds.astype(np.intp)
    return heterogeneity(folds, without.errors, with_effect.errors).relative
