"""Whether the recordings set aside confirm each effect, against the others refitted without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.gain_offset import EFFECT as GAIN
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.prove.holdout import Contender, gaps, reading_error
from gecar.reality.replay.channels import ResidualIndex
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.acceptance import most_uneven, stands_out, worsens
from gecar.reality.selection.cross_validation import refitted_errors
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import (
    AS_GOOD_WITHOUT,
    LEAST_SHOWN,
    UNSEEN,
    Share,
    share_asked_for,
)
from gecar.reality.selection.stepwise import Explanation, concluded, explain
from gecar.reality.selection.thresholds import MAIN_SHARE, WHOLE_SHARE, WORSE
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Confirmation:
    """What of an explanation the recordings set aside confirm.

    Attributes
    ----------
    explained
        The explanation with the effects asked for there; each step has its ``holdout_gain``.
    candidates
        Effects that are not: proved where they were fitted, and no findings.
    unseen
        Effects that they do not show, and that each recording fitted on which does confirms when it is left out.
    """

    explained: Explanation
    candidates: tuple[Step, ...]
    unseen: tuple[str, ...]


def explained_and_confirmed(problem: Problem, held: Residuals) -> Confirmation:
    """Explain recordings and confirm the effects; if any are refused, explain again without them.

    What imitates takes the place of a cause that gains less, and leaves nothing when it is dropped.
    """
    first = confirmed(explain(problem), held)
    refused = frozenset(step.effect for step in first.candidates)
    if not refused or problem.on_bench:
        return first
    problem.tell(f"once more without {', '.join(sorted(refused))}")
    # Clocks and mark that were fitted on the way are the camera's, whatever moves the robot.
    found = first.explained.problem
    begun = found if found.clocks_fitted or found.mark_fitted else problem
    again = confirmed(explain(replace(begun, refused=refused), once_more=True), held)
    if len(again.explained.steps) <= len(first.explained.steps):
        return first
    return replace(again, candidates=(*first.candidates, *again.candidates))


def confirmed(explained: Explanation, held: Residuals, in_part: bool = False) -> Confirmation:
    """Drop, one by one, the effects the recordings set aside do not ask for, and refit the others.

    They must ask for a share of the effect that is surely more than none, and not surely so small that the effect, as
    it was fitted, predicts worse than none (`share_asked_for`). Where they do not show an effect at all, the
    recordings fitted on that do must ask for it, each with everything fitted to the others. Whole drives must not come
    out worse with the effect; where much is left that nothing explains, they must come out better.

    Parameters
    ----------
    explained
        Of the recordings fitted on.
    held
        Residuals of the same kind, of the recordings set aside.
    in_part
        Whether they are parts of what was measured, away from something unknown. This acts in whole drives, which then
        confirm nothing: the parts must more likely than not be predicted better with an effect than without.
    """
    candidates, unseen = list(explained.drifting), set[str]()
    while explained.steps and held.recordings:
        with_all = _held_errors(explained, held, explained.taken, explained.taken)
        without = {s.effect: _without(explained.problem, explained.taken, s) for s in explained.steps}
        judged = [_judged(explained, held, step, without[step.effect], with_all) for step in explained.steps]
        unseen = {s.effect for s, share in judged if share is UNSEEN}
        judged = [
            _left_out(explained, s, without[s.effect]) if s.effect in unseen else (s, share)
            for s, share in judged
        ]
        explained = replace(explained, steps=tuple(step for step, _ in judged))
        least = AS_GOOD_WITHOUT if in_part else -np.inf
        failing = [(s, share) for s, share in judged if share.margin <= 0.0 or share.value <= least]
        if failing:
            worst, _ = min(failing, key=lambda pair: pair[1].margin)
        else:
            useless = [
                s
                for s, share in judged
                if not _is_missed(s, share) and not _helps(explained, held, s, without[s.effect], share)
            ]
            if not useless:
                break
            worst = useless[0]
        candidates.append(worst)
        explained = dropped(explained, worst)
    named = [step.effect for step in explained.steps]
    return Confirmation(explained, tuple(candidates), tuple(effect for effect in named if effect in unseen))


def _judged(
    explained: Explanation, held: Residuals, step: Step, without: Model, with_all: Array
) -> tuple[Step, Share]:
    """Return a step with what it gains on recordings set aside, and the share of it they ask for.

    Without the effect, all other constants may differ a little as with it, or as they would without it: in the first
    case what they make up for would speak for the effect, in the second what they make up would. The less counts.
    ``without`` is the model without it; ``with_all`` are the residuals under all steps, shape (n,).
    """
    left = [_held_errors(explained, held, without, beside) for beside in (explained.taken, without)]
    return _asked_for(step, held.index, left, with_all)


def _asked_for(
    step: Step, index: ResidualIndex, without: Sequence[Array], with_all: Array
) -> tuple[Step, Share]:
    """Return a step with its gain, and the share of its size that residuals without it and with it ask for."""
    shares = [share_asked_for(index, errors, with_all) for errors in without]
    least = UNSEEN if shares[0] is UNSEEN else min(shares, key=lambda share: share.margin)
    return replace(step, holdout_gain=cost(without[0]) - cost(with_all)), least


def _left_out(explained: Explanation, step: Step, without: Model) -> tuple[Step, Share]:
    """Judge an effect on the fitted recordings that show it: each is left out in turn, and everything fitted again.

    Two or more must show it; without the only one nothing is known of it: `UNSEEN`. If there is only one, its thirds
    are left out.
    """
    problem, with_it = explained.problem, explained.taken
    shown = np.flatnonzero(np.bincount(problem.parts, _shown(explained, without)) >= LEAST_SHOWN)
    if len(shown) < 2:
        return step, UNSEEN
    if problem.is_only_one:
        here = problem.estimator
        errors = [refitted_errors(here, here.at(model, model.z)) for model in (without, with_it)]
        return _asked_for(step, here.residuals.index, errors[:1], errors[1])
    parts = []
    for k in shown:
        rest, alone = problem.without(int(k))
        before = rest.estimator.at(with_it, with_it.z)
        fitted = rest.under(before).estimator.fit(with_it.effects, with_it.values)
        others = replace(explained, problem=rest.under(fitted), taken=fitted)
        base = _without(rest, fitted, step)
        parts.append(
            [_held_errors(others, alone, model, beside)
             for model, beside in ((fitted, fitted), (base, fitted), (base, base))]
        )  # fmt: skip
    with_all, *left = (np.concatenate(errors) for errors in zip(*parts, strict=True))
    return _asked_for(step, problem.residuals.part(shown).index, left, with_all)


def _shown(explained: Explanation, without: Model) -> Array:
    """Return the square of the change that an effect makes to each fitted residual, shape (n,)."""
    errors = explained.problem.residuals.errors
    return np.asarray((errors(without.physics) - errors(explained.taken.physics)) ** 2)


def _is_missed(step: Step, share: Share) -> bool:
    """Whether an effect is at a place, and recordings ask for all of it: a drive off its path may miss the place."""
    return BY_ID[step.effect].at_a_place and share.is_whole


def _helps(explained: Explanation, held: Residuals, step: Step, without: Model, share: Share) -> bool:
    """Whether whole drives set aside come out no worse with an effect.

    None may take all channels together a quarter farther off, whatever small changes would make up for it; unless all
    of it is asked for, and drives are then off by less than is material: of so little a few times as much is nothing.
    Where only the end of the one recording is set aside, they must come a quarter nearer: nothing else tests whether
    what fits its beginning is a cause. There each is judged with the small changes that it asks for, or what a robot is
    off its file by would add up to far more than an effect does in so short a part.
    They must come out much better where much is unexplained, unless all of the effect is asked for: what imitates has
    not the same size elsewhere, and a cause may be known better than where a drive ends that it has sent astray. Then
    it is enough, too, that all channels together are nearer: other errors may end one drive of few at the right place.
    What has one size in all recordings fitted on, and as far as can be told in those set aside, must come out nearer,
    but not much: a ripple of the torque hardly shows where a drive ends that gusts have pushed about.
    """
    problem, sizes = explained.problem, explained.problem.sizes.of(held)
    whole_drives = problem, without, explained.taken, sizes
    continues = _continues(held, problem.residuals)
    was, now = _gaps(problem, without, explained.taken, held, continues)
    most = was / WORSE if continues else WORSE * was
    if now > most and not (held.sensor or problem.on_bench):
        if continues or not share.is_whole:
            return False
        return problem.material.times(sizes.left(explained.taken.physics)) < 1.0 and not worsens(
            *whole_drives
        )
    if not explained.unexplained or share.is_whole:
        return not worsens(*whole_drives) or (share.is_whole and now < was)
    beside = (problem.with_small_changes(model, explained.taken) for model in (explained.taken, without))
    left, before = (problem.material.times(sizes.left(physics)) for physics in beside)
    if left**2 < (1.0 - MAIN_SHARE) * before**2:
        return True
    is_steady = share.low < 1.0 < share.high and stands_out(problem, step)
    return now < was and is_steady and not worsens(*whole_drives)


def _continues(held: Residuals, fitted: Residuals) -> bool:
    """Whether what is set aside is the end of the only recording."""
    alone = len(held.recordings) == len(fitted.recordings) == 1
    return alone and held.recordings[0].recording.name == fitted.recordings[0].recording.name


def _gaps(
    problem: Problem, without: Model, with_effect: Model, held: Residuals, changed: bool
) -> tuple[float, float]:
    """Return how far whole drives set aside are off without an effect and with it, as `gaps` does.

    Each model has the small changes that it asks for, if it is to be ``changed`` so.
    """
    values = [problem.small_changes(m) if changed else m.values for m in (without, with_effect)]
    robot, held = problem.estimator.robot, problem.with_its_camera(held, without.physics)
    return gaps(*(Contender(robot.with_effects(each), held) for each in values))


def with_better_readings(seen: Confirmation, held: Residuals) -> Confirmation:
    """Drop effects of the colour sensor, one by one, as long as they make the held-out readings as a whole worse.

    What is confirmed beside small changes of line and mount, which no robot file has, may need them.
    """
    explained = seen.explained
    while explained.steps and held.recordings:
        known, found = explained.problem.known.physics, explained.taken.physics
        if reading_error(held, found) <= WORSE * reading_error(held, known):
            break
        seen = _refused(seen, min(explained.steps, key=lambda step: step.holdout_gain))
        explained = seen.explained
    return seen


def steady(seen: Confirmation) -> Confirmation:
    """Drop effects whose size differs between recordings, the most uneven first: they may be of outside physics."""
    while (worst := most_uneven(seen.explained.problem, seen.explained.steps)) is not None:
        seen = _refused(seen, worst, drifts=True)
    return seen


def standing_out(seen: Confirmation) -> Confirmation:
    """Drop effects of the colour sensor that may come from a wrong path: first those of uneven size, then weak ones.

    Where the motion is unexplained, the path may be off, and readings along it ask for a sensor that sits elsewhere,
    reads late, or looks wider. Uneven is what differs in size between recordings. Where such effects leave much of the
    readings' error, the weakest goes, one by one. A gain shows on even floor, where no path matters.
    """
    while True:
        worst = most_uneven(seen.explained.problem, seen.explained.steps)
        weakest = worst or _weakest_of_place(seen.explained)
        if weakest is None:
            return seen
        seen = _refused(seen, weakest, drifts=worst is not None)


def _weakest_of_place(explained: Explanation) -> Step | None:
    """Return the weakest effect that moves the spot the sensor sees; None if nearly all of the error is explained."""
    residuals = explained.problem.residuals
    known, found = (
        float(np.sum((residuals.errors(model.physics) ** 2 - 1.0) * residuals.reading_sd**2))
        for model in (explained.problem.known, explained.taken)
    )  # squared errors of readings [%^2], beyond what noise and the path's uncertainty make of them
    if found <= (1.0 - WHOLE_SHARE) * known:
        return None
    of_place = [step for step in explained.steps if step.effect != GAIN]
    return min(of_place, key=lambda step: step.gain, default=None)


def _refused(seen: Confirmation, step: Step, drifts: bool = False) -> Confirmation:
    """Return a confirmation with an effect less and a candidate more."""
    candidates = (*seen.candidates, replace(step, drifts=True) if drifts else step)
    return replace(seen, explained=dropped(seen.explained, step), candidates=candidates)


def dropped(explained: Explanation, step: Step) -> Explanation:
    """Return an explanation without an effect, the others refitted; the robot's own value of it comes back."""
    steps = [s for s in (*explained.steps, *explained.minor) if s.effect != step.effect]
    model = _without(explained.problem, explained.whole, step)
    return concluded(explained.problem, model, steps, explained.tried, explained.drifting)


def _without(problem: Problem, model: Model, step: Step) -> Model:
    rest = [effect for effect in model.effects if effect != step.effect]
    return problem.under(model, rest).estimator.fit(rest, model.values)


def _held_errors(explained: Explanation, held: Residuals, model: Model, beside: Model) -> Array:
    """Return a model's residuals of recordings set aside, with small changes as a model asks for."""
    physics = explained.problem.with_small_changes(model, beside)
    return explained.problem.with_its_camera(held, physics).errors(physics)
