"""Write a program as the files that a person copies to a LEGO EV3 or SPIKE hub."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

from gecar.brick import calibration_template, main_template
from gecar.brick.memory_template import keeping_text, memory_text, registers_set
from gecar.brick.python_source import READERS, function_text
from gecar.errors import expected
from gecar.language.program import Program
from gecar.language.statements import If, Statement, While
from gecar.language.values import Sensor
from gecar.world.robot import Robot

_TITLES = {
    "pybricks2": "Drives a LEGO EV3 with EV3 MicroPython 2.0 (Pybricks).",
    "pybricks4": "Drives a LEGO EV3 with Pybricks 4.",
    "spike": "Drives a LEGO SPIKE Prime or Robot Inventor hub with Pybricks 3 or newer.",
}
TARGETS = tuple(_TITLES)
TIME_LIMIT_S = 60  # the paper's
MOST_STATEMENTS = 1000  # MicroPython's jumps reach 32 kB: an if of more statements would not compile
MOST_ROWS = 3000  # for the same reason, those of calculation counted

_CONSTANTS = {
    Sensor.CENTRE: "COLOUR_SENSOR",
    Sensor.LEFT: "LEFT_COLOUR_SENSOR",
    Sensor.RIGHT: "RIGHT_COLOUR_SENSOR",
}


@dataclass(frozen=True)
class Ports:
    """Where motors and sensors are plugged in on an EV3.

    Attributes
    ----------
    left_motor, right_motor
        ``A`` to ``D``; a minus before the letter for a motor mounted the other way round.
    sensor, left_sensor, right_sensor
        ``1`` to ``4``; only those that the program reads matter.
    """

    motors: ClassVar = "ABCD"
    sensors: ClassVar = "1234"
    sensor_prefix: ClassVar = "S"

    left_motor: str = "B"
    right_motor: str = "C"
    sensor: str = "3"
    left_sensor: str = "2"
    right_sensor: str = "4"

    def __post_init__(self) -> None:
        for name in ("left_motor", "right_motor"):
            if not re.fullmatch(f"-?[{self.motors}]", getattr(self, name)):
                ports = f"{_one_of(self.motors)}, or with a minus before it"
                raise expected(f"port of {name}", repr(getattr(self, name)), ports)
        for name in ("sensor", "left_sensor", "right_sensor"):
            if not re.fullmatch(f"[{self.sensors}]", getattr(self, name)):
                raise expected(f"port of {name}", repr(getattr(self, name)), _one_of(self.sensors))

    def of(self, sensor: Sensor) -> str:
        """Return a sensor's port."""
        return {Sensor.CENTRE: self.sensor, Sensor.LEFT: self.left_sensor, Sensor.RIGHT: self.right_sensor}[
            sensor
        ]


@dataclass(frozen=True)
class SpikePorts(Ports):
    """Where motors and sensors are plugged in on a SPIKE or Robot Inventor hub: ``A`` to ``F`` for all."""

    left_motor: str = "-A"
    right_motor: str = "B"
    sensor: str = "C"
    left_sensor: str = "D"
    right_sensor: str = "E"
    motors: ClassVar = "ABCDEF"
    sensors: ClassVar = "ABCDEF"
    sensor_prefix: ClassVar = ""


def _one_of(letters: str) -> str:
    return f"{', '.join(letters[:-1])} or {letters[-1]}"


def default_ports(target: str) -> type[Ports]:
    """Return the ports that a target's hub has."""
    return SpikePorts if target == "spike" else Ports


