"""Choosing effects: what may be found, tried, and proved on recordings it was not fitted to.

An effect is taken when, added to what is already taken, it

- lowers the cost of every left-out recording together by more than the null: the 95 % quantile of the largest gain
  any effect of the catalogue reaches on residuals whose blocks have random signs, which have the noise's colour and
  its wild spans, but no cause;
- is of a size worth a name;
- explains most of the structure that is left. What merely imitates a cause explains a part, and is a stand-in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from gecar.reality.fitting import model_tolerance as subtle
from gecar.reality.fitting.clock_offsets import fitted_offsets, scattered
from gecar.reality.fitting.estimator import Fits
from gecar.reality.fitting.model import Model, Step
from gecar.reality.optimisation.least_squares import cost
from gecar.reality.recordings.recording import Recording
from gecar.reality.residuals.of_case import Comparison
from gecar.reality.selection import cross_validation as proof
from gecar.reality.selection import screening
from gecar.reality.selection.screening import LEAST_GAIN
from gecar.reality.selection.thresholds import MOTION, Limits
from gecar.world.robot import Robot


class Selection(Fits):
    """Selects effects for one comparison.

    Parameters
    ----------
    comparison
        What is fitted.
    robot
        As far as it is known.
    catalogue
        Identifiers of the effects that may be found.
    recordings
        What is fitted on.
    seed
        Of every draw of chance.
    tell
        Called with a line of progress.
    limits
        What structure counts for something.

    Attributes
    ----------
    nothing
        The robot with nothing fitted.
    clocked
        Whether each camera's clock was taken out.
    """

    def __init__(
        self,
        comparison: Comparison,
        robot: Robot,
        catalogue: Sequence[str],
        recordings: Sequence[Recording],
        seed: int = 0,
        tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
        limits: Limits = MOTION,
    ) -> None:
        super().__init__(comparison, robot, seed)
        self.limits = limits
        self.catalogue, self.recordings, self.tell = tuple(catalogue), tuple(recordings), tell
        self.clocked = False
        self.nothing = self.bare()

    def align(self, model: Model, gain: float) -> bool:
        """Set each camera's clock, if that gains more than ``gain``; return whether it did.

        After that, a delay of the camera common to all recordings is no effect any more.
        """
        if self.clocked or self.comparison.sight:
            return False
        physics = model.freedom.physics(model.fit.z)
        offsets, least = fitted_offsets(self.comparison, lambda: self.comparison.errors(physics))
        standing = cost(self.comparison.errors(physics))
        if standing - least < max(gain, LEAST_GAIN * self.blocks.count) or not scattered(offsets):
            return False
        self.clocked = True
        self.comparison.set_offsets(offsets)
        self.forget()
        self.catalogue = tuple(e for e in self.catalogue if e != "pose_delay")
        self.nothing = self.bare()
        return True

    def steps(self, model: Model) -> list[Step]:
        """Try every other effect on top of a model; the most promising are fitted in full. Best first."""
        return screening.steps(self, self.catalogue, self.recordings, model)

    def judged(self, step: Step) -> Step:
        """Judge a step by leaving out recordings, and against the null."""
        return proof.judged(self, self.catalogue, step)

    def rid_of_subtle(self, model: Model) -> Model:
        """Return a model whose residuals are rid of what changes too small for a name explain."""
        return subtle.rid_of_subtle(self, self.catalogue, model)
