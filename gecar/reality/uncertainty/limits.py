"""Limits: the smallest size of each effect that recordings would have shown, as upper limits are given in physics.

An effect of a certain size is added to the robot found. What that changes in the recordings' residuals, beside small
changes of all constants and in units of the noise, is what it would gain: half its square, give or take a normal number
times its root. The limit is the size, worth a name and material, at which in 95 of 100 cases

- that passes the price of a name,
- it gains more than any other effect would in its place,
- its interval excludes neutral, though the simulation's own law for it is a little off,
- the recordings set aside confirm it beside the small changes that make up for it in those fitted on,
- whole drives come out no worse with it, though other small things may have made up for a part of it before.

A patch's limit holds for nine of ten places where the robot has been.

Sources: Feldman and Cousins, Physical Review D 57 (1998) 3873 (sensitivity: the limit where nothing is there); the
noncentral chi-square of a matched filter, Kay, Fundamentals of Statistical Signal Processing II (1998), ch. 4; Cox,
Proc. 4th Berkeley Symposium (1961) 105 (of two models, the right one gains half the square of what parts them more).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import directions
from gecar.reality.fitting.initial_values import patches
from gecar.reality.fitting.model import Model
from gecar.reality.fitting.parameters import free
from gecar.reality.optimisation.least_squares import costs
from gecar.reality.residuals.of_case import Physics, Residuals
from gecar.reality.selection.acceptance import is_worse, worthwhile
from gecar.reality.selection.problem import Problem
from gecar.reality.selection.share import LEAST_SHOWN, least_share_expected
from gecar.reality.selection.thresholds import PRICE
from gecar.reality.uncertainty.intervals import NORMAL_95, model_error
from gecar.reality.verdict import Limit
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]

LARGEST = 60.0  # of the catalogue's sizes: more than any bound
TRIED = 12  # sizes
AT_ONCE = 3  # of them
SURE = 1.645  # 95 % quantile of a normal distribution
NEEDED = float(np.sqrt(2.0 * PRICE)) + SURE  # standard deviations
APART = 2.0 * SURE  # the same, from what any other effect would do in its place
MOST_PLACES = 10  # on the floor, where an effect has one
SEEN_PLACES = 0.9  # share of them that must show it
MARGIN = 1.15  # on the size: what a limit is computed with is a little off, too
FAINT = 1e-9


def limits(problem: Problem, model: Model, held: Residuals) -> dict[str, Limit | None]:
    """Return the limit of every effect of a problem that a model does not hold; None where any size would pass unseen.

    Parameters
    ----------
    problem, model
        The problem, under the discrepancy the model leaves.
    held
        Residuals of the recordings set aside, which must confirm an effect; all may be there if there are none.
    """
    others = [effect for effect in problem.catalogue if effect not in model.effects]
    rivals = dict(zip(others, map(directions, problem.estimator.sensitivities(model, others)), strict=True))
    filmed = problem.with_its_camera(held, model.physics)
    aside = _Held(filmed, filmed.errors(model.physics), filmed.errors(problem.with_small_changes(model)))
    none = problem.residuals.errors(model.physics)
    left = problem.material.times(problem.sizes.left(model.physics))
    searches = [_Search(problem, model, none, left, aside, rivals, effect) for effect in others]
    sizes = iter(_in_step([each for search in searches for each in search.of_each_place_and_side()]))
    return {search.effect: search.limit(sizes) for search in searches}


class _Asked(NamedTuple):
    """A request for the residuals under m physics records."""

    residuals: Residuals
    physics: Physics


_Asking = Generator[_Asked, Array, float]
"""A calculation that asks for residuals, is sent them, shape (m, n), and returns a number at its end."""


def _in_step(searches: Sequence[_Asking]) -> list[float]:
    """Run searches side by side and return what each finds: replays together take a half to a third of the time."""
    found, asked = np.zeros(len(searches)), {k: next(search) for k, search in enumerate(searches)}
    while asked:
        answers = dict[int, Array]()
        for residuals in {id(each.residuals): each.residuals for each in asked.values()}.values():
            alike = {k: each.physics for k, each in asked.items() if each.residuals is residuals}
            errors = residuals.errors_of_each(np.concatenate([*alike.values()]))
            ends = np.cumsum([len(physics) for physics in alike.values()])
            answers.update(zip(alike, np.split(errors, ends[:-1]), strict=True))
        asked = {}
        for k, answer in answers.items():
            try:
                asked[k] = searches[k].send(answer)
            except StopIteration as end:
                found[k] = end.value
    return found.tolist()


class _Held(NamedTuple):
    """Residuals of the recordings set aside: under the model found, and with the small changes it asks for."""

    residuals: Residuals
    before: Array
    noise: Array


class _Search:
    """The search for one effect's limit.

    Parameters
    ----------
    problem, model
        As `limits` takes them.
    none
        The model's residuals in units of the sensors' noise, shape (n,).
    left
        What whole drives are off by under the model, in times the material size.
    held
        The recordings set aside.
    rivals
        Directions in which every effect changes residuals, by effect.
    effect
        Which one.
    """

    def __init__(
        self,
        problem: Problem,
        model: Model,
        none: Array,
        left: float,
        held: _Held,
        rivals: Mapping[str, Array],
        effect: str,
    ) -> None:
        self._problem, self._model, self._none, self._held, self.effect = problem, model, none, held, effect
        self._left = left
        # Drives that are off by little come out no worse, whatever they were off by before.
        self._may_worsen = is_worse(0.0, left) and not (problem.on_bench or BY_ID[effect].at_a_place)
        self._rivals = [directions for other, directions in rivals.items() if other != effect]
        self._parameters = free(problem.estimator.robot, (*model.effects, effect))
        coordinates = self._parameters.coordinates
        self._k = next(k for k, c in enumerate(coordinates) if c.effect.id == effect)
        low, high = (float(bound[self._k]) for bound in self._parameters.bounds)
        least = problem.share(coordinates[self._k].parameter)
        self._sides = [side for side, room in ((1.0, high), (-1.0, -low)) if room > least]
        self._places = self._shapes()

    def of_each_place_and_side(self) -> list[_Asking]:
        """Return the searches at each place, on each side of neutral."""
        return [self._smallest(place, side) for place in self._places for side in self._sides]

    def limit(self, smallest: Iterator[float]) -> Limit | None:
        """Return the limit: the larger of those on both sides of neutral, which holds at nine of ten places.

        ``smallest`` are what the searches of each place and side found, in their order.
        """
        c = self._parameters.coordinates[self._k]
        found = [max((next(smallest) for _ in self._sides), key=abs) for _ in self._places]
        z = sorted(found, key=abs)[math.ceil(SEEN_PLACES * len(found)) - 1]
        if math.isinf(z):
            return None
        return Limit(float(c.value(z) if c.inverse else abs(c.value(z) - c.neutral)), c.parameter.unit)

    def _shapes(self) -> list[Array]:
        """Return coordinate vectors that differ in the effect's other parameters, such as the place of a patch."""
        problem, model, effect = self._problem, self._model, self.effect
        tried: Sequence[Mapping[str, float]] = ()
        if BY_ID[effect].at_a_place:
            tried = patches(problem.recordings, MOST_PLACES)
        elif any(p.worthwhile == 0.0 for p in BY_ID[effect].parameters[1:]):
            tried = problem.estimator.starts(model, effect)[:1]
        return [self._parameters.vector({**model.values, effect: values}) for values in tried or ({},)]

    def _smallest(self, start: Array, side: float) -> _Asking:
        """Find the smallest coordinate on one side of neutral at which the effect would be named; infinite: none."""
        k, coordinate = self._k, self._parameters.coordinates[self._k]
        low, high = (float(bound[k]) for bound in self._parameters.bounds)
        scale = side * (1.0 if not coordinate.inverse else high / LARGEST)
        sizes = scale * np.geomspace(self._problem.share(coordinate.parameter), LARGEST, TRIED)
        vectors = np.tile(start, (TRIED, 1))
        vectors[:, k] = np.clip(sizes, low, high)
        before = 0.0
        for n, z in enumerate(vectors):
            at = n % AT_ONCE
            if at == 0:  # most limits are small
                physics = self._parameters.physics(vectors[n : n + AT_ONCE])
                changes = (yield _Asked(self._problem.residuals, physics)) - self._none
                margins = self._margins(changes)
            now = float(margins[at])
            matters = now >= 1.0 and self._matters(z)
            if matters:
                confirmed = yield from self._confirmed(z, changes[at])
                now = min(now, self._apart_from_neutral(z), confirmed)
            if matters and now >= 1.0:
                found = z[k] if n == 0 or before >= 1.0 else _between(sizes[n - 1 : n + 1], before, now)
                return float(np.clip(MARGIN * found, low, high))
            before = now
        return math.inf

    def _margins(self, changes: Array) -> Array:
        """Return by which factors changes of residuals, shape (sizes, n), exceed what is needed; shape (sizes,).

        Needed are `NEEDED` in all, and `APART` beside what the best rival explains. Large changes count as in costs.
        """
        changes = self._problem.estimator.whitened(changes)
        squares = np.sum(changes**2, axis=1)
        alike = [np.sum((changes @ directions) ** 2, axis=1) for directions in self._rivals]
        shown = np.sqrt(2.0 * np.sum(costs(changes), axis=1))
        own = np.sqrt(
            np.clip(1.0 - np.max(alike, axis=0, initial=0.0) / np.maximum(squares, FAINT), 0.0, 1.0)
        )
        return np.asarray(np.minimum(shown / NEEDED, own * shown / APART))

    def _apart_from_neutral(self, z: Array) -> float:
        """Return by which factor a size exceeds what it needs: its law may be off, and its interval allows for that."""
        size = float(z[self._k])
        off = model_error(self._parameters.coordinates[self._k], size)
        return abs(size) / max((NORMAL_95 + SURE) * off, FAINT)

    def _confirmed(self, z: Array, change: Array) -> _Asking:
        """Return by which factor recordings set aside exceed what is needed to confirm an effect of one size.

        The share of it that they ask for is 1, give or take its standard deviation; with the small changes that make up
        for it where it is absent, or without them. An effect that they do not show must show in two others, or in two
        thirds of the only other one.
        """
        problem, (held, before, noise) = self._problem, self._held
        if not held.recordings:
            return math.inf
        after = (yield _Asked(held, self._parameters.physics(z)))[0]
        least = least_share_expected(held.index, noise, after - before, SURE)
        if math.isinf(least):
            shown = np.bincount(problem.parts, change**2) >= LEAST_SHOWN
            return math.inf if np.sum(shown) > 1 else 0.0
        if least > 0.0:
            made_up = (yield _Asked(held, problem.with_changes_for(self._model, -change)))[0]
            least = min(least, least_share_expected(held.index, noise, after - made_up, SURE))
        return 1.0 / (1.0 - least)

    def _matters(self, z: Array) -> bool:
        """Whether a size is worth a name and material, and whole drives would come out no worse with it."""
        problem, parameters = self._problem, self._parameters
        if not worthwhile(parameters, z, self.effect, problem.share):
            return False
        physics = parameters.physics(z)
        if not problem.sizes.are_apart(self._model.physics, physics, problem.material):
            return False
        return not (self._may_worsen and is_worse(self._would_leave(physics), self._left))

    def _would_leave(self, physics: Physics) -> float:
        """Return how far drives of a robot with the effect would be from the model, in times the material size.

        They are off by b without it, and by b + e with it. By the parallelogram |b + e|² = 2 |b|² + 2 |e|² - |b - e|²,
        and b - e is how far the drives that were measured are from a simulated robot with it.
        """
        sizes, times = self._problem.sizes, self._problem.material.times
        own, opposite = times(sizes.apart(self._model.physics, physics)), times(sizes.left(physics))
        return math.sqrt(max(2.0 * (self._left**2 + own**2) - opposite**2, 0.0))


def _between(sizes: Array, before: float, now: float) -> float:
    """Return the size at which a margin passes 1, interpolated between two sizes; it is less there and more here."""
    share = math.log(1.0 / max(before, FAINT)) / math.log(now / max(before, FAINT))
    return float(sizes[0] * (sizes[1] / sizes[0]) ** share)
