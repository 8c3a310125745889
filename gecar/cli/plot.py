"""``gecar plot``: a run's pictures again, or runs beside each other."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.voice import JsonOption, Voice
from gecar.errors import expected

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
    page: Annotated[
        bool,
        typer.Option(
            "--html", help="Also write drive.html: the drive as a page that plays it, for a classroom."
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Draw a run's pictures again, or several runs beside each other.

    Runs that differ in their seed only are drawn together, as median and middle half.

    [bold]Examples[/]

      gecar plot runs/evolve-001
      gecar plot runs/evolve-001 --html
      gecar plot runs/paper-*  --out figures
    """
    from gecar.cli.pictures import compare, draw_run, write_drive_page

    voice = Voice(as_json)
    if page and len(runs) > 1:
        raise expected("--html", f"{len(runs)} runs", "one")
    if len(runs) == 1:
        drawn = draw_run(runs[0], out)
        pages = [write_drive_page(runs[0], (out or runs[0]) / "drive.html")] if page else []
        voice.answer({"pictures": [str(path) for path in drawn], "pages": [str(path) for path in pages]})
        for path in pages:
            voice.say(f"Page: {path}")
    else:
        table, drawn = compare(voice, runs, out or Path())
        voice.answer({"groups": table, "pictures": [str(path) for path in drawn]})
    for path in drawn:
        voice.say(f"Picture: {path}")
