"""What other methods learn from the same recordings, beside laws that are written.

python -m benchmarks.rivals runs/cases runs/invention       # after benchmarks.invention

What the nominal equations of motion leave over is regressed on the robot's state: a torque at each shaft (Newton and
Euler, as `benchmarks.concealed.comparators.sparse` has them), and by how much more than in the simulation the body
runs ahead of its wheels and turns faster than they do. What was learned acts inside the simulation, as a torque on the
shafts and a speed of the body, on whole drives, open loop. What it gives is kept within what it was taught.

- ``sindy``: PySINDy, polynomials of degree 2 of all variables, STLSQ with ridge 0.05; the threshold of `THRESHOLDS`
  that recordings left out like best. Brunton, Proctor, Kutz, PNAS 113 (2016) 3932; de Silva et al., JOSS 5 (2020) 2104.
- ``network``: a perceptron, two layers of 32 tanh, stopped early (scikit-learn), the decay of `DECAYS` that
  recordings left out like best. It reads what laws read at the same places.
- ``symbolic``: gplearn with its own settings (1,000 programs, 20 generations, tournament 20), sine and cosine among its
  functions, on `SYMBOLIC_ROWS` rows.
- ``formula``: what `gecar discover` writes as a description (`gecar.reality.invent.formula`).

Judged on motion alone, wheel angles, pose and yaw rate, for all methods alike: these rivals have no port for the
battery's voltage or the colour sensor's reading.
"""

from __future__ import annotations

import json
import warnings
from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import minimum_filter1d

from benchmarks.concealed.cases import FASTER
from benchmarks.concealed.comparators.sparse import RESTING, even, leftover_torques, slope
from gecar.files import write_whole
from gecar.reality.discovery import MEMORY_S
from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.invent.corrected_replay import aligned, with_formulas
from gecar.reality.invent.formula import describe
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.prove.holdout import Contender, Correction, judge
from gecar.reality.recordings.recording import read_case
from gecar.reality.recordings.split import hold_out
from gecar.reality.replay.kernel import (
    AHEAD,
    ASIDE,
    HEADING,
    LEFT_ANGLE,
    LEFT_SPEED,
    RIGHT_ANGLE,
    RIGHT_SPEED,
    YAW_RATE,
    X,
    Y,
)
from gecar.reality.replay.replayer import Replayer
from gecar.reality.residuals.of_case import Residuals, motion_residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.residuals.threads import Threads
from gecar.reality.verdict import Judgement
from gecar.report.table import piped
from gecar.world.robot import Robot, load_robot, read_robot

Array = npt.NDArray[np.float64]
Model = Callable[[Array], Array]
"""From variables, shape (n, k), to what is left over, shape (n,)."""

EVERY = 3  # rows: what is differentiated is smoothed over more than that
EDGE = 16  # rows at either end of a recording, where smoothing has no neighbours
THRESHOLDS = (0.02, 0.05, 0.1, 0.2)  # of STLSQ, in standard deviations; PySINDy's own is 0.1
DECAYS = (0.01, 1.0, 30.0)  # L2 of the network; scikit-learn's own is 0.0001
PASSES = 15  # of a replay under what was learned, each about the path of the one before
DAMPED = 0.7
REACH = 1.5  # times the largest value taught: more is not believed
SYMBOLIC_ROWS = 1000


@dataclass(frozen=True)
class Lesson:
    """Variables and what is left over there, of all recordings: shapes (n, k), (n,), and each row's recording (n,)."""

    seen: Array
    left: Array
    recording: npt.NDArray[np.int_]

    def of(self, rows: npt.NDArray[np.bool_]) -> Lesson:
        """Return some of the rows."""
        return Lesson(self.seen[rows], self.left[rows], self.recording[rows])


