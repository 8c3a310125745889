"""Trying every effect of the catalogue on top of a model: scored by all, fitted by the most promising."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import ROUGH_SPREAD, Fits
from gecar.reality.fitting.initial_values import starts
from gecar.reality.fitting.model import Model, Step, worthwhile
from gecar.reality.fitting.model_tolerance import shifts
from gecar.reality.fitting.parameters import Freedom, free
from gecar.reality.optimisation.cma_es import rough_search
from gecar.reality.optimisation.least_squares import Fit, cost, fit, weights
from gecar.reality.recordings.recording import Recording

Array = npt.NDArray[np.float64]

BEGUN, REFITTED = 10, 5
LEAST_GAIN = 0.02  # of cost, a block: less is not worth fitting
# Effects on whose landscape slopes mislead: slip, play, stiction, thresholds, an edge on the floor, waves.
ROUGH = frozenset(
    {"slippery_patch", "backlash", "static_friction", "dead_band", "tyre_friction", "torque_ripple"}
)
ROUGH_SHARE = 0.3  # of the best effect's gain: less is not worth the search
SHORT = 8  # generations of a first search
STUCK, STUCK_SPREAD = (
    1.5,
    1.5,
)  # structure a block that makes a fit doubtful; how far about it is then searched


@dataclass(frozen=True)
class _Ground:
    """How rough ground is searched.

    ``apart``: how far places begun from are from each other [coordinates]; ``restarts``: how many they are at most;
    ``finalists``: how many of them are searched on, for ``generations`` of ``wider`` times as many trials.
    """

    apart: float = 5.5
    restarts: int = 6
    finalists: int = 2
    generations: int = 22
    wider: int = 1


USUAL = _Ground()
# A patch's edge makes many valleys close together; with fewer finalists three seeds ended in three places.
GROUNDS = {"slippery_patch": _Ground(1.5, 12, 6, 40, 3)}


@dataclass(frozen=True)
class _Trial:
    """An effect's first fit, and the best places to search from."""

    effects: tuple[str, ...]
    freedom: Freedom
    fit: Fit
    places: tuple[Array, ...]
    promise: float
    base: Model

    @property
    def effect(self) -> str:
        return self.effects[-1]

    @property
    def values(self) -> dict[str, dict[str, float]]:
        return self.freedom.values(self.fit.z)


def steps(fits: Fits, catalogue: Sequence[str], recordings: Sequence[Recording], model: Model) -> list[Step]:
    """Try every other effect on top of a model; the most promising are refitted in full. Best first."""
    taken_off = shifts(fits, catalogue, model)
    others = [e for e in catalogue if e not in model.effects]
    bases = {e: fits.shifted(model, taken_off[e]) for e in others}
    rough = [t for t in (_screen(fits, recordings, bases[e], e) for e in others) if t]
    rough.sort(key=lambda t: -t.promise)
    if not rough or rough[0].promise < LEAST_GAIN * fits.blocks.count:
        return []
    begun = [_begin(fits, t) for t in rough[:BEGUN]]
    begun.sort(key=lambda t: t.fit.cost)
    gains = [t.base.cost - t.fit.cost for t in begun]
    # What is too small for a name may gain by imitating much; it must not shut the others out.
    best = max((g for t, g in zip(begun, gains, strict=True) if worthwhile(t, t.effect)), default=max(gains))
    done = []
    for trial, gain in list(zip(begun, gains, strict=True))[:REFITTED]:
        if gain < 0.02 * best:
            continue
        search = trial.effect in ROUGH and gain > ROUGH_SHARE * best and best > 0.05 * model.cost
        found = (
            _search(fits, trial)
            if search
            else fits.refit(trial.effects, trial.values, shift=trial.base.shift)
        )
        done.append(_step(fits, trial.effect, trial.base, found))
    done.sort(key=lambda s: -s.gain)
    if done and done[0].model.structure > STUCK * fits.blocks.count:
        done[0] = _step(fits, done[0].effect, done[0].base, _unstuck(fits, done[0].model))
    return done


