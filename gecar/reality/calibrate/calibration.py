"""Calibrate: fit a robot's own constants to recordings, say which of them the recordings cannot tell.

result = calibrate(read_case("recordings/monday"))
write_robot(result.robot, Path("robot.toml"))

A constant is fitted where the recordings tell it from those already fitted. What moves the robot is fitted first, on
its commands replayed open loop; then what the colour sensor reads, along the measured path. Errors of the camera's own
(a mark that is not over the axle's centre, a frame that is not the course's) are fitted with them, belong to no robot,
and are taken out of the recordings before robots are judged on them.

Sources: identifiability by the sensitivities' condition, Ljung, System Identification (2nd ed.), ch. 4 and 13;
intervals by the delete-a-group jackknife with Student's t, Efron and Tibshirani, An Introduction to the Bootstrap
(1993), ch. 11, in its linearised form (CR3), MacKinnon and White, Journal of Econometrics 29 (1985).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from gecar.reality.calibrate.constant_fit import fitted
from gecar.reality.calibrate.constants import MARK, Constant, FreeConstants, chosen, with_constants
from gecar.reality.calibrate.identifiability import BLIND, at_bounds, identifiable, sensitivities
from gecar.reality.noise.sensor_noise import Noise, estimate_noise
from gecar.reality.prove.holdout import Contender, judge
from gecar.reality.recordings.camera_frame import corrected
from gecar.reality.recordings.recording import Case, Recording
from gecar.reality.recordings.split import Split, hold_out
from gecar.reality.residuals.of_case import Residuals, motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.reality.verdict import VISIBLE, Misfit
from gecar.world.robot import Robot, load_robot

Array = npt.NDArray[np.float64]

MEMORY_S = 1.0
SPAN_S = 2.0  # of a recording is one group of the jackknife
FEWEST_GROUPS = 5
# What the simulation itself is trusted to, in steps: so near came the constants of a 3D engine's recordings back.
TRUST_STEPS = 0.15
ROUNDS = 4
MISFIT_WORSE = 1.1  # times the misfit before
EXPLAINED = 0.9  # share of the misfit above noise that constants which explain it take away
COURSE = (
    "line_dx",
    "line_dy",
    "line_angle",
)  # the course in the camera's frame: fields of the `PHYSICS` record


@dataclass(frozen=True)
class FittedConstant:
    """A constant as fitted, with its 95 % interval."""

    constant: Constant
    nominal: float
    value: float
    low: float
    high: float

    def rounded(self, value: float) -> str:
        """Return a number with the digits the interval allows, and one more."""
        places = max(1 - math.floor(math.log10(max(self.high - self.low, 1e-12))), 0)
        return f"{round(value, min(places, 8)) + 0.0:.{min(places, 8)}f}"  # never -0.00


@dataclass(frozen=True)
class UnknownConstant:
    """A constant these recordings do not tell, and why; it keeps its nominal value."""

    constant: Constant
    nominal: float
    why: str


@dataclass(frozen=True)
class Calibration:
    """What a calibration came to.

    Attributes
    ----------
    case, robot
        The case's name, and the robot with its new constants.
    fitted, unknown
        Constants fitted, and those the recordings do not tell.
    fitted_on, held
        Names of recordings.
    by_time
        Whether the last part of the only recording is what is held out.
    channels
        NRMSE on what is held out, by column of the file.
    recordings
        The same by recording, those fitted on included; only columns that move.
    """

    case: str
    robot: Robot
    fitted: tuple[FittedConstant, ...]
    unknown: tuple[UnknownConstant, ...]
    fitted_on: tuple[str, ...]
    held: tuple[str, ...]
    by_time: bool
    channels: Mapping[str, Misfit]
    recordings: Mapping[str, Mapping[str, Misfit]]

    @property
    def worse(self) -> tuple[str, ...]:
        """Columns in which the new constants do worse on what is held out."""
        return tuple(
            c for c, m in self.channels.items() if m.after > max(MISFIT_WORSE * m.before, VISIBLE * m.floor)
        )

    @property
    def unexplained(self) -> tuple[str, ...]:
        """Columns in which the new constants leave a visible part of the misfit on what is held out."""
        return tuple(
            c
            for c, m in self.channels.items()
            if m.after > VISIBLE * m.floor and m.before - m.after < EXPLAINED * (m.before - m.floor)
        )


def calibrate(
    case: Case,
    holdout: Sequence[str] = (),
    robot: Robot | None = None,
    names: Sequence[str] = (),
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
) -> Calibration:
    """Fit a robot's own constants.

    Parameters
    ----------
    case
        Recordings of one robot.
    holdout
        Names of the recordings to judge on; default: every fourth, or the last part of the only one.
    robot
        Where to start; default: what the recordings name.
    names
        Constants to fit; default: the usual ones.
    tell
        Called with a line of progress.

    Raises
    ------
    InputError
        If a name is unknown, or a robot or course file is wrong.
    """
    constants, parts = chosen(names), hold_out(case, holdout)
    known = robot if robot is not None else load_robot(case.recordings[0].setup.robot)
    noise = estimate_noise(parts.fitted, known.physics, MEMORY_S)
    tell(f"fitting on {', '.join(r.name for r in parts.fitted)}")
    with Threads() as threads:
        motion = _motion_residuals(parts.fitted, noise, threads)
        moved = _fit_constants(motion, known, tuple(c for c in constants if not c.sensor))
        better = _taken(known, moved)
        sensor = motion.with_mark(_camera(moved, MARK)).with_paths(better.physics).of_sensor()
        seen = _fit_constants(sensor, better, tuple(c for c in constants if c.sensor))
    calibrated = with_constants(
        better, {f.constant.name: f.value for f in seen.fitted}, f"{known.name}-{case.name}"
    )
    tell("judging on recordings that were held out")
    clear = _clear(parts, _camera(moved, MARK), _camera(seen, COURSE))
    channels, each = _judged(clear, noise, known, calibrated)
    return Calibration(
        case.name, calibrated, moved.fitted + seen.fitted, moved.unknown + seen.unknown,
        tuple(r.name for r in parts.fitted), tuple(r.name for r in parts.held), parts.by_time, channels, each,
    )  # fmt: skip


@dataclass(frozen=True)
class _Constants:
    fitted: tuple[FittedConstant, ...]
    unknown: tuple[UnknownConstant, ...]


def _taken(robot: Robot, constants: _Constants) -> Robot:
    return with_constants(robot, {f.constant.name: f.value for f in constants.fitted})


def _camera(constants: _Constants, fields: Sequence[str]) -> Array:
    """Return what was fitted of the camera, 0 where nothing was, shape (fields,)."""
    found = {f.constant.kernel: f.value for f in constants.fitted if f.constant.section == "camera"}
    return np.array([found.get(field, 0.0) for field in fields])


def _clear(parts: Split, mark: Array, course: Array) -> Split:
    """Return recordings with the camera's own errors taken out, so that robots are judged by what robots do."""
    fitted, held = (tuple(corrected(r, mark, course) for r in some) for some in (parts.fitted, parts.held))
    return Split(fitted, held, parts.by_time)


