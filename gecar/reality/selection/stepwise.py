"""The chain of steps from the bare robot to what explains a comparison, and when to abstain."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gecar.reality.fitting.model import Model, Step, worthwhile
from gecar.reality.locate.hotspot import Spot, stands_out
from gecar.reality.selection.screening import ROUGH
from gecar.reality.selection.selection import Selection

MOST_EFFECTS = 4
MOST_ON_BENCH = 7  # a motor alone is known to tenths of a percent, and shows all its parts
WAYS = 3  # of the first stage's effects a chain may begin with
FAR_BEHIND = 0.3  # of the best gain: no way to begin with less
NEARLY_STOOD = 0.75  # of the structure: a chain that explains so much is worth another beginning
SWAPPED = 4  # of each stage's runners-up are tried in the place of what was taken


NEARLY = 0.8  # of the best effect's gain: clocks that gain this come first
MORE_THAN_COMMON = 1.3  # times the gain of one delay common to all: what clocks must gain
MAIN_SHARE = 0.35  # of what is left: what an effect explains that is no stand-in
WHOLE_SHARE = 0.85  # of all: where several effects together explain this, each may explain less
# Where nearly all is explained already, one more effect must explain this much of what is left above the floor: in
# pairs of a 3D engine the second cause explains 80 to 99 %, what the first one's model lacks is imitated to 20 to 50 %.
MORE_SHARE = 0.6
UNEXPLAINED_SHARE = 0.1


@dataclass(frozen=True)
class Explanation:
    """What explains a comparison.

    Attributes
    ----------
    taken
        The model with the effects that were taken.
    steps
        How they were taken, in order.
    tried
        Everything refitted at each stage, for runners-up.
    unexplained
        Whether structure is left that no effect explains.
    spot
        Where on the floor, if it is left at one place only.
    """

    taken: Model
    steps: tuple[Step, ...]
    tried: tuple[tuple[Step, ...], ...]
    unexplained: bool
    spot: Spot | None = None


def explain(selection: Selection) -> Explanation:
    """Take effects one by one as long as each proves itself; abstain where they only imitate.

    Where it takes several, other ways to begin are tried, too: the first effect may have stood in for two causes.
    """
    first = selection.steps(selection.nothing) if _worth_a_look(selection, selection.nothing) else []
    common = max((step.gain for step in first if step.effect == "pose_delay"), default=0.0)
    if selection.align(
        selection.nothing, max(NEARLY * first[0].gain, MORE_THAN_COMMON * common) if first else 0.0
    ):
        selection.tell("the camera's clock differs from recording to recording: taken out")
        return explain(selection)
    began = _chain(selection, first)
    if began is None:  # clocks came forward on the way
        return explain(selection)
    ways = [began]
    if len(began.steps) > 1 or (not began.steps and began.nearly):
        others = [
            step for step in first[1:WAYS] if step.worthwhile and step.gain > FAR_BEHIND * first[0].gain
        ]
        ways += [way for way in (_chain(selection, [step]) for step in others) if way is not None]
    best = _best_way(selection, [way for way in ways if way.steps] or ways)
    kept = list(best.steps)
    tried = [tuple(first), *best.tried[1:]]
    taken = _settled(selection, kept, tried)
    left = selection.rid_of_subtle(taken)
    floor = max(
        selection.limits.unexplained * selection.blocks.count,
        UNEXPLAINED_SHARE * selection.nothing.structure,
    )
    if left.structure > floor or kept:
        return Explanation(taken, tuple(kept), tuple(tried), left.structure > floor)
    spot = stands_out(selection, left)
    return Explanation(taken, (), tuple(tried), spot is not None, spot)


@dataclass(frozen=True)
class _Way:
    """One chain: the steps that stand, the model they end in, all that was tried, and whether it nearly stood."""

    steps: tuple[Step, ...]
    model: Model
    tried: tuple[tuple[Step, ...], ...]
    nearly: bool


def _best_way(selection: Selection, ways: list[_Way]) -> _Way:
    """Return the way with the fewest effects, unless a longer one explains a good part of what that leaves."""
    floor = selection.limits.floor * selection.blocks.count
    ways = sorted(ways, key=lambda way: (len(way.steps), way.model.cost))
    best = ways[0]
    for way in ways[1:]:
        longer = len(way.steps) > len(best.steps)
        if longer and max(way.model.structure, floor) < (1.0 - MAIN_SHARE) * max(best.model.structure, floor):
            best = way
    return best


def _chain(selection: Selection, first: list[Step]) -> _Way | None:
    """Go on from a first stage until nothing more proves itself; None where the cameras' clocks had to be set."""
    model, steps, tried = selection.nothing, list[Step](), list[tuple[Step, ...]]()
    done = first
    while True:
        tried.append(tuple(done))
        step = _best(selection, done)
        if step is None:
            break
        selection.tell(f"{step.effect}: explains {1.0 - step.after / step.before:.0%} of what is left")
        steps.append(step)
        model = step.model
        if len(steps) == _most(selection) or not _worth_a_look(selection, model):
            break
        done = selection.steps(model)
        common = max((each.gain for each in done if each.effect == "pose_delay"), default=0.0)
        if selection.align(model, max(NEARLY * done[0].gain, MORE_THAN_COMMON * common) if done else 0.0):
            return None
    kept = steps[: _kept(selection, steps)]
    nearly = bool(steps) and steps[0].before - steps[-1].after > NEARLY_STOOD * steps[0].before
    return _Way(tuple(kept), kept[-1].model if kept else selection.nothing, tuple(tried), nearly)


