"""What the runs of a study came to, cell by cell of its grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from gecar.evolution.scores import UNSOLVED
from gecar.results.arrival import median_share
from gecar.results.quantile import median_interval, quantile
from gecar.results.study import Planned, Study
from gecar.search.settings import Settings

Floats = npt.NDArray[np.float64]
Record = Mapping[str, Any]


@dataclass(frozen=True)
class Cell:
    """The runs at one place of the grid.

    Attributes
    ----------
    row, column
        The settings' values.
    records
        Finished runs, by seed.
    """

    row: Any
    column: Any
    records: tuple[Record, ...]

    @property
    def times_s(self) -> Floats:
        """Best time to GOAL of each run [s], inf where none got there, shape (runs,)."""
        return np.array([r["fitness_s"] if r["solved"] else np.inf for r in self.records], float)

    @property
    def solved(self) -> int:
        """How many runs reached GOAL."""
        return int(np.isfinite(self.times_s).sum())

    @property
    def mean_s(self) -> float:
        """Mean over all runs [s], as in the paper's Table 5; inf where a run did not reach GOAL."""
        return float(self.times_s.mean()) if self.records else float("nan")

    @property
    def share(self) -> float:
        """Share of drives in which a run's best program arrives, 0..1, median; nan where a run does not say."""
        return median_share(self.records)

    @property
    def bests_s(self) -> Floats:
        """Best fitness of each run so far by generation [s], shape (runs, generations + 1)."""
        bests = np.array([record["history"]["best"] for record in self.records], float)
        return np.minimum.accumulate(bests, axis=1)

    @property
    def generation(self) -> Floats:
        """Numbers of the generations, shape (generations + 1,)."""
        return np.array(self.records[0]["history"]["generation"], float)

    def quantile_s(self, share: float) -> float:
        """Return a quantile of the times [s]; a run without GOAL counts as slower than any."""
        return float(quantile(self.times_s, share)) if self.records else float("nan")

    @property
    def median_interval_s(self) -> tuple[float, float]:
        """An interval that holds the median with 95 % [s]; nan where there are too few runs for one."""
        return median_interval(self.times_s)

    def figures(self) -> dict[str, Any]:
        """Sum up: runs, solved and times [s]; inf where too few runs reached GOAL, nan where none is finished."""
        times = self.times_s[np.isfinite(self.times_s)]
        return {
            "runs": len(self.records),
            "solved": self.solved,
            "solved_share": self.solved / len(self.records) if self.records else float("nan"),
            "mean_s": self.mean_s,
            "median_s": self.quantile_s(0.5),
            "median_low_s": self.median_interval_s[0],
            "median_high_s": self.median_interval_s[1],
            "sd_solved_s": float(times.std(ddof=1)) if len(times) > 1 else float("nan"),
            "mean_solved_s": float(times.mean()) if len(times) else float("nan"),
            "best_s": self.quantile_s(0.0),
            "lower_quarter_s": self.quantile_s(0.25),
            "upper_quarter_s": self.quantile_s(0.75),
            "worst_s": self.quantile_s(1.0),
            "evaluations": self._median("evaluations"),
            "simulated": self._median("distinct_evaluations"),
            "simulated_steps": self._median("simulated_steps"),
            "wall_s": self._median("wall_s"),
            "arrives_share": self.share,
        }

    def _median(self, name: str) -> float:
        return float(np.median([r[name] for r in self.records])) if self.records else float("nan")


def cells_of(runs: Sequence[Planned], records: Sequence[Record | None]) -> list[Cell]:
    """Gather a study's runs into cells, row by row; runs not finished (None) are left out."""
    found: dict[tuple[str, str], tuple[Any, Any, list[Record]]] = {}
    for run, record in zip(runs, records, strict=True):
        place = found.setdefault((str(run.row), str(run.column)), (run.row, run.column, []))
        if record is not None:
            place[2].append(record)
    return [Cell(row, column, tuple(kept)) for row, column, kept in found.values()]


TREATMENTS = {"preset", "grammar", *Settings.model_fields}
"""What a study may vary and compare; courses, robots and the like are what it compares on."""


def problem_of(study: Study, cell: Cell) -> tuple[str, ...]:
    """Return what a cell's runs were set: the value of each axis that is no treatment."""
    axes = (study.rows.name, cell.row), (study.columns.name, cell.column)
    return tuple(str(value) for name, value in axes if name not in TREATMENTS)


def treatment_of(study: Study, cell: Cell) -> tuple[str, ...]:
    """Return what a cell's runs did about it: the value of each axis that is a treatment."""
    axes = (study.rows.name, cell.row), (study.columns.name, cell.column)
    return tuple(str(value) for name, value in axes if name in TREATMENTS)


def difference_p(study: Study, cells: Sequence[Cell]) -> float | None:
    """Return the probability of differences this large between treatments if they made none.

    Friedman (1937), on ranks within each problem and seed: runs of one seed begin with the same population, and a run
    without GOAL is simply the slowest. None for less than three treatments, two blocks that all of them have, or times
    that all agree.
    """
    times: dict[tuple[str, ...], dict[Any, float]] = {}
    for cell in cells:
        found = times.setdefault(treatment_of(study, cell), {})
        for record in cell.records:
            found[problem_of(study, cell), record["seed"]] = min(record["fitness_s"], UNSOLVED)
    blocks = sorted(set.intersection(*map(set, times.values()))) if times else []
    table = [[found[block] for block in blocks] for found in times.values()]
    if len(table) < 3 or len(blocks) < 2 or np.all(np.ptp(table, axis=0) == 0.0):
        return None
    return float(stats.friedmanchisquare(*table).pvalue)
