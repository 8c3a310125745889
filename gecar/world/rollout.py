"""Drive a program over a course: from opcodes to an outcome and, on request, a trace."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.language.opcodes import N_COLUMNS
from gecar.language.program import sensors_used
from gecar.world.course.course import Course
from gecar.world.kernel.chipmunk import NO_ENGINE
from gecar.world.kernel.conditions import Conditions, conditions, joined, select
from gecar.world.kernel.drive import Setup, drive
from gecar.world.kernel.dynamics import has_terms
from gecar.world.kernel.eyes import EYES, Floor
from gecar.world.kernel.interpreter import CONTROL
from gecar.world.kernel.lanes import Ends, Jobs, drive_lanes, make_memory
from gecar.world.kernel.laws import N_STORES
from gecar.world.kernel.sensing import RING
from gecar.world.kernel.state import STATE
from gecar.world.pymunk_space import build_engine
from gecar.world.robot import Robot

STEP_S = 0.002  # benchmarks/convergence.py shows what halving it moves
TRACE_S = 0.01
TRACE_COLUMNS = (
    "t_s", "x_m", "y_m", "heading_rad", "left_duty", "right_duty", "left_angle_rad", "right_angle_rad",
    "reflection_pct", "line",
)  # fmt: skip


class Outcome(IntEnum):
    """How a drive ended."""

    RUNNING = 0
    GOAL = 1
    OFF_COURSE = 2
    OUT_OF_TIME = 3
    STUCK = 4
    MISSED_CHECKPOINT = 5

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Outcome.RUNNING: "is still driving",
    Outcome.GOAL: "reached GOAL through all checkpoints",
    Outcome.OFF_COURSE: "left the course",
    Outcome.OUT_OF_TIME: "ran out of time",
    Outcome.STUCK: "is stuck in a program that takes no time",
    Outcome.MISSED_CHECKPOINT: "entered GOAL with a checkpoint missing",
}


@dataclass(frozen=True)
class Noise:
    """Noise on request.

    Attributes
    ----------
    sensor_pct
        Standard deviation of each colour sensor reading [%].
    motor_share
        Standard deviation of each command's strength, as a share of it.
    """

    sensor_pct: float = 0.0
    motor_share: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("sensor noise", self.sensor_pct), ("motor noise", self.motor_share)):
            if not 0.0 <= value < np.inf:
                raise expected(name, value, "a number of 0 or more")


@dataclass(frozen=True)
class World:
    """A robot on a course, and the settings of its simulation.

    Attributes
    ----------
    robot, course
        The robot, and the course it drives on.
    step_s
        Step [s]; kernels hold 0.1 to 10 ms.
    time_limit_s
        When a drive ends without GOAL [s].
    noise
        Noise of sensor and motors.
    engine
        ``"pymunk"``: pymunk moves the body and what it touches. ``"inline"``: the same update, written in the
        kernel; only for courses with nothing to touch. ``"auto"``: inline where that is possible.
    """

    robot: Robot
    course: Course
    step_s: float = STEP_S
    time_limit_s: float = 60.0
    noise: Noise = field(default_factory=Noise)
    engine: str = "auto"

    def __post_init__(self) -> None:
        if not 0.0001 <= self.step_s <= 0.01:
            raise expected("step", f"{self.step_s} s", "0.0001 to 0.01 s")
        if not 0.0 < self.time_limit_s <= 3600.0:
            raise expected("time limit", f"{self.time_limit_s} s", "a time of at most 3600 s")
        if self.engine not in ("auto", "inline", "pymunk"):
            raise expected("engine", repr(self.engine), "auto, inline or pymunk")
        if self.engine == "inline" and self.has_contacts:
            raise expected("engine", "inline", "pymunk, for a course with walls or obstacles")

    @property
    def has_contacts(self) -> bool:
        """Whether the course has anything to touch."""
        return len(self.course.walls) > 0 or len(self.course.obstacles) > 0

    @property
    def uses_pymunk(self) -> bool:
        """Whether pymunk moves the body."""
        return self.engine == "pymunk" or (self.engine == "auto" and self.has_contacts)

    @property
    def floor(self) -> Floor:
        """What kernels know of the course."""
        course = self.course
        spot = float(self.robot.physics["spot_diameter"][0])
        return Floor(
            course.averaged(spot),
            course.pitch_m,
            1.0 / course.tile_size_m,
            course.columns,
            course.rows,
            course.drivable,
            course.sequence,
        )

    @property
    def start(self) -> npt.NDArray[np.float64]:
        """Start pose of the axle's centre [m, m, rad], shape (3,)."""
        return np.array([self.course.start.x_m, self.course.start.y_m, self.course.start.heading_rad])

    @property
    def nominal(self) -> Conditions:
        """The conditions of this world, one row."""
        noise = self.noise.sensor_pct, self.noise.motor_share
        return conditions(self.robot.physics, self.step_s, self.start, self.time_limit_s, 0.0, *noise)

    def at_steps(self, steps_s: Sequence[float]) -> Conditions:
        """Return the conditions of this world at other steps [s], one row each."""
        return joined([replace(self, step_s=step).nominal for step in steps_s])


