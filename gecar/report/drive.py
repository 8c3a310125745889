"""A drive in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gecar.results.arrival import percent, with_share
from gecar.search.robustness import Sweep
from gecar.world.course.course import Course
from gecar.world.course.lower_bound.fastest_time import bound_words
from gecar.world.course.reference_times import reference_s
from gecar.world.rollout import Drive, Outcome, World

PAPER_BEST_S = 16.74
"""Time to GOAL of the paper's best program on its course (Tables 5 and 6) [s]."""


def title_of(drive: Drive, course: Course, share: float | None) -> str:
    """Return a title: how a drive ended, and the share of drives in which its program arrives."""
    came = "GOAL in" if drive.outcome == Outcome.GOAL else f"{drive.outcome.sentence} after"
    return f"{course.title or course.name}: {came} {with_share(drive.time_s, share)}"


def sentence_of(drive: Drive) -> str:
    """Say in one sentence how a drive ended."""
    if drive.outcome == Outcome.GOAL:
        return f"The robot reached GOAL through all checkpoints in {drive.time_s:.2f} s."
    return f"The robot {drive.outcome.sentence} after {drive.time_s:.2f} s."


def arrival_of(arrives: Mapping[str, Any]) -> str:
    """Say how a program arrives under random conditions and at other steps, from result.json."""
    if not arrives["of"]:
        return "There is no program to drive under other conditions."
    words = f"Of {arrives['of']} drives under random conditions {percent(arrives['share'])} arrive"
    if arrives["median_s"] is not None:
        words += f", in {arrives['median_s']:.2f} s (median; 95 % of these within {arrives['p95_s']:.2f} s)"
    return f"{words}. {_steps_of(arrives['steps'])}"


def _steps_of(times: Mapping[str, float | None]) -> str:
    missed = [f"{1000 * float(step):g}" for step, time in times.items() if time is None]
    arrived = [time for time in times.values() if time is not None]
    if missed:
        return f"Simulated at a step of {', '.join(missed)} ms it does not arrive."
    return f"Simulated at steps of 4 to 0.25 ms it arrives in {min(arrived):.2f} to {max(arrived):.2f} s."


def robustness_lines(sweeps: Sequence[Sweep]) -> list[str]:
    """Say of each condition from where to where it may go until fewer drives arrive than `ENOUGH`."""
    return [f"  {each.condition.title}: {_range_of(each)}" for each in sweeps]


def _range_of(sweep: Sweep) -> str:
    if sweep.range is None:
        return "nowhere"
    unit, levels = f" {sweep.condition.unit}".rstrip(), sweep.condition.levels
    (low, high), ends = sweep.range, (levels[0], levels[-1])
    edges = [word for word, at, end in (("lowest", low, ends[0]), ("highest", high, ends[1])) if at == end]
    tried = f" (the {' and the '.join(edges)} tried)" if edges else ""
    return f"{low:g} to {high:g}{unit}{tried}"


def robustness_table(sweeps: Sequence[Sweep]) -> dict[str, Any]:
    """Return shares of drives at GOAL by condition, ready for JSON."""
    return {
        each.condition.id: {
            "levels": list(each.condition.levels),
            "nominal": each.nominal,
            "shares": each.shares.tolist(),
        }
        for each in sweeps
    }


def standing_of(world: World, drive: Drive) -> str:
    """Say how far a drive came, and compare its time with the lower bound and the paper's best."""
    bound = world.course.lower_bound_s(world.robot)
    words = f"{drive.checkpoints} of {len(world.course.sequence) - 1} checkpoints; "
    words += f"lower bound {bound:.2f} s{_above(drive, bound)}"
    reference = reference_s(world.course, world.robot)
    if reference is not None:
        words += f"; the fastest drive an optimiser found {reference:.2f} s{_above(drive, reference)}"
    if world.course.name == "paper":
        words += f"; the paper's best {PAPER_BEST_S} s"
    return words + "."


def _above(drive: Drive, time_s: float) -> str:
    if drive.outcome != Outcome.GOAL:
        return ""
    share = 100.0 * (drive.time_s / time_s - 1.0)
    return f" ({abs(share):.0f} % {'above' if share >= 0.0 else 'below'} it)"


def detail_of(world: World, drive: Drive) -> str:
    """Say what a drive is measured by: checkpoints, lower bound, and what it was simulated with."""
    course = world.course
    parts = [
        f"{drive.checkpoints} of {len(course.sequence) - 1} checkpoints",
        bound_words(course.lower_bound_s(world.robot)),
        f"robot {world.robot.name}",
        f"step {1000 * world.step_s:g} ms",
    ]
    noise = world.noise
    if noise.sensor_pct or noise.motor_share:
        parts.append(f"noise: sensor {noise.sensor_pct:g} %, motors {100 * noise.motor_share:g} %")
    return " · ".join(parts)


def drive_table(world: World, drive: Drive) -> dict[str, Any]:
    """Return a drive's figures, ready for JSON."""
    return {
        "outcome": drive.outcome.name.lower(),
        "reached_goal": drive.outcome == Outcome.GOAL,
        "time_s": round(drive.time_s, 6),
        "checkpoints": drive.checkpoints,
        "checkpoints_of": len(world.course.sequence) - 1,
        "arrival_s": [None if np.isnan(t) else round(float(t), 6) for t in drive.arrival_s],
        "lower_bound_s": round(world.course.lower_bound_s(world.robot), 4),
        "reference_s": reference_s(world.course, world.robot),
        "course": world.course.name,
        "robot": world.robot.name,
        "engine": "pymunk" if world.uses_pymunk else "inline",
    }
