"""Recordings of a program driven by a robot that differs from the nominal one: what tests of the gap share."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gecar.language.program import parse_program
from gecar.reality.recordings.recording import Recording, make_recording, write_recording
from gecar.reality.recordings.setup import Setup
from gecar.world.course.course import load_course
from gecar.world.robot import Robot, load_robot
from gecar.world.rollout import Noise, World, simulate

ARRIVES = "if(SensorValue > 85):\n    motor(70,100,10)\nelse:\n    motor(20,-80,110)"
SENSOR_FREE = "motor(60,40,200)\nmotor(-50,50,180)\nmotor(30,80,150)\nmotor(-40,-70,120)\nmotor(90,90,160)\n"


def weak_robot(scale: float = 0.93) -> Robot:
    """Return a robot whose battery is low."""
    nominal = load_robot("ev3")
    battery = nominal.battery.model_copy(update={"voltage": scale * nominal.battery.voltage})
    return nominal.model_copy(update={"battery": battery})


def trial(name: str, robot: Robot, source: str = ARRIVES, seed: int = 1, posed: bool = True) -> Recording:
    """Return a recording of a program, with a camera every third row."""
    drive = simulate(
        World(robot, load_course("paper"), noise=Noise(1.0, 0.0)), parse_program(source).opcodes, seed, True
    )
    trace, rng = drive.trace, np.random.default_rng(seed)
    t = trace["t_s"]
    unseen = (len(t) - 1 - np.arange(len(t))) % 3 != 0

    def camera(values, noise):
        return np.where(unseen, np.nan, values + rng.normal(0.0, noise, len(t)))

    columns = {
        "t_s": t,
        "left_duty_pct": 100 * trace["left_duty"],
        "right_duty_pct": 100 * trace["right_duty"],
        "left_angle_deg": np.round(np.degrees(trace["left_angle_rad"])),
        "right_angle_deg": np.round(np.degrees(trace["right_angle_rad"])),
        "reflection_pct": trace["reflection_pct"],
    }
    if posed:
        columns |= {
            "x_m": camera(trace["x_m"], 1e-4),
            "y_m": camera(trace["y_m"], 1e-4),
            "heading_deg": camera(np.degrees(trace["heading_rad"]), 0.1),
        }
    return make_recording(name, columns, Setup(program=source))


def write_trials(folder: Path, count: int = 2) -> None:
    """Write trials of a weak robot into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for k in range(count):
        name = f"trial_{k + 1}"
        write_recording(trial(name, weak_robot(0.96 - 0.01 * k)), folder / f"{name}.csv")
