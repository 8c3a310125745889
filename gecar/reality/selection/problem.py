"""What a selection is made from: residuals, the effects that may be found, and what counts for something."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.camera_mark import with_fitted_mark
from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.fitting.discrepancy import Discrepancy, discrepancy
from gecar.reality.fitting.estimator import RIPPLE, Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.fitting.parameters import Parameters, free, torque_scale
from gecar.reality.materiality import DEFAULT, Material
from gecar.reality.optimisation.least_squares import cost_of_each, least_squares
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.channels import BATTERY, POSE
from gecar.reality.residuals.of_case import Physics, Residuals
from gecar.reality.residuals.parting import Sizes
from gecar.reality.selection.thresholds import CLOCKS_SCATTER_S, LARGE, PRICE, SMALL, STANDING_OUT, UNNAMED
from gecar.world.effects import BY_ID, Parameter
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
T = TypeVar("T")
SPOT_SIZE = "spot_size"
LEAST_ROOM = 1e-6  # between bounds that would otherwise touch
PROBE = 0.4  # of a size worth a name: step of finite differences by small changes
REFINEMENTS = 2  # of small changes, by derivatives taken anew
RENEWALS = 4  # of camera clocks, beside effects, at most
CONVERGED = 0.5  # gain in log-likelihood from which on they are fitted once more
COMMON_DELAY = "pose_delay"  # the effect that camera clocks late by the same time are


@dataclass(frozen=True)
class Problem:
    """A selection problem.

    Attributes
    ----------
    estimator
        Fits effects to the residuals.
    catalogue
        Identifiers of the effects that may be found.
    material
        From what size on something is material.
    sizes
        How much it matters what robots differ by.
    known
        The robot with nothing fitted.
    tell
        Called with a line of progress.
    clocks_fitted
        Whether each camera's clock offset was fitted.
    refused
        Effects of the catalogue that are not tried, as recordings set aside do not confirm them.
    worth
        Which share of the catalogue's size is worth a name here, by field of the physics record; 1 where none is given.
    place
        Which model left the discrepancy, and what of it was free.
    kept
        What was worked out before: recordings are explained once more where an effect is refused.
    """

    estimator: Estimator
    catalogue: tuple[str, ...]
    material: Material
    sizes: Sizes
    known: Model
    tell: Callable[[str], None]
    clocks_fitted: bool = False
    refused: frozenset[str] = frozenset()
    worth: Mapping[str, float] = field(default_factory=dict)
    place: Hashable = ()
    kept: dict[Hashable, Any] = field(default_factory=dict, repr=False, compare=False)

    def once(self, what: str, *about: Hashable, make: Callable[[], T]) -> T:
        """Return what was worked out before from the same residuals under the same discrepancy, or work it out."""
        key = (what, self.place, *about)
        if key not in self.kept:
            self.kept[key] = make()
        found: T = self.kept[key]
        return found

    @property
    def tried(self) -> tuple[str, ...]:
        """Effects of the catalogue that may be taken."""
        return tuple(effect for effect in self.catalogue if effect not in self.refused)

    @property
    def residuals(self) -> Residuals:
        """What effects are fitted to."""
        return self.estimator.residuals

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """The recordings that its residuals were computed from."""
        return self.estimator.recordings

    @property
    def is_only_one(self) -> bool:
        """Whether there is only one recording: then nothing tells a late camera clock from a late camera."""
        return len(self.residuals.recordings) == 1

    @property
    def blocks(self) -> int:
        """Number of blocks of residuals."""
        return self.estimator.blocks.count

    @property
    def on_bench(self) -> bool:
        """Whether all recordings were made on a bench."""
        return self.estimator.on_bench

    def cost_of(self, physics: Physics) -> float:
        """Return the cost of the residuals that a physics record, shape (1,), leaves."""
        return self.estimator.cost_of(self.residuals.errors(physics))

    @property
    def parts(self) -> npt.NDArray[np.int32]:
        """The recording of each residual, or its third of the only one, shape (n,): parts confirm what others show."""
        index = self.residuals.index
        return self.estimator.blocks.folds if self.is_only_one else index.recording

    def without(self, number: int) -> tuple[Problem, Residuals]:
        """Return the problem without one recording, and that recording's residuals."""
        numbers = [k for k in range(len(self.residuals.recordings)) if k != number]
        rest = self.residuals.part(numbers)
        estimator = Estimator(rest, self.estimator.robot, self.estimator.rng)
        return self._anew(estimator), self.residuals.part([number])

    def _anew(self, estimator: Estimator) -> Problem:
        """Return the problem with another estimator's residuals; nothing of it has been worked out yet."""
        sizes, known = self.sizes.of(estimator.residuals), estimator.known()
        return replace(self, estimator=estimator, sizes=sizes, known=known, place=(), kept={})

    def under(self, model: Model, free_effects: Sequence[str] | None = None) -> Problem:
        """Return the problem with the discrepancy that a model leaves; effects that are free (its own) are no part.

        A motor on a bench is known to tenths of a percent, and what its model is off by is what one looks for.
        """
        if self.on_bench:
            return self
        return self._beside("small", model, free_effects, lambda p: (SMALL * self.share(p), LARGE))

    def beside_unnamed(self, model: Model) -> Problem:
        """Return the problem beside changes of all other parameters of a size that a bench leaves open (`unnamed`)."""
        return self._beside("unnamed", model, None, lambda p: (UNNAMED * unnamed(p), LARGE * unnamed(p)))

    def share(self, parameter: Parameter | None) -> float:
        """Return which share of a parameter's size in the catalogue is worth a name here."""
        return self.worth.get(parameter.field, 1.0) if parameter else 1.0

    def _beside(
        self,
        changes: str,
        model: Model,
        free_effects: Sequence[str] | None,
        sized: Callable[[Parameter | None], tuple[float, float]],
    ) -> Problem:
        """Return the problem with all other parameters uncertain by a small and a large standard deviation of each."""
        if not self.blocks:
            return self
        own = model.effects if free_effects is None else free_effects
        place = (changes, model.key, tuple(sorted(own)))
        last_place, left = self.kept.get("discrepancy", (None, None))
        if place != last_place:
            left = self._left_by(model, own, sized)
            self.kept["discrepancy"] = place, left  # the last one only: each takes tens of megabytes
        estimator = self.estimator.under(left)
        return replace(self, estimator=estimator, known=estimator.known(), place=place)

    def _left_by(
        self,
        model: Model,
        own: Sequence[str],
        sized: Callable[[Parameter | None], tuple[float, float]],
    ) -> Discrepancy:
        """Return the discrepancy that a model leaves; of the ``own`` effects no small changes are assumed."""
        slopes, sizes = [], []
        for effect, columns in small_sensitivities(self, model).items():
            slopes.append(np.where(effect in own, 0.0, columns))
            of_effect: list[Parameter | None] = [*_small(effect)] if effect in BY_ID else []
            sizes += [sized(p) for p in of_effect or [None] * columns.shape[1]]  # ripples, instruments: none
        errors, channel = self.residuals.errors(model.physics), self.residuals.index.channel
        small, large = np.array(sizes).reshape(-1, 2).T
        parameters = sum(len(_small(effect)) for effect in self.catalogue)
        return discrepancy(
            np.concatenate(slopes, axis=1), errors, self.estimator.blocks, channel, small, large, parameters
        )

    def with_small_changes(self, model: Model, beside: Model | None = None) -> Physics:
        """Return a model's physics record with the most likely small changes of all other parameters, shape (1,).

        They are those that this model asks for, or another one.
        """
        values = self.small_changes(model, beside)
        parameters = free(self.estimator.robot, list(values))
        return parameters.physics(parameters.vector(values))

    def slow_noise(self, model: Model) -> Array:
        """Return by how much slow noise of x, y and heading exceeds white noise (variances), shape (3,).

        It is told by what a model leaves with the most likely small changes of all other parameters.
        """
        return self.once("slow noise", model.key, make=lambda: self._slow_noise(model))

    def _slow_noise(self, model: Model) -> Array:
        errors = self.residuals.errors(self.with_small_changes(model))
        return self.estimator.blocks.inflation(errors)[list(POSE)]

    def with_changes_for(self, model: Model, errors: Array) -> Physics:
        """Return a model's physics record with the small changes that explain given residuals best, shape (1,).

        The residuals ``errors``, shape (n,), need not be the model's own; derivatives at the model are used.
        """
        left = self.estimator.discrepancy
        if left is None:
            return model.physics
        parameters, z, at = self._with_others(model)
        z[at] += left.small_changes(errors, *self._room(parameters, z, at))
        return parameters.physics(np.clip(z, *parameters.bounds))

    def small_changes(self, model: Model, beside: Model | None = None) -> dict[str, dict[str, float]]:
        """Return a model's values with the most likely small changes of all other parameters, by effect and label."""
        if self.estimator.discrepancy is None:
            return model.values
        parameters, z, at = self._with_others(model)
        z[at] += self._most_likely(beside or model)
        return parameters.values(np.clip(z, *parameters.bounds))

    def _with_others(self, model: Model) -> tuple[Parameters, Array, npt.NDArray[np.intp]]:
        """Return a model's parameters and those of all other effects, their vector, and where small changes stand."""
        others = [effect for effect in self.catalogue if effect not in model.effects]
        parameters = free(self.estimator.robot, (*model.effects, *others))
        place = {(c.effect.id, c.parameter.label): k for k, c in enumerate(parameters.coordinates)}
        at = [place[effect, p.label] for effect in self.catalogue for p in _small(effect)]
        return parameters, parameters.vector(model.values), np.array(at, np.intp)

    def _most_likely(self, model: Model) -> Array:
        """Return the most likely small changes beside a model, in the catalogue's sizes, shape (changes,).

        Maximum a posteriori. Derivatives at the model give the start: what starts to slip a little sooner, or to play,
        is not in proportion to its size.
        """
        return self.once("small changes", model.key, make=lambda: self._fitted_changes(model))

    def _fitted_changes(self, model: Model) -> Array:
        left = self.estimator.discrepancy
        assert left is not None
        parameters, z, at = self._with_others(model)
        low, high = self._room(parameters, z, at)
        moving = np.flatnonzero(left.uncertain)
        sd = left.small[moving]

        def residual(changes: Array) -> Array:
            vectors = np.tile(z, (len(np.atleast_2d(changes)), 1))
            vectors[:, at[moving]] += changes
            errors = self.residuals.errors_of_each(parameters.physics(np.clip(vectors, *parameters.bounds)))
            out = np.hstack([left.whitened_beside_parameters(errors), np.atleast_2d(changes) / sd])
            return out if changes.ndim == 2 else out[0]

        bounds = low[moving], high[moving]
        linear = left.small_changes(self.residuals.errors(model.physics), low, high)
        starts = np.array([np.zeros(len(moving)), linear[moving]])
        start = starts[int(np.argmin(cost_of_each(residual, starts)))]
        probes = PROBE * np.minimum(high, 1.0)[moving]
        found = np.zeros(len(at))
        found[moving] = least_squares(residual, start, bounds, probes, REFINEMENTS).z
        return found

    def _room(self, parameters: Parameters, z: Array, at: npt.NDArray[np.intp]) -> tuple[Array, Array]:
        """Return the lowest and highest small changes, by the sizes worth a name and the parameters' bounds."""
        lowest, highest = (bound[at] - z[at] for bound in parameters.bounds)
        room = np.array([self.share(parameters.coordinates[k].parameter) for k in at])
        return np.clip(lowest, -room, -LEAST_ROOM), np.clip(highest, LEAST_ROOM, room)

    def with_its_camera(self, held: Residuals, physics: Physics) -> Residuals:
        """Return recordings set aside with this problem's mark, and clocks fitted to them if this problem's were."""
        if held.sensor:
            return held
        held = held.with_mark(self.residuals.mark)
        return with_fitted_clocks(held, physics)[0] if self.clocks_fitted else held

    def with_clocks(self, model: Model, least_gain: float = 0.0) -> Problem | None:
        """Return the problem with camera clocks fitted under a model; None where too little is gained by it.

        That is ``least_gain``, or what a name costs. Clocks late by the same time in all recordings are a late camera,
        an effect; no camera is early, but its clocks may be. Once they are fitted, a late camera is no effect any more:
        what a model has of it is the clocks'.
        """
        if self.clocks_fitted or self.residuals.sensor:
            return None
        fitted, _ = with_fitted_clocks(self.residuals, model.physics)
        before, after = (self.estimator.cost_of(r.errors(model.physics)) for r in (self.residuals, fitted))
        common = float((model.physics[COMMON_DELAY] - self.known.physics[COMMON_DELAY])[0])
        offsets = fitted.clock_offsets_s + common
        early, differ = float(np.mean(offsets)) < 0.0, scattered(offsets)
        if before - after < max(least_gain, PRICE) or not (self.is_only_one or early or differ):
            return None
        late = "differs from recording to recording" if differ else "is early" if early else "is late"
        self.tell(f"the camera's clock {late}: it is fitted")
        others = tuple(e for e in self.catalogue if e != COMMON_DELAY)
        return replace(self.on(fitted.with_clock_offsets(offsets)), catalogue=others, clocks_fitted=True)

    def with_clocks_beside(self, model: Model) -> Problem | None:
        """Fit the camera's clocks anew beside a model's effects, and laws; None where too little is gained by it.

        That is what a name costs. Fitted before these were known, clocks have taken up a part of them.
        """
        anything = model.effects or self.estimator.robot.term
        if not (self.clocks_fitted and anything) or self.residuals.sensor:
            return None
        problem, now = self, self.cost_of(model.physics)
        before = now
        for _ in range(RENEWALS):
            problem = problem.on(with_fitted_clocks(problem.residuals, model.physics)[0])
            model = problem.estimator.fit(model.effects, model.values)
            was, now = now, self.estimator.cost_of(problem.residuals.errors(model.physics))
            if was - now < CONVERGED:
                break
        return problem if before - now >= PRICE else None

    def filmed_as(self, other: Problem) -> Problem:
        """Return the problem with the camera's clocks and mark of another, of the same recordings."""
        return replace(self.on(other.residuals), catalogue=other.catalogue, clocks_fitted=other.clocks_fitted)

    @property
    def mark_fitted(self) -> bool:
        """Whether the place of the camera's mark on the robot was fitted."""
        return any(self.residuals.mark)

    def with_mark(self, model: Model, least_gain: float = 0.0) -> Problem | None:
        """Return the problem with the camera's mark fitted under a model; None where too little is gained by it.

        Recordings left out must gain what a name costs and ``least_gain``: a mark has the same place in all of them.
        """
        headings = any("heading_rad" in run.measured for run in self.recordings)
        if self.residuals.sensor or self.on_bench or not headings:
            return None
        fitted, gain = with_fitted_mark(self.estimator, model.physics)
        return self.on(fitted) if gain >= max(least_gain, PRICE) else None

    @property
    def is_beyond_constants(self) -> bool:
        """Whether a model leaves far more than sensor noise, even with large changes of all the robot's constants.

        That is of how it moves or what it reads: a battery's voltage may have a story of its own.
        """
        found = self.estimator.discrepancy
        return found is not None and float(np.delete(found.ratios, BATTERY).max()) > STANDING_OUT

    def of_effects(self, catalogue: Sequence[str]) -> Problem:
        """Return the same problem with other effects; what was worked out before is of those it had."""
        return replace(self, catalogue=tuple(catalogue), kept={})

    def on(self, residuals: Residuals) -> Problem:
        """Return the same problem for other residuals; their discrepancy is not known yet."""
        return self._anew(Estimator(residuals, self.estimator.robot, self.estimator.rng))


