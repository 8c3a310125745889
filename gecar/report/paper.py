"""A study in LaTeX, as a paper shows it: tables, and a document with tables, figures and where they come from."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from gecar.report.origin import Reported, parameters
from gecar.report.table import FULL_NOTE, Compared, axes_words, contrasts_note, full_lines
from gecar.results.cells import Cell
from gecar.results.study import Study

FIGURES = {
    "convergence": "Best time to GOAL over the generations: each run, the median and the interquartile range.",
    "times": "Time to GOAL of each run's best program. Boxes: quartiles and median; points: runs, by seed; crosses: "
    "runs that did not reach GOAL.",
    "heat_map": "Mean time to GOAL of the runs that reached it, and its standard deviation.",
}
"""The figures of a report, and what they show."""


def latex(study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]) -> str:
    """Write the table of all figures for LaTeX."""
    lines = full_lines(study, cells, paper)
    return tabular(lines, "l" * 2 + "r" * (len(lines[0]) - 2))


def contrasts_latex(study: Study, compared: Sequence[Compared]) -> str:
    """Write comparisons of cells for LaTeX."""
    lines = [[*axes_words(study), "against", "A12", "p", "p (Holm)"]]
    for cell, first, test, corrected in compared:
        figures = [f"{test.a12:.2f}", f"{test.p:.2g}", f"{corrected:.2g}"]
        lines.append([str(cell.row), str(cell.column), f"{first.row}, {first.column}", *figures])
    return tabular(lines, "lllrrr")


def parameters_latex(reported: Reported) -> str:
    """Write the settings for LaTeX."""
    return tabular([["setting", "value"], *map(list, parameters(reported))], "lp{0.6\\linewidth}")


def tabular(lines: Sequence[Sequence[str]], columns: str) -> str:
    """Write lines of words as a table for LaTeX, the first as its head; it needs the package booktabs.

    Parameters
    ----------
    lines
        The words, as they are to be read.
    columns
        How LaTeX aligns the columns.
    """
    head, *body = (" & ".join(map(escaped, line)) + r" \\" for line in lines)
    rows = [rf"\begin{{tabular}}{{{columns}}}", r"\toprule", head, r"\midrule", *body]
    return "\n".join([*rows, r"\bottomrule", r"\end{tabular}"]) + "\n"


_MARKS = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_POWER = re.compile(r"(\d(?:\.\d+)?)e(-?)\+?0*(\d+)")


def escaped(words: str) -> str:
    """Return words as LaTeX reads them; a number such as 1.2e-06 becomes a product."""
    power = _POWER.fullmatch(words)
    if power:
        return rf"${power[1]} \times 10^{{{power[2]}{power[3]}}}$"
    return re.sub(r"[\\~^&%$#_{}]", lambda mark: _MARKS.get(mark[0], "\\" + mark[0]), words)


def document(
    reported: Reported, compared: Sequence[Compared], difference: float | None, shared: str, command: str
) -> str:
    """Write a document that holds a report's tables and figures, with captions, and where they come from.

    Parameters
    ----------
    reported, compared
        The study, and how its cells compare; none where a run is missing.
    difference
        Friedman's p; None where there is none.
    shared
        What `gecar.report.table.about` says.
    command
        What runs the study again.
    """
    results = f"{shared}. {FULL_NOTE}"
    contrasts = contrasts_note(compared) if compared else ""
    if difference is not None:
        contrasts += f" Friedman's test over all cells and seeds: p = {difference:.2g}."
    versions = ", ".join(f"{name} {' or '.join(each)}" for name, each in reported.versions.items())
    finished, planned = len(reported.finished), len(reported.runs)
    parts = [
        _HEAD,
        _float("parameters", "Settings of all runs."),
        _float("results", results),
        *([_float("contrasts", contrasts)] if compared else []),
        *(_figure(name, words) for name, words in FIGURES.items()),
        r"\section*{Where these figures come from}",
        escaped(f"{finished} of {planned} runs are finished. They were made with {versions}. ")
        + r"\texttt{provenance.json} has the hash of each run's configuration. "
        + r"With \texttt{config.toml} and the same versions they are made again by",
        rf"\begin{{quote}}\ttfamily\raggedright {escaped(command)}\end{{quote}}",
        r"\end{document}",
    ]
    return "\n\n".join(parts) + "\n"


_HEAD = r"""% Tables and figures of a study; written by gecar report. Copy what the paper needs.
\documentclass{article}
\usepackage[utf8]{inputenc}
\usepackage[T1]{fontenc}
\usepackage[margin=2cm]{geometry}
\usepackage{booktabs,graphicx}
\begin{document}"""


def _float(name: str, caption: str) -> str:
    """Write a table with its caption, shrunk where it is wider than the page."""
    return (
        rf"\begin{{table}}[htbp]\centering\caption{{{escaped(caption)}}}\label{{tab:{name}}}" + "\n"
        rf"\resizebox{{\ifdim\width>\linewidth\linewidth\else\width\fi}}{{!}}{{\input{{{name}}}}}" + "\n"
        r"\end{table}"
    )


def _figure(name: str, caption: str) -> str:
    return (
        rf"\begin{{figure}}[htbp]\centering\includegraphics[width=\linewidth]{{{name}.pdf}}" + "\n"
        rf"\caption{{{escaped(caption)}}}\label{{fig:{name}}}" + "\n"
        r"\end{figure}"
    )
