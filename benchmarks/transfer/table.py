"""What the drives came to, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.transfer.drives import ENGINES, Key
from benchmarks.transfer.driving import Drive
from benchmarks.transfer.sealing import Winner
from gecar.report.table import piped

NEAR = 0.03  # of the promised time
WORDS = {
    "goal": "GOAL",
    "missed_checkpoint": "missed a checkpoint",
    "off_course": "off the course",
    "out_of_time": "out of time",
    "stuck": "stuck",
}


@dataclass(frozen=True)
class Score:
    """How winners fared in one engine.

    Attributes
    ----------
    at_goal, near
        Winners whose nominal drive reached GOAL, and did so within 3 % of the promised time.
    varied_at_goal, varied
        Drives of variations that reached GOAL, of how many.
    """

    at_goal: int
    near: int
    varied_at_goal: int
    varied: int


def score(winners: Sequence[Winner], drives: Mapping[Key, Drive], engine: str) -> Score:
    """Count how winners fared in one engine."""
    nominal = [(winner, drives[winner.name, engine, 0]) for winner in winners]
    varied = [made for (_, where, k), made in drives.items() if where == engine and k > 0]
    return Score(
        sum(made.at_goal for _, made in nominal),
        sum(is_near(winner, made) for winner, made in nominal),
        sum(made.at_goal for made in varied),
        len(varied),
    )


def is_near(winner: Winner, made: Drive) -> bool:
    """Whether a drive reached GOAL within 3 % of the promised time."""
    return made.at_goal and abs(made.time_s / winner.promised_s - 1.0) <= NEAR


def varied_drives(winner: Winner, drives: Mapping[Key, Drive], engine: str) -> list[Drive]:
    """Return the drives of a winner's variations in one engine."""
    return [
        made for (name, where, k), made in drives.items() if (name, where) == (winner.name, engine) and k > 0
    ]


def table(winners: Sequence[Winner], drives: Mapping[Key, Drive], engines: Sequence[str], sealed: str) -> str:
    """Write the table.

    Parameters
    ----------
    winners, drives, engines
        Who drove, what came of it, and where.
    sealed
        Hash of the manifest.
    """
    head = ["winner", "course", "promised [s]"]
    for engine in engines:
        name = ENGINES[engine]
        head += [f"{name} [s]", "off by", f"{name}, varied: at GOAL", "median [s]"]
    lines = [head, *(_line(winner, drives, engines) for winner in winners), _sum(winners, drives, engines)]
    note = (
        f"Promised: on gecar's nominal robot, sealed before any engine ran (manifest {sealed[:16]}). "
        "Varied: at GOAL of the robots of variations.py; median of those drives. The last row counts winners at GOAL, "
        f"those also within {100 * NEAR:.0f} % of the promise, and varied drives at GOAL."
    )
    return f"{piped(lines)}\n{note}\n"


def _line(winner: Winner, drives: Mapping[Key, Drive], engines: Sequence[str]) -> list[str]:
    cells = [winner.name, Path(winner.course).stem, f"{winner.promised_s:.2f}"]
    for engine in engines:
        made, varied = drives[winner.name, engine, 0], varied_drives(winner, drives, engine)
        late = made.time_s / winner.promised_s - 1.0
        cells += (
            [f"{made.time_s:.2f}", f"{round(100 * late, 1) + 0.0:+.1f} %"]
            if made.at_goal
            else [f"{WORDS[made.outcome]} at {made.time_s:.2f}", "-"]
        )
        times = [each.time_s for each in varied if each.at_goal]
        cells += [
            f"{len(times)}/{len(varied)}" if varied else "-",
            f"{np.median(times):.2f}" if times else "-",
        ]
    return cells


def _sum(winners: Sequence[Winner], drives: Mapping[Key, Drive], engines: Sequence[str]) -> list[str]:
    cells = [f"all {len(winners)}", "", ""]
    for engine in engines:
        counted = score(winners, drives, engine)
        share = 100 * counted.varied_at_goal / max(counted.varied, 1)
        cells += [
            f"{counted.at_goal}/{len(winners)} at GOAL",
            f"{counted.near}/{len(winners)} within {100 * NEAR:.0f} %",
            f"{counted.varied_at_goal}/{counted.varied} ({share:.0f} %)" if counted.varied else "-",
            "",
        ]
    return cells
