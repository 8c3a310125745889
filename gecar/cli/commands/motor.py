"""``gecar motor``: the motor's speed under speed and duty commands, the paper's Figs 7 and 8."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.options import RobotOption
from gecar.cli.output import JsonOption, Output


def motor(
    benches: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FOLDER", show_default=False,
                       help="Recordings of motors on a bench, one folder per motor."),
    ] = None,
    robot: RobotOption = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="FILE", help="Name of the picture: .png, .pdf or .svg.")
    ] = Path("motor.png"),
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Draw the motor's speed under speed commands and duty commands: the paper's Figs 7 and 8.

    [bold]Examples[/]

      gecar motor
      gecar motor recordings/motor_a recordings/motor_b --out figures/motor.png
      gecar motor --robot my_robot.toml
    """
    from gecar.cli.actions.motor import draw_motor

    draw_motor(Output(as_json), benches or [], robot or "ev3", out)
