"""Draw a sealed case: recordings for everyone to see, and what they conceal for the scorer only."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.background import Background, draw_background
from benchmarks.concealed.commands import SECONDS, line_follower, script
from benchmarks.concealed.detectability import visibility
from benchmarks.concealed.effects import EFFECTS, Exactly, Rng
from benchmarks.concealed.history import ROW_TICKS, Array, Controller, Pose, ToppledError, replayed
from benchmarks.concealed.kinds import ALL_OUTSIDE
from benchmarks.concealed.recording import (
    ANGLES,
    CHANNELS,
    POSE,
    Conditions,
    channels,
    even_ticks,
    noise,
    write_recording,
)
from benchmarks.concealed.rehearsal import Act, Rehearsal, along, stacked, tuned
from benchmarks.concealed.robot import NEUTRAL, Base, Concealed
from benchmarks.concealed.settings import RUNS, Setting, draw_setting
from benchmarks.concealed.sizes import is_far, is_material, size
from benchmarks.concealed.worlds import truth

KINDS = ("none", "single", "double", "triple", "mixed", "outside")
SENSORS = {"light": {"reflection_pct"}, "camera": set(POSE), "encoders": set(ANGLES)}
FASTER = "faster"  # folder of sealed recordings, see `Manner`
_HELD_OUT = 2  # recordings to judge by, where there are enough
_DOUBLE_LEAST = 0.4  # two at once are drawn from the upper part of the strengths' log range
_QUIETEST, _QUIETEST_OF_MANY, _LOUDEST = 3.0, 15.0, 300.0  # d' that strengths are drawn for
# Shares of the log range, to find what is just material.
_FROM_WEAK = (-0.5, -0.25, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_LOUD_TIMES = 3.0  # d' of the strongest that is drawn to that of what is just material, at least
_ATTEMPTS = 20  # a robot that topples that often is not drawn anew
_REHEARSED = (0, 2, 3, 4)  # of eight recordings: enough to learn how loud something is
_BACKGROUND_MM = (1.0, 5.0)  # how far a background moves the robot within a recording, and
_BACKGROUND_DEG = 1.2  # turns it, as rehearsed: on the way itself it may be a little more


@dataclass(frozen=True)
class Manner:
    """Where and how cases are drawn.

    Parameters
    ----------
    world
        One of ``WORLDS``.
    background
        Whether every robot has a little of many things, strengths are drawn by how visible they are, and robots and
        recordings vary. Without it cases are those of the first examinations.
    pace
        Share of the usual duties that the robot is driven with. Where it is less than 1, two recordings at the usual
        duties are sealed beside the case: what is learned from slow ones can be judged by faster ones.
    without
        A sensor that no case has, one of ``SENSORS``; all may be there if empty.
    material
        Whether strengths are drawn from what is just material up, where there is a background; most are smaller else.
    """

    world: str = "mujoco"
    background: bool = False
    pace: float = 1.0
    without: str = ""
    material: bool = False


@dataclass(frozen=True)
class Hidden:
    """What a case conceals.

    ``robots``: one per recording. ``off``: the robot with nothing concealed; it has the background. ``without``: for
    every one of several things, the robots with only the others, by id. ``plain``: the robot of the file, where there
    is a background. ``label``: for the sealed file.
    """

    robots: tuple[Concealed, ...]
    off: Concealed
    without: Mapping[str, tuple[Concealed, ...]]
    label: dict[str, Any]
    plain: Concealed | None = None


@dataclass(frozen=True)
class Case:
    """How one case is recorded."""

    manner: Manner
    setting: Setting
    conditions: Conditions
    seeds: Sequence[np.random.SeedSequence]

    @property
    def base(self) -> Base:
        """The robot's file."""
        return self.setting.base


def draw_case(
    name: str,
    kind: str,
    effects: tuple[str, ...],
    seed: tuple[int, ...],
    out: Path,
    manner: Manner = Manner(),
) -> None:
    """Draw one case and write it.

    Parameters
    ----------
    name
        Of the case's folder; it must not give the answer away.
    kind
        One of ``KINDS``.
    effects
        Identifiers of what to conceal: of ``EFFECTS``, of ``ALL_OUTSIDE``, or (mixed) of each one.
    seed
        Entropy: equal seeds give equal bytes.
    out
        ``out/cases/NAME`` receives the recordings, ``out/sealed/NAME`` the label and the noise-free channels.
    manner
        The world, and whether there is a background.
    """
    folder, sealed = out / "cases" / name, out / "sealed" / name
    folder.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(parents=True, exist_ok=True)
    for attempt in itertools.count():
        try:
            hidden, case, worlds = _recorded(kind, effects, (*seed, attempt), folder, manner)
            if manner.pace != 1.0:
                _seal_faster(sealed / FASTER, hidden, case)
            break
        # A robot this tall, or a ridge this high: nobody would keep the recording; draw again.
        except ToppledError:
            for path in folder.iterdir():
                path.unlink()
    seal_truth(sealed, name, kind, seed, hidden, case, worlds)