def _most(selection: Selection) -> int:
    return MOST_ON_BENCH if _on_bench(selection) else MOST_EFFECTS


def _on_bench(selection: Selection) -> bool:
    return all(r.setup.rig == "bench" for r in selection.recordings)


def _worth_a_look(selection: Selection, model: Model) -> bool:
    return model.structure > selection.limits.least_drop * selection.blocks.count


def _settled(selection: Selection, kept: list[Step], tried: list[tuple[Step, ...]]) -> Model:
    """Refit what was taken, with everything but the effects back at the robot's own constants.

    An effect taken early may have stood in for a cause that only the later ones let come forward: each is swapped
    against its runners-up, and dropped where the others can do without it.
    """
    if not kept:
        return selection.nothing
    best, null = kept[-1].model, kept[-1].null_95  # of what is left at the end; earlier ones are of what was
    floor = selection.limits.floor * selection.blocks.count
    rivals = {step.effect: step for stage in tried for step in stage[:SWAPPED]}
    for number, step in enumerate(list(kept)):
        if len(kept) < 2:
            break
        for other in rivals.values():
            if other.effect in best.effects:
                continue
            rest = [e for e in best.effects if e != step.effect]
            values = {**best.values, **other.model.values}
            swapped = selection.refit((*rest, other.effect), values, shift=best.shift)
            if swapped.cost < best.cost - null and worthwhile(swapped, other.effect):
                best = swapped
                kept[number] = replace(step, effect=other.effect)
                break
        else:
            rest = [e for e in best.effects if e != step.effect]
            without = selection.refit(rest, best.values, shift=best.shift)
            if without.cost < best.cost + null or without.structure < floor:
                best, kept[number] = without, replace(step, effect="")
    kept[:] = [step for step in kept if step.effect]
    found = selection.refit(best.effects, best.values)
    return selection.polished(found) if ROUGH.intersection(found.effects) else found


def _best(selection: Selection, done: list[Step]) -> Step | None:
    """Return the best step worth a name that holds on left-out recordings; None if there is none."""
    for step in done[:4]:
        drop = step.before - step.after
        if (
            not all(worthwhile(step.model, effect) for effect in step.model.effects)
            or drop < selection.limits.least_drop * selection.blocks.count
            or step.gain < 0.3 * done[0].gain
        ):
            continue
        judged = selection.judged(step)
        if judged.left_out.sum() > judged.null_95 and judged.p < 0.05:
            return judged
    return None


def _kept(selection: Selection, steps: list[Step]) -> int:
    """Return how many steps of the chain stand.

    Together they must explain nearly all there is; then each must explain a good part of what the others leave, or be
    needed to get there.
    """
    if not steps:
        return 0
    limits = selection.limits
    first = steps[0].before
    excess = max(first - limits.floor * selection.blocks.count, limits.least_drop * selection.blocks.count)
    kept, whole_before = 0, False
    for number, step in enumerate(steps, start=1):
        whole = first - step.after >= WHOLE_SHARE * excess
        main = step.before - step.after >= MAIN_SHARE * step.before
        if whole_before and not _on_bench(selection):
            main &= step.before - step.after >= MORE_SHARE * (
                step.before - limits.floor * selection.blocks.count
            )
        if whole and main and (not whole_before or kept == number - 1):
            kept = number
        whole_before = whole_before or whole
    return kept
