"""Effects beside laws: which are added after a law, exchanged, dropped, or taken back after they were refused."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import directions
from gecar.reality.fitting.model import Step
from gecar.reality.fitting.parameters import free
from gecar.reality.invent.sentences import Laws, pieces, shortened
from gecar.reality.invent.written import (
    Together,
    Written,
    fitted_with,
    fitted_without,
    together,
    written_with,
)
from gecar.reality.prove.confirmation import confirmed
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.acceptance import is_material, size_of, stands_out
from gecar.reality.selection.cross_validation import judged
from gecar.reality.selection.homogeneity import drifts
from gecar.reality.selection.screening import candidate_steps
from gecar.reality.selection.stepwise import Explanation, beside_others, proved_steps
from gecar.reality.selection.thresholds import MOST_EFFECTS, PRICE
from gecar.reality.uncertainty.intervals import intervals, weakest_absent
from gecar.reality.verdict import Invented
from gecar.world.terms import Term

Array = npt.NDArray[np.float64]

AS_MUCH = 0.5  # of what a part of a law does: what an effect's derivative must do, to be tried in its place
SAME = 0.98  # the same, of an effect that a law is
# Share of what laws do below which an effect may only correct their form: a wrong one did 0.06, a right one 0.10.
MENDS = 0.07


def with_effects(written: Written, first: Explanation, held: Residuals) -> Written:
    """Exchange and add effects beside the laws, one at a time, while all of them hold with every constant fitted again.

    Beside what no list holds, a cause may have been refused, as its size seemed to differ between recordings, or
    another may have stood in for it; or it may have become a part of a law, as dry friction is ``c * sign(speed)``.
    """
    for step in written.explained.steps:
        without = _refitted(written, first, fitted_without(written, first, step))
        swapped = _with_one_more(without, first, held)
        if swapped and step.effect not in swapped.explained.taken.effects:
            written = swapped
    written = _in_place_of_laws(_as_effect(written, first), first, held)
    while len(written.explained.taken.effects) < MOST_EFFECTS:
        more = _with_one_more(written, first, held)
        if more is None:
            break
        written = more
    return _without_idle(written, first)


def _without_idle(written: Written, first: Explanation) -> Written:
    """Drop the laws that gain less than a name costs, since an effect that was added later does what they did."""
    for k in reversed(range(len(written.terms))):
        fewer, told = _without_law(written, k)
        fitted = fitted_with(written, first, fewer)
        if fitted.cost - written.explained.taken.cost < PRICE:
            written = replace(_refitted(written, first, fitted), invented=told)
    return written


def _without_law(written: Written, k: int) -> tuple[Laws, tuple[Invented, ...]]:
    """Return the laws but for the k-th, and what the verdict says of them."""
    terms, told = written.terms, written.invented
    return (*terms[:k], *terms[k + 1 :]), (*told[:k], *told[k + 1 :])


def _refitted(written: Written, first: Explanation, fitted: Together) -> Written:
    """Return laws and effects as they were fitted again, with what is known of how the effects were taken."""
    return written_with(written, replace(first, steps=written.explained.steps), fitted)


def _as_effect(written: Written, first: Explanation) -> Written:
    """Replace a single law that is an effect of the catalogue by that effect: a supply that falls with time is a drain.

    It was proved and confirmed as a law. As an effect it was refused, for beside what no list holds whole drives may
    come out worse with a cause.
    """
    here = written.explained
    is_single = len(written.terms) == 1 and len(pieces(written.terms[0])) == 1
    if not is_single or len(here.taken.effects) >= MOST_EFFECTS:
        return written
    fitted = fitted_with(written, first, ())
    same = _doing(here, fitted.errors - here.taken.errors, SAME)
    if not same:
        return written
    without = replace(_refitted(written, first, fitted), invented=())
    others = frozenset(here.problem.catalogue) - same
    stage = candidate_steps(replace(without.explained.problem, refused=others), without.explained.taken)
    if not stage:
        return written
    step = replace(judged(without.explained.problem, stage[0]), holdout_gain=written.invented[0].holdout_gain)
    told = _with_step(without, first, step, (*here.tried, tuple(stage)))
    return told if _explains_as_much(told, here) and _hold(told.explained) else written


def _in_place_of_laws(written: Written, first: Explanation, held: Residuals) -> Written:
    """Exchange a law, or a part of its sum, for an effect that explains about as much, until none does.

    A cause of the catalogue goes before a part of a law, unless it explains less by what a name costs.
    """
    here = written.explained
    if len(here.taken.effects) >= MOST_EFFECTS:
        return written
    catalogue = frozenset(here.problem.catalogue)
    for fewer, told in _shorter(written):
        fitted = fitted_with(written, first, fewer)
        # A whole law may do far more than derivatives tell: any effect is then tried.
        is_part = len(fewer) == len(written.terms)
        alike = _doing(here, fitted.errors - here.taken.errors, AS_MUCH) if is_part else catalogue
        if not alike:
            continue
        others = catalogue - alike
        without = replace(_refitted(written, first, fitted), invented=told)
        swapped = _with_one_more(without, first, held, others)
        if swapped and _explains_as_much(swapped, here):
            return _in_place_of_laws(swapped, first, held)
    return written


def _explains_as_much(swapped: Written, here: Explanation) -> bool:
    """Whether laws and effects cost no more than what they are to replace does, but for the price of a name."""
    return here.problem.cost_of(swapped.explained.taken.physics) <= here.taken.cost + PRICE


def _shorter(written: Written) -> Iterator[tuple[Laws, tuple[Invented, ...]]]:
    """Yield the laws that remain without one part, or without a whole law, and what the verdict says of each."""
    for k, law in enumerate(written.terms):
        before, after = written.terms[:k], written.terms[k + 1 :]
        for fewer in shortened((law,)):
            yield (*before, *fewer, *after), written.invented
        if len(pieces(law)) == 1:
            yield _without_law(written, k)


def _doing(here: Explanation, change: Array, share: float) -> set[str]:
    """Return the effects whose derivatives explain at least a share of a change of the residuals, shape (n,)."""
    tried = [effect for effect in here.problem.catalogue if effect not in here.taken.effects]
    slopes = here.problem.estimator.sensitivities(here.taken, tried)
    return {
        effect
        for effect, columns in zip(tried, slopes, strict=True)
        if np.sum((change @ directions(columns)) ** 2) >= share * (change @ change)
    }


def _with_one_more(
    written: Written, first: Explanation, held: Residuals, left_out: frozenset[str] = frozenset()
) -> Written | None:
    """Add the best effect that holds beside laws and effects, of those not left out; None if there is none."""
    here = written.explained
    problem = replace(here.problem, refused=left_out)
    stage = tuple(candidate_steps(problem, here.taken))
    tried = (*here.tried, stage)
    for step in proved_steps(problem, stage):
        more = _with_step(written, first, step, tried)
        explained = None if _may_mend(more, first, step.effect) else held_up(more.explained, held)
        if explained:
            return replace(more, explained=explained)
    return None


def _may_mend(written: Written, first: Explanation, effect: str) -> bool:
    """Whether an effect added beside laws does so little, compared with them, that it may only correct their form."""
    here = written.explained
    problem, model = here.problem, here.taken
    bare = first.problem.estimator.robot.with_effects(model.values)
    (step,) = (each for each in here.steps if each.effect == effect)
    alone, laws = size_of(problem, model, step), problem.sizes.apart(model.physics, bare.physics)
    return problem.material.times(alone) < MENDS * problem.material.times(laws)


def _with_step(
    written: Written, first: Explanation, step: Step, tried: tuple[tuple[Step, ...], ...]
) -> Written:
    """Add an effect of the last stage tried, and fit all laws and effects again."""
    here, effects = written.explained, step.model.effects
    steps = (*here.steps, replace(step, stage=len(tried) - 1))
    start = free(first.problem.estimator.robot, effects).vector(step.model.values)
    fitted = together(first, here.problem.under(step.model), written.terms, effects, start)
    return written_with(written, replace(first, steps=steps, tried=tried), fitted)


def _hold(explained: Explanation) -> bool:
    """Whether every effect is material, of one size and, where much is left, stands out of it: as without laws."""
    problem, model = explained.problem, explained.taken
    for step in explained.steps:
        alone = beside_others(problem, model, step)
        if not is_material(problem, model, alone) or drifts(problem, model, alone):
            return False
        if explained.unexplained and not stands_out(problem, alone):
            return False
    return True


def held_up(explained: Explanation, held: Residuals) -> Explanation | None:
    """Return an explanation with its hold-out gains if all of its effects hold beside laws; else None.

    The recordings set aside must ask for each, too.
    """
    if not _hold(explained):
        return None
    steps = confirmed(explained, held).explained.steps
    return replace(explained, steps=steps) if len(steps) == len(explained.steps) else None


def pruned(written: Written, first: Explanation) -> Written:
    """Drop the effects that gain too little beside the laws, or are not material there.

    Such an effect had stood in for a law.
    """
    problem = written.explained.problem
    for step in written.explained.steps:
        without, here = fitted_without(written, first, step), written.explained.taken
        stays = without.cost - here.cost >= PRICE
        if not (stays and (problem.on_bench or is_material(problem, here, step))):
            written = written_with(written, first, without, problem)
    return written


def without_absent(written: Written, first: Explanation, seed: int) -> Written:
    """Drop, one by one, the effects that may as well be absent beside the laws, as their interval says."""
    while True:
        here = written.explained
        spans = intervals(here.problem.estimator, here.taken, seed)
        weakest = weakest_absent(here.taken, here.steps, spans, on_bench=here.problem.on_bench)
        if weakest is None:
            return written
        written = _refitted(written, first, fitted_without(written, first, weakest))


def lessened(beside: Explanation, laws: tuple[Term, ...], first: Explanation) -> list[Step]:
    """Return the effects that gain less beside laws than without: they may stand in for a part of what those explain.

    Laws that are right take away what hides a cause, which then gains more.
    """
    written = Written(beside, laws, ())
    gains = {
        step.effect: fitted_without(written, first, step).cost - beside.taken.cost for step in beside.steps
    }
    return [step for step in first.steps if gains.get(step.effect, step.gain) < step.gain]


def taken_back(explained: Explanation, refused: Sequence[Step]) -> Explanation:
    """Return an explanation with refused effects added, all parameters fitted again."""
    values = {step.effect: step.model.values[step.effect] for step in refused}
    effects = [*explained.taken.effects, *values]
    problem = explained.problem.under(explained.taken, effects)
    model = problem.estimator.fit(effects, {**values, **explained.taken.values})
    steps = (*explained.steps, *(replace(step, stage=0) for step in refused))
    return replace(explained, problem=problem, taken=model, whole=model, steps=steps)
