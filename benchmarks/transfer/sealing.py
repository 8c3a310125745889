"""Seal what will be driven: each program's hash and the time promised for it, before any engine runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from gecar.errors import InputError, expected
from gecar.files import read_text, write_whole
from gecar.language.opcodes import JUMP
from gecar.language.program import parse_program
from gecar.results.config import configure, read_config
from gecar.results.run import load_task
from gecar.world.rollout import Drive, Outcome, simulate

MANIFEST = "manifest.json"


@dataclass(frozen=True)
class Winner:
    """The best program of a run, and what gecar says of it.

    Attributes
    ----------
    name, source
        Of the run; the file that says so.
    course, limit_s
        Where it was evolved to drive, and for how long at most [s].
    gecar
        What else of its configuration decides how gecar drives it.
    program, sha256
        Its text and that text's hash.
    fitness_s
        The run's fitness [s]; of a run on perturbed robots that is no time of the nominal one.
    promised_s
        Its time to GOAL on gecar's nominal robot [s].
    """

    name: str
    source: str
    course: str
    limit_s: float
    gecar: dict[str, Any]
    program: str
    sha256: str
    fitness_s: float
    promised_s: float

    @property
    def rows(self) -> list[list[int]]:
        """The program as opcode rows."""
        rows: list[list[int]] = parse_program(self.program).opcodes.tolist()
        if any(row[0] > JUMP for row in rows):
            raise expected(self.source, "a program with memory", "one of Table 3's language")
        return rows

    def in_gecar(self) -> Drive:
        """Drive it on gecar's nominal robot, with its path."""
        world = load_task(
            configure({"course": self.course, "time_limit_s": self.limit_s, **self.gecar})
        ).world
        return simulate(world, parse_program(self.program).opcodes, trace=True)


def find_winners(places: Sequence[Path]) -> list[Winner]:
    """Read the winners of runs.

    Parameters
    ----------
    places
        Run folders of ``gecar evolve``, folders of studies, or single records of a study.

    Raises
    ------
    InputError
        If there is no run, one did not reach GOAL, or was for another robot than the nominal EV3.
    """
    winners = [
        _winner(name, path, table, record) for place in places for name, path, table, record in _runs(place)
    ]
    names = [winner.name for winner in winners]
    for name in names:
        if names.count(name) > 1:
            raise expected("RUN", f"'{name}' twice", "each run once, under different names")
    return winners


def seal(winners: Sequence[Winner], out: Path) -> str:
    """Write the manifest, or make sure that the one that is there holds the same.

    Returns
    -------
    str
        Hash of the manifest.

    Raises
    ------
    InputError
        If other programs were sealed in this folder.
    """
    path = out / MANIFEST
    text = json.dumps([asdict(winner) for winner in winners], indent=2) + "\n"
    if path.exists() and read_text(path, "a manifest") != text:
        raise expected(path, "other programs or promises", "the same runs again, or a new folder for --out")
    out.mkdir(parents=True, exist_ok=True)
    write_whole(path, text)
    return hashlib.sha256(text.encode()).hexdigest()


def _runs(place: Path) -> list[tuple[str, Path, Mapping[str, Any], Mapping[str, Any]]]:
    """Return name, file, configuration and record of each run at a place."""
    if (place / "result.json").is_file():
        result = place / "result.json"
        return [(place.resolve().name, result, read_config(place / "config.toml"), _read(result))]
    folder = place / "runs" if (place / "runs").is_dir() else place
    files = [place] if place.is_file() else sorted(folder.glob("*.json"))
    records = [(path, _read(path)) for path in files]
    kept: list[tuple[str, Path, Mapping[str, Any], Mapping[str, Any]]] = [
        (path.stem, path, record["config"], record) for path, record in records if "config" in record
    ]
    if not kept:
        raise expected(place, "no run", "a run's folder, a study's, or a study's record")
    return kept


def _read(path: Path) -> dict[str, Any]:
    try:
        table = json.loads(read_text(path, "a run's result"))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON: {error}") from None
    if not isinstance(table, dict):
        raise expected(path, "no JSON object", "a run's result")
    return table


def _winner(name: str, path: Path, table: Mapping[str, Any], record: Mapping[str, Any]) -> Winner:
    try:
        program, fitness_s, solved = str(record["program"]), float(record["fitness_s"]), record["solved"]
        course, robot, limit_s = str(table["course"]), str(table["robot"]), float(table["time_limit_s"])
    except (KeyError, TypeError, ValueError) as error:
        raise expected(path, f"no run ({error})", "a run's result and configuration") from None
    if robot != "ev3":
        raise expected(path, f"robot '{robot}'", "'ev3', the robot that was built in the other engines")
    if not solved:
        raise expected(path, "a program that did not reach GOAL", "one that promises a time")
    sha256 = hashlib.sha256(program.encode()).hexdigest()
    gecar = {field: table[field] for field in ("step_s", "engine") if field in table}
    winner = Winner(name, str(path), course, limit_s, gecar, program, sha256, fitness_s, 0.0)
    driven = winner.in_gecar()
    if driven.outcome != Outcome.GOAL:
        ending = Outcome(driven.outcome).name.lower()
        raise expected(path, f"a program that ends here with {ending}", "one that reaches GOAL in gecar")
    return replace(winner, promised_s=round(float(driven.time_s), 6))
