"""Fits of effects to residuals, and the residuals' finite-difference sensitivities to effects' parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.discrepancy import Discrepancy
from gecar.reality.fitting.initial_values import (
    Errors,
    Single,
    Values,
    Wave,
    initial_values,
    responses,
    ripples,
)
from gecar.reality.fitting.model import Effects, Model, Step
from gecar.reality.fitting.parameters import free
from gecar.reality.fitting.profile import RISE_95, reaches
from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.optimisation.cma_es import cma_es
from gecar.reality.optimisation.least_squares import (
    TOGETHER,
    Minimum,
    Residual,
    cost,
    cost_of_each,
    least_squares,
    steps_inwards,
    weights,
)
from gecar.reality.recordings.recording import Recording
from gecar.reality.residuals.of_case import Residuals
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
T = TypeVar("T")
RIPPLE = "torque_ripple"
CACHED_FITS = 2  # whose sensitivities are kept: ten megabytes each
CACHED_RESPONSES = 4  # models whose responses are kept: tens of megabytes each
REFINED_SPREAD = 0.25  # of a parameter's search spread: about a fit that least squares has refined
CENTRINGS = 2  # from one side of a jump, across it, and once more about what is there
FAINT = 1e-9  # a sensitivity that is none
LEAST_NORM = 1e-6  # weighted sensitivities smaller than this say nothing


class FreeParameters(Protocol):
    """What maps vectors to physics records."""

    def physics(self, z: Array) -> npt.NDArray[Any]:
        """Return the physics records of one vector, or of m."""
        ...


def directions(slopes: Array) -> Array:
    """Return orthonormal directions, shape (n, k), in which an effect with these slopes changes residuals."""
    return np.linalg.qr(slopes[:, np.linalg.norm(slopes, axis=0) > FAINT])[0]


class Estimator:
    """Fits a robot's effects to residuals.

    Parameters
    ----------
    residuals
        What is fitted.
    robot
        As far as it is known.
    rng
        Random generator of the searches.
    discrepancy
        What the model is off by, as noise; None: the sensors' noise alone counts.
    """

    def __init__(
        self,
        residuals: Residuals,
        robot: Robot,
        rng: np.random.Generator,
        discrepancy: Discrepancy | None = None,
    ) -> None:
        self.residuals, self.robot, self.rng, self.discrepancy = residuals, robot, rng, discrepancy
        self.blocks = Blocks(residuals.index)
        self.on_bench = all(r.recording.setup.rig == "bench" for r in residuals.recordings)
        self._cache: dict[tuple[tuple[str, ...], bytes], dict[str, Array]] = {}
        self._responses: list[tuple[Model, dict[str, list[Any]]]] = []

    def under(self, discrepancy: Discrepancy | None) -> Estimator:
        """Return this with another discrepancy; derivatives taken so far are kept."""
        other = copy(self)
        other.discrepancy = discrepancy
        return other

    def cost_of(self, errors: Array) -> float:
        """Return the robust cost of residuals in units of the sensors' noise, shape (n,)."""
        return cost(self.whitened(errors))

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """The recordings that the residuals were computed from."""
        return tuple(r.recording for r in self.residuals.recordings)

    def known(self) -> Model:
        """Return the robot as it is known, with nothing fitted."""
        return self._model((), np.zeros(0))

    def residual(self, parameters: FreeParameters) -> Residual:
        """Return the function that fits minimise."""

        def residual(z: Array) -> Array:
            errors = self.whitened(self.residuals.errors_of_each(parameters.physics(z)))
            return errors if z.ndim == 2 else errors[0]

        return residual

    def trial(self, model: Model, effect: str) -> Callable[[Sequence[Mapping[str, float]]], Array]:
        """Return the function from m values of one more effect, by label, to a model's residuals, shape (m, n)."""
        parameters = free(self.robot, (*model.effects, effect))
        residual = self.residual(parameters)

        def errors(tried: Sequence[Mapping[str, float]]) -> Array:
            return residual(
                np.array([parameters.vector({**model.values, effect: values}) for values in tried])
            )

        return errors

    def starts(self, model: Model, effect: str) -> list[Values]:
        """Return values of one more effect to start fits from, by label."""
        waves: list[Wave] = []
        if effect == RIPPLE:
            whitened = zip(self.ripples(model), self.responses(model, effect), strict=True)
            waves = [wave._replace(columns=columns) for wave, columns in whitened]
        return initial_values(effect, self.robot, self.recordings, self.trial(model, effect), waves)

    def responses(self, model: Model, effect: str) -> Iterator[Array]:
        """Yield how residuals change in each direction that a search for one more effect looks in, shape (n, k).

        As `gecar.reality.fitting.initial_values.responses`, and of a ripple its sines and cosines.
        """

        def replayed(errors: Errors) -> Iterable[Single]:
            return responses(effect, self.robot, self.recordings, errors)

        if effect == RIPPLE:
            found = [wave.columns for wave in self.ripples(model)]
        else:
            found = self._once_near(model, effect, replayed)
        for first in range(0, len(found), TOGETHER):
            some = found[first : first + TOGETHER]
            yield from np.split(self.whitened(np.concatenate(some, axis=1).T).T, len(some), axis=1)

    def ripples(self, model: Model) -> list[Wave]:
        """Return what torque ripples add to a model's residuals, in units of the sensors' noise."""
        return self._once_near(model, RIPPLE, lambda errors: ripples(self.robot, self.recordings, errors))

    def _once_near(self, model: Model, effect: str, replay: Callable[[Errors], Iterable[T]]) -> list[T]:
        """Replay one more effect on top of a model, or return what was replayed for a model near it.

        In units of the sensors' noise. Something small changes the residuals of such models alike, and to know it takes
        hundreds of replays.
        """
        known = next((known for other, known in self._responses if model.is_near(other)), None)
        if known is None:
            known = {}
            self._responses[:] = [*self._responses[1 - CACHED_RESPONSES :], (model, known)]
        if effect not in known:
            known[effect] = list(replay(self.under(None).trial(model, effect)))
        return known[effect]

    def fit(
        self,
        effects: Sequence[str],
        values: Effects,
        rounds: int = 10,
    ) -> Model:
        """Fit all parameters of some effects together, from given values."""
        parameters = free(self.robot, effects)
        residual = self.residual(parameters)
        start = parameters.vector(values)
        bounds, probes = parameters.bounds, parameters.probes
        found = least_squares(residual, start, bounds, probes, rounds, past_jumps=self.on_bench)
        energy = self.blocks.excess_energy(found.errors)
        return Model(tuple(effects), parameters, found, energy)

    def at(self, model: Model, z: Array) -> Model:
        """Return a model at other coordinates."""
        return self._model(model.effects, z)

    def models_of(self, step: Step) -> tuple[Model, Model]:
        """Return a step's models, without its effect and with it, with their residuals under this discrepancy."""
        return self.at(step.base, step.base.z), self.at(step.model, step.model.z)

    def searched(self, model: Model, spread: float = REFINED_SPREAD) -> Model:
        """Search about a fit without derivatives; return the better one, its thresholds in the middle of their gaps."""
        parameters, residual = model.parameters, self.residual(model.parameters)
        wide = np.array([spread * c.parameter.search_spread for c in parameters.coordinates])
        z, least = cma_es(lambda at: cost_of_each(residual, at), model.z, wide, parameters.bounds, self.rng)
        return self._centred(model if least >= model.cost else self.at(model, z))

    def _centred(self, model: Model) -> Model:
        """Put each threshold that may lie anywhere between two levels of duty into the middle.

        These commands leave a gap there; those of other recordings may fall into it.
        """
        nobody, residual = np.zeros(0, np.intp), self.residual(model.parameters)
        for k, c in enumerate(model.parameters.coordinates):
            for _ in range(CENTRINGS if c.is_threshold else 0):
                down, up = reaches(residual, model, k, nobody)
                z = model.z.copy()
                z[k] += 0.5 * (up - down)
                centred = self.at(model, z)
                # What is known as well as a size worth a name lies in no such gap.
                if down + up < 1.0 or centred.cost > model.cost + RISE_95:
                    break
                model = centred
        return model

    def sensitivities(self, model: Model, effects: Sequence[str]) -> list[Array]:
        """Return the residuals' derivatives by effects' parameters, the model's or one more, each of shape (n, k)."""
        plain = self.plain_sensitivities(model, effects)
        if not plain:
            return []
        whitened = self.whitened(np.concatenate([slopes.T for slopes in plain]))
        return [rows.T for rows in np.split(whitened, np.cumsum([slopes.shape[1] for slopes in plain[:-1]]))]

    def plain_sensitivities(self, model: Model, effects: Sequence[str]) -> list[Array]:
        """Return the same of residuals in units of the sensors' noise; those of the last few fits are kept."""
        key = (model.effects, model.z.tobytes())
        cached = self._cache.setdefault(key, {})
        missing = [effect for effect in effects if effect not in cached]
        if missing:
            cached.update(zip(missing, self._differences(model, missing), strict=True))
        while len(self._cache) > CACHED_FITS:
            self._cache.pop(next(iter(self._cache)))
        return [cached[effect] for effect in effects]

    def own_sensitivities(self, model: Model) -> Array:
        """Return the residuals' derivatives by a model's own parameters, shape (n, parameters)."""
        columns = self.sensitivities(model, model.effects)
        return np.concatenate([np.zeros((len(model.errors), 0)), *columns], axis=1)

    def projection(self, model: Model) -> Callable[[Array], Array]:
        """Return the function that weights sensitivities, shape (n, k), and projects a model's own parameters out.

        What vanishes is dropped.
        """
        w = np.sqrt(weights(model.errors))[:, None]
        basis = np.linalg.qr(self.own_sensitivities(model) * w)[0]

        def projected(slopes: Array) -> Array:
            weighted = slopes * w
            weighted = weighted - basis @ (basis.T @ weighted)
            kept: Array = weighted[:, np.sqrt(np.sum(weighted * weighted, axis=0)) > LEAST_NORM]
            return kept

        return projected

    def linear_gain(self, model: Model, effect: str) -> float:
        """Return the gain that sensitivities promise for one more effect: a score test.

        Source: Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50.
        """
        w = np.sqrt(weights(model.errors))
        g = self.projection(model)(self.sensitivities(model, [effect])[0])
        if not g.shape[1]:
            return 0.0
        return 0.5 * float(np.sum((np.linalg.qr(g)[0].T @ (w * model.errors)) ** 2))

    def whitened(self, errors: Array) -> Array:
        """Return residuals, shape (n,) or (m, n), in units of what the sensors and the model are off by."""
        return errors if self.discrepancy is None else self.discrepancy.whitened(errors)

    def _model(self, effects: tuple[str, ...], z: Array) -> Model:
        parameters = free(self.robot, effects)
        errors = self.residual(parameters)(z)
        found = Minimum(z, errors, cost(errors))
        return Model(effects, parameters, found, self.blocks.excess_energy(errors))

    def _differences(self, model: Model, effects: Sequence[str]) -> list[Array]:
        steps, moved = [], [model.physics]
        for effect in effects:
            own = effect in model.effects
            parameters = free(self.robot, model.effects if own else (*model.effects, effect))
            z, high = parameters.vector(model.values), parameters.bounds[1]
            of_effect = [k for k, c in enumerate(parameters.coordinates) if c.effect.id == effect]
            probes = parameters.probes[of_effect]
            steps.append(steps_inwards(z[of_effect], probes, high[of_effect]))
            vectors = np.tile(z, (len(of_effect), 1))
            vectors[range(len(of_effect)), of_effect] += steps[-1]
            moved.append(parameters.physics(vectors))
        here, *found = self.residuals.errors_of_each(np.concatenate(moved))
        there = iter(found)
        return [np.stack([(next(there) - here) / step for step in each], axis=1) for each in steps]