def _motion_residuals(recordings: Sequence[Recording], noise: Noise, threads: Threads) -> Residuals:
    return motion_residuals(recordings, noise, MEMORY_S, threads, bench_memory_s=np.inf)


def _fit_constants(residuals: Residuals, robot: Robot, constants: tuple[Constant, ...]) -> _Constants:
    """Fit the constants a residuals tells; which they are is asked again where the fit ended."""
    everything = FreeConstants(robot, constants)
    z = np.zeros(len(constants))
    identified, reasons = np.zeros(len(constants), bool), dict.fromkeys(range(len(constants)), BLIND)
    if not constants or not residuals.recordings or not len(everything.errors(residuals, z)):
        return _Constants(
            (),
            tuple(
                UnknownConstant(c, float(v), BLIND)
                for c, v in zip(constants, everything.standing, strict=True)
            ),
        )
    pressed: dict[int, str] = {}
    for _ in range(ROUNDS):
        found, reasons = identifiable(residuals, everything, z, pressed)
        if (found == identified).all():
            break
        identified = found
        z = fitted(residuals, everything, identified, np.where(identified, z, 0.0))
        pressed |= at_bounds(everything, z, identified)
    spread = _spread(residuals, everything, z, identified)
    values = everything.values(z)
    ends = [
        np.clip(everything.values(z + side * spread), [c.low for c in constants], [c.high for c in constants])
        for side in (-1, 1)
    ]
    return _Constants(
        tuple(FittedConstant(c, float(everything.standing[k]), float(values[k]), float(ends[0][k]), float(ends[1][k]))
              for k, c in enumerate(constants) if identified[k]),
        tuple(UnknownConstant(c, float(everything.standing[k]), reasons[k])
              for k, c in enumerate(constants) if not identified[k]),
    )  # fmt: skip


