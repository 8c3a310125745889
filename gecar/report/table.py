"""A study in words: as a table for a terminal, as Markdown, CSV and JSON, beside the paper's Table 5."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.markup import escape
from rich.table import Table

from gecar.files import json_ready
from gecar.results.arrival import percent, share_of
from gecar.results.cells import Cell, difference_p, problem_of
from gecar.results.statistics import Contrast, contrast, holm
from gecar.results.study import TABLE_5, Planned, Study

PAPER_TABLE_5: Mapping[tuple[float, float], float] = {
    (0.4, 0.03): math.inf, (0.4, 0.05): math.inf, (0.4, 0.07): 22.51,
    (0.5, 0.03): 22.32, (0.5, 0.05): 16.74, (0.5, 0.07): 17.20,
    (0.7, 0.03): 28.64, (0.7, 0.05): 16.98, (0.7, 0.07): 18.74,
}  # fmt: skip
"""Mean of the best in the last generation over five runs by crossover and mutation rate [s]; inf: did not converge."""

_HEADINGS = (
    "runs", "at GOAL", "mean [s]", "median [s]", "best to worst [s]", "arrive", "sd [s]", "evaluations", "simulated",
)  # fmt: skip
ARRIVE = (
    "the share of drives under fresh conditions in which a run's best program arrives (median over the runs)"
)
"""What a table's shares are."""
FULL_NOTE = (
    f"A run without GOAL counts as slower than any in mean, median and worst; arrive is {ARRIVE}; "
    "sd is of the runs at GOAL. "
    "Evaluations and simulated (programs that no earlier one answered) are medians over the runs."
)
"""What the table of all figures holds."""
_RUN_COLUMNS = (
    "fitness_s", "solved", "found_in_generation", "evaluations", "distinct_evaluations", "simulated_steps", "wall_s",
)  # fmt: skip


def paper_figures(study: Study, runs: Sequence[Planned]) -> Mapping[tuple[float, float], float]:
    """Return the paper's figures where the study asks what the paper asked: its rates, on its course."""
    names = tuple(axis.name for axis in TABLE_5)
    same = all(run.config.course == "paper" and run.config.grammar == "paper" for run in runs)
    return PAPER_TABLE_5 if same and (study.rows.name, study.columns.name) == names else {}


def of_paper(cell: Cell, paper: Mapping[tuple[float, float], float]) -> float | None:
    """Return the paper's figure for a cell [s]; None where it has none."""
    return paper.get((cell.row, cell.column)) if paper else None


def terminal_table(study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]) -> Table:
    """Return the table for people."""
    table = Table(*map(escape, _heads(study, paper)), box=None, pad_edge=False, header_style="bold")
    for column in table.columns[2:]:
        column.justify = "right"
    for cell in cells:
        table.add_row(*_words(cell, paper))
    return table


def markdown(
    study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float], shared: str
) -> str:
    """Write the table as Markdown: in the paper's form first, then all figures.

    Parameters
    ----------
    study, cells
        What was varied, and what came of it.
    paper
        The paper's figures, or none.
    shared
        What `about` says.
    """
    blocks = [f"# {_letters(study)}", shared, _matrix(study, cells, paper), _full(study, cells, paper)]
    p = difference_p(study, cells)
    if p is not None:
        blocks.append(f"Do the cells differ at all? Friedman over the seeds: p = {p:.2g}.")
    compared = contrasted(study, cells)
    blocks += [contrasts(study, compared)] if compared else []
    return "\n\n".join(blocks) + "\n"


class Compared(NamedTuple):
    """A cell, and how it does against the first that had the same problem."""

    cell: Cell
    first: Cell
    test: Contrast
    corrected_p: float


def contrasted(study: Study, cells: Sequence[Cell]) -> list[Compared]:
    """Compare each cell with the first of the same course, robot and so on; none where a run is missing.

    Parameters
    ----------
    study
        What was varied.
    cells
        What came of it.
    """
    if not all(cell.records for cell in cells):
        return []
    firsts: dict[tuple[str, ...], Cell] = {}
    pairs = [(cell, firsts.setdefault(problem_of(study, cell), cell)) for cell in cells]
    tests = [(cell, first, contrast(cell, first)) for cell, first in pairs if cell is not first]
    corrected = holm([test.p for _, _, test in tests])
    return [Compared(*each, float(p)) for each, p in zip(tests, corrected, strict=True)]


