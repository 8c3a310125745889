"""Where a result comes from: versions, commit, and fingerprints of grammar, course and robot."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from gecar import __version__
from gecar.language.grammar import Grammar
from gecar.world.course.course import Course
from gecar.world.robot import Robot

_LIBRARIES = ("numpy", "numba", "pymunk", "scipy", "shapely")


def versions() -> dict[str, str]:
    """Return the versions of everything that computes, and gecar's git commit where it runs from a repository."""
    found = {"gecar": __version__, "git": commit(), "python": platform.python_version()}
    found["system"] = f"{platform.system()} {platform.machine()}"
    return found | {library: _installed(library) for library in _LIBRARIES}


def commit() -> str:
    """Return the commit gecar runs from, with ``-dirty`` where files were changed since; empty if there is none."""
    git, here = shutil.which("git"), Path(__file__).parents[2]
    if git is None or not (here / ".git").exists():
        return ""
    command = [git, "-C", str(here), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        return ""
    return said.stdout.strip()


FITS_ONLY = {"voltage_low", "voltage_high"}  # of a battery: bounds of fits, which change no drive


def fingerprints(grammar: Grammar, courses: Sequence[Course], robot: Robot) -> dict[str, str]:
    """Return hashes of what a run reads, by what it says and not by how its files are written."""
    laid = [course_fingerprint(course) for course in courses]
    rules = [(rule.name, [production.parts for production in rule.productions]) for rule in grammar.rules]
    return {
        "grammar": _hash(repr(rules)),
        "course": laid[0] if len(laid) == 1 else _hash(repr(laid)),
        "robot": _hash(robot.model_dump_json(exclude={"battery": FITS_ONLY})),
    }


def course_fingerprint(course: Course) -> str:
    """Return a hash of what lies on a course."""
    image = course.image and (course.image.brightness.tobytes(), course.image.pixels_per_metre)
    laid = (
        course.layout, course.start, course.start_tile, course.sequence.tolist(), course.walls.tolist(),
        course.obstacles, image,
    )  # fmt: skip
    return _hash(repr(laid))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _installed(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return ""
