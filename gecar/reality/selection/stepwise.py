"""Stepwise selection: effects added one by one while each proves itself, then swapped and dropped; or none named.

Every stage begins with what the model so far is off by (`gecar.reality.fitting.discrepancy`): an effect is added where
it gains beside that. Source: forward, backward and stepwise selection, Draper and Smith, Applied Regression Analysis
(3rd ed.), ch. 15.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gecar.reality.fitting.model import Model, Step
from gecar.reality.materiality import Size
from gecar.reality.selection.acceptance import (
    at_a_bound,
    candidates,
    competing,
    imitates_a_step,
    is_another,
    is_material,
    is_worthwhile,
    lead,
    most_uneven,
    proved,
    size_of,
    stands_out,
    stopped,
)
from gecar.reality.selection.cross_validation import judged
from gecar.reality.selection.homogeneity import drifts, mark_differs
from gecar.reality.selection.motor_constants import CONSTANTS, with_constants
from gecar.reality.selection.problem import COMMON_DELAY, Problem
from gecar.reality.selection.screening import candidate_steps, step_of
from gecar.reality.selection.thresholds import (
    CLOCKS_FIRST,
    CLOCKS_OVER_COMMON,
    LEFT_SHARE,
    MOST_EFFECTS,
    MOST_ON_BENCH,
    PRICE,
    PROMISING,
    SEVERAL,
    WHOLE_SHARE,
    WORSE,
)
from gecar.world.effects import BY_ID

BEGINNINGS = 3  # effects of the first stage a chain may begin with
CONTINUED = 2  # times that the chain of a bench goes on
RIVALS = 4  # effects of a stage that are tried in the place of one that was taken


@dataclass(frozen=True)
class Explanation:
    """What explains a problem's residuals.

    Attributes
    ----------
    problem
        The problem, under the discrepancy of the model that was taken.
    taken
        The model with the effects that are named.
    steps
        How they were taken, in order.
    tried
        Everything fitted at each stage, for runners-up.
    left
        How far the model, its constants fitted, parts from the recordings.
    unexplained
        Whether that is material.
    minor, whole
        Effects that are too small for a name, and the model with them.
    spot
        Where on the floor something is left, if at one place only: x, y [m].
    drifting
        Effects that were taken and are no findings, as their sizes differ between recordings, times or regimes.
    """

    problem: Problem
    taken: Model
    steps: tuple[Step, ...]
    tried: tuple[tuple[Step, ...], ...]
    left: Size
    unexplained: bool
    minor: tuple[Step, ...]
    whole: Model
    spot: tuple[float, float] | None = None
    drifting: tuple[Step, ...] = ()


def explain(problem: Problem, once_more: bool = False) -> Explanation:
    """Take effects one by one as long as each proves itself; abstain where they only imitate.

    Where it takes several, other beginnings are tried, too: the first effect may have stood in for two causes. That is
    half the time, and not done ``once_more`` where recordings are explained without what was refused or an instrument,
    or with the camera's clocks and mark fitted anew, as before the effects were known these took up a part of them.
    """
    known = problem.under(problem.known)
    first = candidate_steps(known, known.known)
    if problem.on_bench:
        return _explain_motor(known, first)
    chains, with_camera = _chains(known, first, once_more)
    if with_camera is not None:
        return explain(with_camera, once_more)
    best = chains[likeliest([(problem, chain.model) for chain in chains])]
    tried = (tuple(first), *best.tried[1:])
    model, steps = _swapped_and_dropped(problem, best, tried)
    late = _with_late_clock(problem, model)
    if late is not None:
        return explain(late, once_more)
    renewed = None if once_more else _with_camera_beside(problem.under(model), model)
    if renewed is not None:
        return explain(renewed, once_more=True)
    return concluded(problem, model, steps, tried)


def _chains(known: Problem, first: Sequence[Step], once_more: bool) -> tuple[list[_Chain], Problem | None]:
    """Return the chains to choose from, or the problem to start over with, the camera's clocks or mark fitted.

    It starts over where these explain as much as the best effect of a stage. Where that happens in a chain with another
    beginning, it does so only if the first chain leaves more than is material.
    """
    with_camera = _with_camera(known, known.known, first)
    if with_camera is not None:
        return [], with_camera
    chain = _forward(known, _Chain((), known.known, ()), first)
    if once_more or chain.with_camera is not None:
        return [chain], chain.with_camera
    others = _other_beginnings(known, first, chain)
    filmed = [other.with_camera for other in others if other.with_camera is not None]
    if filmed and _leaves_much(known, chain.model):
        return [], filmed[0]
    return [chain, *(other for other in others if other.with_camera is None)], None


def _explain_motor(problem: Problem, first: Sequence[Step]) -> Explanation:
    """Explain a motor on a bench: its own constants before anything else, chosen anew beside what is found.

    What takes another's place may let more come forward: then the chain goes on.
    """
    chain = _Chain((), with_constants(problem, problem.known), (tuple(first),))
    for _ in range(CONTINUED):
        chain = _forward(problem, chain, candidate_steps(problem, chain.model))
        model = with_constants(problem, chain.model)
        constants = [effect for effect in model.effects if effect in CONSTANTS]
        found = replace(chain, steps=tuple(s for s in chain.steps if s.effect not in CONSTANTS), model=model)
        model, kept = _swapped_and_dropped(problem, found, chain.tried, constants)
        chain = replace(chain, steps=kept, model=with_constants(problem, model))
        if _effects(found.steps) == _effects(kept):
            break
    stages = {step.effect: step.stage for step in chain.steps}
    steps = [replace(step, stage=stages.get(step.effect, 0)) for step in _steps(problem, chain.model)]
    return concluded(problem, chain.model, steps, chain.tried)


def _steps(problem: Problem, model: Model) -> tuple[Step, ...]:
    """Return the step of every effect of a model on top of all others."""
    return tuple(
        _judged(problem, model, [e for e in model.effects if e != effect], effect) for effect in model.effects
    )


def concluded(
    problem: Problem,
    model: Model,
    steps: Sequence[Step],
    tried: Sequence[tuple[Step, ...]],
    drifting: tuple[Step, ...] = (),
) -> Explanation:
    """Keep the effects that are findings, and judge what they leave; ``drifting`` are known to differ in size."""
    problem = problem.under(model)
    before = left_before(problem)
    while True:
        weakest = _weakest_drifting(problem, model, steps)
        if weakest is not None:
            kept = [step for step in steps if step is not weakest]
            drifting = (*drifting, replace(weakest, drifts=True))
        else:
            left = left_by(problem, model)
            kept = _standing_beside(problem, model, steps, problem.material.times(left), before)
        if len(kept) == len(steps):
            break
        model = _fitted_anew(problem, model, kept)
        problem = problem.under(model)
        steps = [beside_others(problem, model, step) for step in kept]
    minor = tuple(step for step in steps if not is_material(problem, model, step))
    named, whole = tuple(step for step in steps if step not in minor), model
    if minor:  # what carries no claim bends no other effect's size
        problem = problem.under(model, [step.effect for step in named])
        model = problem.estimator.fit([step.effect for step in named], model.values)
        # What they explain is left, unless small changes of what is known explain it as well.
        left = left_by(problem, model)
    much = is_much(problem, problem.material.times(left), before, left_share(model))
    return Explanation(problem, model, named, tuple(tried), left, much, minor, whole, drifting=drifting)


def resumed(problem: Problem, found: Explanation, rivals: Sequence[Sequence[Step]] = ()) -> Explanation:
    """Explain residuals with the effects found before in similar ones, small effects included; judge each anew.

    ``rivals`` are the stages whose runners-up are tried in their place.
    """
    steps = (*found.steps, *found.minor)
    model = _fitted_anew(problem, found.whole, steps)
    beside = [beside_others(problem.under(model), model, step) for step in steps]
    model, kept = _swapped_and_dropped(problem, _Chain(tuple(beside), model, ()), rivals)
    return concluded(problem, model, kept, found.tried)


def _standing_beside(
    problem: Problem, model: Model, steps: Sequence[Step], now: float, before: float
) -> list[Step]:
    """Return the effects that may be named beside what they leave: all, unless that is material.

    Then effects below the catalogue's size must stand out of it, as they may be part of what is left; and all must
    where they leave much of it. One goes at a time, for without it the others may leave less: of those too small the
    one that gains least, of the others the most uneven, as it bends the others.
    ``now`` and ``before`` are what is left, with the model and with nothing fitted, in times the material size.
    """
    if not is_much(problem, now, before, left_share(model)):
        return list(steps)
    small = [
        step
        for step in steps
        if not (problem.on_bench or is_worthwhile(model, step.effect) or stands_out(problem, step))
    ]
    worst: Step | None = None
    if small:
        worst = min(small, key=lambda step: step.gain)
    elif now / max(before, 1.0) > (1.0 - WHOLE_SHARE) ** 0.5:
        worst = most_uneven(problem, steps)
    return [step for step in steps if step is not worst]


def left_by(problem: Problem, model: Model) -> Size:
    """Return what a model leaves, with the most likely small changes of all constants or, if that is less, without.

    They explain windows of a second, and may take whole drives farther from what was measured.
    """
    robots, inflation = (model.physics, problem.with_small_changes(model)), problem.slow_noise(model)
    return min(
        (problem.sizes.left(physics, repeatedly=True, inflation=inflation) for physics in robots),
        key=problem.material.times,
    )


def _weakest_drifting(problem: Problem, model: Model, steps: Sequence[Step]) -> Step | None:
    """Return the effect that gains least of those whose size differs; a bench's recordings are of one regime each."""
    drifting = [] if problem.on_bench else [step for step in steps if drifts(problem, model, step)]
    return min(drifting, key=lambda step: step.gain, default=None)


