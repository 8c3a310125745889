"""Compiles the replay kernels in several processes at once: each takes 5 to 20 s, once on a machine.

In one process Numba compiles one function at a time; what it made is kept on disk for all others.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import MappingProxyType

import numpy as np

from gecar.compiled import CACHE, LANES, is_cold, mark_warm
from gecar.reality.noise.sensor_noise import Noise
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.recordings.recording import make_recording
from gecar.reality.recordings.setup import Setup
from gecar.reality.replay.replayer import USUAL_NOISE, USUAL_WALK
from gecar.reality.residuals.nuisances import Nuisances, SensorPath
from gecar.reality.residuals.of_recording import RecordingResiduals, residuals_of
from gecar.world.course.course import load_course
from gecar.world.robot import Robot, load_robot
from gecar.world.terms import Term

REPLAYS = "replays"
LAW = Term(port="yaw_moment", law="a", a=0.0)  # all laws run in one kernel


@contextmanager
def compiled_replays(laws: bool, tell: Callable[[str], None]) -> Iterator[None]:
    """Compile the replay kernels before a block of code runs, unless that was done on this machine before.

    The kernel for laws, if any are wanted, is compiled while the block runs. One that fails is compiled where it is
    called first.
    """
    if not is_cold(REPLAYS) or not os.access(CACHE, os.W_OK):
        yield
        return
    tell("compiling the simulation: this once, it takes about 20 s")
    children = [compiling("lanes", "readings"), compiling("one")]
    try:
        for child in children:
            child.wait()
        mark_warm(REPLAYS)
        if laws:
            children.append(compiling("laws"))
        yield
    finally:
        for child in children:
            child.kill()
            child.wait()


def compiling(*kernels: str) -> subprocess.Popen[bytes]:
    """Start a process that compiles some of `KERNELS`."""
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", __name__, *kernels]
    return subprocess.Popen(command, stdout=quiet, stderr=quiet)  # noqa: S603 - a module of ours


def _one(run: RecordingResiduals, robot: Robot) -> None:
    run.replayer.play(robot.physics)


def _in_lock_step(run: RecordingResiduals, robot: Robot) -> None:
    run.motion_errors(np.repeat(robot.physics, LANES))


def _with_laws(run: RecordingResiduals, robot: Robot) -> None:
    run.motion_errors(np.repeat(robot.with_terms([LAW]).physics, LANES))


def _readings(run: RecordingResiduals, robot: Robot) -> None:
    path = SensorPath(np.zeros((len(run.recording.t_s), 3)), 0.0, 0.001, 0.001)
    run.with_nuisances(Nuisances(path=path)).readings(robot.physics)


KERNELS = MappingProxyType({"lanes": _in_lock_step, "laws": _with_laws, "one": _one, "readings": _readings})


def compile_here(*kernels: str) -> None:
    """Compile some of `KERNELS` in this process, unless that was done before."""
    for kernel in kernels:
        KERNELS[kernel](_standing_still(), load_robot("ev3"))


def _standing_still() -> RecordingResiduals:
    """Return a recording of a robot that stands still on the paper's course, with its simulation."""
    rows = 10
    columns = {name: np.zeros(rows) for name in COLUMNS}
    columns["t_s"] += 0.01 * np.arange(rows)
    recording = make_recording("still", columns, Setup(course="paper"))
    noise = Noise(np.array(USUAL_NOISE), np.array(USUAL_WALK), 1.0, np.full(3, 0.001))
    return residuals_of(recording, noise, 1.0, load_course("paper"))


if __name__ == "__main__":
    compile_here(*sys.argv[1:])
