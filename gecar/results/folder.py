"""A run's folder and its files, each written whole or not at all."""

from __future__ import annotations

import csv
import json
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.calling import command
from gecar.errors import InputError, expected
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.history import Generation
from gecar.evolution.scores import UNSOLVED
from gecar.evolution.state import State
from gecar.files import json_lines, read_text, write_whole
from gecar.language.program import Program
from gecar.results.checkpoint import pack, unpack

REQUIRED = ("generation", "best", "mean", "valid", "distinct", "evaluations", "wall_s")
"""Columns every history.csv has; see `gecar.evolution.history.Generation`."""

UNSEEN_FILE, FRONT_FILE, FRONT_FOLDER = "unseen.csv", "front.csv", "front"
FILES = ("config.toml", "history.csv", "best.txt", "result.json", "checkpoint", UNSEEN_FILE, FRONT_FILE)


def check_new(path: Path) -> None:
    """Check that a folder for a new run is not there yet.

    Raises
    ------
    InputError
        If it is.
    """
    if path.exists() or path.is_symlink():
        raise expected("--out", f"{path}, which exists", "a new folder, or --resume to continue in it")


@dataclass(frozen=True)
class RunFolder:
    """A run's folder."""

    path: Path

    @classmethod
    def create(cls, path: Path, config: str) -> RunFolder:
        """Make a folder for a new run.

        Raises
        ------
        InputError
            If it exists, or cannot be made.
        """
        check_new(path)
        temporary = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
            temporary.chmod(0o755)
            write_whole(temporary / "config.toml", config)
            temporary.rename(path)  # whoever sees the folder sees it with its configuration
        except OSError as error:
            if temporary is not None:
                shutil.rmtree(temporary, ignore_errors=True)
            raise expected(
                "--out", f"{path}: {error.strerror}", "a folder that can be made and written"
            ) from None
        return cls(path)

    def sweep(self) -> None:
        """Remove what a killed process left of files it was just writing."""
        for name in FILES:
            for left in self.path.glob(f".{name}.*"):
                left.unlink(missing_ok=True)

    def write(self, name: str, content: str | bytes, durable: bool = True) -> None:
        """Write one file.

        Parameters
        ----------
        name
            In the folder.
        content
            All of it.
        durable
            Whether to wait until it would survive a power cut; it survives a killed process anyway.

        Raises
        ------
        InputError
            If it cannot be written; what was written before stays.
        """
        try:
            write_whole(self.path / name, content, durable)
        except OSError as error:
            wanted = f"to write it; all before is kept: {command()} evolve --resume --out {self.path}"
            raise expected(self.path / name, error.strerror or "an error", wanted) from None

    def save(self, state: State, configuration: str) -> None:
        """Write the checkpoint."""
        self.write("checkpoint", pack(state, configuration), durable=False)

    def load(self, configuration: str) -> State | None:
        """Read the checkpoint; None if the run was stopped before its first one.

        Raises
        ------
        InputError
            If it is damaged or from another configuration.
        """
        place = self.path / "checkpoint"
        try:
            raw = place.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise expected(place, error.strerror or "an unreadable file", "a gecar checkpoint") from None
        return unpack(raw, configuration, place)

    def write_reports(self, evolution: Evolution[Program], durable: bool = True) -> None:
        """Write history.csv and best.txt, if there is a generation."""
        if evolution.history:
            self.write("history.csv", history_csv(evolution.history), durable)
            program = evolution.best.program
            self.write("best.txt", f"{program}\n" if program else "", durable)

    def write_result(self, evolution: Evolution[Program], more: Mapping[str, Any]) -> dict[str, Any]:
        """Write result.json and return what it says.

        Parameters
        ----------
        evolution
            Finished.
        more
            Fields that are known outside the evolution.
        """
        result = {**outcome_of(evolution), **more}
        self.write("result.json", json_lines(result))
        return result


def outcome_of(evolution: Evolution[Program]) -> dict[str, Any]:
    """Return what a finished evolution came to, as result.json says it."""
    best, last = evolution.best, evolution.history[-1]
    fitness_s = float(best.score["fitness_s"][0])
    return {
        "fitness_s": fitness_s,
        "solved": fitness_s < UNSOLVED,
        "program": str(best.program or ""),
        "genome": best.genome.tolist(),
        "found_in_generation": best.generation,
        "generations": evolution.generation,
        "evaluations": last.evaluations,
        "distinct_evaluations": last.simulated,
        "simulated_steps": last.steps,
        "wall_s": round(last.wall_s, 3),
        "seed": evolution.seed,
    }


def history_csv(history: list[Generation]) -> str:
    """Write a history as CSV: numbers in full, so that they read back equal."""
    rows = (",".join(map(repr, record)) for record in history)
    return "\n".join([",".join(Generation._fields), *rows]) + "\n"


def read_history(folder: Path) -> dict[str, npt.NDArray[np.float64]]:
    """Read a run's history.csv.

    Returns
    -------
    dict
        Columns by name, each (generations,).

    Raises
    ------
    InputError
        If it is missing, has no row, lacks a column, or holds something that is no number; names the line.
    """
    path = folder / "history.csv"
    try:
        rows = list(csv.reader(read_text(path, "a run's history").splitlines()))
    except csv.Error as error:  # a quote that does not end takes in more than a field may hold
        raise expected(path, f"no table ({error})", "a run's history") from None
    names = rows[0] if rows else []
    missing = [name for name in REQUIRED if name not in names]
    if missing or len(rows) < 2:
        raise expected(
            path, f"no {missing[0] if missing else 'generation'}", f"columns {', '.join(REQUIRED)}, and rows"
        )
    values = [_numbers(row, len(names), f"{path}, line {k}") for k, row in enumerate(rows[1:], 2)]
    return dict(zip(names, np.array(values).T.copy(), strict=True))


def _numbers(row: list[str], n: int, where: str) -> list[float]:
    try:
        numbers = [float(text) for text in row]
    except ValueError as error:
        raise InputError(f"{where}: found {error}, expected numbers") from None
    if len(numbers) != n:
        raise expected(where, f"{len(numbers)} values", f"{n}")
    return numbers


def read_result(folder: Path) -> dict[str, Any]:
    """Read a run's result.json.

    Raises
    ------
    InputError
        If it is missing or no result.
    """
    path = folder / "result.json"
    try:
        result = json.loads(read_text(path, "a run's result"))
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not JSON: {error}") from None
    if not isinstance(result, dict) or "fitness_s" not in result:
        raise expected(path, "no fitness_s", "a run's result")
    return result
