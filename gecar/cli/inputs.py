"""From options and runs' folders to programs, and robots on courses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gecar.errors import expected
from gecar.language.program import Program
from gecar.results.config import Config, configure, read_config
from gecar.results.folder import FRONT_FOLDER
from gecar.search.programs import noise_seed
from gecar.world.course.course import course_names, load_course
from gecar.world.robot import Robot, load_robot
from gecar.world.rollout import Noise, World

if TYPE_CHECKING:
    from gecar.reality.recordings.recording import Recording

_OF_A_WORLD = ("course", "robot", "time_limit_s", "step_s", "engine", "noise", "motor_noise", "seed")


def find_program(place: Path) -> tuple[Path, dict[str, Any]]:
    """Find a program's file, and the settings of the run it comes from if it lies in a run's folder, or its front.

    Of a run on several courses they name the first, that of eq. 1.

    Raises
    ------
    InputError
        If a folder holds no best.txt, or its config.toml is wrong.
    """
    file = place / "best.txt" if place.is_dir() else place
    if place.is_dir() and not file.is_file():
        raise expected(place, "a folder without best.txt", "a program file or a run's folder")
    run = file.parent.parent if file.parent.name == FRONT_FOLDER else file.parent
    of_run = file.name == "best.txt" or run != file.parent
    if not of_run or not (run / "config.toml").is_file():
        return file, {}
    config = read_run_config(run)
    settings = {name: getattr(config, name) for name in _OF_A_WORLD}
    return file, settings | {"course": course_names(config.course)[0]}


def read_run_config(folder: Path) -> Config:
    """Read the configuration a run's folder holds.

    Raises
    ------
    InputError
        If there is none, or it is wrong.
    """
    place = folder / "config.toml"
    if folder.is_dir() and not place.is_file():
        raise expected(
            folder, "a folder without config.toml", "the folder of a run, as gecar evolve makes it"
        )
    return configure(read_config(place), place)


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
    plain = Config()

    def chosen(given: Any, name: str) -> Any:
        return settings.get(name, getattr(plain, name)) if given is None else given

    return World(
        load_robot(chosen(robot, "robot")),
        load_course(chosen(course, "course")),
        chosen(None, "step_s"),
        chosen(time_limit_s, "time_limit_s"),
        Noise(chosen(noise_pct, "noise"), 0.01 * chosen(motor_noise_pct, "motor_noise")),
        chosen(engine, "engine"),
    )


def drive_seed(given: int | None, settings: dict[str, Any], program: Program) -> int:
    """Return the seed of a drive's noise: as given, or as the run scored the program, or 1."""
    if given is not None:
        return given
    return noise_seed(settings["seed"], program) if settings else 1


def warnings_of(recordings: Sequence[Recording], robot: Robot) -> list[str]:
    """Return what was passed over in reading recordings, and whether a cap on duty surely did not hold."""
    from gecar.reality.recordings.duty_cap import cap_warning

    found = dict.fromkeys(line for recording in recordings for line in recording.warnings)
    return [line for line in (*found, cap_warning(recordings, robot)) if line]
