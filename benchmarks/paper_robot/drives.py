"""Fig. 6's drives by many robots: one `Driver`, whose constants and start are set anew for each."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from gecar.language.program import parse_program
from gecar.world.course.course import Course, load_course
from gecar.world.kernel.state import derive
from gecar.world.robot import load_robot
from gecar.world.rollout import STEP_S, Drive, Driver, World

Floats = npt.NDArray[np.float64]

FIG_6 = "if(SensorValue > 80):\n    motor(80,80,50)\nelse:\n    motor(80,0,160)"
OPCODES = parse_program(FIG_6).opcodes
PAPER_S = 16.74
TOLERANCE_S = 0.05
LONGEST_S = 24.0
PAPER_COURSE = load_course("paper")


class Fleet:
    """Robots that drive Fig. 6 on a course.

    Parameters
    ----------
    base
        The robot whose constants hold where a drive does not replace them.
    course
        Where.
    step_s
        Step [s].
    """

    def __init__(self, base: str = "ev3", course: Course = PAPER_COURSE, step_s: float = STEP_S) -> None:
        self.course = course
        self._driver = Driver(World(load_robot(base), course, step_s, LONGEST_S))
        self._nominal = self._driver.setup.physics.copy()
        self._step_s = step_s

    @property
    def start(self) -> Floats:
        """The course's own start [m, m, rad]."""
        return self._driver.world.start

    def drive(
        self,
        constants: Mapping[str, float],
        start: Floats,
        trace: bool = False,
        noise_pct: float = 0.0,
        seed: int = 0,
    ) -> Drive:
        """Drive with some of the robot's constants replaced, from a pose [m, m, rad]."""
        setup = self._driver.setup
        setup.physics[:] = self._nominal
        for field, value in constants.items():
            setup.physics[field] = value
        derive(setup.physics[0], self._step_s, setup.derived[0])
        setup.eyes["noise_pct"] = noise_pct
        averaged = self.course.averaged(float(setup.physics["spot_diameter"][0]))
        self._driver.setup = setup._replace(start=start, floor=setup.floor._replace(averaged=averaged))
        return self._driver.simulate(OPCODES, seed, trace)


def turns(drive: Drive) -> int:
    """Return how many times a drive goes over from driving straight to turning."""
    assert drive.trace is not None
    turning = drive.trace["right_duty"] == 0.0
    return int(np.count_nonzero(np.diff(turning.astype(int), prepend=0) > 0))


def moved(start: Floats, count: int, metres: float, degrees: float, seed: int = 7) -> list[Floats]:
    """Return starts around one: standard deviations along x and y [m], and of the heading [deg]."""
    steps = np.random.default_rng(seed).normal(size=(count, 3))
    return list(start + steps * [metres, metres, np.radians(degrees)])