def problem_of(
    residuals: Residuals,
    robot: Robot,
    catalogue: Sequence[str],
    material: Material = DEFAULT,
    seed: int = 0,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    held: Residuals | None = None,
) -> Problem:
    """Set a selection problem.

    Parameters
    ----------
    residuals
        What effects are fitted to.
    robot
        As far as it is known.
    catalogue
        Identifiers of the effects that may be found.
    material
        From what size on something is material.
    seed
        Random seed.
    tell
        Called with a line of progress.
    held
        Recordings set aside, under whose commands it counts, too, what robots differ by.
    """
    estimator = Estimator(residuals, robot, np.random.default_rng(seed))
    beside = held.recordings if held else ()
    sizes = Sizes(residuals.recordings, residuals.sensor, beside)
    small = () if estimator.on_bench else catalogue
    if residuals.sensor:  # an edge is as wide wherever the path lies; where it lies a path tells to 3 mm
        small = [effect for effect in catalogue if effect == SPOT_SIZE]
    worth = worth_a_name(sizes, material, robot, small)
    return Problem(estimator, tuple(catalogue), material, sizes, estimator.known(), tell, worth=worth)


def worth_a_name(
    sizes: Sizes, material: Material, robot: Robot, catalogue: Sequence[str]
) -> dict[str, float]:
    """Return the share of each parameter's size in the catalogue that is material in these recordings, by field.

    It is 1 where all of it does not, and no less than what the simulation's own laws may be off by
    (`Parameter.model_error_steps`). Of a ripple it is that of one wave a turn, which moves the robot most.
    """
    small, changed = [], []
    for effect in catalogue:
        parameters, fields = free(robot, (effect,)), {p.field for p in _sizes_of(effect)}
        sides = np.where(parameters.bounds[1] >= 1.0, 1.0, -1.0)
        for alone, c in zip(np.diag(sides), parameters.coordinates, strict=True):
            if c.parameter.field in fields:
                small.append(c.parameter)
                changed.append(parameters.physics(alone))
    out = {}
    for p, apart in zip(small, sizes.apart_of_each(robot.physics, changed), strict=True):
        out[p.field] = min(1.0, max(1.0 / max(material.times(apart), 1e-9), p.model_error_steps))
    return out