def _fitted_anew(problem: Problem, model: Model, kept: Sequence[Step]) -> Model:
    """Fit some effects to a problem from a model's values, under what the robot as it is known leaves."""
    effects = [step.effect for step in kept]
    return problem.under(problem.known, effects).estimator.fit(effects, model.values)


def beside_others(problem: Problem, model: Model, step: Step) -> Step:
    """Return a step on top of a model's other effects, with what is known of how it was taken."""
    rest = [effect for effect in model.effects if effect != step.effect]
    estimator = problem.under(model, rest).estimator
    base, whole = estimator.fit(rest, model.values), estimator.fit(model.effects, model.values)
    return replace(step, base=base, model=whole, gain=base.cost - whole.cost)


def left_before(problem: Problem) -> float:
    """Return what the robot leaves with nothing fitted, in times the material size."""
    left = problem.once("before", make=lambda: problem.sizes.left(problem.known.physics, repeatedly=True))
    return problem.material.times(left)


def is_much(problem: Problem, now: float, before: float, allowed: float) -> bool:
    """Whether a model leaves more than is material, and than the share of the error that its own laws may leave.

    Measurement errors and several small things may add up to more than is material; what stands out of them may not.

    Parameters
    ----------
    problem
        Under the discrepancy that the model leaves.
    now, before
        What is left, with the model and with nothing fitted, in times the material size.
    allowed
        That share.
    """
    least = WORSE if problem.is_beyond_constants else SEVERAL
    return now > least and now / max(before, 1.0) > allowed


