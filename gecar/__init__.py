"""Evolve readable robot programs in a fast planar simulation, and close the gap to the real robot.

>>> import gecar
>>> run = gecar.evolve(course="hairpin")
>>> gecar.simulate(run.program, course="hairpin", robot="ev3")
>>> gecar.discover("recordings/monday")

Modules are imported when they are used, so that ``import gecar`` alone is fast.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PLACES = {
    "Run": "gecar.api",
    "Simulation": "gecar.api",
    "discover": "gecar.api",
    "evolve": "gecar.api",
    "simulate": "gecar.api",
    "InputError": "gecar.errors",
    "load_course": "gecar.world.course.course",
    "load_grammar": "gecar.language.grammar",
    "load_robot": "gecar.world.robot",
    "parse_program": "gecar.language.program",
    "read_case": "gecar.reality.recordings.recording",
    "read_program": "gecar.language.program",
    "read_recording": "gecar.reality.recordings.recording",
}
"""Public names and their modules; `gecar/__init__.pyi` lists them for type checkers."""


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'gecar' has no attribute '{name}'")
    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_PLACES])