def unnamed(parameter: Parameter | None) -> float:
    """Return how many times `UNNAMED` a parameter may differ from its known value: as motors do, or below a name."""
    if parameter is None:
        return 1.0
    return max(parameter.differs / (UNNAMED * parameter.worthwhile), 1.0)


def small_sensitivities(
    problem: Problem,
    model: Model,
    sized: Callable[[Parameter], float] = lambda p: 1.0,  # noqa: ARG005
) -> dict[str, Array]:
    """Return the derivatives of residuals by small changes, in sizes worth a name, by effect, shape (n, changes).

    Some may be so many times as large (``sized``).

    The ripple of a motor that is known for none has no phase yet: it may be any sum of sines. It comes after all other
    effects; then, under no name, what errors of a gyro and of encoders do.
    """
    plain = problem.estimator.under(None)
    found = plain.plain_sensitivities(model, problem.catalogue)
    out = {}
    for effect, slopes in zip(problem.catalogue, found, strict=True):
        small = _small(effect)
        factors = np.array([sized(p) for p in small])
        out[effect] = slopes[:, [p in small for p in BY_ID[effect].parameters]] * factors
    if RIPPLE in out:
        del out[RIPPLE]
        if RIPPLE not in model.effects:
            size = BY_ID[RIPPLE].parameters[0].worthwhile * torque_scale(plain.robot)
            waves = (wave.columns * (size / wave.amplitude_nm) for wave in plain.ripples(model))
            out[RIPPLE] = np.concatenate([np.zeros((len(model.errors), 0)), *waves], axis=1)
    return {**out, "": problem.residuals.instrument_errors(model.physics)}


def _small(effect: str) -> list[Parameter]:
    """Return the parameters that may be off a little: residuals follow them smoothly from neutral on."""
    return [] if effect == RIPPLE else [p for p in _sizes_of(effect) if p.smooth]


def _sizes_of(effect: str) -> list[Parameter]:
    """Return the parameters of an effect that have a size worth a name."""
    return [p for p in BY_ID[effect].parameters if p.worthwhile > 0.0]


def scattered(offsets_s: Array) -> bool:
    """Whether offsets differ from recording to recording by more than one common delay can."""
    return len(offsets_s) >= 2 and float(np.std(offsets_s)) > CLOCKS_SCATTER_S