def left_share(model: Model) -> float:
    """Return the share of the initial error that a model's effects may leave, because their laws are approximate."""
    return LEFT_SHARE + max((_off(model, effect) for effect in model.effects), default=0.0)


def left_share_of_each(problem: Problem, model: Model, steps: Sequence[Step]) -> float:
    """Return the share of the initial error that effects may leave, each at most a share of what it does itself.

    One that does little can leave little: more grip, whose law is rough, excuses nothing of what a delay does.
    """
    before = max(left_before(problem), 1.0)
    does = ((step, problem.material.times(size_of(problem, model, step)) / before) for step in steps)
    return LEFT_SHARE + max((min(share, 1.0) * _off(model, step.effect) for step, share in does), default=0.0)


def _off(model: Model, effect: str) -> float:
    """Return which share of an effect its law is off by: `Parameter.model_error`, and more where the effect is small.

    What the law may be off by in sizes worth a name counts by its standard deviation, half of it; not for what vanishes
    at infinity.
    """
    coordinates = enumerate(model.parameters.coordinates)
    own = {k: c for k, c in coordinates if c.effect.id == effect and c.parameter.worthwhile > 0.0}
    size = max(math.hypot(*model.z[list(own)]), 1.0)
    steps = max((c.parameter.model_error_steps for c in own.values() if not c.inverse), default=0.0)
    return max((c.parameter.model_error for c in own.values()), default=0.0) + 0.5 * steps / size


@dataclass(frozen=True)
class _Chain:
    """One forward selection.

    Of the steps taken ``model`` holds the effects; ``with_camera`` is the problem to begin anew, where the camera's
    clocks or mark had to be fitted on the way.
    """

    steps: tuple[Step, ...]
    model: Model
    tried: tuple[tuple[Step, ...], ...]
    with_camera: Problem | None = None