def export_program(program: Program, robot: Robot, target: str, ports: Ports | None = None) -> dict[str, str]:
    """Write a program as files for the brick.

    Parameters
    ----------
    program
        What to drive.
    robot
        For its wheels, its track, its cap on duty and the sensor levels its thresholds are meant for.
    target
        ``"pybricks2"``: LEGO's EV3 MicroPython 2.0, started from its menu or from Visual Studio Code.
        ``"pybricks4"``: Pybricks 4, started from Pybricks Code. ``"spike"``: Pybricks 3 or newer on a SPIKE Prime or
        Robot Inventor hub.
    ports
        Where motors and sensors are plugged in; default: `Ports`, or `SpikePorts`.

    Returns
    -------
    dict
        Text by file name, with line feeds only. ``main.py`` is the program.

    Raises
    ------
    InputError
        If there is no such target, or the program is empty or too long for a brick.
    """
    if target not in TARGETS:
        raise expected("target", repr(target), f"one of {', '.join(TARGETS)}")
    statements = sum(1 for _ in _all(program.statements))
    if not 1 <= statements <= MOST_STATEMENTS:
        raise expected("program", f"{statements} statements", f"1 to {MOST_STATEMENTS}, to fit on a brick")
    if len(program.opcodes) > MOST_ROWS:
        raise expected(
            "program", f"{len(program.opcodes)} rows of opcodes", f"at most {MOST_ROWS}, to fit on a brick"
        )
    files = {"main.py": _main(program, robot, target, ports or default_ports(target)())}
    return files | _vs_code() if target == "pybricks2" else files


def _all(statements: Sequence[Statement]) -> Iterator[Statement]:
    for statement in statements:
        yield statement
        if isinstance(statement, If):
            yield from _all(statement.then)
            yield from _all(statement.otherwise)
        elif isinstance(statement, While):
            yield from _all(statement.body)


def _main(program: Program, robot: Robot, target: str, ports: Ports) -> str:
    sensors = [sensor for sensor in Sensor if sensor in program.sensors] or [Sensor.CENTRE]
    second = target == "pybricks2"
    text = (
        main_template.TOP
        + function_text(program.statements, registers_set(program))
        + main_template.DRIVING
        + (calibration_template.KEEP_IN_FILE if second else calibration_template.KEEP_IN_STORAGE)
        + main_template.RUN
    )
    words = (
        _robot_words(robot, ports)
        | _hub_words(target)
        | _sensor_words(sensors, ports)
        | _log_words(second, Sensor.CENTRE in sensors)
        | {"TITLE": _TITLES[target], "MEMORY": memory_text(program), "KEEP_READINGS": keeping_text(program)}
    )
    for name, word in words.items():
        text = text.replace(f"[[{name}]]", word)
    return main_template.SHEBANG + text if second else text


def _robot_words(robot: Robot, ports: Ports) -> dict[str, str]:
    """Return what the robot and its build say."""
    command = "run(10 * capped({}))" if robot.drive.mode == "speed" else "dc(capped({}))"
    forward = {
        name: "COUNTERCLOCKWISE" if getattr(ports, name)[0] == "-" else "CLOCKWISE"
        for name in ("left_motor", "right_motor")
    }
    return {
        "LEFT_MOTOR": ports.left_motor[-1],
        "RIGHT_MOTOR": ports.right_motor[-1],
        "LEFT_FORWARD": forward["left_motor"],
        "RIGHT_FORWARD": forward["right_motor"],
        "WHEEL_DIAMETER": f"{2000 * robot.body.wheel_radius:.6g}",
        "TRACK_WIDTH": f"{1000 * robot.body.track_width:.6g}",
        "DUTY_CAP": f"{100 * robot.drive.duty_cap:.6g}",
        "WHITE": f"{robot.colour_sensor.white:.6g}",
        "BLACK": f"{robot.colour_sensor.black:.6g}",
        "LIMIT": str(TIME_LIMIT_S),
        "COMMAND": command.format("left"),
        "COMMAND_RIGHT": command.format("right"),
    }