def seal_truth(
    folder: Path,
    name: str,
    kind: str,
    seed: tuple[int, ...],
    hidden: Hidden,
    case: Case,
    worlds: Mapping[str, Array],
) -> None:
    """Write what a recorded case conceals, the noise-free channels first and the label last, into a folder."""
    manner, runs = case.manner, list(case.setting.runs)
    single: dict[str, Any] = {
        key: array.astype(np.float32) for key, array in worlds.items() if not key.endswith("_plain")
    }
    np.savez_compressed(folder / "truth.npz", **single)
    about = {"case": name, "kind": kind, **hidden.label, "seed": list(seed)}
    about |= {"conditions": _stated(case.conditions), "runs": runs, "holdout": _holdout(len(runs))}
    about |= {"robot": _plain(hidden.robots[0])}
    if manner.pace != 1.0:
        about |= {"pace": manner.pace}
    if manner.without:
        about |= {"without": manner.without}
    if manner.material:
        about |= {"material": True}
    if manner.background or manner.world != "mujoco":
        about |= {"world": manner.world, "setting": case.setting.as_label()}
        about |= _measured(hidden, case, worlds)
    (folder / "label.json").write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8", newline="\n")


def redrawn(out: Path, label: Mapping[str, Any]) -> tuple[Hidden, Case, dict[str, Array], list[Act]]:
    """Draw a sealed case once more, from its label.

    Parameters
    ----------
    out
        Holds ``sealed/``.
    label
        The case's.

    Returns
    -------
    tuple[Hidden, Case, dict[str, Array], list[Act]]
        What it conceals, how it is recorded, the channels in every world, and the commands of each recording.

    Raises
    ------
    ValueError
        If that gives other channels than those sealed.
    """
    things = tuple(effect["id"] for effect in label["effects"])
    things += (label["outside"]["id"],) if label["outside"] else ()
    manner = Manner(
        label.get("world", "mujoco"),
        "background" in label,
        label.get("pace", 1.0),
        label.get("without", ""),
        label.get("material", False),
    )
    with np.load(out / "sealed" / label["case"] / "truth.npz") as archive:
        sealed = archive["run0_on"]
    for attempt in range(_ATTEMPTS):
        with tempfile.TemporaryDirectory() as folder:
            try:
                hidden, case, worlds = _recorded(
                    label["kind"], things, (*label["seed"], attempt), Path(folder), manner
                )
            except ToppledError:
                continue
        if not np.array_equal(worlds["run0_on"].astype(np.float32), sealed):
            break
        acts = []
        for run, kind in enumerate(case.setting.runs):
            start, _ = _task(kind, np.random.default_rng(case.seeds[run]), case.base, manner.pace)
            acts.append(Act(start, worlds[f"run{run}_commands"], case.conditions.camera_offset_s(run)))
        return hidden, case, worlds, acts
    message = f"{label['case']}: found other channels than those sealed, expected the code that drew it"
    raise ValueError(message)


def _seal_faster(folder: Path, hidden: Hidden, case: Case) -> None:
    """Record the same robot at the usual duties, once for each recording to judge by."""
    folder.mkdir(exist_ok=True)
    runs = case.setting.runs
    seeds = np.random.SeedSequence(entropy=case.seeds[0].entropy, spawn_key=(len(runs), 1)).spawn(len(runs))
    usual = replace(case, manner=replace(case.manner, pace=1.0), seeds=seeds)
    for run in _holdout(len(runs)):
        record(folder / f"run_{run + 1:02d}_{runs[run]}.csv", run, hidden, usual)