def _forward(problem: Problem, begun: _Chain, first: Sequence[Step], other: _Chain | None = None) -> _Chain:
    """Continue a chain until nothing more proves itself; the problem is under what its model leaves.

    Where it has come to the effects that another chain began with, it would go on like that one, which is returned.
    """
    model, steps, tried = begun.model, list(begun.steps), list(begun.tried)
    here, stage = problem, tuple(first)
    most = int(MOST_ON_BENCH if problem.on_bench else MOST_EFFECTS)
    while True:
        tried.append(stage)
        step = _best(here, stage)
        if step is None:
            break
        problem.tell(f"{step.effect}: gains {step.gain:.0f}")
        steps.append(replace(step, stage=len(tried) - 1))
        if other is not None and _effects(steps) == _effects(other.steps[: len(steps)]):
            return other
        if len(step.model.effects) == most:
            model = step.model
            break
        here = problem.under(step.model)
        model = _refitted(here, step.model)
        stage = tuple(candidate_steps(here, model, stage))
        with_camera = _with_camera(here, model, stage)
        if with_camera is not None:
            return _Chain((), problem.known, (), with_camera)
    return _Chain(tuple(steps), model, tuple(tried))


def _refitted(problem: Problem, model: Model) -> Model:
    """Fit a model again, then search past jumps; on a bench, choose its constants anew if one is at a bound."""
    model = problem.estimator.fit(model.effects, model.values)
    if problem.on_bench and at_a_bound(model):
        model = with_constants(problem, model)
    if not any(BY_ID[effect].search for effect in model.effects):
        return model
    found = problem.estimator.searched(model, 1.0)
    return min(found, problem.estimator.fit(found.effects, found.values), key=lambda m: m.cost)


def _best(problem: Problem, stage: Sequence[Step]) -> Step | None:
    """Return the best candidate that gains on left-out recordings; None if there is none.

    On a bench, where many fit alike, the one that gains most on them.
    """
    found = proved_steps(problem, stage)
    if problem.on_bench:
        return max(found, key=lambda step: float(step.left_out.sum()), default=None)
    return next(found, None)


def proved_steps(problem: Problem, stage: Sequence[Step]) -> Iterator[Step]:
    """Yield a stage's candidates that gain on left-out recordings, best first."""
    return filter(proved, (judged(problem, step) for step in candidates(problem, stage)))


def _other_beginnings(problem: Problem, first: Sequence[Step], chain: _Chain) -> list[_Chain]:
    """Return other chains: from runners-up where the first took several effects, from halves of pairs where none.

    From runners-up, too, where it took only one, and leaves more than is material: that may be like one of two, and
    hide the other. Where it took none, and leaves as much, what fits best may be stopped by a bound, or make whole
    drives worse, for it stands in for two. Those leave no more than is material: what imitates is stopped, too. Chains
    that come to the camera's clocks or mark are all among them.
    """
    if len(chain.steps) < 2 and not _leaves_much(problem, chain.model):
        return []
    firsts = competing(first)[:BEGINNINGS]
    if not chain.steps:
        pairs = [_beginning_with(problem, first, step) for step in firsts]
        return [
            pair
            for pair in pairs
            if pair.with_camera is not None or (len(pair.steps) > 1 and not _leaves_much(problem, pair.model))
        ]
    runners_up = [step for step in firsts if step is not first[0] and not stopped(step)]
    chains = [_forward(problem, _Chain((), problem.known, ()), [step], chain) for step in runners_up]
    return [other for other in chains if other is not chain]


def _leaves_much(problem: Problem, model: Model) -> bool:
    """Whether a model leaves more than is material (`is_much`)."""
    here = problem.under(model)
    left = here.material.times(left_by(here, model))
    return is_much(here, left, left_before(problem), left_share(model))


def _beginning_with(problem: Problem, first: Sequence[Step], step: Step) -> _Chain:
    """Return the chain that begins with one step of the first stage, which is judged beside what comes after it."""
    here = problem.under(step.model)
    model = _refitted(here, step.model)
    return _forward(here, _Chain((step,), model, (tuple(first),)), candidate_steps(here, model, first))


def _effects(steps: Sequence[Step]) -> set[str]:
    return {step.effect for step in steps}


def likeliest(found: Sequence[tuple[Problem, Model]]) -> int:
    """Return the index of the model that costs least, including the price of its names.

    All are judged under the smallest discrepancy that any of them leaves, each on the residuals of its own problem: the
    same rows, the logs perhaps repaired differently.
    """
    if len(found) == 1:
        return 0
    spaces = [problem.under(model, ()).estimator for problem, model in found]
    under = min(spaces, key=lambda e: float(e.discrepancy.ratios.sum()) if e.discrepancy else 0.0)
    costs = [
        under.cost_of(problem.residuals.errors(model.physics)) + PRICE * len(model.effects)
        for problem, model in found
    ]
    return costs.index(min(costs))