def _spread(
    residuals: Residuals, free_constants: FreeConstants, z: Array, identified: npt.NDArray[np.bool_]
) -> Array:
    """Return half the 95 % intervals in steps, shape (k,): a jackknife over recordings, or spans of them.

    Where there are recordings enough, the wider of both: few groups determine a constant that few recordings show.
    """
    errors, slopes = sensitivities(residuals, free_constants, z)
    slopes = slopes[:, identified]
    halves = [_half_width(errors, slopes, groups) for groups in _groupings(residuals)]
    out = np.zeros(len(z))
    out[identified] = np.hypot(np.max(halves, axis=0), TRUST_STEPS)
    return out


def _half_width(errors: Array, slopes: Array, groups: npt.NDArray[np.int64]) -> Array:
    """Return half the 95 % intervals by leaving out one group after the other, shape (identified,)."""
    normal = slopes.T @ slopes
    leaps = []
    for group in np.unique(groups):
        rows = groups == group
        part = normal - slopes[rows].T @ slopes[rows]
        leaps.append(np.linalg.pinv(part, hermitian=True) @ (slopes[rows].T @ errors[rows]))
    count = len(leaps)
    variance = (count - 1) / count * np.sum((np.array(leaps) - np.mean(leaps, axis=0)) ** 2, axis=0)
    return np.asarray(stdtrit(count - 1, 0.975) * np.sqrt(variance))


def _groupings(residuals: Residuals) -> list[npt.NDArray[np.int64]]:
    """Return each residual's group: a span of its recording, and its recording where those are not few."""
    index = residuals.index
    recording = index.recording.astype(np.int64)
    span = (index.t_s / SPAN_S).astype(np.int64)
    spans = recording * (span.max() + 1) + span
    return [spans, recording] if len(np.unique(recording)) >= FEWEST_GROUPS else [spans]


def _judged(
    parts: Split, noise: Noise, before: Robot, after: Robot
) -> tuple[dict[str, Misfit], dict[str, dict[str, Misfit]]]:
    """Return misfits over what is held out, and of each recording, by column."""
    everyone = parts.held if parts.by_time else (*parts.fitted, *parts.held)
    with Threads() as threads:
        contenders = [
            Contender(robot, _motion_residuals(everyone, noise, threads).with_paths(robot.physics))
            for robot in (before, after)
        ]
        each = {r.name: _moving(r, judge(*(_only(c, {r.name}) for c in contenders))) for r in everyone}
        held = {r.name for r in parts.held}
        return judge(*(_only(c, held) for c in contenders)), each


def _only(contender: Contender, names: set[str]) -> Contender:
    """Return a contender on some of its recordings."""
    runs = tuple(run for run in contender.held.recordings if run.recording.name in names)
    return replace(contender, held=replace(contender.held, recordings=runs))


def _moving(recording: Recording, misfits: dict[str, Misfit]) -> dict[str, Misfit]:
    """Leave out columns that stand still: their misfit has nothing to be a share of."""
    return {column: m for column, m in misfits.items() if m.floor < 1.0 and recording.duration_s > 0.0}
