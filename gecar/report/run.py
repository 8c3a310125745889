"""A run in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gecar.report.drive import short_arrival
from gecar.results.config import Config
from gecar.world.course import load_course


def run_title(config: Config, result: Mapping[str, Any]) -> str:
    """Say in a few words what came of a run."""
    course = load_course(config.course)
    where = course.title or course.name
    if result["solved"]:
        words = f"{where}: GOAL in {result['fitness_s']:.2f} s after {result['generations']} generations"
        return ", ".join(filter(None, [words, short_arrival(result.get("arrives"))]))
    return f"{where}: no program at GOAL after {result['generations']} generations"


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