def sindy(lesson: Lesson) -> Model:
    """Return sparse regression on polynomials."""
    import pysindy  # noqa: PLC0415

    def fitted(some: Lesson, threshold: float) -> Model:
        model = pysindy.SINDy(
            pysindy.STLSQ(threshold=threshold, alpha=0.05),
            feature_library=pysindy.PolynomialLibrary(degree=2),
        )
        model.fit(some.seen, t=0.01, x_dot=some.left[:, None])
        return lambda seen: np.asarray(model.predict(seen), float)[:, 0]

    return _best(fitted, THRESHOLDS, lesson)


def network(lesson: Lesson) -> Model:
    """Return a small perceptron."""
    from sklearn.neural_network import MLPRegressor  # noqa: PLC0415

    def fitted(some: Lesson, decay: float) -> Model:
        net = MLPRegressor(
            hidden_layer_sizes=(32, 32), activation="tanh", alpha=decay, early_stopping=True, random_state=0
        )
        net.fit(some.seen, some.left)
        return lambda seen: np.asarray(net.predict(seen), float)

    return _best(fitted, DECAYS, lesson)


def _best(fitted: Callable[[Lesson, float], Model], settings: Sequence[float], lesson: Lesson) -> Model:
    """Return a model fitted with the setting that every third recording, left out, likes best; all is standardised."""
    middle, spread, unit = lesson.seen.mean(axis=0), lesson.seen.std(axis=0) + 1e-9, lesson.left.std() + 1e-12
    whole = Lesson((lesson.seen - middle) / spread, lesson.left / unit, lesson.recording)
    out = whole.recording % 3 == 2

    def lost(setting: float) -> float:
        model = fitted(whole.of(~out), setting)
        return float(np.sum((whole.left[out] - model(whole.seen[out])) ** 2))

    model = fitted(whole, min(settings, key=lost) if out.any() else settings[len(settings) // 2])
    return lambda seen: model((seen - middle) / spread) * unit


def symbolic(lesson: Lesson) -> Model:
    """Return a program of genetic programming."""
    from gplearn.genetic import SymbolicRegressor  # noqa: PLC0415

    unit = lesson.left.std() + 1e-12
    rows = np.random.default_rng(0).permutation(len(lesson.left))[:SYMBOLIC_ROWS]
    search = SymbolicRegressor(
        population_size=1000, generations=20, tournament_size=20, random_state=0,
        function_set=("add", "sub", "mul", "div", "sqrt", "abs", "neg", "max", "min", "sin", "cos"),
    )  # fmt: skip
    search.fit(lesson.seen[rows], lesson.left[rows] / unit)
    return lambda seen: np.asarray(search.predict(seen), float) * unit


METHODS: dict[str, Callable[[Lesson], Model]] = {"sindy": sindy, "network": network, "symbolic": symbolic}
NAMES = ("formula", *METHODS)
LAW = "law"
NO_MOTION = ("battery_v", "reflection_pct")


def correction(method: str, fitted: Sequence[RecordingResiduals], robot: Robot) -> Correction:
    """Return what a method learned on recordings as a change of replays by the robot as it is known.

    Parameters
    ----------
    method
        One of `NAMES`.
    fitted
        The recordings to learn from.
    robot
        The robot as it is known.
    """
    if method == "formula":
        return with_formulas(describe(fitted, robot.physics))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of libraries, on their own future
        torque, ahead, turn = (_learned(METHODS[method], lessons) for lessons in _lessons(fitted, robot))
    return _replayed_with(torque, ahead, turn, robot)


def _learned(learn: Callable[[Lesson], Model], lessons: Sequence[tuple[Array, Array]]) -> Model:
    """Return what was learned, kept within reach of what was taught; nothing where there is nothing to learn from."""
    if not lessons:
        return lambda seen: np.zeros(len(seen))
    seen, left = (np.concatenate(parts) for parts in zip(*lessons, strict=True))
    number = np.concatenate([np.full(len(part), k) for k, (_, part) in enumerate(lessons)])
    reach = REACH * float(np.quantile(np.abs(left), 0.999))
    model = learn(Lesson(seen, left, number))
    return lambda variables: np.clip(np.nan_to_num(model(variables)), -reach, reach)


def _lessons(
    fitted: Sequence[RecordingResiduals], robot: Robot
) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """Return variables and what is left over there of every recording: of shafts, speed ahead, and turning rate."""
    shafts, ahead, turn = [], [], []
    for run in fitted:
        recording = run.recording
        angles = np.column_stack([recording.left_angle_rad, recording.right_angle_rad])
        if np.isnan(angles).all(axis=0).any():
            continue
        t, at = even(recording.t_s, recording.t_s), recording.t_s
        rows = run.replayer.play(robot.physics).rows  # drawn to what was measured: where the robot was
        told = np.column_stack([even(at, column) for column in rows.T])
        path = told.copy()
        angles = np.column_stack([even(at, a) for a in angles.T])
        speeds = slope(angles)
        path[:, [LEFT_ANGLE, RIGHT_ANGLE, LEFT_SPEED, RIGHT_SPEED]] = np.column_stack([angles, speeds])
        duty = np.column_stack([np.interp(t, at, u) for u in recording.commands.T])
        left, inner = leftover_torques(angles, duty, robot), np.arange(EDGE, len(t) - EDGE, EVERY)
        slowest = minimum_filter1d(
            np.abs(speeds), EDGE, axis=0
        )  # friction turns about where smoothing reaches
        kept = [inner[slowest[inner, wheel] > RESTING] for wheel in (0, 1)]
        both = [seen[kept[wheel]] for wheel, seen in enumerate(_of_wheels(path, duty, t))]
        shafts.append((np.concatenate(both), np.concatenate([left[kept[k], k] for k in (0, 1)])))
        if run.replayer.has_poses:
            x, y, heading = (even(at, c) for c in (recording.x_m, recording.y_m, recording.heading_rad))
            measured = slope(x) * np.cos(heading) + slope(y) * np.sin(heading), slope(heading)
            slipped = _slip(
                slope(told[:, [AHEAD, YAW_RATE]], 0).T, slope(told[:, [LEFT_SPEED, RIGHT_SPEED]], 0), robot
            )
            more = _slip(measured, speeds, robot) - slipped
            seen = _of_body(path, t)[inner]
            ahead.append((seen, more[0, inner]))
            turn.append((seen, more[1, inner]))
    return shafts, ahead, turn


def _slip(body: Sequence[Array] | Array, shafts: Array, robot: Robot) -> Array:
    """Return by how much speed ahead and turning rate exceed those of wheels that roll, shape (2, n)."""
    p = robot.physics[0]
    rolled = p["wheel_radius"] * shafts
    out: Array = np.array([
        body[0] - rolled.mean(axis=1), body[1] - (rolled[:, 1] - rolled[:, 0]) / p["track_width"],
    ])  # fmt: skip
    return out


def _of_wheels(path: Array, duty: Array, t: Array) -> list[Array]:
    """Return what a law at a wheel may look at, of the left and the right one, shape (n, variables) each."""
    out = []
    for own, other, side in ((0, 1, -1.0), (1, 0, 1.0)):
        angle, speed = path[:, (LEFT_ANGLE, RIGHT_ANGLE)[own]], path[:, (LEFT_SPEED, RIGHT_SPEED)[own]]
        u, elsewhere = duty[:, own], path[:, (LEFT_SPEED, RIGHT_SPEED)[other]]
        out.append(np.column_stack([
            u, np.abs(u), speed, np.abs(speed), np.sign(speed), elsewhere, np.full(len(t), side), side * u,
            np.sin(angle), np.cos(angle), np.sin(2.0 * angle), np.cos(2.0 * angle), *_place(path, t),
        ]))  # fmt: skip
    return out


def _of_body(path: Array, t: Array) -> Array:
    """Return what a law at the body may look at, shape (n, variables)."""
    left, right, v, rate = (path[:, k] for k in (LEFT_ANGLE, RIGHT_ANGLE, AHEAD, YAW_RATE))
    turning = np.column_stack([f(n * a) for a in (left, right) for n in (1.0, 2.0) for f in (np.sin, np.cos)])
    return np.column_stack([v, np.abs(v), rate, np.abs(rate), turning, *_place(path, t)])


def _place(path: Array, t: Array) -> list[Array]:
    heading = path[:, HEADING]
    return [t, path[:, X], path[:, Y], np.sin(heading), np.cos(heading)]


def _replayed_with(torque: Model, ahead: Model, turn: Model, robot: Robot) -> Correction:
    """Return the change of a replay that what was learned makes, acting inside it."""
    p = robot.physics[0]
    a_duty = float(p["resistance"] / (p["torque_constant"] * p["voltage"]))  # that gives a torque of 1 N m

    def change(replayer: Replayer, rows: Array, poses: Array) -> tuple[Array, Array]:
        cap = replayer.recording.setup.duty_cap or float(p["duty_cap"])
        told = np.clip(replayer.inputs.commands, -cap, cap)
        free = _uncapped(replayer)
        first, t = replayer.first_row, replayer.t
        more, moved, played = np.zeros((len(t), 2)), rows, rows
        for _ in range(PASSES):
            driven = told[first:]
            found = np.column_stack([torque(seen) for seen in _of_wheels(moved, driven, t)]) * a_duty
            found[(driven == 0.0) & (np.abs(moved[:, [LEFT_SPEED, RIGHT_SPEED]]) < RESTING)] = 0.0
            more = more + DAMPED * (found - more)
            commands = told.copy()
            commands[first:] += more
            inputs = free.inputs._replace(commands=commands)
            played = replace(free, inputs=inputs).play(robot.physics, rows[0, [X, Y, HEADING]]).rows
            moved = _with_speeds(played, ahead(_of_body(moved, t)), turn(_of_body(moved, t)), t)
        shift = moved[:, [X, Y, HEADING]] - rows[:, [X, Y, HEADING]]
        moves = np.stack([np.interp(replayer.inputs.pose_t, t, column) for column in shift.T], axis=1)
        return moved, aligned(poses + moves, replayer.inputs.pose, replayer.inputs.sd[3:5])

    return change


def _uncapped(replayer: Replayer) -> Replayer:
    """Return a replayer whose commands, capped already, may carry a torque besides."""
    setup = replace(replayer.recording.setup, duty_cap=10.0)
    return replace(replayer, recording=replace(replayer.recording, setup=setup))


def _with_speeds(rows: Array, ahead: Array, turn: Array, t: Array) -> Array:
    """Return a replay whose body has a speed ahead and a turning rate besides."""
    out = rows.copy()
    out[:, HEADING] += cumulative_trapezoid(turn, t, initial=0)
    out[:, YAW_RATE] += turn
    out[:, AHEAD] += ahead
    heading, v, w = out[:, HEADING], out[:, AHEAD], out[:, ASIDE]
    out[:, X] = rows[0, X] + cumulative_trapezoid(v * np.cos(heading) - w * np.sin(heading), t, initial=0)
    out[:, Y] = rows[0, Y] + cumulative_trapezoid(v * np.sin(heading) + w * np.cos(heading), t, initial=0)
    return out


@dataclass(frozen=True)
class Material:
    """A case's recordings beside the robot as it is known: to learn from, set aside, and faster ones if there are."""

    known: Robot
    fitted: Residuals
    held: Residuals
    faster: Residuals


def material(folder: Path, sealed: Path) -> Material:
    """Read a case, and the faster recordings sealed beside it."""
    case = read_case(folder)
    parts = hold_out(case, ())
    known = load_robot(parts.fitted[0].setup.robot)
    noise, threads = estimate_noise(parts.fitted, known.physics, MEMORY_S), Threads(1)
    faster = read_case(sealed / FASTER).recordings if (sealed / FASTER).is_dir() else ()
    three = (motion_residuals(some, noise, MEMORY_S, threads) for some in (parts.fitted, parts.held, faster))
    return Material(known, *three)


def gaps(at: Material, found: Robot, clocks: bool) -> Iterator[tuple[str, dict[str, float | None]]]:
    """Yield each method's gaps closed, on the recordings set aside and on faster ones; of the law that was found first.

    Parameters
    ----------
    at
        The case.
    found
        The robot with its laws.
    clocks
        Whether the camera's clocks are each recording's own.
    """
    for name in (LAW, *NAMES):
        learned = None if name == LAW else correction(name, at.fitted.recordings, at.known)
        robot = found if name == LAW else at.known
        yield (
            name,
            {
                kind: gap_closed(at.known, robot, learned, held, clocks)
                for kind, held in (("holdout", at.held), ("faster", at.faster))
            },
        )


def gap_closed(
    known: Robot, found: Robot, learned: Correction | None, held: Residuals, clocks: bool
) -> float | None:
    """Return the share of the gap of motion that is closed; None where there is none, or nothing to judge by."""
    if not held.recordings:
        return None
    bare = replace(held, recordings=tuple(replace(run, course=None) for run in held.recordings))
    before, after = (
        Contender(robot, with_fitted_clocks(bare, robot.physics)[0] if clocks else bare)
        for robot in (known, found)
    )
    misfits = judge(before, replace(after, correction=learned))
    return Judgement((), False, {c: m for c, m in misfits.items() if c not in NO_MOTION}).gap_closed


def table(cases: dict[str, dict[str, Any]]) -> str:
    """Write medians and spread of each method, then a case a row."""
    names, kinds = (LAW, *NAMES), ("holdout", "faster")
    heads = {"holdout": "set aside", "faster": "twice as fast"}
    rows = [["method", *(f"{heads[k]}: median (quartiles), made worse" for k in kinds)]]
    for name in names:
        of_kind = []
        for kind in kinds:
            closed = [gap for case in cases.values() if (gap := case["gaps"][name][kind]) is not None]
            low, middle, high = np.quantile(closed, (0.25, 0.5, 0.75)) if closed else (np.nan,) * 3
            worse = sum(gap < 0.0 for gap in closed)
            of_kind.append(
                f"{middle:.2f} ({low:.2f} to {high:.2f}), {worse} of {len(closed)}" if closed else "-"
            )
        rows.append([name, *of_kind])
    single = [
        ["case", "concealed", *(f"{n}{' faster' if k == 'faster' else ''}" for k in kinds for n in names)]
    ]
    for number, case in sorted(cases.items()):
        told = [case["gaps"][name][kind] for kind in kinds for name in names]
        single.append([number, case["concealed"], *("-" if gap is None else f"{gap:.2f}" for gap in told)])
    return piped(rows) + "\n" + piped(single)


def main() -> None:
    """Judge the rivals in every case in which a law was written, beside the law; goes on where it was stopped."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=Path, help="as benchmarks.concealed draws them: cases/ and sealed/")
    parser.add_argument("out", type=Path, help="what benchmarks.invention wrote")
    parser.add_argument("--all", action="store_true", help="also where no law was written")
    given = parser.parse_args()
    found = {}
    for file in sorted(given.out.glob("c*.json")):
        case = json.loads(file.read_text())
        if "gaps" not in case and (given.all or case["invented"]):
            robot = read_robot(file.with_suffix(".toml"))
            at = material(given.cases / "cases" / file.stem, given.cases / "sealed" / file.stem)
            case["gaps"] = dict(gaps(at, robot, case["clocks_fitted"]))
            write_whole(file, json.dumps(case, indent=1) + "\n")
            print(file.stem, case["concealed"], case["gaps"], flush=True)
        if "gaps" in case:
            found[file.stem] = case
    write_whole(given.out / "rivals.md", table(found))
    print(table(found))


if __name__ == "__main__":
    main()
