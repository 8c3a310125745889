"""Screening: every effect of the catalogue scored on top of a model; the most promising are fitted in full."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model, Step
from gecar.reality.fitting.parameters import Parameters
from gecar.reality.fitting.parameters import free as free_parameters
from gecar.reality.optimisation.cma_es import cma_es
from gecar.reality.optimisation.least_squares import Minimum, cost_of_each, least_squares
from gecar.reality.selection.acceptance import competing, is_worthwhile, rank
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.thresholds import (
    COMPETING,
    DOUBTFUL_FIT,
    NEGLIGIBLE,
    PRICE,
    PROMISING,
    SEARCHED,
)
from gecar.world.effects import BY_ID, Search

Array = npt.NDArray[np.float64]

IMPROVED, REFITTED = 10, 5  # effects of a stage that are improved by two iterations, and fitted in full
SHORT = 8  # generations of a first search
FINALIST_SPREAD = 0.6  # of a parameter's search spread, for the second search
DOUBTFUL_SPREAD = 1.5  # of a parameter's search spread, about a fit that leaves much
USUAL = Search()


@dataclass(frozen=True)
class _Trial:
    """An effect on top of a model: the best starting values, where a first fit ended, and the gain it promises."""

    effects: tuple[str, ...]
    parameters: Parameters
    minimum: Minimum
    starts: tuple[Array, ...]
    promise: float
    base: Model

    @property
    def effect(self) -> str:
        return self.effects[-1]

    @property
    def gain(self) -> float:
        return self.base.cost - self.minimum.cost

    @property
    def values(self) -> dict[str, dict[str, float]]:
        return self.parameters.values(self.minimum.z)

    @property
    def search(self) -> Search | None:
        return BY_ID[self.effect].search


def candidate_steps(problem: Problem, model: Model, before: Sequence[Step] = ()) -> list[Step]:
    """Try every other effect on top of a model; the most promising are fitted in full. Best first.

    Parameters
    ----------
    problem
        Under the discrepancy the model leaves.
    model
        With the effects taken so far.
    before
        The stage at which the last of them was taken: what rivalled it is also fitted where they share what it does.
    """
    estimator = problem.estimator
    others = [effect for effect in problem.tried if effect not in model.effects]
    estimator.sensitivities(model, others)  # all at once, in lock step
    scored = (problem.once("scored", model.key, e, make=partial(_scored, problem, model, e)) for e in others)
    trials = [trial for trial in scored if trial]
    trials.sort(key=lambda t: -t.promise)
    shared = _sharing(problem, model, before)
    if not trials or trials[0].promise < PROMISING * PRICE:
        return shared
    begun = [
        problem.once("improved", model.key, t.effect, make=partial(_improved, estimator, t))
        for t in trials[:IMPROVED]
    ]
    begun.sort(key=lambda t: t.minimum.cost)
    best = max(t.gain for t in begun)
    steps = [
        problem.once("fitted", model.key, t.effect, search, make=partial(_fitted, estimator, t, search))
        for t, search in ((t, _search_of(t, best)) for t in begun[:REFITTED])
        if t.gain >= NEGLIGIBLE * best
    ]
    steps = _best_of_each([*steps, *shared])
    if steps and steps[0].model.excess_energy > DOUBTFUL_FIT * problem.blocks:
        steps[0] = step_of(
            estimator, steps[0].effect, steps[0].base, _searched_about(estimator, steps[0].model)
        )
    return steps


def _scored(problem: Problem, model: Model, effect: str) -> _Trial | None:
    """Score an effect without fitting it: by its sensitivities at the model, and by trying its starting values."""
    estimator = problem.estimator
    parameters = free_parameters(estimator.robot, (*model.effects, effect))
    values = estimator.starts(model, effect)
    if not values:
        return None
    starts = [parameters.vector({**model.values, effect: each}) for each in values]
    found = cost_of_each(estimator.trial(model, effect), values)
    order = np.argsort(found)
    search = BY_ID[effect].search or USUAL
    kept = _apart([starts[k] for k in order], search.restarts, search.apart)
    least = float(found[order[0]])
    promise = max(estimator.linear_gain(model, effect), model.cost - least)
    start = Minimum(kept[0], model.errors, least)
    return _Trial((*model.effects, effect), parameters, start, kept, promise, model)


def _sharing(problem: Problem, model: Model, before: Sequence[Step]) -> list[Step]:
    """Fit each rival of the effect taken last together with half of that effect. Best first.

    A high centre of mass stood in for a lower one on tyres that slip: with all of it, no tyres gained anything.
    """
    steps = [
        problem.once(
            "shared", model.key, rival.model.key, make=partial(_shared, problem.estimator, model, rival)
        )
        for rival in competing(before)
        if rival.effect not in model.effects
    ]
    return _best_of_each(steps)


def _shared(estimator: Estimator, model: Model, rival: Step) -> Step:
    """Fit a rival on top of a model: from its own size, and sizes of the others half way between the two models."""
    effects = (*model.effects, rival.effect)
    parameters = free_parameters(estimator.robot, effects)
    ours, theirs = (parameters.vector(values) for values in (model.values, rival.model.values))
    own = np.array([c.effect.id == rival.effect for c in parameters.coordinates])
    placed = np.array([not c.effect.differentiable for c in parameters.coordinates])
    start = np.where(own, theirs, np.where(placed, ours, (ours + theirs) / 2.0))
    return step_of(estimator, rival.effect, model, estimator.fit(effects, parameters.values(start)))


def _best_of_each(steps: Sequence[Step]) -> list[Step]:
    """Return each effect's best step, best first."""
    best = {step.effect: step for step in sorted(steps, key=lambda s: s.gain)}
    return sorted(best.values(), key=rank, reverse=True)


