"""A study of ``gecar table``, from what was typed to the table and its pictures."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from gecar.cli.options import settings
from gecar.cli.output import Output
from gecar.compiled import is_cold, mark_warm
from gecar.errors import expected
from gecar.files import json_text, write_whole
from gecar.parallel.executors import check_workers, usable_cores
from gecar.parallel.run_parallel import Workplace
from gecar.plots.runs.study_table import convergences, heat_map
from gecar.plots.style import save
from gecar.report.paper import contrasts_latex, latex
from gecar.report.table import (
    about,
    as_table,
    contrasted,
    contrasts_csv,
    csv_text,
    markdown,
    paper_figures,
    runs_csv,
    setting_words,
    terminal_table,
)
from gecar.results.cells import Cell, cells_of, difference_p
from gecar.results.config import read_config
from gecar.results.run import load_task
from gecar.results.study import Axis, Planned, Study, StudyFolder, other_versions, read_study
from gecar.results.study_runs import perform_all


@dataclass(frozen=True)
class Asked:
    """What was typed; None is what was not."""

    config: Path | None
    changes: dict[str, Any]
    rows: str | None
    columns: str | None
    seeds: int | None
    first_seed: int | None
    out: Path | None
    resume: bool
    executor: str
    workers: int | None
    scheduler: str | None

    def study(self) -> Study:
        """Return the study: new, or what the folder was begun with and options change.

        Raises
        ------
        InputError
            If a file or an option is wrong.
        """
        if self.resume and self.out is None:
            raise expected("--resume", "no --out", "--out with the folder to continue in")
        before = read_study(self.out) if self.resume and self.out else Study({}, {})
        base = read_config(self.config) if self.config else before.base
        search = {**before.changes.get("search", {}), **self.changes["search"]}
        changes = {**before.changes, **self.changes, "search": search}
        first = before.seeds[0] if self.first_seed is None else self.first_seed
        n = len(before.seeds) if self.seeds is None else self.seeds
        rows = axis(self.rows, "--rows") if self.rows else before.rows
        columns = axis(self.columns, "--columns") if self.columns else before.columns
        return Study(base, changes, rows, columns, tuple(range(first, first + n)))

    def place(self) -> Workplace:
        """Return where runs are performed.

        Raises
        ------
        InputError
            If there is no such executor or no worker.
        """
        workers = check_workers(usable_cores() if self.workers is None else self.workers)
        if self.executor not in ("process", "thread", "serial", "dask"):
            raise expected("--executor", repr(self.executor), "process, thread, serial or dask")
        return Workplace.of(self.executor, workers, self.scheduler or "")


def axis(words: str, where: str) -> Axis:
    """Read ``NAME=V1,V2``; values are as in TOML, and words without quotes text.

    Raises
    ------
    InputError
        If there is no ``=``, or nothing after it.
    """
    name, equals, values = words.partition("=")
    if not equals or not name or not values:
        raise expected(where, f"'{words}'", "NAME=VALUE,VALUE,...")
    return Axis(name, tuple(settings([f"value={value.strip()}"])["value"] for value in values.split(",")))


def study(output: Output, asked: Asked, pictures: bool, quiet: bool) -> None:
    """Perform what is left of a study, and tell what came of it; Ctrl-C ends it with all finished runs kept.

    Parameters
    ----------
    output
        Where words go.
    asked
        What was typed.
    pictures, quiet
        Whether to draw; whether to keep still until the end.
    """
    wanted, place = asked.study(), asked.place()
    runs = wanted.plan()
    first = runs[0].config
    out = asked.out or Path("runs") / f"table-{first.course_name}-{first.preset}"
    for config in {
        (c.grammar, c.course, c.robot, c.engine): c for c in (run.config for run in runs)
    }.values():
        load_task(config)  # what is wrong with a file is said before anything is written
    folder = StudyFolder(out)
    folder.begin(wanted, asked.resume)
    began = time.monotonic()
    left = [run for run in runs if folder.load(run) is None]
    if not quiet:
        _announce(output, wanted, len(runs), len(left), place.workers)
    try:
        with _Watch(len(runs), len(runs) - len(left), quiet) as watch:
            perform_all(left, folder, place, watch)
    except KeyboardInterrupt:
        done = sum(folder.load(run) is not None for run in runs)
        words = f"stopped with {done} of {len(runs)} runs kept. Go on with: gecar table --resume --out {out}"
        print(words, file=sys.stderr, flush=True)
        raise typer.Exit(130) from None
    mark_warm()
    _tell(output, wanted, runs, folder, pictures, time.monotonic() - began)


def _announce(output: Output, wanted: Study, total: int, left: int, workers: int) -> None:
    grid = f"{setting_words(wanted.rows.name)} x {setting_words(wanted.columns.name)} x {len(wanted.seeds)} seeds"
    kept = f", {total - left} kept from before" if left < total else ""
    output.print(f"{grid}: {total} runs, {workers} side by side{kept}")
    if is_cold():
        print("Compiling the simulation; this once, it takes about 20 s ...", file=sys.stderr, flush=True)


def _tell(
    output: Output, wanted: Study, runs: Sequence[Planned], folder: StudyFolder, pictures: bool, wall_s: float
) -> None:
    """Write the tables and pictures, and print the table."""
    loaded = [folder.load(run) for run in runs]
    records = [record for record in loaded if record is not None]
    cells, paper = cells_of(runs, loaded), paper_figures(wanted, runs)
    shared = about(wanted, runs[0], cells)
    answer = as_table(wanted, cells, paper)
    write_whole(folder.path / "table.md", markdown(wanted, cells, paper, shared))
    write_whole(folder.path / "table.csv", csv_text(wanted, cells, paper))
    write_whole(folder.path / "runs.csv", runs_csv(wanted, cells))
    write_whole(folder.path / "table.tex", latex(wanted, cells, paper))
    compared = contrasted(wanted, cells)
    if compared:
        write_whole(folder.path / "contrasts.csv", contrasts_csv(wanted, compared))
        write_whole(folder.path / "contrasts.tex", contrasts_latex(wanted, compared))
    write_whole(folder.path / "table.json", json_text(answer))
    drawn = draw(wanted, cells, paper, shared, folder.path) if pictures else []
    warning = other_versions(records)
    if warning:
        print(f"warning: {warning}", file=sys.stderr)
    output.print()
    output.print(terminal_table(wanted, cells, paper))
    p = difference_p(wanted, cells)
    if p is not None:
        output.print(f"\nDo the cells differ at all? Friedman over the seeds: p = {p:.2g}")
    evaluations = sum(record["evaluations"] for record in records)
    busy = sum(record["wall_s"] for record in records)
    output.print(f"{evaluations:,} evaluations; {wall_s:.0f} s now, {busy:.0f} s of one worker in all")
    output.print(
        f"\nTable:    {folder.path / 'table.md'}  (also .csv, .tex, .json, runs.csv, contrasts.csv, .tex)"
    )
    for picture in drawn:
        output.print(f"Picture:  {picture}")
    output.print_json(
        {**answer, "wall_s": round(wall_s, 3), "folder": str(folder.path), "pictures": list(map(str, drawn))}
    )


def draw(wanted: Study, cells: Sequence[Cell], paper: Any, shared: str, folder: Path) -> list[Path]:
    """Draw convergence and heat map into a folder; return their files."""
    names = setting_words(wanted.rows.name), setting_words(wanted.columns.name)
    solved, total = sum(cell.solved for cell in cells), sum(len(cell.records) for cell in cells)
    title = f"{solved} of {total} runs at GOAL"
    curves = convergences(cells, names, paper, f"Best time to GOAL [s]: {title}", shared)
    heat = heat_map(cells, names, paper, f"Mean time to GOAL ± sd [s]: {title}", shared)
    return [save(curves, folder / "convergence.png"), save(heat, folder / "heat_map.png")]


class _Watch:
    """Shows on a terminal how many runs are finished."""

    def __init__(self, total: int, done: int, quiet: bool) -> None:
        console = Console(stderr=True, highlight=False)
        self.live = None
        if console.is_terminal and not quiet:
            columns = (BarColumn(bar_width=24), TextColumn("{task.description}"), TimeRemainingColumn())
            self.live = Progress(*columns, console=console, transient=True)
            self.total, self.done = total, done
            self.task = self.live.add_task(f"{done}/{total} runs", total=total, completed=done)

    def __enter__(self) -> Callable[[Planned], None]:
        if self.live:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.live:
            self.live.stop()

    def __call__(self, run: Planned) -> None:
        """Count a run that is kept."""
        if self.live:
            self.done += 1
            words = f"{self.done}/{self.total} runs, last {run.row}, {run.column}, seed {run.config.seed}"
            self.live.update(self.task, completed=self.done, description=words)
