"""``gecar export``: write a program as main.py for the brick."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.options import RobotOption
from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

PORTS = "Where things are plugged in"


def _port(name: str, words: str) -> typer.models.OptionInfo:
    return typer.Option(f"--{name}", metavar="PORT", help=words, rich_help_panel=PORTS)


def export(
    program: Annotated[
        Path,
        typer.Argument(metavar="PROGRAM", show_default=False,
                       help="A program file in the paper's syntax, or the folder of a run."),
    ],
    target: Annotated[
        str,
        typer.Option("--target", metavar="pybricks2|pybricks4|spike",
                     help="pybricks2: EV3 MicroPython 2.0; pybricks4: Pybricks 4 on an EV3; spike: Pybricks on a SPIKE "
                          "Prime or Robot Inventor hub."),
    ] = "pybricks2",
    robot: RobotOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="Output folder.", show_default="brick"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    left_motor: Annotated[
        str | None,
        _port("left-motor", "EV3: A to D (B); SPIKE: A to F (-A). With a minus: mounted in reverse."),
    ] = None,
    right_motor: Annotated[str | None, _port("right-motor", "Likewise (C; SPIKE: B).")] = None,
    sensor: Annotated[str | None, _port("sensor", "SensorValue. EV3: 1 to 4 (3); SPIKE: A to F (C).")] = None,
    left_sensor: Annotated[str | None, _port("left-sensor", "LeftSensorValue (2; SPIKE: D).")] = None,
    right_sensor: Annotated[str | None, _port("right-sensor", "RightSensorValue (4; SPIKE: E).")] = None,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Write a program as main.py for the brick.

    The file contains the program as readable Python. On the brick it asks for the sensor's calibration, starts when a
    button is pressed, stops after 60 s or when a button is pressed, and writes a log for gecar import.

    [bold]Examples[/]

      gecar export runs/evolve-001
      gecar export best.txt --target pybricks4 --out brick4
      gecar export runs/spike-001 --target spike
      gecar export best.txt --robot my_robot.toml --left-motor -A --right-motor -D --sensor 1
    """
    from gecar.brick.export import default_ports, export_program
    from gecar.cli.inputs import find_program
    from gecar.language.program import read_program
    from gecar.world.robot import load_robot

    output = Output(as_json)
    file, settings = find_program(program)
    loaded = read_program(file)
    given = {
        "left_motor": left_motor, "right_motor": right_motor,
        "sensor": sensor, "left_sensor": left_sensor, "right_sensor": right_sensor,
    }  # fmt: skip
    plugs = default_ports(target)(**{name: port.upper() for name, port in given.items() if port is not None})
    driver = load_robot(settings.get("robot", "ev3") if robot is None else robot)
    folder = out or Path("brick")
    written = _write(export_program(loaded, driver, target, plugs), folder, force)
    output.print(loaded.source)
    output.print(f"Written: {', '.join(written)}")
    output.print(
        f"Copy the folder {folder} to the brick." if target == "pybricks2" else "Open it in Pybricks Code."
    )
    output.print_json({"program": loaded.source, "target": target, "files": written})


def _write(files: dict[str, str], folder: Path, force: bool) -> list[str]:
    """Write files into a folder, and return their paths."""
    from gecar.files import write_whole

    for name in files:
        if (folder / name).exists() and not force:
            raise expected(folder / name, "a file that is there", "none, or --force to write over it")
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole(folder / name, text)
    return [str(folder / name) for name in files]