def contrasts(study: Study, compared: Sequence[Compared]) -> str:
    """Write comparisons as Markdown."""
    lines = [[*axes_words(study), "against", "A12", "p"]]
    for cell, first, test, p in compared:
        against = f"{first.row}, {first.column}"
        lines.append([str(cell.row), str(cell.column), against, f"{test.a12:.2f}", f"{p:.2g}"])
    return f"{piped(lines)}\n\n{contrasts_note(compared)}"


def contrasts_note(compared: Sequence[Compared]) -> str:
    """Say what the figures of comparisons are."""
    tests = {
        "Wilcoxon's signed ranks over the seeds" if each.test.paired else "Mann-Whitney" for each in compared
    }
    return (
        "A12 is how often a run is faster than one of the cell it is set against (Vargha and Delaney; 0.5 is no "
        f"difference), p that of {' or '.join(sorted(tests))}, corrected by Holm."
    )


def contrasts_csv(study: Study, compared: Sequence[Compared]) -> str:
    """Write comparisons as CSV."""
    stream = io.StringIO()
    out = csv.writer(stream, lineterminator="\n")
    names = study.rows.name, study.columns.name
    out.writerow([*names, *(f"against_{name}" for name in names), "a12", "p", "p_holm", "paired"])
    for cell, first, test, p in compared:
        out.writerow([cell.row, cell.column, first.row, first.column, test.a12, test.p, p, test.paired])
    return stream.getvalue()


def csv_text(study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]) -> str:
    """Write a row for each cell as CSV; empty where there is no number, inf where GOAL was not reached.

    The paper gives no number where its runs did not converge.
    """
    stream = io.StringIO()
    out = csv.writer(stream, lineterminator="\n")
    out.writerow([study.rows.name, study.columns.name, *cells[0].figures(), *(["paper_s"] if paper else [])])
    for cell in cells:
        figures = [*cell.figures().values(), *([json_ready(of_paper(cell, paper))] if paper else [])]
        out.writerow([cell.row, cell.column, *map(_csv, figures)])
    return stream.getvalue()


def runs_csv(study: Study, cells: Sequence[Cell]) -> str:
    """Write a row for each run as CSV."""
    stream = io.StringIO()
    out = csv.writer(stream, lineterminator="\n")
    out.writerow([study.rows.name, study.columns.name, "seed", *_RUN_COLUMNS, "arrives_share", "program"])
    for cell in cells:
        for record in cell.records:
            figures = [_csv(value) for value in (*(record[name] for name in _RUN_COLUMNS), share_of(record))]
            out.writerow([cell.row, cell.column, record["seed"], *figures, record["program"]])
    return stream.getvalue()


def as_table(
    study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]
) -> dict[str, Any]:
    """Return the table for JSON; null where there is no number, or GOAL was not reached."""
    return {
        "rows": {study.rows.name: list(study.rows.values)},
        "columns": {study.columns.name: list(study.columns.values)},
        "seeds": list(study.seeds),
        "difference_p": difference_p(study, cells),
        "cells": [
            {
                study.rows.name: cell.row,
                study.columns.name: cell.column,
                **cell.figures(),
                **({"paper_s": of_paper(cell, paper)} if paper else {}),
            }
            for cell in cells
        ],
    }


def about(study: Study, run: Planned, cells: Sequence[Cell]) -> str:
    """Say in a line what all runs share."""
    config, search = run.config, run.config.search
    varied = {study.rows.name, study.columns.name}
    parts = [
        f"{name} {Path(str(getattr(config, name))).stem}"
        for name in ("course", "preset")
        if name not in varied
    ]
    if not varied & {"population", "generations"}:
        parts.append(f"{search.population} programs, {search.generations} generations")
    runs = sorted({len(cell.records) for cell in cells})
    parts.append(f"{runs[0]} seeds a cell" if len(runs) == 1 else f"{runs[0]} to {runs[-1]} seeds a cell")
    return " · ".join(parts)


