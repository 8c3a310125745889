"""Runs in words: what came of one, what several share, and what each kind came to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.table import Table

from gecar.results.arrival import median_share, percent, share_of, with_share
from gecar.results.config import Config
from gecar.results.quantile import quantile
from gecar.world.course.course import Course, load_courses

_NAMES = {"crossover_rate": "crossover", "mutation_rate": "mutation"}


def group_names(configs: Sequence[Config]) -> list[str]:
    """Name each run by what sets it apart from the others, seeds aside; runs that differ in seed only share a name."""
    flat = [_flat(config) for config in configs]
    apart = [key for key in flat[0] if len({str(each[key]) for each in flat}) > 1]
    if "preset" in apart:  # it says what the search settings are, where they are the preset's own
        apart = ["preset", *(key for key in apart if key in _flat_world(configs[0]))]
        apart += [key for key in flat[0] if key not in apart and _varies_within(flat, apart, key)]
    if not apart:
        return [f"preset {config.preset}" for config in configs]
    return [", ".join(f"{_NAMES.get(key, key)} {each[key]}" for key in apart) for each in flat]


def _flat(config: Config) -> dict[str, Any]:
    return {"preset": config.preset, **_flat_world(config), **config.identity["search"]}


def _flat_world(config: Config) -> dict[str, Any]:
    return {name: value for name, value in config.identity.items() if name not in ("search", "seed")}


def _varies_within(flat: Sequence[Mapping[str, Any]], apart: Sequence[str], key: str) -> bool:
    """Whether runs that agree in the keys so far still differ in another."""
    seen: dict[tuple[str, ...], str] = {}
    return any(
        seen.setdefault(tuple(str(each[k]) for k in apart), str(each[key])) != str(each[key]) for each in flat
    )


def summaries(names: Sequence[str], results: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Sum up each group of runs: how many, how many solved, and the times of those."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for name, result in zip(names, results, strict=True):
        groups.setdefault(name, []).append(result)
    return {name: _summary(group) for name, group in groups.items()}


def _summary(results: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    times = np.array([result["fitness_s"] if result["solved"] else np.inf for result in results])
    solved = times[np.isfinite(times)]
    return {
        "runs": len(times),
        "solved": len(solved),
        "best_s": float(times.min()),
        "median_s": float(quantile(times, 0.5)),
        "worst_s": float(times.max()),
        "mean_solved_s": float(solved.mean()) if len(solved) else float("nan"),
        "arrives_share": median_share(results),
        "evaluations": int(np.median([result["evaluations"] for result in results])),
    }


def came_to(group: Mapping[str, Any]) -> str:
    """Say in few words what a group of runs came to, in the median; nothing where that did not reach GOAL."""
    return with_share(group["median_s"], group["arrives_share"]) if np.isfinite(group["median_s"]) else ""


def front_table(points: Sequence[Mapping[str, Any]], most: int = 20) -> Table:
    """Return the programs on a front as a table for people; of many, some spread over all."""
    best = [point for point in points if point["on_front"]]
    table = Table("program", "time", "arrive", "energy", "length", box=None, pad_edge=False)
    for k in np.unique(np.linspace(0, len(best) - 1, min(most, len(best))).astype(int)):
        point = best[k]
        table.add_row(
            str(point["program"]), f"{point['time_s']:.2f} s", percent(1.0 - point["missed"]),
            f"{point['energy_j']:.1f} J", str(point["length"]),
        )  # fmt: skip
    for column in table.columns:
        column.justify = "right"
    return table


def summary_table(groups: Mapping[str, Mapping[str, Any]]) -> Table:
    """Return groups of runs as a table for people."""
    table = Table(
        "", "runs", "solved", "best", "median", "worst", "arrive", "evaluations", box=None, pad_edge=False
    )
    for name, group in groups.items():
        times = (
            f"{group[key]:.2f} s" if np.isfinite(group[key]) else "no GOAL"
            for key in ("best_s", "median_s", "worst_s")
        )
        counts = str(group["runs"]), str(group["solved"])
        table.add_row(name, *counts, *times, percent(group["arrives_share"]), f"{group['evaluations']:,}")
    return table


def run_title(config: Config, result: Mapping[str, Any]) -> str:
    """Say in a few words what came of a run."""
    where = courses_title(load_courses(config.course))
    if "unseen" in result:
        return f"{where}: {result['unseen']['driven']} of {result['unseen']['of']} unseen courses driven"
    if result["solved"]:
        return f"{where}: GOAL in {with_share(result['fitness_s'], share_of(result))}"
    return f"{where}: no program at GOAL after {result['generations']} generations"


def courses_title(courses: Sequence[Course]) -> str:
    """Name courses by the first one's title."""
    first = courses[0].title or courses[0].name
    return f"{first} and {len(courses) - 1} more" if len(courses) > 1 else first


def run_detail(config: Config, result: Mapping[str, Any]) -> str:
    """Say what a run was: search, seed and effort."""
    search = config.search
    return " · ".join(
        [
            f"preset {config.preset}",
            f"crossover {search.crossover_rate:g}, mutation {search.mutation_rate:g}",
            f"seed {config.seed}",
            f"{result['evaluations']:,} evaluations, {result['distinct_evaluations']:,} simulated",
            f"{result['wall_s']:.1f} s",
        ]
    )


def effort_of(result: Mapping[str, Any]) -> str:
    """Say how much work a run was, and how fast it went."""
    rate = result["evaluations"] / max(result["wall_s"], 1e-3)
    return (
        f"{result['evaluations']:,} evaluations in {result['wall_s']:.1f} s ({rate:,.0f}/s); "
        f"{result['distinct_evaluations']:,} programs differed and were simulated."
    )