@dataclass(frozen=True)
class Drive:
    """The result of a program's drive.

    Attributes
    ----------
    outcome
        How it ended.
    time_s
        When it ended [s]; with `Outcome.GOAL` the time to GOAL.
    checkpoints
        Checkpoints passed in order, GOAL not counted.
    arrival_s
        When each tile of the course's sequence was reached [s], nan where it was not, shape (k,).
    steps
        Steps simulated.
    energy_j
        Electrical energy that the motors took from the battery [J]; nan: not known.
    trace
        Time series at 100 Hz by name (`TRACE_COLUMNS`; angles in rad, duties -1..1), or None.
    obstacles
        Obstacles' poses over the trace, shape (samples, obstacles, 3) [m, m, rad], or None.
    """

    outcome: Outcome
    time_s: float
    checkpoints: int
    arrival_s: npt.NDArray[np.float64]
    steps: int
    energy_j: float = math.nan
    trace: Mapping[str, npt.NDArray[np.float64]] | None = None
    obstacles: npt.NDArray[np.float64] | None = None


class Driver:
    """One world's arrays, made once, and drives on them.

    Parameters
    ----------
    world
        Robot and course.
    under
        Other conditions than the world's own, one row.
    """

    def __init__(self, world: World, under: Conditions | None = None) -> None:
        under = world.nominal if under is None else under
        self.world = world
        self.step_s = float(under.derived["dt"][0])
        self.obstacles: list[Any] = []
        eyes = np.zeros(1, EYES)
        eyes["noise_pct"], eyes["motor_noise"] = under.sensor_noise_pct, under.motor_noise
        eyes["statement_ms"] = under.statement_ms
        self.setup = Setup(
            under.physics,
            under.derived,
            under.start[0],
            float(under.phase_ms[0]),
            int(under.limit[0]),
            int(under.patience[0]),
            world.floor,
            np.zeros(1, STATE),
            np.zeros(1, CONTROL),
            eyes,
            np.zeros(2 * RING),
            np.zeros(N_STORES),
            NO_ENGINE,
            np.zeros(1),
        )

    def simulate(self, opcodes: npt.NDArray[np.int32], seed: int = 0, trace: bool = False) -> Drive:
        """Drive a program from START to its outcome.

        Parameters
        ----------
        opcodes
            Program, shape (rows, 6).
        seed
            Seed of the noise, where the world has any.
        trace
            Whether to keep the time series.
        """
        self.reset()
        setup, every = self.setup, round(TRACE_S / self.step_s)
        arrival = np.full(len(setup.floor.sequence), np.nan)
        setup.eyes["used"] = sensors_used(opcodes)
        setup.eyes["stream"] = seed
        samples = np.full((setup.limit // every + 2 if trace else 0, len(TRACE_COLUMNS)), np.nan)
        poses: list[list[tuple[float, float, float]]] = []
        chunk = every if trace and self.obstacles else setup.limit + 1
        outcome, n, passed = 0, 0, 0
        while outcome == Outcome.RUNNING:
            poses.append([(*body.position, body.angle) for body in self.obstacles])
            outcome, n, passed = drive(opcodes, setup, n, n + chunk, passed, arrival, samples, every)
        checkpoints = min(passed, len(setup.floor.sequence) - 1)
        kept = samples[~np.isnan(samples[:, 0])]
        return Drive(
            Outcome(outcome),
            n * self.step_s,
            checkpoints,
            arrival,
            n,
            float(setup.energy[0]),
            dict(zip(TRACE_COLUMNS, kept.T.copy(), strict=True)) if trace else None,
            np.array(poses)[: len(kept)] if trace and self.obstacles else None,
        )

    def reset(self) -> None:
        """Reset robot and obstacles to where the course has them, and the sensors' memory."""
        self.setup.eyes["asked"] = -1
        if self.world.uses_pymunk:
            x, y, heading = self.setup.start
            self._engine, self.obstacles = build_engine(self.world.robot, self.world.course, x, y, heading)
            self.setup = self.setup._replace(engine=self._engine.arrays)


def simulate(world: World, opcodes: npt.NDArray[np.int32], seed: int = 0, trace: bool = False) -> Drive:
    """Drive one program; see `Driver.simulate`."""
    return Driver(world).simulate(opcodes, seed, trace)


SUMMARY = np.dtype([("outcome", np.int8), ("time_s", float), ("checkpoints", np.int32), ("steps", np.int64)])


def goal_times(summary: npt.NDArray[np.void]) -> npt.NDArray[np.float64]:
    """Return the times to GOAL of summaries [s], inf where it was missed, shape (n,)."""
    times: npt.NDArray[np.float64] = np.where(summary["outcome"] == Outcome.GOAL, summary["time_s"], np.inf)
    return times


class Fleet:
    """One course's arrays, made once, and many drives at a time.

    In lanes; or one by one where something is touched, or the robot has terms.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.floor = world.floor
        self._memory = make_memory()

    def drive(
        self,
        programs: Sequence[npt.NDArray[np.int32]],
        under: Conditions,
        pairs: npt.ArrayLike,
        streams: npt.ArrayLike,
    ) -> tuple[npt.NDArray[np.void], npt.NDArray[np.float64]]:
        """Drive programs, each from START to its outcome.

        Parameters
        ----------
        programs
            Opcodes, each of shape (rows, 6).
        under
            Conditions.
        pairs
            Which program drives under which conditions, shape (n, 2).
        streams
            Seed of each drive's noise, shape (n,).

        Returns
        -------
        tuple
            Summaries of dtype `SUMMARY`, shape (n,), and when each tile of the course's sequence was reached [s], nan
            where it was not, shape (n, k).
        """
        which = np.asarray(pairs, np.int64).reshape(-1, 2)
        seeds = np.asarray(streams, np.uint64)
        rows = np.concatenate([np.zeros((0, N_COLUMNS), np.int32), *programs])
        first_row = np.cumsum([0, *map(len, programs)]).astype(np.int64)
        used = np.array([sensors_used(opcodes) for opcodes in programs]).reshape(-1, 3)
        jobs = Jobs(rows, first_row, used, which[:, 0].copy(), which[:, 1].copy(), seeds)
        n = len(which)
        arrival = np.full((n, len(self.floor.sequence)), np.nan)
        ends = Ends(np.zeros(n, np.int8), np.zeros(n, np.int64), np.zeros(n, np.int32), arrival)
        if self.world.uses_pymunk or has_terms(under.physics).any():
            self._drive_one_by_one(jobs, under, ends)
        else:
            drive_lanes(jobs, under, self.floor, self._memory, ends)
        summary = np.zeros(len(which), SUMMARY)
        summary["outcome"], summary["steps"] = ends.outcome, ends.steps
        summary["time_s"] = ends.steps * under.derived["dt"][which[:, 1]]
        summary["checkpoints"] = np.minimum(ends.passed, len(self.floor.sequence) - 1)
        return summary, ends.arrival_s

    def _drive_one_by_one(self, jobs: Jobs, under: Conditions, ends: Ends) -> None:
        """Make all drives, each with arrays of its own; ``ends`` is filled as by `drive_lanes`."""
        drivers = {row: Driver(self.world, select(under, [row])) for row in set(jobs.condition.tolist())}
        for k, (program, row) in enumerate(zip(jobs.program, jobs.condition.tolist(), strict=True)):
            opcodes = jobs.rows[jobs.first_row[program] : jobs.first_row[program + 1]]
            result = drivers[row].simulate(opcodes, int(jobs.stream[k]))
            ends.outcome[k], ends.steps[k], ends.arrival_s[k] = result.outcome, result.steps, result.arrival_s
            ends.passed[k] = np.count_nonzero(~np.isnan(result.arrival_s))


def simulate_many(
    world: World, programs: Sequence[npt.NDArray[np.int32]], seeds: Sequence[int] | None = None
) -> npt.NDArray[np.void]:
    """Drive many programs, each from START; see `Fleet.drive`.

    Parameters
    ----------
    programs
        Opcodes, each of shape (rows, 6).
    seeds
        Noise seed of each; default 0.

    Returns
    -------
    numpy.ndarray
        Dtype `SUMMARY`, shape (n,).
    """
    n = len(programs)
    pairs = np.stack([np.arange(n), np.zeros(n)], axis=1)
    return Fleet(world).drive(programs, world.nominal, pairs, np.zeros(n) if seeds is None else seeds)[0]
