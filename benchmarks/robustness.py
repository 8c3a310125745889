"""What evolving on perturbed robots gains: how many of 200 others a winner brings to GOAL, and what that costs.

python -m benchmarks.robustness --out runs/robustness

Goes on where it was stopped, and writes table.md into its folder. The 200 robots are none of those evolved on.
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
from gecar.language.program import parse_program
from gecar.report.table import piped, seconds
from gecar.results.cells import Cell
from gecar.results.config import configure
from gecar.results.running import load_task
from gecar.world.perturbation import perturbed
from gecar.world.rollout import Outcome, simulate

ROBOTS = 10
OTHERS, OTHERS_SEED = 200, 1_000_003  # evolution draws its robots by the run's seed
SEARCHES: dict[str, dict[str, Any]] = {
    "nominal robot": {"preset": "better"},
    f"mean of {ROBOTS} robots": {"preset": "better", "robust": ROBOTS, "robust_by": "mean"},
    f"worst of {ROBOTS} robots": {"preset": "better", "robust": ROBOTS, "robust_by": "worst"},
}


def shares(cell: Cell) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Drive each run's winner on the others; return the share at GOAL and those drives' median time [s] (runs,)."""
    world = load_task(configure({"course": cell.row})).world
    others = perturbed(world, OTHERS, OTHERS_SEED)
    found = []
    for record in cell.records:
        opcodes = parse_program(record["program"]).opcodes
        drives = [simulate(other, opcodes, seed) for seed, other in enumerate(others)]
        times = [drive.time_s for drive in drives if drive.outcome == Outcome.GOAL]
        found.append((len(times) / OTHERS, np.median(times) if times else np.inf))
    at_goal, median_s = np.array(found, float).T
    return at_goal, median_s


def table(cells: Sequence[Cell]) -> str:
    """Write what each search's winners do on the others."""
    lines = [
        ["evolved on", "its own fitness [s]", "of 200 others at GOAL", "least", "their time [s]", "cost"]
    ]
    cost_of_one = np.median([record["simulated_steps"] for record in cells[0].records])
    for cell in cells:
        at_goal, median_s = shares(cell)
        cost = np.median([record["simulated_steps"] for record in cell.records]) / cost_of_one
        words = [str(cell.column), seconds(cell.quantile_s(0.5)), f"{100 * np.median(at_goal):.0f} %"]
        lines.append(
            [*words, f"{100 * at_goal.min():.0f} %", seconds(float(np.median(median_s))), f"{cost:.1f} x"]
        )
    note = f"Medians over {len(cells[0].records)} seeds; least is the worst seed's; cost in simulated steps."
    return f"{piped(lines)}\n{note}\n"


def main() -> None:
    """Perform the study and print its table."""
    parser = ArgumentParser(prog="python -m benchmarks.robustness", description=__doc__)
    add_seeds(parser, 10)
    parser.add_argument("--course", default="paper")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    text = table(performed(planned([asked.course], SEARCHES, seeds_of(asked), "paper"), asked.out))
    write_whole(asked.out / "table.md", text)
    print(text)


if __name__ == "__main__":
    main()
