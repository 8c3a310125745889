"""Other ways to choose effects, put in the place of `gecar`'s: everything else of `gecar discover` stays."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from gecar.reality import discovery
from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Effects, Model, Step
from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.optimisation.least_squares import cost_of_each
from gecar.reality.prove import confirmation
from gecar.reality.replay.channels import CHANNELS
from gecar.reality.replay.replayer import Replayer, replayer_of
from gecar.reality.residuals import of_case
from gecar.reality.residuals.of_recording import RecordingResiduals, residuals_of
from gecar.reality.selection import cross_validation, stepwise
from gecar.reality.selection.acceptance import is_worthwhile
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.stepwise import Explanation, concluded
from gecar.reality.selection.thresholds import MOST_EFFECTS
from gecar.reality.uncertainty.intervals import half_widths
from gecar.reality.verdict import NextRecording
from gecar.world.robot import load_robot

Array = npt.NDArray[np.float64]

ROUNDS = 5  # of a comparator's fits
REFITTED = 5  # effects a stage, as `gecar`
START_S = 1.0  # over which an open-loop replay's start pose is fitted


def by_bic(problem: Problem, once_more: bool = False) -> Explanation:  # noqa: ARG001
    """Take the effect that lowers BIC most, as long as one does (Schwarz 1978).

    Effects are screened as `gecar` screens them: only the criterion differs.
    """
    model, steps, tried = problem.known, list[Step](), list[tuple[Step, ...]]()
    while len(steps) < MOST_EFFECTS:
        stage = _stage(problem, model)
        tried.append(tuple(stage))
        best = min(stage, key=lambda step: _bic(step.model), default=None)
        if best is None or _bic(best.model) >= _bic(model):
            break
        steps.append(best)
        model = best.model
    return concluded(problem, model, steps, tried)


def _bic(model: Model) -> float:
    """Return the Bayesian information criterion; the cost is half a sum of squares in units of the noise."""
    return 2.0 * model.cost + len(model.z) * math.log(max(len(model.errors), 1))


def _stage(problem: Problem, model: Model) -> list[Step]:
    """Fit the effects that promise most, by their sensitivities or from the best of their starts."""
    others = [e for e in problem.tried if e not in model.effects]
    begun = {e: _begun(problem, model, e) for e in others}
    best = sorted(others, key=lambda e: -begun[e][0])[:REFITTED]
    fitted = [problem.estimator.fit((*model.effects, e), begun[e][1], ROUNDS) for e in best]
    return sorted((Step(m.effects[-1], model, m, model.cost - m.cost) for m in fitted), key=lambda s: -s.gain)


def _begun(problem: Problem, model: Model, effect: str) -> tuple[float, Effects]:
    """Return what one more effect promises to gain, and the best of its starts."""
    estimator = problem.estimator
    starts = estimator.starts(model, effect)
    costs = cost_of_each(estimator.trial(model, effect), starts)
    gain = model.cost - min(costs, default=math.inf)
    return (
        max(gain, estimator.linear_gain(model, effect)),
        {**model.values, effect: starts[int(np.argmin(costs))]} if starts else {},
    )


def everything(problem: Problem, once_more: bool = False) -> Explanation:  # noqa: ARG001
    """Fit all effects at once; name those of a size worth it whose 95 % interval leaves out neutral."""
    model = problem.estimator.fit(problem.tried, {}, ROUNDS)
    sure = np.abs(model.z) > half_widths(problem.estimator, model)
    seen = {c.effect.id for c, told in zip(model.parameters.coordinates, sure, strict=True) if told}
    named = [e for e in problem.tried if e in seen and is_worthwhile(model, e)]
    steps = [Step(e, problem.known, model, problem.known.cost - model.cost) for e in named]
    return concluded(problem, model, steps, ((),) * len(steps))


def without_null(problem: Problem, step: Step) -> Step:
    """Judge a step by leaving out recordings alone: take it when they gain anything at all."""
    return replace(cross_validation.judged(problem, step), null_95=0.0, p=0.0)


def by_sensitivities(problem: Problem, model: Model, before: Sequence[Step] = ()) -> list[Step]:  # noqa: ARG001
    """Rank every other effect by its sensitivities, and take one step along them: screening, never a fit."""
    others = (e for e in problem.tried if e not in model.effects)
    promises = {e: problem.estimator.linear_gain(model, e) for e in others}
    best = sorted(promises, key=lambda e: -promises[e])[:REFITTED]
    return [_linear_step(problem.estimator, model, effect, promises[effect]) for effect in best]


def _linear_step(estimator: Estimator, model: Model, effect: str, promise: float) -> Step:
    found = estimator.fit((*model.effects, effect), model.values)
    inflation = estimator.blocks.inflation(found.errors)
    before, after = (estimator.blocks.excess_energy(m.errors, inflation) for m in (model, found))
    size = is_worthwhile(found, effect)
    return Step(effect, model, found, promise, worthwhile=size, energy_before=before, energy_after=after)


_fit = Estimator.fit


def one_iteration(
    estimator: Estimator,
    effects: Sequence[str],
    values: Effects,
    rounds: int = 1,
) -> Model:
    """Take one step along the sensitivities, however many rounds are asked for."""
    return _fit(estimator, effects, values, min(rounds, 1))


def as_it_is(estimator: Estimator, model: Model, spread: float = 0.0) -> Model:  # noqa: ARG001
    """Leave the model as it is."""
    return model


@dataclass(frozen=True)
class OpenLoop(RecordingResiduals):
    """Motion's residuals as they accumulate over a whole replay, in units of the sensors' noise: not whitened."""

    open_start: Array = field(default_factory=lambda: np.zeros(3))

    def motion_errors(self, physics: npt.NDArray[Any]) -> Array:
        """Return the residuals of motion open loop under m physics records, shape (m, n)."""
        played = (self._whole.play(physics[k : k + 1], self.open_start) for k in range(len(physics)))
        return np.stack([np.r_[p.row_errors.T.ravel(), p.pose_errors.T.ravel()] for p in played])

    @property
    def _whole(self) -> Replayer:
        return replayer_of(self.recording, self.noise.sd).with_clock(self.nuisances.clock_offset_s)


def open_loop_residuals_of(*parts: Any) -> RecordingResiduals:
    """Set a recording beside its open-loop simulation."""
    beside = residuals_of(*parts)
    known = load_robot(beside.recording.setup.robot).physics
    start = replayer_of(beside.recording, beside.noise.sd).aligned_start(known, START_S)
    return OpenLoop(**vars(beside), open_start=start)


def _white(blocks: Blocks, errors: Array) -> Array:  # noqa: ARG001
    """Take all noise for white."""
    return np.ones(len(CHANNELS))


def without_discrepancy(problem: Problem, *_: object, **__: object) -> Problem:
    """Take the simulation for exact: only the sensors' noise counts."""
    return problem


_NO_HOTSPOT = (discovery, "with_spot", lambda explained: explained)
# By name: what stands in for which part, and where that part is.
METHODS: dict[str, tuple[tuple[Any, str, object], ...]] = {
    "bic": ((confirmation, "explain", by_bic), _NO_HOTSPOT),
    "everything": ((confirmation, "explain", everything), _NO_HOTSPOT),
    "no_whitening": ((of_case, "residuals_of", open_loop_residuals_of), (Blocks, "inflation", _white)),
    "no_discrepancy": ((Problem, "under", without_discrepancy),),
    "no_null": ((stepwise, "judged", without_null),),
    "no_refit": (
        (stepwise, "candidate_steps", by_sensitivities),
        (Estimator, "fit", one_iteration),
        (Estimator, "searched", as_it_is),
    ),
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
