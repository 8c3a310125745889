"""A motor on a bench beside its simulation: the recorded commands replayed, wheel by wheel.

found = bench_gap([read_recording("step_060.csv"), ...], robot)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gecar.reality.compare.gap import nrmse
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.replayer import replay
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
SIDES = ("left", "right")


@dataclass(frozen=True)
class Shaft:
    """One recorded shaft beside the simulated one.

    Attributes
    ----------
    trial, side
        The recording's name, and "left" or "right".
    t_s, duty_pct
        Times since the recording's start, and commands before any cap, shape (samples,) [s, %].
    measured_deg, simulated_deg
        Angles, shape (samples,) [deg].
    nrmse
        Root mean square error in standard deviations of what was measured; nan where the shaft stood still.
    """

    trial: str
    side: str
    t_s: Array
    duty_pct: Array
    measured_deg: Array
    simulated_deg: Array
    nrmse: float

    @property
    def error_deg(self) -> Array:
        """How far the simulation is ahead of the recording, shape (samples,) [deg]."""
        return self.simulated_deg - self.measured_deg

    @property
    def rms_deg(self) -> float:
        """Root mean square error [deg]."""
        return float(np.sqrt(np.mean(self.error_deg**2)))

    @property
    def held_pct(self) -> float | None:
        """The command, where it was held throughout [%]; ``None`` where it changed."""
        return float(self.duty_pct[0]) if np.ptp(self.duty_pct) == 0.0 else None

    @property
    def end_deg(self) -> float:
        """Error at the last sample [deg]."""
        return float(self.error_deg[-1])

    @property
    def speeds_dps(self) -> tuple[float, float]:
        """Mean speed over the second half, measured and simulated [deg/s]."""
        late = self.t_s >= 0.5 * (self.t_s[0] + self.t_s[-1])
        if late.sum() < 2:
            return np.nan, np.nan
        took = self.t_s[late][-1] - self.t_s[late][0]
        measured, simulated = (
            float((angle[late][-1] - angle[late][0]) / took)
            for angle in (self.measured_deg, self.simulated_deg)
        )
        return measured, simulated


@dataclass(frozen=True)
class BenchGap:
    """Recordings from a bench beside a simulation of their commands.

    Attributes
    ----------
    shafts
        One for each recorded shaft.
    robot
        Whose motor was simulated.
    """

    shafts: tuple[Shaft, ...]
    robot: Robot


def bench_gap(recordings: Sequence[Recording], robot: Robot) -> BenchGap:
    """Replay recordings from a bench, whole and open loop, by a robot's motors.

    Parameters
    ----------
    recordings
        From a bench; each with at least two samples of a shaft's angle.
    robot
        Of the simulation.
    """
    shafts: list[Shaft] = []
    for recording in recordings:
        replayed = replay(recording, robot)
        for side in SIDES:
            angle, simulated = (getattr(r, f"{side}_angle_rad") for r in (recording, replayed))
            seen = ~np.isnan(angle)
            if seen.sum() > 1:
                duty = 100.0 * getattr(recording, f"{side}_duty")[seen]
                since = recording.t_s[seen] - recording.t_s[0]
                measured, replayed_deg = np.rad2deg(angle[seen]), np.rad2deg(simulated[seen])
                misfit = nrmse(angle, simulated)
                shafts.append(Shaft(recording.name, side, since, duty, measured, replayed_deg, misfit))
    return BenchGap(tuple(shafts), robot)
