"""`python -m benchmarks.problems --seeds 30`: run the searches in turns, and print a table in Markdown."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from scipy import stats

from benchmarks.problems.searches import CASES, SEARCHES, Ended
from gecar.report.table import piped


def main() -> None:
    """Run what has not been run, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.problems", description=__doc__)
    parser.add_argument("--seeds", type=int, default=30, help="runs of each search")
    parser.add_argument("--first-seed", type=int, default=1, help="their first seed")
    parser.add_argument("--out", type=Path, default=Path("runs/problems.jsonl"), help="where runs are kept")
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.touch()
    lines = options.out.read_text(encoding="utf-8").splitlines()
    done = {tuple(key): Ended(*ended) for key, ended in map(json.loads, lines)}
    for problem, case in CASES.items():
        for search in SEARCHES.values():
            search(case, 0)  # compiles what there is to compile
        for seed in seeds:
            for name, search in SEARCHES.items():
                key = (problem, name, seed)
                if key not in done:
                    done[key] = search(case, seed)
                    with options.out.open("a", encoding="utf-8") as file:
                        file.write(json.dumps([key, done[key]]) + "\n")
            print(problem, seed, file=sys.stderr, flush=True)
        print(
            f"\n{table(problem, {name: [done[problem, name, seed] for seed in seeds] for name in SEARCHES})}"
        )


def table(problem: str, ended: dict[str, list[Ended]]) -> str:
    """Return a problem's table, each search against the first."""
    first, *_ = (np.array(runs) for runs in ended.values())
    solved_by = CASES[problem].solved
    lines = [
        [
            problem,
            "solved",
            "p",
            "error, median (quartiles)",
            "A12",
            "p",
            "time of a run [s]",
            "times as fast",
        ]
    ]
    for name, runs in ended.items():
        error, cpu = np.array(runs).T
        quarter, median, three = np.quantile(error, (0.25, 0.5, 0.75))
        solved, theirs = (int((e <= solved_by).sum()) for e in (error, first[:, 0]))
        words = [
            name,
            f"{solved}/{len(error)}",
            "",
            f"{median:.3g} ({quarter:.3g} to {three:.3g})",
            "",
            "",
            f"{np.median(cpu):.2f}",
            f"{np.median(first[:, 1] / cpu):.1f}",
        ]
        if name != next(iter(ended)):
            counts = [[solved, len(error) - solved], [theirs, len(first) - theirs]]
            rank = stats.mannwhitneyu(error, first[:, 0])
            words[2] = f"{stats.fisher_exact(counts).pvalue:.2g}"
            words[4] = f"{1.0 - rank.statistic / (len(error) * len(first)):.2f}"
            words[5] = f"{rank.pvalue:.2g}"
        lines.append(words)
    return piped(lines)


if __name__ == "__main__":
    main()
