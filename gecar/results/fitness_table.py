"""A fitness table that guards a study's numbers: drives and small searches, what they came to, and what moved since.

With the versions the table names, every figure must come out equal: all arithmetic is IEEE in a fixed order, and all
randomness is gecar's own. With others, a last bit may differ, and what follows it: drives may then move by
`DRIVE_TOLERANCE_PCT`, a search's median over its seeds by `SEARCH_TOLERANCE_PCT`, one of its seeds may gain or lose
GOAL, and a share of drives that arrive (of searches the median) may move by `SHARE_TOLERANCE`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from gecar.errors import expected
from gecar.files import read_toml, write_whole
from gecar.language.program import parse_program
from gecar.results.arrival import share_of, shares
from gecar.results.config import Config, configure
from gecar.results.provenance import versions
from gecar.results.quantile import quantile
from gecar.results.run import load_task
from gecar.results.study_runs import perform
from gecar.world.rollout import simulate

PINNED = ("numba", "numpy", "pymunk", "scipy", "shapely")
DRIVE_TOLERANCE_PCT = 1.0
SEARCH_TOLERANCE_PCT = 15.0
SHARE, SHARE_TOLERANCE = "arrives_share", 0.1
DRIVE_FIGURES = ("outcome", "time_s", "checkpoints", SHARE)
SEARCH_FIGURES = ("fitness_s", SHARE, "simulated")
_SAME_S = 1e-9

Row = Mapping[str, Any]


@dataclass(frozen=True)
class FitnessTable:
    """What is guarded.

    Attributes
    ----------
    versions
        Of the libraries that computed the figures.
    drives
        A program each, and fields of `gecar.results.config.Config`; then outcome, time_s, checkpoints and
        arrives_share (of drives under fresh conditions, 0..1).
    searches
        Seeds each, and fields of `Config`; then fitness_s [s], arrives_share and simulated (programs), a figure for
        each seed.
    """

    versions: Mapping[str, str]
    drives: tuple[Row, ...]
    searches: tuple[Row, ...]


@dataclass(frozen=True)
class Move:
    """A figure that is not what the table says.

    Attributes
    ----------
    row
        What was run.
    figure
        Its name.
    before, now
        In the table (None: not in it yet), and this time.
    matters
        Whether it is more than is allowed.
    """

    row: str
    figure: str
    before: Any
    now: Any
    matters: bool

    @property
    def percent(self) -> float | None:
        """By how much it moved, a list's median; None where that has no meaning."""
        before, now = _typical(self.before), _typical(self.now)
        return None if before is None or now is None or before == 0.0 else 100.0 * (now / before - 1.0)


def read_table(path: Path) -> FitnessTable:
    """Read a fitness table.

    Raises
    ------
    InputError
        If it is missing, not TOML, holds nothing to run, or something in it is no setting; names the row.
    """
    table = read_toml(path, "a fitness table (.toml)")
    unknown = set(table) - {"versions", "drive", "search"}
    drives, searches = table.get("drive", []), table.get("search", [])
    if unknown or not isinstance(drives, list) or not isinstance(searches, list) or not drives + searches:
        raise expected(path, f"{sorted(unknown) or 'nothing to run'}", "[versions], [[drive]] and [[search]]")
    if not isinstance(table.get("versions", {}), dict):
        raise expected(f"{path}, versions", repr(table["versions"])[:40], "a table: library = version")
    for kind, rows, needed in (("drive", drives, "program"), ("search", searches, "seeds")):
        for k, row in enumerate(rows, 1):
            _check_row(row, needed, f"{path}, {kind} {k}")
    return FitnessTable(table.get("versions", {}), tuple(drives), tuple(searches))


def _check_row(row: object, needed: str, where: str) -> None:
    if not isinstance(row, dict) or not row.get(needed):
        raise expected(where, f"no {needed}", f"a row with {needed}")
    if needed == "program" and not isinstance(row[needed], str):
        raise expected(f"{where}, program", repr(row[needed])[:40], "a program's text")
    if needed == "seeds" and not isinstance(row[needed], list):
        raise expected(f"{where}, seeds", repr(row[needed])[:40], "a list of seeds")
    for seed in row[needed] if needed == "seeds" else (1,):
        config_of(row, where, seed)


def config_of(row: Row, where: str = "row", seed: int = 1) -> Config:
    """Return a row's configuration.

    Raises
    ------
    InputError
        If a field of it is no setting, or out of bounds.
    """
    not_settings = {"program", "seeds", *DRIVE_FIGURES, *SEARCH_FIGURES}
    fields = {name: value for name, value in row.items() if name not in not_settings}
    return configure({**fields, "seed": seed, "workers": 1}, where)


def run_again(table: FitnessTable, executor: Executor) -> FitnessTable:
    """Return the table with fresh figures.

    Raises
    ------
    InputError
        If a program, grammar, course or robot is wrong.
    """
    configs = [config_of(row, seed=seed) for row in table.searches for seed in row["seeds"]]
    records = executor.map(perform, configs)
    drives = tuple({**row, **_drive(row)} for row in table.drives)
    searches = tuple({**row, **_searched(row, records)} for row in table.searches)
    here = versions()
    return FitnessTable({name: here[name] for name in PINNED}, drives, searches)