def _recorded(
    kind: str, effects: tuple[str, ...], seed: tuple[int, ...], folder: Path, manner: Manner
) -> tuple[Hidden, Case, dict[str, Array]]:
    """Draw a robot and how it is recorded, and record it."""
    seeds = np.random.SeedSequence(seed)
    rng = np.random.default_rng(seeds.spawn(1)[0])
    if manner.background:
        setting = draw_setting(rng, "line" if _needed(effects) & {"reflection_pct"} else "holds")
        background = draw_background(rng, manner.world)
        conditions = _conditions(rng, effects, len(setting.runs), manner.without)
        known = {name: number for part in background.recorder.values() for name, number in part.items()}
        known |= {"log_hz": setting.log_hz, "encoder_step_deg": setting.encoder_step_deg}
        case = Case(manner, setting, replace(conditions, **known), seeds.spawn(len(setting.runs)))
        hidden = _conceal_tuned(kind, effects, rng, background, case)
    else:
        hidden = conceal(effects, rng)
        conditions = _conditions(rng, effects, len(RUNS), manner.without)
        case = Case(manner, Setting(runs=RUNS), conditions, seeds.spawn(len(RUNS)))
    worlds: dict[str, Array] = {}
    for run, run_kind in enumerate(case.setting.runs):
        worlds |= record(folder / f"run_{run + 1:02d}_{run_kind}.csv", run, hidden, case)
    return hidden, case, worlds


def conceal(effects: tuple[str, ...], rng: Rng) -> Hidden:
    """Draw strengths for what a case conceals, in a robot that is nominal otherwise.

    Parameters
    ----------
    effects
        As :func:`draw_case` takes them.
    rng
        Source of randomness.

    Returns
    -------
    Hidden
    """
    least = _DOUBLE_LEAST if len(effects) > 1 else 0.0
    return _hidden([_thing(effect, rng, least, len(RUNS)) for effect in effects], NEUTRAL, len(RUNS))


@dataclass(frozen=True)
class Thing:
    """One thing concealed: an effect of the catalogue, or physics outside it.

    ``changes``: fields of ``Concealed`` to replace, per recording; ``label``: what the sealed file says.
    """

    id: str
    changes: tuple[Mapping[str, Any], ...]
    label: dict[str, Any]

    def on(self, robots: Sequence[Concealed]) -> tuple[Concealed, ...]:
        """Conceal it in robots, one per recording."""
        return tuple(replace(robot, **change) for robot, change in zip(robots, self.changes, strict=True))


def _thing(name: str, rng: Rng, least: float, runs: int) -> Thing:
    if name in EFFECTS:
        drawn = EFFECTS[name].draw(rng, least)
        return Thing(name, (drawn.changes,) * runs, {"id": name, "parameters": drawn.parameters})
    outside = ALL_OUTSIDE[name]
    robots, numbers = outside.draw(rng, runs, least)
    changes = tuple(unlike_neutral(robot) for robot in robots)
    return Thing(name, changes, {"id": name, "words": outside.words, "numbers": numbers})


def _hidden(things: Sequence[Thing], off: Concealed, runs: int) -> Hidden:
    """Put things together; with several, every one of them is also left out."""
    robots = _with(things, off, runs)
    without = {
        thing.id: _with([other for other in things if other is not thing], off, runs)
        for thing in things
        if len(things) > 1
    }
    outside = next((thing.label for thing in things if thing.id in ALL_OUTSIDE), None)
    effects = [thing.label for thing in things if thing.id in EFFECTS]
    return Hidden(robots, off, without, {"effects": effects, "outside": outside})


def _with(things: Sequence[Thing], off: Concealed, runs: int) -> tuple[Concealed, ...]:
    robots: tuple[Concealed, ...] = (off,) * runs
    for thing in things:
        robots = thing.on(robots)
    return robots


