"""Stepwise selection: effects added one by one while each proves itself, then swapped and dropped; or none named.

Source: forward, backward and stepwise selection, Draper and Smith, Applied Regression Analysis (3rd ed.), ch. 15.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gecar.reality.fitting.model import Model, Step
from gecar.reality.selection.acceptance import (
    RUNNERS_UP,
    candidates,
    is_worthwhile,
    number_accepted,
    number_beside_the_unexplained,
    proved,
)
from gecar.reality.selection.cross_validation import judged
from gecar.reality.selection.model_tolerance import without_tolerated
from gecar.reality.selection.problem import COMMON_DELAY, Problem
from gecar.reality.selection.screening import candidate_steps, step_of
from gecar.reality.selection.thresholds import (
    CLOCKS_FIRST,
    CLOCKS_OVER_COMMON,
    COMPETING,
    MAIN_SHARE,
    MOST_EFFECTS,
    MOST_ON_BENCH,
    UNEXPLAINED_SHARE,
)
from gecar.world.effects import BY_ID

BEGINNINGS = 3  # effects of the first stage a chain may begin with


@dataclass(frozen=True)
class Explanation:
    """What explains a problem's residuals.

    Attributes
    ----------
    problem
        The problem, with the camera's clocks fitted if they had to be.
    taken
        The model with the effects that were taken.
    left
        The same, rid of what changes too small for a name explain.
    steps
        How they were taken, in order.
    tried
        Everything fitted at each stage, for runners-up.
    unexplained
        Whether excess energy is left that no effect explains.
    spot
        Where on the floor it is left, if at one place only: x, y [m].
    """

    problem: Problem
    taken: Model
    left: Model
    steps: tuple[Step, ...]
    tried: tuple[tuple[Step, ...], ...]
    unexplained: bool
    spot: tuple[float, float] | None = None


def explain(problem: Problem) -> Explanation:
    """Take effects one by one as long as each proves itself; abstain where they only imitate.

    Where they explain nearly all, they are taken; where they do not, those of one size in all recordings. Where it
    takes several, other beginnings are tried, too: the first effect may have stood in for two causes.
    """
    first = candidate_steps(problem, problem.known) if _worth_fitting(problem, problem.known) else []
    with_clocks = _with_clocks(problem, problem.known, first)
    if with_clocks is not None:
        return explain(with_clocks)
    chain = _forward(problem, first)
    if chain.with_clocks is not None:
        return explain(chain.with_clocks)
    chains = [chain, *_other_beginnings(problem, first, chain)]
    if not any(each.steps for each in chains):
        chains = [each.beside_the_unexplained(problem) for each in chains]
    best = _shortest(chains, problem)
    tried = (tuple(first), *best.tried[1:])
    taken, steps = _swapped_and_dropped(problem, best.steps, tried)
    left = without_tolerated(problem, taken)
    return Explanation(problem, taken, left, steps, tried, is_unexplained(problem, left))


def is_unexplained(problem: Problem, left: Model) -> bool:
    """Whether a model leaves more excess energy than the simulation itself does."""
    floor = max(problem.limits.unexplained * problem.blocks, UNEXPLAINED_SHARE * problem.known.excess_energy)
    return left.excess_energy > floor


@dataclass(frozen=True)
class _Chain:
    """One forward selection.

    Of the ``proved`` steps the first ``steps`` were accepted and end in ``model``; ``with_clocks`` is the problem to
    begin anew, where the camera's clocks had to be fitted on the way.
    """

    proved: tuple[Step, ...]
    steps: tuple[Step, ...]
    model: Model
    tried: tuple[tuple[Step, ...], ...]
    with_clocks: Problem | None = None

    def beside_the_unexplained(self, problem: Problem) -> _Chain:
        """Return this with the steps that are accepted though nothing explains the rest."""
        steps = self.proved[: number_beside_the_unexplained(problem, self.proved)]
        return replace(self, steps=steps, model=steps[-1].model if steps else self.model)


def _forward(problem: Problem, first: Sequence[Step]) -> _Chain:
    """Go on from a first stage until nothing more proves itself."""
    model, steps, tried = problem.known, list[Step](), list[tuple[Step, ...]]()
    stage = tuple(first)
    most = int(MOST_ON_BENCH if problem.on_bench else MOST_EFFECTS)
    while True:
        tried.append(stage)
        step = _best(problem, stage)
        if step is None:
            break
        problem.tell(f"{step.effect}: explains {step.drop / step.energy_before:.0%} of what is left")
        steps.append(replace(step, stage=len(steps)))
        model = step.model
        if len(steps) == most or not _worth_fitting(problem, model):
            break
        stage = tuple(candidate_steps(problem, model))
        with_clocks = _with_clocks(problem, model, stage)
        if with_clocks is not None:
            return _Chain((), (), problem.known, (), with_clocks)
    accepted = tuple(steps[: number_accepted(problem, steps)])
    return _Chain(tuple(steps), accepted, accepted[-1].model if accepted else problem.known, tuple(tried))


def _best(problem: Problem, stage: Sequence[Step]) -> Step | None:
    """Return the best candidate that gains on left-out recordings; None if there is none."""
    return next(filter(proved, (judged(problem, step) for step in candidates(problem, stage))), None)


def _other_beginnings(problem: Problem, first: Sequence[Step], chain: _Chain) -> list[_Chain]:
    """Return the chains that begin with a runner-up, where the first took several effects, or explained a good part."""
    part = bool(chain.proved) and chain.proved[0].drop >= MAIN_SHARE * chain.proved[0].energy_before
    if not (len(chain.steps) > 1 or (not chain.steps and part)):
        return []
    rivals = [
        step for step in first[1:BEGINNINGS] if step.worthwhile and step.gain > COMPETING * first[0].gain
    ]
    chains = [_forward(problem, [step]) for step in rivals]
    return [other for other in chains if other.with_clocks is None]


def _shortest(chains: Sequence[_Chain], problem: Problem) -> _Chain:
    """Return the chain with the fewest effects, unless a longer one explains a good part of what that leaves."""
    floor = problem.limits.floor * problem.blocks
    accepted = [chain for chain in chains if chain.steps] or list(chains)
    accepted.sort(key=lambda chain: (len(chain.steps), chain.model.cost))
    best = accepted[0]
    for chain in accepted[1:]:
        left, more_left = (max(c.model.excess_energy, floor) for c in (chain, best))
        if len(chain.steps) > len(best.steps) and left < (1.0 - MAIN_SHARE) * more_left:
            best = chain
    return best


def _swapped_and_dropped(
    problem: Problem, accepted: Sequence[Step], tried: Sequence[Sequence[Step]]
) -> tuple[Model, tuple[Step, ...]]:
    """Refit what was accepted, with everything but the effects back at the robot's own constants.

    An effect taken early may have stood in for a cause that only the later ones let come forward: each is swapped
    against its runners-up, and dropped where the others can do without it.
    """
    if not accepted:
        return problem.known, ()
    estimator, floor = problem.estimator, problem.limits.floor * problem.blocks
    # The null distribution of what is left at the end; earlier ones are of what was left then.
    steps, best, null = list(accepted), accepted[-1].model, accepted[-1].null_95
    rivals = {step.effect: step for stage in tried for step in stage[:RUNNERS_UP]}
    for number, step in enumerate(accepted if len(accepted) > 1 else ()):
        rest = [e for e in best.effects if e != step.effect]
        swap = _swapped(problem, best, rest, list(rivals.values()), best.cost - null)
        if swap is not None:
            best, steps[number] = swap.model, replace(swap, stage=step.stage)
            continue
        without = estimator.fit(rest, best.values, tolerated=best.tolerated)
        if without.cost < best.cost + null or without.excess_energy < floor:
            best, steps[number] = without, replace(step, effect="")
    found = estimator.fit(best.effects, best.values)
    if any(BY_ID[effect].search for effect in found.effects):
        found = estimator.searched(found)
    return found, tuple(step for step in steps if step.effect)


def _swapped(
    problem: Problem, best: Model, rest: Sequence[str], rivals: Sequence[Step], least: float
) -> Step | None:
    """Return the step to the first rival in an effect's place that costs less than ``least`` and proves itself."""
    estimator = problem.estimator
    for other in rivals:
        if other.effect in best.effects:
            continue
        values = {**best.values, **other.model.values}
        swapped = estimator.fit((*rest, other.effect), values, tolerated=best.tolerated)
        if swapped.cost < least and is_worthwhile(swapped, other.effect):
            without = estimator.fit(rest, best.values, tolerated=best.tolerated)
            step = judged(problem, step_of(estimator, other.effect, without, swapped))
            if proved(step):
                return step
    return None


def _with_clocks(problem: Problem, model: Model, stage: Sequence[Step]) -> Problem | None:
    """Return the problem with camera clocks fitted, where they gain as much as the best effect of a stage."""
    common = max((step.gain for step in stage if step.effect == COMMON_DELAY), default=0.0)
    least = max(CLOCKS_FIRST * stage[0].gain, CLOCKS_OVER_COMMON * common) if stage else 0.0
    return problem.with_clocks(model, least)


def _worth_fitting(problem: Problem, model: Model) -> bool:
    return model.excess_energy > problem.limits.least_drop * problem.blocks