def _screen(fits: Fits, recordings: Sequence[Recording], model: Model, effect: str) -> _Trial | None:
    """Score an effect without fitting it: by its slopes at the model, and by trying its starts."""
    freedom = free(fits.robot, (*model.effects, effect))
    residual = fits.residual(freedom, model.shift)

    def place(values: Mapping[str, float]) -> Array:
        return freedom.vector({**model.values, effect: values})

    begun = starts(effect, fits.robot, recordings, lambda values: residual(place(values)))
    places = [place(values) for values in begun]
    if not places:
        return None
    found = np.array([cost(residual(z)) for z in places])
    order = np.argsort(found)
    ground = GROUNDS.get(effect, USUAL)
    kept = _apart([places[k] for k in order], ground.restarts, ground.apart)
    slopes = fits.felt(model, effect)
    linear = _linear_gain(fits, model, slopes)
    promise = max(linear, model.cost - float(found[order[0]]))
    return _Trial((*model.effects, effect), freedom, Fit(kept[0], model.fit.errors, slopes, float(found[order[0]])),
                  kept, promise, model)  # fmt: skip


def _linear_gain(fits: Fits, model: Model, slopes: Array) -> float:
    """Return the gain the slopes alone promise, beside the model's own parameters."""
    w = np.sqrt(weights(model.fit.errors))
    g = fits.beside(model, slopes * w[:, None])
    if not g.shape[1]:
        return 0.0
    q = np.linalg.qr(g)[0]
    return 0.5 * float(np.sum((q.T @ (w * model.fit.errors)) ** 2))


def _begin(fits: Fits, trial: _Trial) -> _Trial:
    """Improve an effect's best start by two rounds."""
    first = fit(
        fits.residual(trial.freedom, trial.base.shift),
        trial.places[0],
        trial.freedom.bounds,
        trial.freedom.probes,
        rounds=2,
    )
    return replace(trial, fit=first)


def _search(fits: Fits, trial: _Trial) -> Model:
    """Fit an effect whose landscape is rough: from several starts without slopes, then with them."""
    model, freedom, residual = trial.base, trial.freedom, fits.residual(trial.freedom, trial.base.shift)
    own = slice(len(model.fit.z), None)
    spread = np.array([ROUGH_SPREAD.get(c.parameter.field, 1.0) for c in freedom.coordinates[own]])
    low, high = freedom.bounds

    def cost_of(tail: Array) -> float:
        return cost(residual(np.r_[model.fit.z, tail]))

    bounds = (low[own], high[own])
    short = [
        rough_search(cost_of, z[own], spread, bounds, fits.rng, SHORT) for z in (*trial.places, trial.fit.z)
    ]
    short.sort(key=lambda pair: pair[1])
    best, least = trial.fit.z, trial.fit.cost
    ground = GROUNDS.get(trial.effect, USUAL)
    for place, _ in short[: ground.finalists]:
        tail, found = rough_search(
            cost_of, place, 0.6 * spread, bounds, fits.rng, ground.generations, ground.wider
        )
        if found < least:
            best, least = np.r_[model.fit.z, tail], found
    return fits.polished(fits.refit(trial.effects, freedom.values(best), shift=model.shift))


def _unstuck(fits: Fits, model: Model) -> Model:
    """Search about a fit that leaves much, and fit on from there."""
    again = fits.polished(model, STUCK_SPREAD)
    if again is model:
        return model
    found = fits.refit(again.effects, again.values, shift=again.shift)
    return found if found.cost < again.cost else again


def _step(fits: Fits, effect: str, base: Model, found: Model) -> Step:
    colour = fits.blocks.colour(found.fit.errors)
    before, after = (fits.blocks.structure(m.fit.errors, colour) for m in (base, found))
    size = worthwhile(found, effect)
    return Step(effect, base, found, base.cost - found.cost, worthwhile=size, before=before, after=after)


def _apart(places: Sequence[Array], count: int, distance: float) -> tuple[Array, ...]:
    """Return the first few places that are no neighbours of each other."""
    kept: list[Array] = []
    for place in places:
        if len(kept) < count and all(np.max(np.abs(place - other)) > distance for other in kept):
            kept.append(place)
    return tuple(kept)