def _conceal_tuned(
    kind: str, effects: tuple[str, ...], rng: Rng, background: Background, case: Case
) -> Hidden:
    """Scale the background to its size and every thing to a drawn visibility."""
    runs = len(case.setting.runs)
    plain = replace(NEUTRAL, base=case.base)
    chosen = [run for run in (_REHEARSED if runs >= len(RUNS) else range(runs)) if run < runs]
    acts = {run: act(run, plain, case) for run in range(min(runs, len(RUNS)))}
    wanted = float(np.exp(rng.uniform(*np.log(_BACKGROUND_MM))))
    amounts = _amounts(background, plain, wanted, acts, case)
    off = background.on(plain, amounts)
    rehearsal = Rehearsal(case.manner.world, off, [acts[run] for run in chosen], SECONDS, case.conditions)
    loudness = (runs / len(chosen)) ** 0.5
    things = []
    for effect in effects:
        seed = int(rng.integers(2**32))
        quietest = _QUIETEST if len(effects) == 1 else _QUIETEST_OF_MANY
        loudest, weakest, place = _LOUDEST, -math.inf, rng.uniform()

        def drawn(share: float, effect: str = effect, seed: int = seed) -> Thing:
            return _thing(effect, np.random.default_rng(seed), Exactly(share), runs)

        def shown(share: float) -> tuple[Concealed, ...]:
            robots = drawn(share).on((off,) * runs)
            return tuple(robots[run] for run in chosen)

        def loud(share: float) -> float:
            return loudness * rehearsal.d_prime(shown(share))

        def matters(share: float) -> bool:
            return is_far(drawn(share).label) and is_material(rehearsal.size(shown(share)))

        if case.manner.material:
            weakest = next((one for one in _FROM_WEAK if matters(one)), 1.0)
            quietest = max(loud(weakest), _QUIETEST)
            loudest = max(_LOUDEST, _LOUD_TIMES * quietest)
        low, high = np.log([quietest, loudest])
        target = float(np.exp(low + (high - low) * place))
        share = max(tuned(loud, target), weakest)
        if kind == "mixed" and effect in EFFECTS:
            while share < 1.0 and not matters(share):
                share = min(share + 0.25, 1.0)
        things.append(drawn(share))
    hidden = _hidden(things, off, runs)
    return replace(hidden, plain=plain, label={**hidden.label, "background": background.as_label(amounts)})


def _amounts(
    background: Background, plain: Concealed, wanted_mm: float, acts: Mapping[int, Act], case: Case
) -> dict[str, float]:
    """Find shares of a background's kinds that together move the robot as far as wanted, each about as far."""
    rehearsals = {
        run: Rehearsal(case.manner.world, plain, [one], SECONDS, case.conditions) for run, one in acts.items()
    }

    def excess(amounts: Mapping[str, float], runs: Iterable[int]) -> float:
        robot = background.on(plain, amounts)
        found = [rehearsals[run].size([robot]) for run in runs]
        return max(max(one["mm_drive"] / wanted_mm, one["deg_drive"] / _BACKGROUND_DEG) for one in found)

    few = [run for run in _REHEARSED if run in acts] or list(acts)
    each = len(background.moving) ** 0.5
    amounts = {kind: 1.0 / max(excess({kind: 1.0}, few) * each, 1.0) for kind in background.moving}
    together = max(excess(amounts, acts), 1.0)
    return {kind: round(amount / together, 6) for kind, amount in amounts.items()}


def act(run: int, robot: Concealed, case: Case) -> Act:
    """Let a robot choose the commands of one recording: a line follower's depend on who drives."""
    start, controller = _task(
        case.setting.runs[run], np.random.default_rng(case.seeds[run]), case.base, case.manner.pace
    )
    ticks = case.conditions.row_ticks
    history = truth(case.manner.world, robot).run(start, controller, SECONDS, turn_ticks=ticks)
    return Act(start, history.commands[::ticks], case.conditions.camera_offset_s(run))


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


def record(path: Path, run: int, hidden: Hidden, case: Case) -> dict[str, Array]:
    """Drive one recording, write it, and return the noise-free channels of every world."""
    robot, conditions, rng = hidden.robots[run], case.conditions, np.random.default_rng(case.seeds[run])
    offset, ticks = conditions.camera_offset_s(run), conditions.row_ticks
    start, controller = _task(case.setting.runs[run], rng, case.base, case.manner.pace)
    rows = round(SECONDS * 100) + 1
    reading_noise = np.repeat(noise("reflection_pct", rows, conditions, rng), ROW_TICKS)[
        : (rows - 1) * ROW_TICKS + 1
    ]
    history = truth(case.manner.world, robot).run(start, controller, SECONDS, reading_noise, ticks)
    written = even_ticks(history, ticks)
    clean = channels(history, robot, offset, written)
    write_recording(path, history, clean, conditions, rng, base=case.base)
    commands = history.commands[::ticks]
    worlds = {f"run{run}_on": stacked(clean), f"run{run}_commands": commands}
    others = {"off": hidden.off, **{f"without_{key}": each[run] for key, each in hidden.without.items()}}
    if hidden.plain is not None:
        others["plain"] = hidden.plain
    for label, other in others.items():
        if other == robot:
            continue
        replay = truth(case.manner.world, other).run(
            start, replayed(commands, ticks), SECONDS, turn_ticks=ticks
        )
        view = channels(replace(replay, light=along(history, other)), other, offset, written)
        worlds[f"run{run}_{label}"] = stacked(view)
    return worlds


