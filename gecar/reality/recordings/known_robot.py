"""The robot a recording names: whole, or, for a motor on a bench, with only the sections a bench can show."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gecar.errors import expected
from gecar.files import is_file, read_toml
from gecar.reality.recordings.recording import Recording
from gecar.world.robot import Robot, load_robot, robot_from

BENCH_SECTIONS = ("motor", "battery", "drive")
LEAST_BACK_EMF = 1e-9  # V s/rad: a drive that has none, controlled in current


def known_robot(recording: Recording) -> Robot:
    """Load the robot a recording names.

    A bench file may leave out body, tyres and sensor: those of the EV3 then stand in, and touch nothing.

    Raises
    ------
    InputError
        If the file is missing or wrong.
    """
    name = recording.setup.robot
    if recording.setup.rig != "bench" or not is_file(Path(name)):
        return load_robot(name)
    table = read_toml(Path(name), "a robot file")
    if "body" in table:
        return load_robot(name)
    for section in BENCH_SECTIONS:
        if section not in table:
            raise expected(f"{name}, {section}", "nothing", "a section of a robot file")
    whole: dict[str, Any] = load_robot("ev3").model_dump() | table
    motor = dict(whole["motor"])
    motor["back_emf_constant"] = motor.get("back_emf_constant") or LEAST_BACK_EMF
    return robot_from(whole | {"motor": motor}, name)
