"""``gecar report``: a study's tables and figures for a paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.output import JsonOption, Output


def report(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="Folder of a study, made by gecar table.",
                                          show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="Output folder.", show_default="STUDY/report"),
    ] = None,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Write a study's tables and figures for a paper, with their provenance.

    Tables are LaTeX (booktabs) and CSV: settings, results with intervals, and comparisons between cells with effect
    sizes and p-values corrected by Holm, paired where runs share seeds. Figures are PDF and PNG. report.tex holds all
    of them with captions. provenance.json has versions, commit, seeds, hashes and the command that runs the study
    again. The same study gives the same files on any machine.

    [bold]Examples[/]

      gecar table --seeds 20 --out runs/table-20
      gecar report runs/table-20
      gecar report runs/table-20 --out paper && cd paper && pdflatex report
    """
    from gecar.cli.actions.report import write_report

    output = Output(as_json)
    written = write_report(output, study, out or study / "report")
    output.print_json({"folder": str(written[0].parent), "files": [path.name for path in written]})