def _measured(hidden: Hidden, case: Case, worlds: Mapping[str, Array]) -> dict[str, Any]:
    """Say how visible, and how large, each thing concealed and the background are."""
    runs = range(len(case.setting.runs))

    def pairs(with_it: str, without_it: str) -> list[tuple[Array, Array]]:
        found = []
        for run in runs:
            on = worlds[f"run{run}_on"]
            found.append((worlds.get(f"run{run}_{with_it}", on), worlds.get(f"run{run}_{without_it}", on)))
        return found

    ids = [effect["id"] for effect in hidden.label["effects"]]
    ids += [hidden.label["outside"]["id"]] if hidden.label["outside"] else []
    absent = {name: f"without_{name}" if len(ids) > 1 else "off" for name in ids}
    compared = {name: pairs("on", other) for name, other in absent.items()}
    if hidden.plain is not None:
        compared["background"] = pairs("off", "plain")
    sizes, repeated = ({name: size(of, often) for name, of in compared.items()} for often in (False, True))
    loud = {
        name: round(visibility(worlds, "on", other, case.conditions).d_prime, 3)
        for name, other in absent.items()
    }
    return {"d_prime": loud, "size": sizes, "size_repeatedly": repeated}


def _task(kind: str, rng: Rng, base: Base, pace: float = 1.0) -> tuple[Pose, Controller]:
    if kind.startswith("line"):
        start, controller = line_follower(kind, rng)
    else:
        start, commands = script(kind, rng, base)
        controller = replayed(commands)
    return start, controller if pace == 1.0 else _at_pace(controller, pace)


def _at_pace(controller: Controller, pace: float) -> Controller:
    """Return a controller that asks for a share of the duties, in whole percents."""

    def slower(time_s: float, reading: int) -> tuple[int, int] | None:
        duties = controller(time_s, reading)
        return None if duties is None else (round(pace * duties[0]), round(pace * duties[1]))

    return slower


def _conditions(rng: Rng, effects: Sequence[str], runs: int, without: str) -> Conditions:
    """Draw how a case is recorded; what the hidden effect needs to show at all is never left out."""
    away = {"battery_v"} if rng.random() < 0.4 else set()
    away |= {"yaw_rate_dps"} if rng.random() < 0.7 else set()
    away |= _gap(float(rng.random())) - _needed(effects)
    away = away - set().union(*SENSORS.values()) | SENSORS[without] if without else away
    offsets = tuple(float(offset) for offset in rng.uniform(-0.015, 0.015, runs))
    return Conditions(
        columns=tuple(name for name in CHANNELS if name not in away),
        noise_level=float(2.0 ** rng.uniform(-1.0, 1.0)),
        coloured_share=float(rng.uniform(0.2, 0.6)) if rng.random() < 0.4 else 0.0,
        coloured_time_s=float(rng.uniform(0.05, 0.5)),
        camera_hz=float(rng.choice([25.0, 30.0, 30.0, 100.0 / 3.0, 50.0])),
        camera_offsets_s=offsets if rng.random() < 0.2 and "pose_delay" not in effects else (),
    )


def _needed(effects: Sequence[str]) -> set[str]:
    """Columns without which what is concealed leaves no trace."""
    return {column for name in effects for column in {**EFFECTS, **ALL_OUTSIDE}[name].needs}


def _gap(chance: float) -> set[str]:
    """Leave out one kind of sensor, in a quarter of the cases."""
    for share, sensor in ((0.10, "light"), (0.18, "camera"), (0.25, "encoders")):
        if chance < share:
            return SENSORS[sensor]
    return set()


def _holdout(runs: int) -> list[int]:
    """Places of the recordings to judge by."""
    return list(range(runs - _HELD_OUT, runs)) if runs > _HELD_OUT else []


def _stated(conditions: Conditions) -> dict[str, Any]:
    """Give the conditions; what only backgrounds and settings change, where it is not as usual."""
    usual = {field.name: field.default for field in fields(Conditions)}
    rare = ("log_hz", "encoder_step_deg", "jitter_s", "dropped_share")
    return {
        key: number for key, number in asdict(conditions).items() if key not in rare or number != usual[key]
    }


def unlike_neutral(robot: Concealed) -> dict[str, Any]:
    """Give the fields that are not those of a robot that conceals nothing."""
    return {field: number for field, number in vars(robot).items() if number != getattr(NEUTRAL, field)}


def _plain(robot: Concealed) -> dict[str, Any]:
    """Give the fields that are not neutral."""
    return {field: number for field, number in asdict(robot).items() if field in unlike_neutral(robot)}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
