"""Fits of effects to a comparison, and how its residuals feel their parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.model import Effects, Model
from gecar.reality.fitting.parameters import Freedom, free
from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.optimisation.cma_es import rough_search
from gecar.reality.optimisation.least_squares import Fit, cost, fit, weights
from gecar.reality.residuals.of_case import Comparison
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
NO_SHIFT = np.zeros(1)
KEPT_FITS = 2  # whose slopes are kept: ten megabytes each
# How far about a fit is worth a search, in coordinates, where it is not 1.
ROUGH_SPREAD = {
    "patch_radius": 1.5,
    "patch_x": 2.0,
    "patch_y": 2.0,
    "patch_friction": 0.5,
    "stribeck_speed": 0.7,
    "ripple_lead": 0.2,
}


class Fits:
    """A comparison and a robot whose effects are fitted to it.

    Parameters
    ----------
    comparison
        What is fitted.
    robot
        As far as it is known.
    seed
        Of every draw of chance.
    """

    def __init__(self, comparison: Comparison, robot: Robot, seed: int = 0) -> None:
        self.comparison, self.robot = comparison, robot
        self.rng = np.random.default_rng(seed)
        comparison.errors(robot.physics)
        self.cells = comparison.cells
        self.blocks = Blocks(self.cells)
        self._felt: dict[tuple[tuple[str, ...], bytes], dict[str, Array]] = {}

    def bare(self) -> Model:
        """Return the robot with nothing fitted."""
        errors = self.comparison.errors(self.robot.physics)
        found = Fit(np.zeros(0), errors, np.zeros((len(errors), 0)), cost(errors))
        return Model((), free(self.robot, ()), found, self.blocks.structure(errors))

    def residual(self, freedom: Freedom, shift: Array = NO_SHIFT) -> Callable[[Array], Array]:
        """Return the function that fits minimise."""
        return lambda z: self.comparison.errors(freedom.physics(z)) - shift

    def refit(
        self, effects: Sequence[str], values: Effects, rounds: int = 10, shift: Array = NO_SHIFT
    ) -> Model:
        """Fit all parameters of some effects together, from given values."""
        freedom = free(self.robot, effects)
        residual = self.residual(freedom, shift)
        found = fit(residual, freedom.vector(values), freedom.bounds, freedom.probes, rounds)
        return Model(tuple(effects), freedom, found, self.blocks.structure(found.errors), shift)

    def shifted(self, model: Model, shift: Array) -> Model:
        """Return a model with another shift taken off its residuals."""
        errors = model.fit.errors + model.shift - shift
        found = Fit(model.fit.z, errors, model.fit.jacobian, cost(errors))
        return Model(model.effects, model.freedom, found, self.blocks.structure(errors), shift)

    def polished(self, model: Model, spread: float = 0.25) -> Model:
        """Search about a fit without slopes."""
        freedom, residual = model.freedom, self.residual(model.freedom, model.shift)
        wide = np.array([spread * ROUGH_SPREAD.get(c.parameter.field, 1.0) for c in freedom.coordinates])
        z, least = rough_search(lambda at: cost(residual(at)), model.fit.z, wide, freedom.bounds, self.rng)
        if least >= model.cost:
            return model
        return self.moved(model, z)

    def moved(self, model: Model, z: Array) -> Model:
        """Return a model at other coordinates, with the slopes it had."""
        errors = self.residual(model.freedom, model.shift)(z)
        found = Fit(z, errors, model.fit.jacobian, cost(errors))
        return Model(model.effects, model.freedom, found, self.blocks.structure(errors), model.shift)

    def slopes(self, model: Model) -> Array:
        """Return how residuals feel a model's own parameters, shape (n, parameters)."""
        felt = [self.felt(model, effect) for effect in model.effects]
        return np.concatenate([np.zeros((len(model.fit.errors), 0)), *felt], axis=1)

    def felt(self, model: Model, effect: str) -> Array:
        """Return how a model's residuals feel the parameters of an effect, its own or one more, shape (n, parameters).

        A shift taken off the residuals changes no slope, so models with the same fit share theirs; those of the last
        few fits are kept.
        """
        key = (model.effects, model.fit.z.tobytes())
        kept = self._felt.setdefault(key, {})
        if effect not in kept:
            kept[effect] = self._slopes_of(model, effect)
        while len(self._felt) > KEPT_FITS:
            self._felt.pop(next(iter(self._felt)))
        return kept[effect]

    def forget(self) -> None:
        """Forget the slopes that are kept: the comparison has changed."""
        self._felt.clear()

    def _slopes_of(self, model: Model, effect: str) -> Array:
        own = effect in model.effects
        freedom = free(self.robot, model.effects if own else (*model.effects, effect))
        z, high, residual = freedom.vector(model.values), freedom.bounds[1], self.residual(freedom)
        raw = model.fit.errors + model.shift
        columns = []
        for k, c in enumerate(freedom.coordinates):
            if c.effect.id == effect:
                moved = z.copy()
                step = c.probe if z[k] + c.probe <= high[k] else -c.probe
                moved[k] += step
                columns.append((residual(moved) - raw) / step)
        return np.stack(columns, axis=1)

    def beside(self, model: Model, g: Array) -> Array:
        """Project a model's own parameters out of weighted slopes; what vanishes is dropped."""
        own = self.slopes(model) * np.sqrt(weights(model.fit.errors))[:, None]
        if own.shape[1]:
            basis = np.linalg.qr(own)[0]
            g = g - basis @ (basis.T @ g)
        kept: Array = g[:, np.sqrt(np.sum(g * g, axis=0)) > 1e-6]
        return kept
