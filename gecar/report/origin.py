"""What a study was run with, and where its figures come from: settings, versions, hashes, and the command.

All of it is made from the study's folder: no clock, path or name of the machine that tells it comes in.
"""

from __future__ import annotations

import csv
import io
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import tomli_w

from gecar.report.table import setting_words
from gecar.results.cells import Cell, cells_of
from gecar.results.config import NOT_PART_OF_THE_RESULT, Config, merged
from gecar.results.study import Axis, Planned, Study
from gecar.search.settings import Settings
from gecar.world.course.course import course_parts

_WHERE = NOT_PART_OF_THE_RESULT - {"preset"}
_FILES = ("course", "grammar", "robot")
_ALWAYS = (
    "population", "generations", "codons", "initialisation", "selection", "tournament", "elites", "crossover",
    "crossover_rate", "mutation", "mutation_rate",
)  # fmt: skip
"""Settings that a paper tells whatever they are; others where they are not Table 4's."""


@dataclass(frozen=True)
class Reported:
    """A study, and what came of its runs.

    Attributes
    ----------
    study, runs, records
        Its plan, and each run's record; None of a run that is not finished.
    """

    study: Study
    runs: Sequence[Planned]
    records: Sequence[Mapping[str, Any] | None]

    @cached_property
    def cells(self) -> list[Cell]:
        """What the runs came to."""
        return cells_of(self.runs, self.records)

    @cached_property
    def finished(self) -> list[Mapping[str, Any]]:
        """The records that are there."""
        return [record for record in self.records if record is not None]

    @cached_property
    def versions(self) -> dict[str, list[str]]:
        """What computed the runs, each with all its versions; gecar's commit is ``git``."""
        found: dict[str, set[str]] = {}
        for record in self.finished:
            for name, version in record.get("versions", {}).items():
                found.setdefault(name, set()).add(version or "unknown")
        return {name: sorted(each) for name, each in found.items()}


def portable(study: Study, cells: Sequence[Cell]) -> tuple[Study, list[Cell]]:
    """Return a study and its cells for tables, files named without their folders; as they are where names collide."""
    axes = [Axis(axis.name, tuple(_bare(axis.name, value) for value in axis.values)) for axis in study.axes]
    if any(len(set(map(str, axis.values))) < len(axis.values) for axis in axes):
        return study, list(cells)
    rows, columns = axes
    named = [
        Cell(_bare(rows.name, cell.row), _bare(columns.name, cell.column), cell.records) for cell in cells
    ]
    return Study(study.base, study.changes, rows, columns, study.seeds), named


def parameters(reported: Reported) -> list[tuple[str, str]]:
    """Return the settings of all runs, name and value in words; of one that varies all its values."""
    configs, varied = [run.config for run in reported.runs], [axis.name for axis in reported.study.axes]
    told = [("preset", _values(configs, "preset"))]
    for model, plain in ((Config, Config(workers=1)), (Settings, Settings())):
        for name in model.model_fields:
            values, default = _values(configs, name), _words(name, getattr(plain, name))
            if name in (*_ALWAYS, *_FILES, *varied) or (values != default and name not in _OWN):
                told.append((setting_words(name), values))
    seeds = reported.study.seeds
    told = [(name, words) for name, words in told if words]
    return [*dict(told).items(), ("runs in each cell", str(len(seeds))), ("seeds", _ranged(seeds))]


def parameters_csv(reported: Reported) -> str:
    """Write the settings as CSV."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([("setting", "value"), *parameters(reported)])
    return stream.getvalue()


_OWN = {"search", "seed", *NOT_PART_OF_THE_RESULT}
"""Fields that are told in other ways, or not at all."""


def _values(configs: Sequence[Config], name: str) -> str:
    """Return all values of a setting, in words."""
    values = [getattr(config.search if name in Settings.model_fields else config, name) for config in configs]
    return ", ".join(dict.fromkeys(_words(name, value) for value in values))


def _words(name: str, value: Any) -> str:
    if name == "start_from":
        return f"{len(value)} programs"
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(_bare(name, value))


def _ranged(seeds: Sequence[int]) -> str:
    return f"{seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else str(seeds[0])


def command(study: Study) -> str:
    """Return the command that runs a study again, beside the ``config.toml`` of `shared_config`."""
    words = ["gecar", "table", "config.toml"]
    for option, axis in zip(("--rows", "--columns"), study.axes, strict=True):
        words += [option, f"{axis.name}={','.join(str(_bare(axis.name, value)) for value in axis.values)}"]
    words += ["--first-seed", str(study.seeds[0]), "--seeds", str(len(study.seeds))]
    for name, value in study.changes.get("search", {}).items():
        words += ["--set", f"{name}={_toml(value)}"]
    return shlex.join([*words, "--out", "study"])


def shared_config(study: Study) -> str:
    """Write what all runs share and no option of `command` says, for ``gecar table``; files without their folders."""
    by_options = {"search", "seed", *_WHERE, *(axis.name for axis in study.axes)}
    changes = {name: value for name, value in study.changes.items() if name not in by_options}
    table = merged(study.base, changes)
    kept = {name: _bare(name, value) for name, value in table.items() if name not in {"seed", *_WHERE}}
    return tomli_w.dumps({name: value for name, value in kept.items() if value != {}})


def provenance(reported: Reported) -> dict[str, Any]:
    """Return where the figures come from, for JSON."""
    study = reported.study
    hashes = {
        f"{kind} {_bare(kind, getattr(run.config, kind))}": found
        for run in reported.runs
        for kind, found in run.fingerprints.items()
    }
    return {
        "command": command(study),
        "seeds": list(study.seeds),
        "runs": {"planned": len(reported.runs), "finished": len(reported.finished)},
        "versions": {name: each[0] if len(each) == 1 else each for name, each in reported.versions.items()},
        "fingerprints": hashes,
        "settings": dict(parameters(reported)),
        "configurations": {_short(run): run.configuration for run in reported.runs},
    }


def _short(run: Planned) -> str:
    return run.file.removesuffix(".json")


def _bare(name: str, value: Any) -> Any:
    """Return a setting's value without the folders of files that it names."""
    if name not in _FILES or not isinstance(value, str):
        return value
    return "+".join(Path(part).name for part in course_parts(value))


def _toml(value: Any) -> str:
    """Return a value as TOML writes it."""
    return tomli_w.dumps({"value": value}).removeprefix("value = ").strip()