def _swapped_and_dropped(
    problem: Problem, chain: _Chain, tried: Sequence[Sequence[Step]], settled: Sequence[str] = ()
) -> tuple[Model, tuple[Step, ...]]:
    """Judge every effect of a chain beside all others, and those that are settled, under what they leave together.

    An effect taken early may have stood in for a cause that only the later ones let come forward: each is swapped
    against its runners-up, and dropped where the others can do without it. To be kept it may gain less than to be
    taken, for what is taken after it takes up a part of what it does.
    """
    steps, model = dict(enumerate(chain.steps)), chain.model
    rivals = {step.effect: step for stage in tried for step in stage[:RIVALS]}
    if settled:
        rivals = {effect: step for effect, step in rivals.items() if effect not in CONSTANTS}
    several = (
        chain.steps if settled or len(chain.steps) > 1 else ()
    )  # one alone was judged beside nothing else
    for number, step in enumerate(several):
        rest = [*settled, *(s.effect for s in steps.values() if s is not step)]
        here = problem.under(model, rest)
        found = _judged(here, model, rest, step.effect)
        swap = _swapped(here, found, rest, list(rivals.values())) if rest else None
        if swap is not None:
            steps[number], model = replace(swap, stage=step.stage), swap.model
        elif found.gain < PROMISING * PRICE or not proved(found):
            del steps[number]
            model = found.base
        else:
            steps[number], model = replace(found, stage=step.stage), found.model
    kept = tuple(steps.values())
    estimator = problem.under(model).estimator
    model = estimator.fit([*settled, *(step.effect for step in kept)], model.values)
    if any(BY_ID[effect].search for effect in model.effects):
        model = estimator.searched(model)
    return model, kept


def _judged(problem: Problem, model: Model, rest: Sequence[str], effect: str) -> Step:
    """Return an effect's step on top of all others."""
    estimator = problem.estimator
    base = estimator.fit(rest, model.values)
    whole = estimator.fit((*rest, effect), model.values)
    return judged(problem, step_of(estimator, effect, base, whole))


def _swapped(problem: Problem, found: Step, rest: Sequence[str], rivals: Sequence[Step]) -> Step | None:
    """Return the step of the first rival that proves itself in an effect's place, gains more or says less of where."""
    estimator = problem.estimator
    for other in rivals:
        if other.effect in found.model.effects:
            continue
        values = {**found.model.values, **other.model.values}
        swapped = estimator.fit((*rest, other.effect), values)
        if swapped.cost < found.model.cost - lead(found, other.effect):
            step = judged(problem, step_of(estimator, other.effect, found.base, swapped))
            if (
                proved(step)
                and not stopped(step, own=problem.on_bench)
                and not is_another(problem, swapped)
                and not imitates_a_step(problem, step)
            ):
                return step
    return None


def _with_camera(problem: Problem, model: Model, stage: Sequence[Step]) -> Problem | None:
    """Return the problem with camera clocks or mark fitted, where they gain as much as the best effect of a stage.

    The clock of an only recording waits: fitted first, it takes up what makes a robot late, too.
    """
    best = stage[0].gain if stage else 0.0
    common = max((step.gain for step in stage if step.effect == COMMON_DELAY), default=0.0)
    least = max(CLOCKS_FIRST * best, CLOCKS_OVER_COMMON * common)
    with_clocks = None if problem.is_only_one else problem.with_clocks(model, least)
    if with_clocks is not None or problem.mark_fitted:
        return with_clocks
    return _with_mark(problem, model, best)


def _with_late_clock(problem: Problem, model: Model) -> Problem | None:
    """Return the problem with the clock of an only recording's camera fitted beside a model's effects, if it is late.

    Where the model holds a camera's delay, that is what it is.
    """
    if not problem.is_only_one:
        return None
    rest = [effect for effect in model.effects if effect != COMMON_DELAY]
    here = problem.under(model)
    return here.with_clocks(here.estimator.fit(rest, model.values, rounds=0))


def _with_camera_beside(problem: Problem, model: Model) -> Problem | None:
    """Return the problem with camera clocks and mark fitted anew beside a model's effects; None if it gains little."""
    with_clocks = problem.with_clocks_beside(model)
    here = with_clocks.under(model) if with_clocks else problem
    return _with_mark(here, model) or with_clocks


def _with_mark(problem: Problem, model: Model, least_gain: float = 0.0) -> Problem | None:
    """Return the problem with the camera's mark fitted; None where that gains too little, or is no mark."""
    found = problem.with_mark(model, least_gain)
    if found is None or mark_differs(problem, found, model):
        return None
    problem.tell("the camera's mark is not over the axle's centre: its place is fitted")
    return found
