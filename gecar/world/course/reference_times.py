"""Reference times: the fastest drives an optimiser found, for the robot and the courses that come with gecar.

`python -m benchmarks.reference_times` searches for them and writes the table. A reference drive needs no sensor and
no program: it is what the robot can do on a course, where the lower bound is what it cannot, as far as its tyres hold.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gecar.files import read_toml
from gecar.world.course.course import Course, list_courses, load_course
from gecar.world.robot import Robot, load_robot

TABLE = Path(__file__).with_suffix(".toml")


@cache
def reference_table() -> dict[str, Any]:
    """Return the table: ``robot``, and by course ``time_s`` and the ``points`` the drive steers towards."""
    return dict(read_toml(TABLE, "the table of reference times"))


def reference_s(course: Course, robot: Robot) -> float | None:
    """Return a course's reference time [s]; None for another robot, or a course that is not as it came with gecar."""
    found = reference_table().get(course.name)
    if not isinstance(found, dict) or course.name not in list_courses():
        return None
    if robot != load_robot(reference_table()["robot"]) or not _same(course, load_course(course.name)):
        return None
    return float(found["time_s"])


def _same(a: Course, b: Course) -> bool:
    alike = a.layout == b.layout and a.start == b.start and a.obstacles == b.obstacles
    return alike and np.array_equal(a.sequence, b.sequence) and np.array_equal(a.walls, b.walls)
