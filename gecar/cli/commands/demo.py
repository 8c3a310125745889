"""``gecar demo``: what gecar does, from the first program to the gap closed, in a minute or two."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.options import QuietOption
from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

MOST_FOLDERS = 1_000


def demo(
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="A new folder for all that is made.",
                     show_default="runs/demo, runs/demo-2, ..."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Random seed of both evolutions.")] = 1,
    generations: Annotated[int, typer.Option("--generations", help="Generations of each evolution.")] = 254,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Show all of gecar on one page: evolve, drive, see the gap, discover what was left out, evolve again.

    The real robot is a worn one, simulated as well: all it takes is this computer, and under three minutes.

    [bold]Examples[/]

      gecar demo
      gecar demo --seed 2 --out demo
    """
    from gecar.parallel.executors import prepare_workers

    prepare_workers()  # they load beside this process
    from gecar.cli.actions.demo import Demo

    Demo(Output(as_json), out or _new_folder(), seed, generations, quiet).perform()


def _new_folder() -> Path:
    """Return the first of runs/demo, runs/demo-2, ... that is not there."""
    names = ("demo", *(f"demo-{k}" for k in range(2, MOST_FOLDERS)))
    free = next((Path("runs") / name for name in names if not (Path("runs") / name).exists()), None)
    if free is None:
        raise expected("--out", f"{MOST_FOLDERS} demonstrations in runs", "a new folder")
    return free