def _sensor_words(sensors: Sequence[Sensor], ports: Ports) -> dict[str, str]:
    """Return what the sensors that a program reads need."""
    functions = [f"def {READERS[sensor]}():\n    return reading({k})\n\n" for k, sensor in enumerate(sensors)]
    light = sensors.index(Sensor.CENTRE) if Sensor.CENTRE in sensors else None
    return {
        "SENSOR_PORTS": "\n".join(
            f"{_CONSTANTS[sensor]} = Port.{ports.sensor_prefix}{ports.of(sensor)}" for sensor in sensors
        ),
        "SENSORS": "[" + ", ".join(f"ColorSensor({_CONSTANTS[sensor]})" for sensor in sensors) + "]",
        "SENSOR_FUNCTIONS": "\n".join(functions),
        "LIGHT": "0" if light is None else f"reading({light})",
    }


def _hub_words(target: str) -> dict[str, str]:
    """Return what the hub's hardware needs."""
    if target != "spike":
        return {
            "DEVICES": "ev3devices",
            "HUB": "EV3Brick",
            "STOP_BUTTON": "Back",
            "STOP_SETTING": "",
            "SAY": main_template.SAY_ON_SCREEN,
            "ROW_MS": "10",
        }
    return {
        "DEVICES": "pupdevices",
        "HUB": "PrimeHub",
        "STOP_BUTTON": "Bluetooth",
        "STOP_SETTING": "hub.system.set_stop_button(Button.BLUETOOTH)  # or CENTER would end the program\n",
        "SAY": main_template.SAY_IN_TERMINAL,
        "ROW_MS": "20",  # the hub has a quarter of a megabyte for a log of 17 bytes a row
    }


def _log_words(second: bool, with_light: bool) -> dict[str, str]:
    """Return how the log is written: names as `gecar.reality.recordings.columns` has them."""
    light = ['"reflection_pct"'] if with_light else []
    columns = [
        '"t_s"',
        '"left_duty_pct"',
        '"right_duty_pct"',
        *light,
        '"left_angle_deg"',
        '"right_angle_deg"',
        '"battery_v"',
    ]
    values = ", ".join(
        ["time", "left", "right", *(["light"] if light else []), "left_angle", "right_angle", "volts"]
    )
    words = {"COLUMNS": ", ".join(columns) + ","}
    remark = '"# white, black: " + str(calibration)'
    if second:
        return words | {
            "HOW_TO_START": "Copy this folder to the brick (Visual Studio Code: F5) and start main.py.",
            "HOW_TO_GET_THE_LOG": "The run is in gecar_log_(date).csv on the brick: gecar import reads it.",
            "TOOLS": "DataLog, StopWatch, wait",
            "BEFORE_SAVING": '    say("Saving the log,", "wait ...")',
            "OPEN_LOG": f'    log = DataLog(*COLUMNS, name="gecar_log")\n    log.log({remark})',
            "WRITE_ROW": f"log.log({values})",
        }
    return words | {
        "HOW_TO_START": "Open it in Pybricks Code and start it there, with the hub connected.",
        "HOW_TO_GET_THE_LOG": "The run is printed: copy the terminal's text into a file, which gecar import reads.",
        "TOOLS": "StopWatch, wait",
        "BEFORE_SAVING": '    say("Connect again,", "CENTER prints", "the log.")\n    wait_for(Button.CENTER)',
        "OPEN_LOG": f'    print({remark})\n    print(",".join(COLUMNS))',
        "WRITE_ROW": f'print({values}, sep=",")',
    }


def _vs_code() -> dict[str, str]:
    """Return what LEGO's extension for Visual Studio Code writes into a project: F5 runs it, line feeds stay."""
    launch = {
        "version": "0.2.0",
        "configurations": [
            {
                "name": "Download and Run",
                "type": "ev3devBrowser",
                "request": "launch",
                "program": "/home/robot/${workspaceRootFolderName}/main.py",
            }
        ],
    }
    settings = {"files.eol": "\n"}
    return {
        ".vscode/launch.json": json.dumps(launch, indent=4) + "\n",
        ".vscode/settings.json": json.dumps(settings, indent=4) + "\n",
    }
