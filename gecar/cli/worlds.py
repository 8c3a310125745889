"""From options to a robot on a course."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gecar.errors import expected
from gecar.world.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Noise, World


def find_program(place: Path) -> tuple[Path, dict[str, Any]]:
    """Find a program's file, and the settings of the run it comes from if it lies in a run's folder.

    Raises
    ------
    InputError
        If a folder holds no best.txt.
    """
    file = place / "best.txt" if place.is_dir() else place
    if place.is_dir() and not file.is_file():
        raise expected(place, "a folder without best.txt", "a program file or a run's folder")
    return file, {}


def build_world(
    settings: dict[str, Any],
    course: str | None = None,
    robot: str | None = None,
    noise_pct: float | None = None,
    motor_noise_pct: float | None = None,
    time_limit_s: float | None = None,
    engine: str | None = None,
) -> World:
    """Put a robot on a course; what is None comes from a run's settings, or else is as in the paper.

    Raises
    ------
    InputError
        If there is no such course or robot, or a number is out of range.
    """

    def chosen(given: Any, name: str, otherwise: Any) -> Any:
        return settings.get(name, otherwise) if given is None else given

    return World(
        load_robot(chosen(robot, "robot", "ev3")),
        load_course(chosen(course, "course", "paper")),
        time_limit_s=chosen(time_limit_s, "time_limit_s", 60.0),
        noise=Noise(chosen(noise_pct, "noise", 0.0), 0.01 * chosen(motor_noise_pct, "motor_noise", 0.0)),
        engine=chosen(engine, "engine", "auto"),
    )
