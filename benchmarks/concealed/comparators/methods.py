"""Other ways to choose effects, put in the place of `gecar`'s: everything else of `gecar discover` stays."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from gecar.reality import discovery
from gecar.reality.fitting.initial_values import starts
from gecar.reality.fitting.model import Effects, Model, Step, worthwhile
from gecar.reality.fitting.parameters import free
from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.optimisation.least_squares import cost, weights
from gecar.reality.recordings.known_robot import known_robot
from gecar.reality.replay.replayer import Film
from gecar.reality.residuals.of_recording import CHANNELS, Strip
from gecar.reality.selection.selection import Selection
from gecar.reality.selection.stepwise import MOST_EFFECTS, Explanation
from gecar.reality.uncertainty.intervals import NORMAL_95, deviations
from gecar.reality.verdict import NextRecording

Array = npt.NDArray[np.float64]

ROUNDS = 5  # of a comparator's fits
REFITTED = 5  # effects a stage, as `gecar`
START_S = 1.0  # over which an open-loop replay's start pose is fitted


def by_bic(selection: Selection) -> Explanation:
    """Take the effect that lowers BIC most, as long as one does (Schwarz 1978); it has no way to abstain.

    Effects are screened as `gecar` screens them: only the criterion differs.
    """
    model, steps, tried = selection.nothing, list[Step](), list[tuple[Step, ...]]()
    while len(steps) < MOST_EFFECTS:
        stage = _stage(selection, model)
        tried.append(tuple(stage))
        best = min(stage, key=lambda step: _bic(step.model), default=None)
        if best is None or _bic(best.model) >= _bic(model):
            break
        steps.append(best)
        model = best.model
    return Explanation(model, tuple(steps), tuple(tried), unexplained=False)


def _bic(model: Model) -> float:
    """Return the Bayesian information criterion; the cost is half a sum of squares in units of the noise."""
    return 2.0 * model.cost + len(model.fit.z) * math.log(max(len(model.fit.errors), 1))


def _stage(selection: Selection, model: Model) -> list[Step]:
    """Fit the effects that promise most, by their slopes or from the best of their starts."""
    others = [e for e in selection.catalogue if e not in model.effects]
    begun = {e: _begun(selection, model, e) for e in others}
    best = sorted(others, key=lambda e: -begun[e][0])[:REFITTED]
    fitted = [selection.refit((*model.effects, e), begun[e][1], ROUNDS) for e in best]
    return sorted((Step(m.effects[-1], model, m, model.cost - m.cost) for m in fitted), key=lambda s: -s.gain)


def _begun(selection: Selection, model: Model, effect: str) -> tuple[float, Effects]:
    """Return what one more effect promises to gain, and the best of its starts."""
    freedom = free(selection.robot, (*model.effects, effect))
    residual = selection.residual(freedom)

    def errors(values: Mapping[str, float]) -> Array:
        return residual(freedom.vector({**model.values, effect: values}))

    begun = starts(effect, selection.robot, selection.recordings, errors)
    places = [{**model.values, effect: v} for v in begun]
    costs = [cost(residual(freedom.vector(values))) for values in places]
    gain = model.cost - min(costs, default=math.inf)
    return max(gain, _promise(selection, model, effect)), places[int(np.argmin(costs))] if places else {}


def _promise(selection: Selection, model: Model, effect: str) -> float:
    """Return what the slopes alone promise an effect gains, beside the model's own parameters: a score test."""
    w = np.sqrt(weights(model.fit.errors))
    g = selection.beside(model, selection.felt(model, effect) * w[:, None])
    return 0.5 * float(np.sum((np.linalg.qr(g)[0].T @ (w * model.fit.errors)) ** 2))