def moves(before: FitnessTable, now: FitnessTable) -> list[Move]:
    """Return the figures that differ, and whether by more than is allowed."""
    exact = not other_versions(before, now)
    rows = [
        *_pairs(before.drives, now.drives, DRIVE_FIGURES),
        *_pairs(before.searches, now.searches, SEARCH_FIGURES),
    ]
    found = [
        Move(row, figure, was, is_, matters=True) for row, figure, was, is_ in rows if not _same(was, is_)
    ]
    return [replace(move, matters=_matters(move, exact)) for move in found]


def other_versions(before: FitnessTable, now: FitnessTable) -> list[str]:
    """Say which libraries are others than the table's; nothing where it names none."""
    if not before.versions:
        return []
    pairs = [(name, before.versions.get(name, "unknown"), now.versions[name]) for name in now.versions]
    return [f"{name} {is_} instead of {was}" for name, was, is_ in pairs if was != is_]


def row_name(row: Row) -> str:
    """Name a row by what is run."""
    config = config_of(row)
    place = f"{config.preset}, " if "program" not in row else ""
    place += f"course {config.course_name}"
    place += f", grammar {Path(config.grammar).stem}" if config.grammar != "paper" else ""
    place += f", robot {Path(config.robot).stem}" if config.robot != "ev3" else ""
    if "program" in row:
        return f"drive, {place}: {' '.join(row['program'].split())}"
    search = config.search
    return f"search {place}, {search.population} x {search.generations}, seeds {', '.join(map(str, row['seeds']))}"


def write_table(path: Path, table: FitnessTable) -> None:
    """Write a fitness table whole or not at all; comments of the old one are replaced by the usual one.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    rows = {"versions": table.versions, "drive": table.drives, "search": table.searches}
    text = tomli_w.dumps({name: found for name, found in rows.items() if found})
    try:
        write_whole(path, f"{_HEAD}\n\n{text}")
    except OSError as error:
        raise expected(path, error.strerror or "an error", "to write it") from None


_HEAD = """\
# What `gecar check` runs again and compares; `gecar check --update` writes the figures anew.
# Add rows of your own, without figures: any field of a run's config.toml, a program (drive) or seeds (search).
# With the versions below all figures must be equal. With others a drive may move by 1 %, a search's median by 15 %,
# one of its seeds may gain or lose GOAL, and a share of drives that arrive (its median) may move by 0.1.
# 10000 s: nobody reached GOAL."""


def _drive(row: Row) -> dict[str, Any]:
    config, program = config_of(row), parse_program(row["program"])
    world = load_task(config).world
    drive = simulate(world, program.opcodes, config.seed)
    return {
        "outcome": drive.outcome.name.lower(),
        "time_s": round(drive.time_s, 6),
        "checkpoints": drive.checkpoints,
        SHARE: shares(world, [program], config.seed)[0],
    }


def _searched(row: Row, records: Iterator[Mapping[str, Any]]) -> dict[str, Any]:
    own = [next(records) for _ in row["seeds"]]
    return {
        "fitness_s": [round(record["fitness_s"], 6) for record in own],
        SHARE: [share_of(record) for record in own],
        "simulated": [record["distinct_evaluations"] for record in own],
    }


def _pairs(
    before: Sequence[Row], now: Sequence[Row], figures: Sequence[str]
) -> Iterator[tuple[str, str, Any, Any]]:
    for was, is_ in zip(before, now, strict=True):
        for figure in figures:
            yield row_name(is_), figure, was.get(figure), is_[figure]


def _same(was: Any, now: Any) -> bool:
    if was is None or isinstance(now, str) or isinstance(was, str):
        return bool(was == now)
    one, other = np.atleast_1d(was), np.atleast_1d(now)
    return one.shape == other.shape and bool(np.all(np.abs(one - other) <= _SAME_S))


def _matters(move: Move, exact: bool) -> bool:
    """Whether a figure moved by more than is allowed: at all with the same versions, else by more than they excuse."""
    if move.figure == SHARE and move.before is None:
        return False  # tables written before shares were measured lack them
    if exact or move.before is None or isinstance(move.now, str) or move.figure == "checkpoints":
        return True
    if move.figure == "time_s":
        return abs(move.percent or 0.0) > DRIVE_TOLERANCE_PCT
    if move.figure == SHARE:
        return abs(np.median(move.now) - np.median(move.before)) > SHARE_TOLERANCE
    if move.figure == "simulated":
        return False  # how many programs differed says nothing of how good they are
    lost = abs(sum(s < 1e4 for s in move.before) - sum(s < 1e4 for s in move.now))
    return lost > 1 or (lost == 0 and abs(move.percent or 0.0) > SEARCH_TOLERANCE_PCT)


def _typical(value: Any) -> float | None:
    if isinstance(value, list) and value:
        return float(quantile(value, 0.5))
    return float(value) if isinstance(value, int | float) else None
