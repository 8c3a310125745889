"""``gecar check``: a table of fitness figures against a fresh run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.output import JsonOption, Output


def check(
    table: Annotated[
        Path | None,
        typer.Argument(metavar="TABLE.toml", help="The fitness table; --update fills in rows without figures.",
                       show_default="benchmarks/fitness_table.toml, here or beside gecar"),
    ] = None,
    update: Annotated[bool, typer.Option("--update", help="Write the new figures to the table.")] = False,
    pins: Annotated[
        bool, typer.Option("--pins", help="Only print the library versions of the table, for pip install -r.")
    ] = False,
    workers: Annotated[
        int | None, typer.Option("--workers", help="Number of processes; it does not change the figures.",
                                 show_default="cores"),
    ] = None,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Run a table of fitness figures again: prints what moved and by how much, and exits 1 if anything did.

    With the versions the table names, figures must be equal, on any machine. With others, drives may move by 1 %, a
    search's median over its seeds by 15 %, and one of its seeds may gain or lose GOAL.

    [bold]Examples[/]

      gecar check
      gecar check --update
      gecar check my_study.toml                         a table of your own; gecar's own shows the form
      gecar check --pins > pins.txt && pip install -r pins.txt
    """
    from gecar.parallel.executors import prepare_workers

    if workers != 1 and not pins:
        prepare_workers()
    from gecar.cli.actions.check import find_table, guard, print_pins

    place = table or find_table()
    if pins:
        print_pins(place)
    else:
        guard(Output(as_json), place, update, workers)
