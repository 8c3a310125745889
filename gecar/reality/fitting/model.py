"""A robot with some effects fitted, and one effect tried on top of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.parameters import Parameters
from gecar.reality.optimisation.least_squares import Minimum
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
Effects = Mapping[str, Mapping[str, float]]
NEAR = 1.0  # in sizes worth a name


@dataclass(frozen=True)
class Model:
    """The robot with some effects fitted.

    Attributes
    ----------
    effects
        Identifiers, in the order they were taken.
    parameters
        Their free parameters.
    minimum
        Where the fit ended.
    excess_energy
        Energy of the residuals' block means above noise.
    """

    effects: tuple[str, ...]
    parameters: Parameters
    minimum: Minimum
    excess_energy: float

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """Parameters' values as in a robot file."""
        return self.parameters.values(self.minimum.z)

    @property
    def robot(self) -> Robot:
        """The robot that effects are fitted to, laws included, with the model's effects."""
        return self.parameters.robot.with_effects(self.values)

    @property
    def physics(self) -> npt.NDArray[Any]:
        """Physics record, shape (1,)."""
        return self.parameters.physics(self.minimum.z)

    @property
    def z(self) -> Array:
        """Coordinates, shape (k,)."""
        return self.minimum.z

    @property
    def key(self) -> tuple[tuple[str, ...], bytes]:
        """Its effects and coordinates, which tell it from other models of the same robot."""
        return self.effects, self.minimum.z.tobytes()

    def is_near(self, other: Model) -> bool:
        """Whether another model has the same effects, with every parameter within `NEAR` of this one's."""
        mine, theirs = (
            dict(zip(((c.effect.id, c.parameter.label) for c in m.parameters.coordinates), m.z, strict=True))
            for m in (self, other)
        )
        return mine.keys() == theirs.keys() and all(abs(z - theirs[k]) < NEAR for k, z in mine.items())

    @property
    def errors(self) -> Array:
        """Whitened residuals, shape (n,)."""
        return self.minimum.errors

    @property
    def cost(self) -> float:
        """Robust cost of the residuals."""
        return self.minimum.cost


@dataclass(frozen=True)
class Step:
    """One effect tried on top of a model.

    Attributes
    ----------
    effect
        Its identifier.
    base, model
        The model without and with it.
    gain
        What it lowers the cost by.
    left_out
        What it lowers the cost of left-out recordings by, one number a recording.
    null_95, p
        The null distribution's 95 % quantile, and the share of null draws that gain as much.
    worthwhile
        Whether its size is worth a name.
    energy_before, energy_after
        Excess energy without and with it, by the same measure.
    stage
        At which stage of a chain it was tried, from 0.
    holdout_gain
        What it lowers the cost of the recordings set aside by, against the others refitted without it.
    drifts
        Whether its size differs between recordings, times or regimes.
    """

    effect: str
    base: Model
    model: Model
    gain: float
    left_out: Array = field(default_factory=lambda: np.zeros(0))
    null_95: float = np.nan
    p: float = np.nan
    worthwhile: bool = False
    energy_before: float = 0.0
    energy_after: float = 0.0
    stage: int = 0
    holdout_gain: float = np.nan
    drifts: bool = False
