"""What a cluster would give: whole runs of Table 5 on many cores, from what one core and one message cost here."""

from __future__ import annotations

import math
import time

import distributed  # noqa: F401  without it there is nothing to measure

from gecar.parallel.executors import open_executor
from gecar.results.config import configure
from gecar.results.study_runs import perform

CELLS, SEEDS = 9, 30
CORES = (1, 2, 64, 1_000)


def rows() -> list[tuple[str, str, str]]:
    """Return this benchmark's rows: figure, value, goal."""
    run_s, message_s = run_seconds(), message_seconds()
    shown = [
        ("one paper run on one core", f"{run_s:.2f} s", ""),
        ("one call through Dask, there and back", f"{1e3 * message_s:.2f} ms", ""),
    ]
    for cores in CORES:
        total = table_seconds(cores, run_s, message_s)
        shown.append((f"Table 5 x {SEEDS} seeds on {cores:,} cores (model)", f"{total:.1f} s", ""))
    return shown


def table_seconds(cores: int, run_s: float, message_s: float) -> float:
    """Return how long all runs take [s]: whole runs side by side, sent by one scheduler one after the other."""
    runs = CELLS * SEEDS
    return math.ceil(runs / cores) * run_s + runs * message_s


def run_seconds() -> float:
    """Return the processor time of a whole run in this process [s], median of three."""
    times = []
    for seed in (1, 2, 3):
        began = time.process_time()  # not the clock: others may use this machine
        perform(configure({"seed": seed, "executor": "serial"}))
        times.append(time.process_time() - began)
    return sorted(times)[1]


def message_seconds(calls: int = 300) -> float:
    """Return what a call through Dask costs [s], many being under way."""
    executor = open_executor("dask", 1)
    executor.submit(max, 1, 2).result()
    began = time.perf_counter()
    for answer in [executor.submit(max, k, 2) for k in range(calls)]:
        answer.result()
    spent = time.perf_counter() - began
    executor.shutdown()
    return spent / calls