def setting_words(name: str) -> str:
    """Return a setting's name as people say it."""
    return name.replace("_", " ")


def seconds(value: float) -> str:
    """Return a time as the paper writes it: two decimals, and a dash where GOAL was not reached."""
    return f"{value:.2f}" if math.isfinite(value) else "-"


def _letters(study: Study) -> str:
    rows, columns = setting_words(study.rows.name), setting_words(study.columns.name)
    return f"{rows.capitalize()} x {columns}, {len(study.seeds)} seeds"


def axes_words(study: Study) -> list[str]:
    """Return what rows and columns vary, in words."""
    return [setting_words(study.rows.name), setting_words(study.columns.name)]


def _heads(study: Study, paper: Mapping[tuple[float, float], float]) -> list[str]:
    return [*axes_words(study), *_HEADINGS, *(["paper [s]"] if paper else [])]


def _words(cell: Cell, paper: Mapping[tuple[float, float], float]) -> list[str]:
    figures = cell.figures()
    words = [str(cell.row), str(cell.column), str(figures["runs"])]
    if not cell.records:
        return words + [""] * (len(_HEADINGS) - 1 + bool(paper))
    spread = f"{seconds(figures['best_s'])} to {seconds(figures['worst_s'])}"
    words += [
        f"{cell.solved}/{figures['runs']}",
        seconds(figures["mean_s"]),
        seconds(figures["median_s"]),
        spread,
        percent(figures["arrives_share"]),
    ]
    words += [
        seconds(figures["sd_solved_s"]),
        f"{figures['evaluations']:,.0f}",
        f"{figures['simulated']:,.0f}",
    ]
    value = of_paper(cell, paper)
    return words + ([seconds(value) if value is not None else ""] if paper else [])


def _matrix(study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]) -> str:
    """Write the means in the paper's form, its own figures in brackets."""
    by_place = {(str(cell.row), str(cell.column)): cell for cell in cells}
    corner = f"{setting_words(study.rows.name)} \\ {setting_words(study.columns.name)}"
    lines = [[corner, *map(str, study.columns.values)]]
    for row in study.rows.values:
        shown = [str(row)]
        for column in study.columns.values:
            cell = by_place[str(row), str(column)]
            value = of_paper(cell, paper)
            words = f"{seconds(cell.mean_s)}, {percent(cell.share)}"
            shown.append(words + (f" ({seconds(value)})" if value is not None else ""))
        lines.append(shown)
    note = "Mean of the best time to GOAL over the seeds [s], a dash where a run did not get there, and "
    note += f"{ARRIVE}{'; in brackets the paper' if paper else ''}."
    return f"{piped(lines)}\n\n{note}"


def _full(study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]) -> str:
    return piped(full_lines(study, cells, paper)) + f"\n\n{FULL_NOTE}"


def full_lines(
    study: Study, cells: Sequence[Cell], paper: Mapping[tuple[float, float], float]
) -> list[list[str]]:
    """Return head and rows of the table, medians with their intervals."""
    heads, median = _heads(study, paper), 2 + _HEADINGS.index("median [s]")
    heads[median] = "median [s] (95 %)"
    lines = [_words(cell, paper) for cell in cells]
    for cell, line in zip(cells, lines, strict=True):
        low, high = cell.median_interval_s
        if not math.isnan(low):
            line[median] += f" ({seconds(low)} to {seconds(high)})"
    return [heads, *lines]


def piped(lines: Sequence[Sequence[str]]) -> str:
    """Write lines of words as a Markdown table, the first as its head."""
    head, *rest = (f"| {' | '.join(line)} |" for line in lines)
    rule = "|" + "|".join(["---"] * len(lines[0])) + "|"
    return "\n".join([head, rule, *rest])


def _csv(value: Any) -> Any:
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value
