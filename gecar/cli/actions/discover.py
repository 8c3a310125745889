"""What ``gecar discover`` makes of a case; and of several, each whole in one worker, here or on a cluster."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import typer

from gecar.cli.output import Output
from gecar.cli.progress import Steps
from gecar.errors import InputError
from gecar.files import json_ready, json_text, write_whole
from gecar.language.grammar import Grammar
from gecar.language.program import Program
from gecar.parallel.run_parallel import Workplace, perform_each
from gecar.reality.compare.side_by_side import Beside
from gecar.reality.discovery import discover
from gecar.reality.materiality import Material
from gecar.reality.recordings.recording import Case
from gecar.reality.verdict import Verdict
from gecar.report.verdict import words
from gecar.world.effects import Effect
from gecar.world.robot import Robot, write_robot

USUAL = 0.6
"""Processor time per second of recording within which nine of ten cases are done [s] (docs/discover.md)."""


@dataclass(frozen=True)
class Task:
    """A case and how it is to be looked at; it travels to whoever does it.

    Attributes
    ----------
    case
        The recordings.
    holdout, robot, seed, workers, with_formula, catalogue, material, program, language, invents, about
        As `gecar.reality.discovery.discover`.
    pictures
        Whether to draw.
    """

    case: Case
    holdout: Sequence[str]
    robot: Robot | None
    seed: int
    workers: int | None
    with_formula: bool
    pictures: bool
    catalogue: Sequence[Effect]
    material: Material
    program: Program | None
    language: Grammar | None
    invents: bool
    about: str


class Told(NamedTuple):
    """What a verdict comes to: its sentences, its JSON object, and its files if they were made elsewhere."""

    sentences: list[str]
    table: dict[str, Any]
    files: dict[str, bytes]


class Shown(NamedTuple):
    """What report.html shows: recordings beside their simulations, and the HTML that stands below them."""

    recordings: Sequence[Beside]
    article: str


def keep_still(line: str) -> None:
    """Say nothing."""


def conclude(task: Task, out: Path, tell: Callable[[str], None] = keep_still) -> Told:
    """Discover what a case's simulation lacks, and write the verdict's files into a folder, made at the end.

    Raises
    ------
    InputError
        As `gecar.reality.discovery.discover`.
    """
    verdict = discover(
        task.case, task.holdout, task.robot, task.seed, task.workers, tell, task.with_formula,
        catalogue=task.catalogue, material=task.material, program=task.program, language=task.language,
        invents=task.invents, about=task.about,
    )  # fmt: skip
    table = write(verdict, out)
    if task.pictures:
        tell("pictures")
        draw(verdict, out)
    return Told(words(verdict), table, {})


def write(verdict: Verdict, out: Path) -> dict[str, Any]:
    """Write verdict.json and robot.toml into a folder; return what the first says."""
    out.mkdir(parents=True, exist_ok=True)
    table: dict[str, Any] = json_ready(verdict.as_json())
    write_whole(out / "verdict.json", json_text(table))
    write_robot(verdict.robot, out / "robot.toml")
    return table


def conclude_away(task: Task, tell: Callable[[str], None] = keep_still) -> Told:
    """Do the same where the sender's folders need not be, and hand the files back."""
    with tempfile.TemporaryDirectory(prefix="verdict-") as folder:
        told = conclude(task, Path(folder), lambda step: tell(f"{task.case.name}: {step}"))
        return told._replace(files={path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())})


def conclude_all(output: Output, tasks: Mapping[Path, Task], kind: str, workers: int, scheduler: str) -> None:
    """Conclude cases side by side; write each when it ends, print its result in one line, and name those that failed.

    Parameters
    ----------
    output
        Where words go.
    tasks
        By the folder each goes to.
    kind, workers, scheduler
        As `gecar.parallel.executors.open_executor`.

    Raises
    ------
    InputError
        If there is no such executor, or Dask does not answer.
    typer.Exit
        If a case failed: code 2 for bad input alone, 1 if a fault of gecar's own is among it.
    """
    answers: dict[Path, dict[str, Any]] = {}
    failed: dict[Path, Exception] = {}

    def keep(out: Path, future: Future[Told]) -> None:
        error = future.exception()
        if isinstance(error, BrokenExecutor):
            raise error
        if isinstance(error, Exception):
            failed[out] = error
        else:
            answers[out] = _written(output, out, future.result(), brief=len(tasks) > 1)
        steps.ended(len(answers) + len(failed), len(tasks))

    place = Workplace.of(kind, workers, scheduler)
    steps = Steps(teller(output))
    try:
        with steps:
            work = partial(conclude_away, tell=steps) if kind == "serial" else conclude_away
            perform_each(place, work, list(tasks.items()), keep)
    except InputError as error:  # workers that die again and again, a scheduler that went away
        failed |= {out: error for out in tasks if out not in answers and out not in failed}
    for out, why in failed.items():
        words = f"{'' if isinstance(why, InputError) else f'internal error: {type(why).__name__}: '}{why}"
        print(f"error: {tasks[out].case.name}: {words}", file=sys.stderr)
        answers[out] = {"error": words}
    named = {out.name: answers[out] for out in tasks}
    output.print_json(named if len(tasks) > 1 else next(iter(answers.values())))
    if failed:
        raise typer.Exit(2 if all(isinstance(why, InputError) for why in failed.values()) else 1)


def usual_s(case: Case) -> float:
    """Return the processor time within which nine of ten cases of this length are done [s]."""
    return USUAL * sum(float(run.t_s[-1] - run.t_s[0]) for run in case.recordings)


def teller(output: Output) -> Callable[[str], None]:
    """Return what says lines of progress."""
    return lambda line: output.print(f"  {line}", style="dim")


def say(output: Output, told: Told, out: Path) -> None:
    """Say a verdict, and where it is."""
    for line in told.sentences:
        output.print(line)
    output.print(f"Written to {out}.")


def _written(output: Output, out: Path, told: Told, *, brief: bool) -> dict[str, Any]:
    """Write files that were made elsewhere and print the result, in one line if brief; return the JSON object."""
    out.mkdir(parents=True, exist_ok=True)
    for name, content in told.files.items():
        write_whole(out / name, content)
    if brief:
        output.print(f"{out.name}: {told.sentences[0]} Written to {out}.")
    else:
        say(output, told, out)
    return told.table


def draw(verdict: Verdict, out: Path) -> Shown:
    """Write the pictures, the data behind them, and report.html; return what was replayed for them."""
    from gecar.plots.reality.replay_page import replay_page
    from gecar.plots.reality.verdict import verdict_figures, verdict_tables
    from gecar.plots.style import save
    from gecar.reality.compare.choices import tell
    from gecar.report.verdict_page import article, first_screen, picture_html, picture_of

    told = tell(verdict)
    paths = {
        name: save(figure, out / f"{name}.png") for name, figure in verdict_figures(verdict, told).items()
    }
    tables = verdict_tables(verdict, told)
    for name, table in tables.items():
        write_whole(out / f"{name}.csv", table)
    words = (
        "How dense the mismatch is in each channel and motion, times the average; the data are below as CSV."
    )
    picture = picture_html("In what motion it shows", paths["where"].read_bytes(), words)
    inside = {name: table for name, table in tables.items() if name in ("gap", "where")}
    laws = [picture_of(name, paths[name].read_bytes()) for name in ("law", "law_map") if name in paths]
    below = article(verdict, told.choices, inside, picture, "".join(laws))
    write_whole(
        out / "report.html", replay_page(verdict, told.shown, first_screen(verdict, told.shown), below)
    )
    return Shown(told.shown, below)
