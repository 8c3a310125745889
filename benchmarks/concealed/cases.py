"""Draw a sealed case: recordings for everyone to see, and what they conceal for the scorer only."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.colour_sensor import ColourSensor
from benchmarks.concealed.commands import SECONDS, line_follower, script
from benchmarks.concealed.effects import EFFECTS, Rng
from benchmarks.concealed.outside import OUTSIDE
from benchmarks.concealed.recording import (
    ANGLES,
    CHANNELS,
    POSE,
    Conditions,
    channels,
    noise,
    write_recording,
)
from benchmarks.concealed.robot import NEUTRAL, Concealed
from benchmarks.concealed.history import (
    ROW_TICKS,
    Array,
    Controller,
    History,
    Pose,
    ToppledError,
    replayed,
)
from benchmarks.concealed.truth import Truth

# Six recordings to learn from and two to be judged by, of kinds that the six do not hold.
RUNS = ("holds", "holds", "holds_gentle", "sines", "line", "line", "reversals", "line_smooth")
HOLDOUT = (6, 7)
KINDS = ("none", "single", "double", "outside")
_DOUBLE_LEAST = 0.4  # two at once are drawn from the upper part of the strengths' log range


@dataclass(frozen=True)
class Hidden:
    """What a case conceals.

    ``robots``: one per recording. ``without``: for every effect, the robot with only the others, by the effect's id;
    what is left when nothing is concealed is the nominal robot. ``label``: for the sealed file.
    """

    robots: tuple[Concealed, ...]
    without: dict[str, Concealed]
    needs: tuple[str, ...]
    label: dict[str, Any]


def draw_case(name: str, kind: str, effects: tuple[str, ...], seed: tuple[int, ...], out: Path) -> None:
    """Draw one case and write it.

    Parameters
    ----------
    name
        Of the case's folder; it must not give the answer away.
    kind
        One of ``KINDS``.
    effects
        Identifiers of what to conceal: none, one or two of ``EFFECTS``, or one of ``OUTSIDE``.
    seed
        Entropy: equal seeds give equal bytes.
    out
        ``out/cases/NAME`` receives the recordings, ``out/sealed/NAME`` the label and the noise-free channels.
    """
    folder, sealed = out / "cases" / name, out / "sealed" / name
    folder.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(parents=True, exist_ok=True)
    for attempt in itertools.count():
        try:
            hidden, conditions, worlds = _recorded(kind, effects, (*seed, attempt), folder)
            break
        except (
            ToppledError
        ):  # a robot this tall, or a ridge this high: nobody would keep the recording; draw again
            continue
    single: dict[str, Any] = {key: array.astype(np.float32) for key, array in worlds.items()}
    np.savez_compressed(sealed / "truth.npz", **single)
    about = {"case": name, "kind": kind, **hidden.label, "seed": list(seed), "conditions": asdict(conditions)}
    about |= {"runs": list(RUNS), "holdout": list(HOLDOUT), "robot": _plain(hidden.robots[0])}
    (sealed / "label.json").write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8", newline="\n")


def _recorded(
    kind: str, effects: tuple[str, ...], seed: tuple[int, ...], folder: Path
) -> tuple[Hidden, Conditions, dict[str, Array]]:
    """Draw a robot and how it is recorded, and record it."""
    rng, *run_rngs = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(1 + len(RUNS)))
    hidden = conceal(kind, effects, rng)
    conditions = _conditions(rng, hidden)
    worlds: dict[str, Array] = {}
    for run, run_rng in enumerate(run_rngs):
        path = folder / f"run_{run + 1:02d}_{RUNS[run]}.csv"
        worlds |= record(path, run, hidden, conditions, run_rng)
    return hidden, conditions, worlds


def conceal(kind: str, effects: tuple[str, ...], rng: Rng) -> Hidden:
    """Draw strengths for what a case conceals.

    Parameters
    ----------
    kind, effects
        As :func:`draw_case` takes them.
    rng
        Source of randomness.

    Returns
    -------
    Hidden
    """
    if kind == "outside":
        outside = OUTSIDE[effects[0]]
        robots, numbers = outside.draw(rng, len(RUNS))
        label = {"effects": [], "outside": {"id": effects[0], "words": outside.words, "numbers": numbers}}
        return Hidden(tuple(robots), {}, outside.needs, label)
    least = _DOUBLE_LEAST if len(effects) > 1 else 0.0
    drawn = {effect: EFFECTS[effect].draw(rng, least) for effect in effects}
    robot = replace(
        NEUTRAL, **{field: number for one in drawn.values() for field, number in one.changes.items()}
    )
    without = (
        {effect: replace(robot, **_neutral(one.changes)) for effect, one in drawn.items()} if least else {}
    )
    needs = tuple(column for effect in effects for column in EFFECTS[effect].needs)
    named = [{"id": effect, "parameters": one.parameters} for effect, one in drawn.items()]
    return Hidden((robot,) * len(RUNS), without, needs, {"effects": named, "outside": None})


def seal(out: Path) -> str:
    """Hash every file of every case, sealed and open, before anybody looks at one.

    Parameters
    ----------
    out
        As :func:`draw_case` takes it.

    Returns
    -------
    str
        SHA-256 of ``out/manifest.sha256``, which this writes in the format of ``sha256sum``: worth publishing.
    """
    files = sorted(path for part in ("cases", "sealed") for path in (out / part).rglob("*") if path.is_file())
    lines = [f"{_digest(path)}  {path.relative_to(out).as_posix()}\n" for path in files]
    manifest = out / "manifest.sha256"
    manifest.write_text("".join(lines), encoding="utf-8", newline="\n")
    return _digest(manifest)


def broken_seals(out: Path) -> list[str]:
    """List the files that are not as they were when the manifest was written.

    Parameters
    ----------
    out
        As :func:`draw_case` takes it.

    Returns
    -------
    list[str]
        Paths relative to ``out``.
    """
    entries = [
        line.split("  ", 1) for line in (out / "manifest.sha256").read_text(encoding="utf-8").splitlines()
    ]
    return [name for digest, name in entries if not (out / name).is_file() or _digest(out / name) != digest]


def record(path: Path, run: int, hidden: Hidden, conditions: Conditions, rng: Rng) -> dict[str, Array]:
    """Drive one recording, write it, and return the noise-free channels of every world."""
    robot, offset = hidden.robots[run], conditions.camera_offset_s(run)
    start, controller = _task(RUNS[run], rng)
    rows = round(SECONDS * 100) + 1
    reading_noise = np.repeat(noise("reflection_pct", rows, conditions, rng), ROW_TICKS)[
        : (rows - 1) * ROW_TICKS + 1
    ]
    history = Truth(robot).run(start, controller, SECONDS, reading_noise)
    clean = channels(history, robot, offset)
    write_recording(path, history, clean, conditions, rng)
    commands = history.commands[::ROW_TICKS]
    worlds = {f"run{run}_on": _stacked(clean), f"run{run}_commands": commands}
    if robot == NEUTRAL:
        return worlds
    for label, other in {
        "off": NEUTRAL,
        **{f"without_{key}": one for key, one in hidden.without.items()},
    }.items():
        replay = Truth(other).run(start, replayed(commands), SECONDS)
        view = channels(replace(replay, light=_along(history, other)), other, offset)
        worlds[f"run{run}_{label}"] = _stacked(view)
    return worlds


def _task(kind: str, rng: Rng) -> tuple[Pose, Controller]:
    if kind.startswith("line"):
        return line_follower(kind, rng)
    start, commands = script(kind, rng)
    return start, replayed(commands)


def _along(history: History, other: Concealed) -> Array:
    """Let another robot's sensor look along this run's path, so that sensor and motion effects stay apart."""
    sensor = ColourSensor(other)
    return np.array([sensor.look(*pose) for pose in history.pose.tolist()])


def _conditions(rng: Rng, hidden: Hidden) -> Conditions:
    """Draw how a case is recorded; what the hidden effect needs to show at all is never left out."""
    away = {"battery_v"} if rng.random() < 0.4 else set()
    away |= {"yaw_rate_dps"} if rng.random() < 0.7 else set()
    away |= _gap(float(rng.random())) - set(hidden.needs)
    tied = any(effect["id"] == "pose_delay" for effect in hidden.label["effects"])
    offsets = tuple(float(offset) for offset in rng.uniform(-0.015, 0.015, len(RUNS)))
    return Conditions(
        columns=tuple(name for name in CHANNELS if name not in away),
        noise_level=float(2.0 ** rng.uniform(-1.0, 1.0)),
        coloured_share=float(rng.uniform(0.2, 0.6)) if rng.random() < 0.4 else 0.0,
        coloured_time_s=float(rng.uniform(0.05, 0.5)),
        camera_hz=float(rng.choice([25.0, 30.0, 30.0, 100.0 / 3.0, 50.0])),
        camera_offsets_s=offsets if rng.random() < 0.2 and not tied else (),
    )


def _gap(chance: float) -> set[str]:
    """Leave out one kind of sensor, in a quarter of the cases."""
    for share, columns in ((0.10, {"reflection_pct"}), (0.18, set(POSE)), (0.25, set(ANGLES))):
        if chance < share:
            return columns
    return set()


def _neutral(changes: Any) -> dict[str, Any]:
    return {field: getattr(NEUTRAL, field) for field in changes}


def _stacked(clean: dict[str, Array]) -> Array:
    return np.column_stack([clean[name] for name in CHANNELS])


def _plain(robot: Concealed) -> dict[str, Any]:
    """Give the fields that are not neutral."""
    return {field: number for field, number in asdict(robot).items() if number != getattr(NEUTRAL, field)}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
