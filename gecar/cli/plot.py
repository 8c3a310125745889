"""``gecar plot``: a run's pictures again, or runs beside each other."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.voice import JsonOption, Voice

RunsArgument = Annotated[
    list[Path], typer.Argument(metavar="RUN", help="Folders that gecar evolve made.", show_default=False)
]


def plot(
    runs: RunsArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FOLDER", help="Where the pictures go.", show_default="the run, or here"
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw a run's pictures again, or several runs beside each other.

    Runs that differ in their seed only are drawn together, as median and middle half.

    [bold]Examples[/]

      gecar plot runs/evolve-001
      gecar plot runs/paper-*  --out figures
    """
    from gecar.cli.pictures import compare, draw_run

    voice = Voice(as_json)
    if len(runs) == 1:
        drawn = draw_run(runs[0], out)
        voice.answer({"pictures": [str(path) for path in drawn]})
    else:
        table, drawn = compare(voice, runs, out or Path())
        voice.answer({"groups": table, "pictures": [str(path) for path in drawn]})
    for path in drawn:
        voice.say(f"Picture: {path}")
