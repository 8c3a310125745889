"""The chain of steps from the bare robot to what explains a comparison, and when to abstain."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gecar.reality.selection import MOST_EFFECTS, Model, Selection, Step

# Structure below this, a block, is the simulation's own: against a 3D engine with nothing concealed, 0.2 to 1.4.
FLOOR = 1.0
LEAST_DROP = 0.25  # of structure, a block: what an effect must explain at least
MAIN_SHARE = 0.35  # of what is left: what an effect explains that is no stand-in
WHOLE_SHARE = 0.85  # of all: where several effects together explain this, each may explain less
UNEXPLAINED = 4.0  # structure a block, above which what is left is worth a word
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
    """

    taken: Model
    steps: tuple[Step, ...]
    tried: tuple[tuple[Step, ...], ...]
    unexplained: bool


def explain(selection: Selection) -> Explanation:
    """Take effects one by one as long as each proves itself; abstain where they only imitate."""
    model, steps, tried = selection.bare, [], []
    while len(steps) < MOST_EFFECTS and model.structure > LEAST_DROP * selection.blocks:
        done = selection.steps(model)
        if selection.align(model, done[0].gain if done else 0.0):
            selection.tell("the camera's clock differs from recording to recording: taken out")
            return explain(selection)
        tried.append(tuple(done))
        step = _best(selection, model, done)
        if step is None:
            break
        selection.tell(
            f"{step.effect}: explains {1.0 - step.model.structure / model.structure:.0%} of what is left"
        )
        steps.append(step)
        model = step.model
    kept = _kept(selection, steps)
    taken = steps[kept - 1].model if kept else selection.bare
    floor = max(UNEXPLAINED * selection.blocks, UNEXPLAINED_SHARE * selection.bare.structure)
    return Explanation(taken, tuple(steps[:kept]), tuple(tried), taken.structure > floor)


def _best(selection: Selection, model: Model, done: list[Step]) -> Step | None:
    """Return the best step worth a name that holds on left-out recordings; None if there is none."""
    for step in done[:4]:
        drop = model.structure - step.model.structure
        if not step.worthwhile or drop < LEAST_DROP * selection.blocks or step.gain < 0.3 * done[0].gain:
            continue
        judged = selection.judged(model, step)
        if judged.left_out.sum() > judged.null_95 and judged.p < 0.05:
            return judged
    return None


def _kept(selection: Selection, steps: list[Step]) -> int:
    """Return how many steps of the chain stand.

    Together they must explain nearly all there is; then each must explain a good part of what the others leave, or be
    needed to get there.
    """
    first = selection.bare.structure
    excess = max(first - FLOOR * selection.blocks, LEAST_DROP * selection.blocks)
    kept, before = 0, first
    for number, step in enumerate(steps, start=1):
        after = step.model.structure
        whole_before = first - before >= WHOLE_SHARE * excess
        whole = first - after >= WHOLE_SHARE * excess
        if (
            whole
            and (not whole_before or before - after >= MAIN_SHARE * before)
            and (kept == number - 1 or not whole_before)
        ):
            kept = number
        before = after
    return kept


def without(model: Model, selection: Selection, effect: str) -> Model:
    """Return a model refitted without one of its effects."""
    rest = [e for e in model.effects if e != effect]
    return selection.refit(rest, model.values) if rest else selection.bare


def swapped(model: Model, selection: Selection, effect: str, other: Step) -> Model:
    """Return a model refitted with an effect exchanged for another."""
    rest = [e for e in model.effects if e != effect]
    found = selection.refit((*rest, other.effect), {**model.values, **other.model.values})
    return replace(found)
