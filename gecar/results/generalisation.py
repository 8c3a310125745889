"""How many courses a program drives that it was not evolved on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gecar.errors import expected
from gecar.files import read_rows
from gecar.language.program import Program
from gecar.parallel.executors import usable_cores
from gecar.results.arrival import percent
from gecar.results.provenance import course_fingerprint
from gecar.search.chance import arrivals
from gecar.search.programs import noise_seed
from gecar.world.course.course import Course, course_names, load_course, load_courses
from gecar.world.rollout import Outcome, World, simulate

UNSEEN = 100
"""Random courses that a program evolved on several is tested on."""
DRAWS = 4
"""Drives under random conditions on each, beside that of the nominal robot."""
_FIRST, _STREAM = 1_000_001, 1_000_121


class CourseDrive(NamedTuple):
    """How a program fares on one course.

    Attributes
    ----------
    course
        Its name.
    driven
        1 if the nominal robot reaches GOAL, else 0.
    time_s
        When its drive ended [s].
    checkpoints, of
        Checkpoints it passed, and how many there are.
    lower_bound_s
        Of the time to GOAL [s].
    arrived
        How many of `DRAWS` drives under random conditions reach GOAL.
    """

    course: str
    driven: int
    time_s: float
    checkpoints: int
    of: int
    lower_bound_s: float
    arrived: int


def unseen_courses(trained: Sequence[Course], count: int = UNSEEN) -> str:
    """Return the names of random courses, none of which is one of those given: ``random:1000001-1000100``."""
    known, first = {course_fingerprint(course) for course in trained}, _FIRST
    while True:
        names = f"random:{first}-{first + count - 1}"
        if known.isdisjoint(course_fingerprint(course) for course in load_courses(names)):
            return names
        first += count


def drives_on(world: World, program: Program, courses: str, seed: int) -> list[CourseDrive]:
    """Drive a program on courses, one after the other, as a floor takes some 20 MB.

    Parameters
    ----------
    world
        Robot and settings; its own course does not matter.
    program
        The program.
    courses
        Their names, as for `gecar.world.course.course.course_names`.
    seed
        Where noise and random conditions come from.
    """

    def driven(numbered: tuple[int, str]) -> CourseDrive:
        number, name = numbered
        return _driven(replace(world, course=load_course(name)), name, program, (seed, _STREAM, number))

    with ThreadPoolExecutor(usable_cores()) as threads:
        return list(threads.map(driven, enumerate(course_names(courses))))


def _driven(world: World, name: str, program: Program, seed: tuple[int, ...]) -> CourseDrive:
    drive = simulate(world, program.opcodes, noise_seed(seed[0], program))
    (drawn,) = arrivals(world, [program.opcodes], DRAWS, seed)
    return CourseDrive(
        name,
        int(drive.outcome == Outcome.GOAL),
        drive.time_s,
        drive.checkpoints,
        len(world.course.checkpoints),
        world.course.lower_bound_s(world.robot),
        int(np.isfinite(drawn.times_s).sum()),
    )


def summed_up(drives: Sequence[CourseDrive]) -> dict[str, Any]:
    """Return what drives on several courses came to, for result.json.

    Returns
    -------
    dict
        ``driven``: courses on which the nominal robot reaches GOAL, ``of`` so many. ``share``, and ``low`` and
        ``high``, its 95 % interval (Clopper and Pearson, Biometrika 26(4), 1934). ``arrive``: share of the drives under
        random conditions that reach GOAL. ``times_bound``: median time on driven courses over the lower bound, or None.
    """
    from scipy.stats import binomtest  # noqa: PLC0415  a third of a command's start, and seldom wanted

    times = [drive.time_s / drive.lower_bound_s for drive in drives if drive.driven]
    interval = binomtest(len(times), len(drives)).proportion_ci(0.95)
    return {
        "driven": len(times),
        "of": len(drives),
        "share": len(times) / len(drives),
        "low": float(interval.low),
        "high": float(interval.high),
        "arrive": sum(drive.arrived for drive in drives) / (DRAWS * len(drives)),
        "times_bound": float(np.median(times)) if times else None,
    }


def sentence(told: Mapping[str, Any], kind: str = "unseen random courses") -> str:
    """Say what `summed_up` found."""
    words = f"Of {told['of']} {kind} it drives {told['driven']} (95 % interval {percent(told['low'])} to "
    words += f"{percent(told['high'])}); under random conditions {percent(told['arrive'])} of drives arrive"
    if told["times_bound"] is not None:
        words += f"; its time is {told['times_bound']:.2f} times the lower bound (median)"
    return f"{words}."


def drives_csv(drives: Sequence[CourseDrive]) -> str:
    """Write drives as CSV."""
    rows = [
        ",".join(f"{value:.6g}" if isinstance(value, float) else str(value) for value in row)
        for row in drives
    ]
    return "\n".join([",".join(CourseDrive._fields), *rows]) + "\n"


def read_drives(path: Path) -> list[CourseDrive]:
    """Read what `drives_csv` wrote.

    Raises
    ------
    InputError
        If the file is missing or is no such table; names the line.
    """
    drives = read_rows(path, "a table of drives on several courses", CourseDrive)
    if not drives:
        raise expected(path, "no row", "one for each course")
    for number, drive in enumerate(drives, 2):
        if not (math.isfinite(drive.time_s) and 0 <= drive.checkpoints <= drive.of):
            raise expected(
                f"{path}, line {number}", repr(drive), "a time, and checkpoints within their number"
            )
    return drives