def _improved(estimator: Estimator, trial: _Trial) -> _Trial:
    """Improve an effect's best start by two iterations."""
    residual = estimator.residual(trial.parameters)
    bounds, probes = trial.parameters.bounds, trial.parameters.probes
    begun = least_squares(residual, trial.starts[0], bounds, probes, rounds=2, past_jumps=estimator.on_bench)
    return replace(trial, minimum=replace(begun, errors=trial.base.errors))  # those there are not kept


def _search_of(trial: _Trial, best: float) -> Search | None:
    """Return how to search for an effect without derivatives, where they mislead and it is a rival; else None."""
    rival = trial.gain > COMPETING * best and trial.gain > SEARCHED * PRICE
    return trial.search if rival else None


def _fitted(estimator: Estimator, trial: _Trial, search: Search | None) -> Step:
    """Fit an effect in full."""
    found = _searched(estimator, trial, search) if search else estimator.fit(trial.effects, trial.values)
    return step_of(estimator, trial.effect, trial.base, found)


def _searched(estimator: Estimator, trial: _Trial, search: Search) -> Model:
    """Fit an effect from several starts without derivatives, then with them."""
    model, parameters = trial.base, trial.parameters
    residual = estimator.residual(parameters)
    own = slice(len(model.z), None)
    spread = np.array([c.parameter.search_spread for c in parameters.coordinates[own]])
    low, high = parameters.bounds
    bounds = (low[own], high[own])

    def costs_of(tails: Array) -> Array:
        return cost_of_each(residual, np.column_stack([np.tile(model.z, (len(tails), 1)), tails]))

    starts = (*trial.starts, trial.minimum.z)
    short = [cma_es(costs_of, z[own], spread, bounds, estimator.rng, SHORT) for z in starts]
    short.sort(key=lambda pair: pair[1])
    best, least = trial.minimum.z, trial.minimum.cost
    for start, _ in short[: search.finalists]:
        tail, found = cma_es(
            costs_of,
            start,
            FINALIST_SPREAD * spread,
            bounds,
            estimator.rng,
            search.generations,
            search.trials_factor,
        )
        if found < least:
            best, least = np.r_[model.z, tail], found
    refined = estimator.fit(trial.effects, parameters.values(best))
    return estimator.searched(refined)


def _searched_about(estimator: Estimator, model: Model) -> Model:
    """Search about a fit that leaves much, and fit on from there."""
    again = estimator.searched(model, DOUBTFUL_SPREAD)
    if again is model:
        return model
    found = estimator.fit(again.effects, again.values)
    return found if found.cost < again.cost else again


def step_of(estimator: Estimator, effect: str, base: Model, found: Model) -> Step:
    """Return the step from a model to one with an effect more."""
    inflation = estimator.blocks.inflation(found.errors)
    before, after = (estimator.blocks.excess_energy(m.errors, inflation) for m in (base, found))
    size = is_worthwhile(found, effect)
    return Step(
        effect,
        base,
        found,
        base.cost - found.cost,
        worthwhile=size,
        energy_before=before,
        energy_after=after,
    )


def _apart(starts: Sequence[Array], count: int, distance: float) -> tuple[Array, ...]:
    """Return the first few starts that are no neighbours of each other."""
    kept: list[Array] = []
    for start in starts:
        if len(kept) < count and all(np.max(np.abs(start - other)) > distance for other in kept):
            kept.append(start)
    return tuple(kept)
