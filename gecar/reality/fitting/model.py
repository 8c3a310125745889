"""A robot with some effects fitted, and one effect tried on top of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.parameters import Freedom
from gecar.reality.optimisation.least_squares import Fit

Array = npt.NDArray[np.float64]
Effects = Mapping[str, Mapping[str, float]]

AT_BOUND, FAR = (
    0.01,
    8.0,
)  # coordinates: where a bound is far from neutral, a fit that ends there has not ended
HELD_DUTY = 5.0  # %: what friction holds anyway, 4 % of an EV3's duty, needs no dead band


@dataclass(frozen=True)
class Model:
    """The robot with some effects fitted.

    Attributes
    ----------
    effects
        Identifiers, in the order they were taken.
    freedom, fit
        Their parameters.
    structure
        Energy of the residuals that averages over short blocks leave, above noise.
    shift
        What changes too small for a name explain, taken off the residuals; shape (n,) or (1,).
    """

    effects: tuple[str, ...]
    freedom: Freedom
    fit: Fit
    structure: float
    shift: Array = field(default_factory=lambda: np.zeros(1))

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """Parameters' values as in a robot file."""
        return self.freedom.values(self.fit.z)

    @property
    def cost(self) -> float:
        """Robust cost of the whitened residuals."""
        return self.fit.cost


@dataclass(frozen=True)
class Step:
    """One effect tried on top of a model.

    Attributes
    ----------
    effect
        Its identifier.
    base, model
        The model without and with it, both rid of what changes too small for a name explain.
    gain
        What it lowers the cost by.
    left_out
        What it lowers the cost of left-out recordings by, one number a recording.
    null_95, p
        The null's 95 % quantile, and the share of nulls that gain as much.
    worthwhile
        Whether its size is worth a name.
    before, after
        Structure without and with it, by the same measure.
    """

    effect: str
    base: Model
    model: Model
    gain: float
    left_out: Array = field(default_factory=lambda: np.zeros(0))
    null_95: float = np.nan
    p: float = np.nan
    worthwhile: bool = False
    before: float = 0.0
    after: float = 0.0


class Fitted(Protocol):
    """What has fitted effects: a model, or a first try of one."""

    @property
    def freedom(self) -> Freedom:
        """The effects' coordinates."""

    @property
    def fit(self) -> Fit:
        """Where the fit ended."""


def worthwhile(model: Fitted, effect: str) -> bool:
    """Whether an effect's size in a model is worth a name."""
    if effect == "dead_band":
        found = model.freedom.values(model.fit.z)[effect]
        return found["duty_pct"] >= 1.0 and (found["offset_share"] > 0.3 or found["duty_pct"] >= HELD_DUTY)
    sizes = []
    low, high = model.freedom.bounds
    for k, (c, z) in enumerate(zip(model.freedom.coordinates, model.fit.z, strict=True)):
        if c.effect.id == effect and (c.parameter.worthwhile > 0.0 or c.inverse):
            # A cause has a size; what grows until it is stopped imitates another.
            stopped = z != 0.0 and (z > high[k] - AT_BOUND or z < low[k] + AT_BOUND) and abs(z) > FAR
            sizes.append(not stopped and abs(z) >= (0.02 if c.inverse else 1.0))
    return any(sizes)
