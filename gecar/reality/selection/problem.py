"""What a selection is made from: residuals, the effects that may be found, and what counts for something."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gecar.reality.fitting.clock_offsets import scattered, with_fitted_clocks
from gecar.reality.fitting.estimator import Estimator
from gecar.reality.fitting.model import Model
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.recordings.recording import Recording
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.selection.thresholds import NEGLIGIBLE, EnergyLimits
from gecar.world.robot import Robot

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
    limits
        Excess energy that counts.
    known
        The robot with nothing fitted.
    tell
        Called with a line of progress.
    clocks_fitted
        Whether each camera's clock offset was fitted.
    """

    estimator: Estimator
    catalogue: tuple[str, ...]
    limits: EnergyLimits
    known: Model
    tell: Callable[[str], None]
    clocks_fitted: bool = False

    @property
    def residuals(self) -> Residuals:
        """What effects are fitted to."""
        return self.estimator.residuals

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """Of which robot's motion and readings they are."""
        return tuple(r.recording for r in self.residuals.recordings)

    @property
    def blocks(self) -> int:
        """Number of blocks of residuals."""
        return self.estimator.blocks.count

    @property
    def on_bench(self) -> bool:
        """Whether all recordings were made on a bench."""
        return all(r.setup.rig == "bench" for r in self.recordings)

    def with_clocks(self, model: Model, least_gain: float) -> Problem | None:
        """Return the problem with camera clocks fitted under a model; None where that gains less than ``least_gain``.

        After that, a delay common to all cameras is no effect any more.
        """
        if self.clocks_fitted or self.residuals.sensor:
            return None
        fitted, least = with_fitted_clocks(self.residuals, model.physics)
        gain = cost(self.residuals.errors(model.physics)) - least
        if gain < max(least_gain, NEGLIGIBLE * self.blocks) or not scattered(fitted.clock_offsets_s):
            return None
        self.tell("the camera's clock differs from recording to recording: its offsets are fitted")
        estimator = Estimator(fitted, self.estimator.robot, self.estimator.rng)
        others = tuple(e for e in self.catalogue if e != COMMON_DELAY)
        known = estimator.known()
        return replace(self, estimator=estimator, catalogue=others, known=known, clocks_fitted=True)


def problem_of(
    residuals: Residuals,
    robot: Robot,
    catalogue: Sequence[str],
    limits: EnergyLimits,
    seed: int = 0,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
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
    limits
        Excess energy that counts.
    seed
        Random seed.
    tell
        Called with a line of progress.
    """
    estimator = Estimator(residuals, robot, np.random.default_rng(seed))
    return Problem(estimator, tuple(catalogue), limits, estimator.known(), tell)
