"""``gecar check``: a table of fitness figures against a fresh run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.output import JsonOption, Output


def check(
    table: Annotated[
        Path | None,
        typer.Argument(metavar="TABLE.toml", help="Fitness table; --update fills in rows without figures.",
                       show_default="benchmarks/fitness_table.toml, here or in gecar's repository"),
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
    """Rerun a table of fitness figures, report changes, and exit with 1 if there are any.

    With the library versions named in the table, figures must be equal on any machine. With other versions, times of
    drives may change by 1 %, the median of a search by 15 %, and one of its seeds may gain or lose GOAL.

    [bold]Examples[/]

      gecar check
      gecar check --update
      gecar check my_study.toml                         your own table, in the form of gecar's
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
