"""Whether the better search is better, and which part of it earns its place.

python -m benchmarks.better_search ablation --out runs/ablation      the paper's course: comparators and ablations
python -m benchmarks.better_search courses --out runs/courses        every course: the paper's search and the better one

Both go on where they were stopped, and write table.md into their folder: 20 seeds, 10,200 evaluations a run. Seeds 1 to
20 took part in choosing the preset, and so did some from 1001 up; those from 21 up are fresh.
"""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.studies import add_seeds, performed, planned, seeds_of
from gecar.files import write_whole
from gecar.report.table import piped, seconds
from gecar.results.arrival import percent
from gecar.results.cells import Cell
from gecar.results.quantile import median_interval, quantile
from gecar.results.statistics import contrast, evaluations_to, holm
from gecar.search.settings import PRESETS
from gecar.world.course.course import list_courses

PAPERS_BEST_S = 16.74  # Table 5
REFERENCE = "better"
PONYGE2 = {
    "initialisation": "ptc2", "tournament": 2, "crossover": "variable_one_point", "crossover_rate": 0.75,
    "mutation": "one_used_codon",
}  # fmt: skip
"""PonyGE2's defaults (Fenton et al. 2017) with this project's operators; its position-independent grow becomes PTC2."""
_CHANGED = {name: value for name, value in PRESETS["better"] if getattr(PRESETS["paper"], name) != value}
_SIZES = {"population", "generations"}
_HEADS = ("at GOAL", "median [s] (95 %)", "arrive", "worst [s]")


def searches() -> dict[str, dict[str, Any]]:
    """Return what differs by name of the search: comparators, then the better one less or plus one part each."""
    paper = PRESETS["paper"].model_dump()
    parts = [{name} for name in _CHANGED if name not in _SIZES] + [_SIZES]
    less = {
        f"{REFERENCE}, paper's {' and '.join(sorted(part)).replace('_', ' ')}": {
            "preset": "better",
            "search": {name: paper[name] for name in part},
        }
        for part in parts
    }
    more = {
        f"{REFERENCE}, {words}": {"preset": "better", "search": change}
        for words, change in {
            "no program simulated twice": {"duplicates": "run"},
            "lexicase selection": {"selection": "lexicase"},
            "PTC2 initialisation": {"initialisation": "ptc2"},
            "sensible initialisation": {"initialisation": "sensible"},
        }.items()
    }
    return {
        REFERENCE: {"preset": "better"},
        "paper": {"preset": "paper"},
        "random": {"preset": "random"},
        "PonyGE2's operators": {"preset": "paper", "search": PONYGE2},
        **less,
        **more,
    }


def ablation_table(cells: Sequence[Cell]) -> str:
    """Write the searches beside each other, against the better one."""
    better, *others = cells
    tests = [contrast(cell, better) for cell in others]
    corrected = holm([test.p for test in tests])
    lines = [[REFERENCE, *_figures(better), "", ""]]
    for cell, test, p in zip(others, tests, corrected, strict=True):
        lines.append([cell.column, *_figures(cell), f"{test.a12:.2f}", f"{p:.2g}"])
    heads = ["search", *_HEADS, "evaluations to 16.74 s", "A12", "p"]
    return piped([heads, *lines])


def courses_table(cells: Sequence[Cell]) -> str:
    """Write both searches for each course."""
    pairs = list(zip(cells[::2], cells[1::2], strict=True))
    tests = [contrast(better, paper) for better, paper in pairs]
    corrected = holm([test.p for test in tests])
    heads = [
        f"{search}: {head}" if head == _HEADS[0] else head
        for search in ("better", "paper")
        for head in _HEADS
    ]
    lines = [["course", *heads, "A12", "p"]]
    for (better, paper), test, p in zip(pairs, tests, corrected, strict=True):
        lines.append(
            [
                str(better.row),
                *_figures(better)[: len(_HEADS)],
                *_figures(paper)[: len(_HEADS)],
                f"{test.a12:.2f}",
                f"{p:.2g}",
            ]
        )
    return piped(lines)


def _figures(cell: Cell) -> list[str]:
    low, high = median_interval(cell.times_s)
    times = cell.times_s
    return [
        f"{cell.solved}/{len(times)}",
        f"{seconds(cell.quantile_s(0.5))} ({seconds(low)} to {seconds(high)})",
        percent(cell.share),
        seconds(float(times.max())),
        _count(evaluations_to(cell, PAPERS_BEST_S)),
    ]


def _count(spent: npt.NDArray[np.float64]) -> str:
    median = float(quantile(spent, 0.5))
    return f"{median:,.0f}" if np.isfinite(median) else "-"


def main() -> None:
    """Perform one of the two studies and print its table."""
    parser = ArgumentParser(prog="python -m benchmarks.better_search", description=__doc__)
    parser.add_argument("study", choices=("ablation", "courses"))
    add_seeds(parser, 20, first=21)
    parser.add_argument("--grammar", default="paper")
    parser.add_argument("--courses", nargs="+", default=None)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    if asked.study == "ablation":
        runs = planned(asked.courses or ["paper"], searches(), seeds_of(asked), asked.grammar)
        table = ablation_table(performed(runs, asked.out))
    else:
        pair = {REFERENCE: {"preset": "better"}, "paper": {"preset": "paper"}}
        runs = planned(asked.courses or list_courses(), pair, seeds_of(asked), asked.grammar)
        table = courses_table(performed(runs, asked.out))
    write_whole(asked.out / "table.md", table)
    print(table)


if __name__ == "__main__":
    main()
