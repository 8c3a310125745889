"""``gecar plot``: a run's pictures, a film of its evolution, or a comparison of runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

RunsArgument = Annotated[
    list[Path], typer.Argument(metavar="RUN", help="Run folders, made by gecar evolve.", show_default=False)
]


def _file(option: str, words: str) -> Any:
    return typer.Option(option, metavar="FILE", help=words, show_default=False)


def plot(
    runs: RunsArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FOLDER",
            help="Output folder for all pictures.",
            show_default="the run, or here",
        ),
    ] = None,
    tree: Annotated[
        Path | None,
        _file("--tree", "Draw only the named pictures: the best program's derivation; .png, .pdf or .svg."),
    ] = None,
    genealogy: Annotated[Path | None, _file("--genealogy", "... its ancestors; .png, .pdf or .svg.")] = None,
    locality: Annotated[
        Path | None,
        _file("--locality", "... what a changed codon changes, and how many genomes share a program."),
    ] = None,
    evolution: Annotated[
        Path | None, _file("--evolution", "... a film of the best program by generation; .gif or .mp4.")
    ] = None,
    page: Annotated[
        bool,
        typer.Option("--html", help="Also write drive.html, a page that plays the drive, for a classroom."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Draw a run's pictures, or compare several runs.

    One run: convergence, populations, locality and redundancy of the genomes, and the best program's drive, derivation
    and genealogy. Runs that differ only in their seed
    are drawn together: median and interquartile range.

    [bold]Examples[/]

      gecar plot runs/evolve-001
      gecar plot runs/evolve-001 --html
      gecar plot runs/evolve-001 --evolution evolution.gif
      gecar plot runs/paper-*  --out figures
    """
    output = Output(as_json)
    named = {"--tree": tree, "--genealogy": genealogy, "--locality": locality, "--evolution": evolution}
    if len(runs) > 1:
        _compare(output, runs, out or Path(), {**named, "--html": page})
    else:
        placed = {option: file and (out or Path()) / file for option, file in named.items()}
        _study(output, runs[0], out or runs[0], placed, page)


def _compare(output: Output, runs: list[Path], out: Path, of_one: dict[str, Any]) -> None:
    """Compare runs in one picture."""
    from gecar.cli.actions.run_pictures import compare

    for option, given in of_one.items():
        if given:
            raise expected(option, f"{len(runs)} runs", "one")
    table, drawn = compare(output, runs, out)
    output.print_json({"groups": table, "pictures": [str(path) for path in drawn]})
    for path in drawn:
        output.print(f"Picture: {path}")


def _study(output: Output, run: Path, out: Path, named: dict[str, Path | None], page: bool) -> None:
    """Draw what is named of a run, or everything."""
    from gecar.cli.actions.run_pictures import (
        draw_genealogy,
        draw_locality,
        draw_tree,
        film_run,
        study_run,
        write_drive_page,
    )

    tree, genealogy, locality, evolution = named.values()
    _check_endings((tree, genealogy, locality), evolution)
    made: dict[str, list[Path]] = {"pictures": [], "films": [], "pages": []}
    if not any(named.values()):
        made["pictures"] += study_run(run, out)
    made["pages"] += [write_drive_page(run, out / "drive.html")] if page else []
    made["pictures"] += [draw_tree(run, tree)] if tree else []
    made["pictures"] += [draw_genealogy(run, genealogy)] if genealogy else []
    made["pictures"] += [draw_locality(run, locality)] if locality else []
    made["films"] += [film_run(run, evolution)] if evolution else []
    output.print_json({kind: [str(path) for path in paths] for kind, paths in made.items()})
    for kind, paths in made.items():
        for path in paths:
            output.print(f"{kind.capitalize().removesuffix('s')}: {path}")


def _check_endings(pictures: Sequence[Path | None], evolution: Path | None) -> None:
    """Refuse what cannot be drawn before anything is."""
    from gecar.plots.drives.animation import check_film
    from gecar.plots.style import picture_kind

    for picture in filter(None, pictures):
        picture_kind(picture)
        picture.parent.mkdir(parents=True, exist_ok=True)
    if evolution:
        check_film(evolution, option="--evolution")
        evolution.parent.mkdir(parents=True, exist_ok=True)