def everything(selection: Selection) -> Explanation:
    """Fit all effects at once; name those of a size worth it whose 95 % interval leaves out neutral."""
    model = selection.refit(selection.catalogue, {}, ROUNDS)
    sure = np.abs(model.fit.z) > NORMAL_95 * deviations(selection, model)
    seen = {c.effect.id for c, told in zip(model.freedom.coordinates, sure, strict=True) if told}
    named = [e for e in selection.catalogue if e in seen and worthwhile(model, e)]
    steps = [Step(e, selection.nothing, model, selection.nothing.cost - model.cost) for e in named]
    return Explanation(model, tuple(steps), ((),) * len(steps), unexplained=False)


class WithoutNull(Selection):
    """Takes a step when left-out recordings gain anything at all."""

    def judged(self, step: Step) -> Step:
        """Judge a step by leaving out recordings alone."""
        return replace(super().judged(step), null_95=0.0, p=0.0)


class WithoutRefit(Selection):
    """Ranks effects by what their slopes promise, and takes one step along them: screening, never a fit."""

    def steps(self, model: Model) -> list[Step]:
        """Rank every other effect by its slopes at the model."""
        promises = {e: _promise(self, model, e) for e in self.catalogue if e not in model.effects}
        best = sorted(promises, key=lambda e: -promises[e])[:REFITTED]
        return [self._linear(model, effect, promises[effect]) for effect in best]

    def _linear(self, model: Model, effect: str, promise: float) -> Step:
        found = self.refit((*model.effects, effect), model.values)
        colour = self.blocks.colour(found.fit.errors)
        before, after = (self.blocks.structure(m.fit.errors, colour) for m in (model, found))
        size = worthwhile(found, effect)
        return Step(effect, model, found, promise, worthwhile=size, before=before, after=after)

    def refit(
        self, effects: Sequence[str], values: Effects, rounds: int = 1, shift: Array | None = None
    ) -> Model:
        """Take one step along the slopes, however many rounds are asked for."""
        return super().refit(effects, values, min(rounds, 1), np.zeros(1) if shift is None else shift)

    def polished(self, model: Model, spread: float = 0.0) -> Model:  # noqa: ARG002
        """Leave the model as it is."""
        return model


class OpenLoop(Strip):
    """Motion's residuals as they accumulate over a whole replay, in units of the sensors' noise: not whitened."""

    def __init__(self, *parts: Any) -> None:
        super().__init__(*parts)
        self.whole = Film(self.recording, self.noise.sd)
        self.whole.start = self.whole.aligned_start(known_robot(self.recording).physics, START_S)

    def errors(self, physics: npt.NDArray[Any], sight: bool) -> Array:
        """Return the residuals of motion open loop, or those of the colour sensor as they are."""
        if sight:
            return super().errors(physics, sight)
        self.whole.offset_s = self.film.offset_s
        _, rows, _, poses = self.whole.play(physics)
        return np.concatenate([rows.T.ravel(), poses.T.ravel()])


def _white(blocks: Blocks, errors: Array) -> Array:  # noqa: ARG001
    """Take all noise for white."""
    return np.ones(len(CHANNELS))


# By name: what stands in for which part, and where that part is.
METHODS: dict[str, tuple[tuple[Any, str, object], ...]] = {
    "bic": ((discovery, "explain", by_bic),),
    "everything": ((discovery, "explain", everything),),
    "no_whitening": ((discovery, "Strip", OpenLoop), (Blocks, "colour", _white)),
    "no_null": ((discovery, "Selection", WithoutNull),),
    "no_refit": ((discovery, "Selection", WithoutRefit),),
}
# What the scorer does not read costs time.
_UNREAD: tuple[tuple[Any, str, Callable[..., object]], ...] = (
    (discovery, "describe", lambda *_: ()),
    (discovery, "suggest", lambda *_: NextRecording("", ())),
)


@contextlib.contextmanager
def changed(name: str) -> Iterator[None]:
    """Put a method's parts in the place of `gecar`'s."""
    with contextlib.ExitStack() as stack:
        for owner, part, other in (*METHODS[name], *_UNREAD):
            stack.enter_context(patch.object(owner, part, other))
        yield
