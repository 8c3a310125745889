"""Studies that benchmarks share: runs kept in a folder, gone on with where they were stopped, and tables of them."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from gecar.parallel.executors import usable_cores
from gecar.parallel.run_parallel import Workplace
from gecar.results.cells import Cell, cells_of
from gecar.results.config import configure
from gecar.results.study import Planned, StudyFolder
from gecar.results.study_runs import perform_all


def add_seeds(parser: ArgumentParser, seeds: int, first: int = 1) -> None:
    """Let a study be asked for its seeds, e.g. for fresh ones."""
    parser.add_argument("--seeds", type=int, default=seeds, help="runs of each kind (%(default)s)")
    parser.add_argument("--first-seed", type=int, default=first, help="(%(default)s)")


def seeds_of(asked: Namespace) -> range:
    """Return the seeds asked for."""
    return range(asked.first_seed, asked.first_seed + asked.seeds)


def planned(
    courses: Sequence[str], chosen: Mapping[str, Mapping[str, Any]], seeds: Iterable[int], grammar: str
) -> list[Planned]:
    """Return all runs, seed after seed."""
    return [
        Planned(course, name, configure({**fields, "course": course, "grammar": grammar, "seed": seed}))
        for seed in seeds
        for course in courses
        for name, fields in chosen.items()
    ]


def performed(runs: Sequence[Planned], out: Path) -> list[Cell]:
    """Perform what is not kept in the folder yet; return the cells."""
    folder = StudyFolder(out)
    folder.runs.mkdir(parents=True, exist_ok=True)
    left = [run for run in runs if folder.load(run) is None]
    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("runs", total=len(runs), completed=len(runs) - len(left))
        place = Workplace.of("process", usable_cores())
        perform_all(left, folder, place, lambda _: bar.advance(task))
    return cells_of(runs, [folder.load(run) for run in runs])
