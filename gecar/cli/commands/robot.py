"""``gecar robot``: list and show robots."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.output import JsonOption, Output

if TYPE_CHECKING:
    from gecar.world.robot import Robot

robot = typer.Typer(
    name="robot",
    help="List, show and make robots.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    add_completion=False,
)


@robot.command("list")
def list_all(as_json: JsonOption = False) -> None:
    """List the robots that ship with gecar."""
    from rich.table import Table

    from gecar.world.robot import list_robots, load_robot, robot_file

    output = Output(as_json)
    found = {name: {**facts(load_robot(name)), "title": _title(robot_file(name))} for name in list_robots()}
    table = Table(
        "robot", "top speed", "time constant", "track", "sensor ahead", "", box=None, pad_edge=False
    )
    for name, each in found.items():
        table.add_row(
            name,
            f"{each['top_speed_m_s']:.3f} m/s",
            f"{1000.0 * each['time_constant_s']:.0f} ms",
            f"{1000.0 * each['track_width_m']:.0f} mm",
            f"{1000.0 * each['sensor_ahead_m']:.0f} mm",
            each["title"],
        )
    output.print(table)
    output.print_json({"robots": found})


@robot.command()
def show(
    name: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A name or a robot file (.toml).", show_default=False)
    ],
    as_json: JsonOption = False,
) -> None:
    """Show a robot's file: every constant, its unit, and its source.

    [bold]Example[/]

      gecar robot show paper
    """
    from gecar.files import read_text
    from gecar.world.robot import load_robot, robot_file

    output = Output(as_json)
    loaded = load_robot(name)
    output.print(read_text(robot_file(name), "a robot file").rstrip())
    output.print_json({"robot": name, **facts(loaded), "constants": loaded.model_dump()})


@robot.command()
def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="File to write, NAME.toml.", show_default=False)
    ],
    like: Annotated[
        str, typer.Option("--like", metavar="NAME|FILE", help="Robot whose file is copied.")
    ] = "ev3",
    as_json: JsonOption = False,
) -> None:
    """Write a template for a robot: every constant with its unit and source.

    [bold]Example[/]

      gecar robot new mine.toml
      gecar evolve --robot mine.toml
    """
    from gecar.calling import command
    from gecar.errors import expected
    from gecar.files import read_text, write_whole
    from gecar.world.robot import load_robot, robot_file

    output = Output(as_json)
    if file.suffix != ".toml":
        raise expected("FILE", f"'{file}'", "a name that ends in .toml")
    if file.exists():
        raise expected(file, "a file that exists", "a new name")
    named = load_robot(like).name
    text = read_text(robot_file(like), "a robot file")
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, text.replace(f'name = "{named}"', f"name = {json.dumps(file.stem)}", 1))
    output.print(f"Wrote {file}. Edit it, then: {command()} evolve --robot {file}")
    output.print_json({"file": str(file)})


def facts(loaded: Robot) -> dict[str, Any]:
    """Return a robot's figures, ready for JSON."""
    from gecar.world.course.lower_bound.fastest_time import sprint
    from gecar.world.kernel.motor import FULL_SPEED

    fastest = sprint(loaded)
    regulated = loaded.drive.mode == "speed"
    free = FULL_SPEED if regulated else loaded.battery.voltage / loaded.motor.back_emf_constant
    return {
        "top_speed_m_s": min(fastest.limit, loaded.drive.duty_cap * free * loaded.body.wheel_radius),
        "time_constant_s": fastest.time_constant,
        "track_width_m": loaded.body.track_width,
        "sensor_ahead_m": loaded.colour_sensor.ahead,
        "mode": loaded.drive.mode,
        "effects": sorted(loaded.effects),
    }


def _title(file: Path) -> str:
    """Return a robot file's first line where that is a comment."""
    from gecar.files import read_text

    first = read_text(file, "a robot file").partition("\n")[0]
    return first.lstrip("# ") if first.startswith("#") else ""
