"""A study: two settings that vary, and seeds; every run that is finished is kept as a plain file.

A run's file is named by its place in the grid and by a hash of all its result depends on. So a study that was stopped,
however suddenly, loses the runs under way and no other, and a grid that grows takes over what is there.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from gecar.errors import InputError, expected
from gecar.files import json_lines, json_text, read_text, write_whole
from gecar.language.grammar import load_grammar
from gecar.results.config import NOT_PART_OF_THE_RESULT, Config, configure, identify, merged
from gecar.results.provenance import fingerprints, versions
from gecar.search.settings import TABLE_4_CROSSOVER_RATES, TABLE_4_MUTATION_RATES, Settings
from gecar.world.course.course import load_courses
from gecar.world.robot import load_robot

MAX_RUNS = 100_000
_VARY_NOT = {"seed", "search", *NOT_PART_OF_THE_RESULT} - {"preset"}
_MUST_AGREE = ("gecar", "numba", "numpy", "pymunk")


@dataclass(frozen=True)
class Axis:
    """A setting, and the values it takes in a study."""

    name: str
    values: tuple[Any, ...]

    def change(self, value: Any) -> dict[str, Any]:
        """Return the setting at one value, for `gecar.results.config.merged`."""
        return {"search": {self.name: value}} if self.name in Settings.model_fields else {self.name: value}

    def check(self) -> None:
        """Check that there is such a setting, and a value, each once.

        Raises
        ------
        InputError
            If not.
        """
        known = [*Settings.model_fields, *(name for name in Config.model_fields if name not in _VARY_NOT)]
        if self.name not in known:
            raise expected("grid", f"'{self.name}'", f"a setting: one of {', '.join(known)}")
        if not self.values or len(set(map(str, self.values))) < len(self.values):
            raise expected(f"grid, {self.name}", f"{list(self.values)}", "at least one value, and each once")


TABLE_5 = (Axis("crossover_rate", TABLE_4_CROSSOVER_RATES), Axis("mutation_rate", TABLE_4_MUTATION_RATES))


@dataclass(frozen=True)
class Planned:
    """One run of a study: where in the grid it stands, and its configuration."""

    row: Any
    column: Any
    config: Config

    @property
    def configuration(self) -> str:
        """Hash of all that the result depends on."""
        return identify(self.config, self.fingerprints)

    @property
    def fingerprints(self) -> dict[str, str]:
        """Hashes of its grammar, course and robot."""
        return _fingerprints(self.config.grammar, self.config.course, self.config.robot)

    @property
    def file(self) -> str:
        """Name of its file."""
        place = f"{_slug(self.row)}_{_slug(self.column)}_seed{self.config.seed}"
        return f"{place}_{self.configuration[:8]}.json"


@dataclass(frozen=True)
class Study:
    """What is varied, and what stays.

    Attributes
    ----------
    base, changes
        A configuration's table, and what is laid over it (`gecar.results.config.merged`).
    rows, columns
        What varies.
    seeds
        Each combination is run once with each.
    """

    base: Mapping[str, Any]
    changes: Mapping[str, Any]
    rows: Axis = TABLE_5[0]
    columns: Axis = TABLE_5[1]
    seeds: tuple[int, ...] = (1, 2, 3, 4, 5)

    @property
    def axes(self) -> tuple[Axis, Axis]:
        """What varies over the rows, and over the columns."""
        return self.rows, self.columns

    def config(self, row: Any, column: Any, seed: int) -> Config:
        """Return the configuration of one run.

        Raises
        ------
        InputError
            If a setting is out of bounds.
        """
        table = {**self.changes, "seed": seed}
        for axis, value in ((self.rows, row), (self.columns, column)):
            change = axis.change(value)
            search = {**table.get("search", {}), **change.pop("search", {})}
            table = {**table, **change, "search": search}
        return configure(merged(self.base, table), "grid")

    def plan(self) -> list[Planned]:
        """Return all runs, seed after seed, so that a study that is stopped has seen every cell about as often.

        Raises
        ------
        InputError
            If an axis is wrong, there is no seed, one stands twice, or there are too many runs.
        """
        self.rows.check()
        self.columns.check()
        if self.rows.name == self.columns.name:
            raise expected("grid", f"{self.rows.name} twice", "two different settings")
        if not self.seeds or len(set(self.seeds)) < len(self.seeds):
            raise expected("seeds", list(self.seeds), "at least one, and each once")
        n = len(self.seeds) * len(self.rows.values) * len(self.columns.values)
        if n > MAX_RUNS:
            raise expected("grid", f"{n:,} runs", f"at most {MAX_RUNS:,}")
        return [
            Planned(row, column, self.config(row, column, seed))
            for seed in self.seeds
            for row in self.rows.values
            for column in self.columns.values
        ]

    def as_json(self) -> str:
        """Write the study, for `read_study`."""
        table = {
            "rows": {self.rows.name: self.rows.values},
            "columns": {self.columns.name: self.columns.values},
            "seeds": self.seeds,
            "base": self.base,
            "changes": self.changes,
            "provenance": versions(),
        }
        return json_text(table)


def read_study(folder: Path) -> Study:
    """Read the study a folder was begun with.

    Raises
    ------
    InputError
        If there is none, or it is none.
    """
    path = folder / "study.json"
    table = _read_json(path, "a study's folder")
    try:
        rows, columns = (_axis(table[side]) for side in ("rows", "columns"))
        return Study(
            dict(table["base"]), dict(table["changes"]), rows, columns, tuple(map(int, table["seeds"]))
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise expected(path, f"no study ({error})", "what gecar table wrote") from None


def _axis(table: Mapping[str, Any]) -> Axis:
    ((name, values),) = table.items()
    return Axis(name, tuple(values))


class StudyFolder:
    """A study's folder: ``study.json``, and a file for each finished run in ``runs/``."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.runs = path / "runs"

    def begin(self, study: Study, again: bool) -> None:
        """Make the folder, or go on in it.

        Raises
        ------
        InputError
            If it exists and ``again`` is not asked for, or cannot be made.
        """
        if not again and (self.path.exists() or self.path.is_symlink()):
            raise expected(
                "--out", f"{self.path}, which exists", "a new folder, or --resume to continue in it"
            )
        try:
            self.runs.mkdir(parents=True, exist_ok=True)
            for left in [*self.path.glob(".*.json.*"), *self.runs.glob(".*.json.*")]:
                left.unlink(missing_ok=True)  # what a killed process was just writing
            write_whole(self.path / "study.json", study.as_json())
        except OSError as error:
            found = f"{self.path}: {error.strerror}"
            raise expected("--out", found, "a folder that can be made and written") from None

    def keep(self, run: Planned, record: Mapping[str, Any]) -> None:
        """Write a finished run's file.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        place = self.runs / run.file
        try:
            write_whole(place, json_lines(record))
        except OSError as error:
            raise expected(
                place, error.strerror or "an error", "to write it; runs before it are kept"
            ) from None

    def load(self, run: Planned) -> dict[str, Any] | None:
        """Read a finished run's file; None if the run has not been finished.

        Raises
        ------
        InputError
            If the file is damaged.
        """
        place = self.runs / run.file
        if not place.exists():
            return None
        record = _read_json(place, "a finished run")
        wanted = ("fitness_s", "solved", "history", "evaluations", "distinct_evaluations", "simulated_steps")
        missing = [name for name in wanted if name not in record]
        if missing or record.get("configuration") != run.configuration:
            raise expected(
                place,
                f"no {', '.join(missing) or 'run of this study'}",
                "a run; delete it to run it again",
            )
        return record


def other_versions(records: Sequence[Mapping[str, Any]]) -> str:
    """Say which version of what computed some of the runs and is not the one here; empty if there is none."""
    here = versions()
    for record in records:
        was = record.get("versions", {})
        for name in _MUST_AGREE:
            if was.get(name) != here[name]:
                return f"some runs were made with {name} {was.get(name)}, and {here[name]} is here"
    return ""


def _read_json(path: Path, what: str) -> dict[str, Any]:
    try:
        table = json.loads(read_text(path, what))
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not JSON: {error}") from None
    if not isinstance(table, dict):
        raise expected(path, "no JSON object", what)
    return table


def _slug(value: Any) -> str:
    name = Path(value).stem if isinstance(value, str) else str(value)
    return re.sub(r"[^\w.+-]", "-", name)[:40]


@lru_cache(maxsize=256)
def _fingerprints(grammar: str, course: str, robot: str) -> dict[str, str]:
    return fingerprints(load_grammar(grammar), load_courses(course), load_robot(robot))
