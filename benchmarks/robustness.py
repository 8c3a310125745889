"""What judging programs by drawn conditions gains: where winners arrive that were judged so, and others, and the cost.

python -m benchmarks.robustness --out runs/robustness                    the paper's course, with and without draws
python -m benchmarks.robustness --out runs/arrival --courses all --searches "16 draws" --seeds 10

Goes on where it was stopped, and writes table.md into its folder. The conditions a winner is driven under are none of
those it was evolved on. ``jitter``: the nominal robot, started up to 2 mm and 1 degree off (standard deviations).
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
from gecar.results.cells import Cell, Record
from gecar.results.config import configure
from gecar.results.run import load_task
from gecar.search.chance import Arrivals, arrivals, times_at_steps, times_to_goal
from gecar.world.course.course import list_courses
from gecar.world.kernel.conditions import conditions
from gecar.world.rollout import World

OTHERS, OTHERS_SEED = 200, 900_000_011
WITHIN = 0.02
SEARCHES: dict[str, dict[str, Any]] = {
    "nominal drive alone": {"preset": "better", "search": {"draws": 1}},
    "8 draws": {"preset": "better", "search": {"draws": 8}},
    "16 draws": {"preset": "better"},
}


def jittered(world: World, opcodes: npt.NDArray[np.int32]) -> float:
    """Return the share of 200 starts, 2 mm and 1 degree off, from which a program arrives."""
    spread = np.array([0.002, 0.002, np.radians(1.0)])
    starts = world.start + spread * np.random.default_rng(OTHERS_SEED).normal(size=(OTHERS, 3))
    under = conditions(np.repeat(world.robot.physics, OTHERS), world.step_s, starts, world.time_limit_s)
    return Arrivals(times_to_goal(world, [opcodes], under, np.arange(OTHERS))[0]).share


def figures(world: World, record: Record) -> tuple[bool, float, float, float]:
    """Return whether a winner arrives at all steps within 2 %, its shares of others and of starts, and their time."""
    opcodes = parse_program(record["program"]).opcodes
    times = list(times_at_steps(world, opcodes).values())
    arrived = [time for time in times if time is not None]
    everywhere = len(arrived) == len(times) and max(arrived) <= (1.0 + WITHIN) * min(arrived)
    (others,) = arrivals(world, [opcodes], OTHERS, OTHERS_SEED)
    return everywhere, others.share, jittered(world, opcodes), others.quantile_s(0.5) or np.inf


def row_of(cell: Cell, nominal_steps: float) -> list[str]:
    """Write one search on one course."""
    world = load_task(configure({"course": cell.row})).world
    found = [figures(world, record) for record in cell.records]
    everywhere, shares, starts, times = (np.array(column, float) for column in zip(*found, strict=True))
    cost = np.median([record["simulated_steps"] for record in cell.records]) / nominal_steps
    return [
        str(cell.row), str(cell.column), seconds(cell.quantile_s(0.5)), seconds(cell.quantile_s(1.0)),
        f"{int(everywhere.sum())} of {len(found)}", f"{np.median(shares):.1%} ({shares.min():.1%})",
        f"{np.median(starts):.1%} ({starts.min():.1%})", seconds(float(np.median(times))), f"{cost:.1f} x",
    ]  # fmt: skip


def table(cells: Sequence[Cell]) -> str:
    """Write how each search's winners arrive."""
    heads = [
        "course", "judged by", "fitness [s]", "worst", "at all steps within 2 %", "of 200 conditions at GOAL (least)",
        "of 200 starts (least)", "time there [s]", "steps simulated",
    ]  # fmt: skip
    first = float(np.median([record["simulated_steps"] for record in cells[0].records]))
    note = f"Medians over {len(cells[0].records)} seeds; least is the worst seed's."
    return f"{piped([heads, *(row_of(cell, first) for cell in cells)])}\n{note}\n"


def main() -> None:
    """Perform the study and print its table."""
    parser = ArgumentParser(prog="python -m benchmarks.robustness", description=__doc__)
    add_seeds(parser, 10)
    parser.add_argument("--courses", nargs="+", default=["paper"])
    parser.add_argument("--searches", nargs="+", default=list(SEARCHES), choices=SEARCHES)
    parser.add_argument("--grammar", default="paper")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    courses = list_courses() if asked.courses == ["all"] else asked.courses
    chosen = {name: SEARCHES[name] for name in asked.searches}
    text = table(performed(planned(courses, chosen, seeds_of(asked), asked.grammar), asked.out))
    write_whole(asked.out / "table.md", text)
    print(text)


if __name__ == "__main__":
    main()
