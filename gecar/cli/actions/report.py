"""A study's report, from its folder to tables, figures and provenance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gecar.cli.output import Output
from gecar.errors import expected
from gecar.files import json_text, write_whole
from gecar.plots.runs.study_table import convergences, heat_map
from gecar.plots.runs.times import times_figure
from gecar.plots.style import save
from gecar.report.origin import (
    Reported,
    command,
    parameters_csv,
    portable,
    provenance,
    shared_config,
)
from gecar.report.paper import FIGURES, contrasts_latex, document, latex, parameters_latex
from gecar.report.table import (
    about,
    contrasted,
    contrasts_csv,
    csv_text,
    paper_figures,
    runs_csv,
    setting_words,
)
from gecar.results.cells import Cell, difference_p
from gecar.results.study import Study, StudyFolder, read_study


def write_report(output: Output, folder: Path, out: Path) -> list[Path]:
    """Write a study's report; return its files, the document first.

    Parameters
    ----------
    output
        Where words go.
    folder
        The study's.
    out
        Where the report goes; files of an earlier one are replaced.

    Raises
    ------
    InputError
        If the folder holds no study or no finished run, a run's file is damaged, or the report cannot be written.
    """
    reported = read_reported(folder)
    study, cells = portable(reported.study, reported.cells)
    texts = _texts(reported, study, cells)
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            write_whole(out / name, text)
        drawn = _draw(reported, study, cells, out)
    except OSError as error:
        raise expected("--out", f"{out}: {error.strerror}", "a folder that can be written") from None
    left = len(reported.runs) - len(reported.finished)
    if left:
        output.warn([f"{left} of {len(reported.runs)} runs are not finished, and left out"])
    output.print(f"Report:   {out / 'report.tex'}")
    output.print(f"Tables:   {', '.join(name for name in texts if name.endswith('.csv'))} (also .tex)")
    output.print(f"Figures:  {', '.join(path.name for path in drawn if path.suffix == '.pdf')} (also .png)")
    output.print("Provenance: provenance.json, config.toml")
    return [*(out / name for name in texts), *drawn]


def read_reported(folder: Path) -> Reported:
    """Read a study and its runs.

    Raises
    ------
    InputError
        If there is none, a run's file is damaged, or no run is finished.
    """
    study, kept = read_study(folder), StudyFolder(folder)
    runs = study.plan()
    reported = Reported(study, runs, [kept.load(run) for run in runs])
    if not reported.finished:
        raise expected(
            folder,
            "no finished run of its study",
            "at least one; a grammar, course or robot may have changed",
        )
    return reported


def _texts(reported: Reported, study: Study, cells: Sequence[Cell]) -> dict[str, str]:
    """Return the report's files that are text, by name."""
    compared, paper = contrasted(study, cells), paper_figures(study, reported.runs)
    shared = about(study, reported.runs[0], cells)
    difference, again = difference_p(study, cells), command(reported.study)
    contrasts = {
        "contrasts.tex": contrasts_latex(study, compared),
        "contrasts.csv": contrasts_csv(study, compared),
    }
    return {
        "report.tex": document(reported, compared, difference, shared, again),
        "parameters.tex": parameters_latex(reported),
        "parameters.csv": parameters_csv(reported),
        "results.tex": latex(study, cells, paper),
        "results.csv": csv_text(study, cells, paper),
        **(contrasts if compared else {}),
        "runs.csv": runs_csv(study, cells),
        "provenance.json": json_text(provenance(reported)),
        "config.toml": shared_config(reported.study),
    }


def _draw(reported: Reported, study: Study, cells: Sequence[Cell], out: Path) -> list[Path]:
    """Draw the report's figures, without titles: a paper has captions."""
    names = setting_words(study.rows.name), setting_words(study.columns.name)
    paper = paper_figures(study, reported.runs)
    figures = {
        "convergence": convergences(cells, names, paper, "", ""),
        "times": times_figure(cells, names),
        "heat_map": heat_map(cells, names, paper, "", ""),
    }
    return [save(figures[name], out / f"{name}{ending}") for name in FIGURES for ending in (".pdf", ".png")]
