"""``gecar calibrate``: fit the robot's constants to recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.output import JsonOption, Output


def calibrate(
    case: Annotated[
        Path, typer.Argument(metavar="CASE", show_default=False,
                             help="A folder of recordings of one robot; or one recording.")
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Folder for robot.toml, calibration.json and the picture.")
    ] = Path("calibrated"),
    holdout: Annotated[
        str, typer.Option("--holdout", metavar="NAMES", show_default="every fourth",
                          help="Held-out recordings, for validation, separated by commas."),
    ] = "",
    robot: Annotated[
        str, typer.Option("--robot", metavar="NAME|FILE", show_default="what the recordings name",
                          help="Robot whose constants the fit starts from."),
    ] = "",
    constants: Annotated[
        str, typer.Option("--constants", metavar="NAMES", show_default="the usual ones",
                          help="Constants to fit, named as in a robot file: battery.voltage,motor.inertia."),
    ] = "",
    picture: Annotated[bool, typer.Option("--picture/--no-picture", help="Draw calibration.png.")] = True,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Fit the robot's constants, with 95 % intervals; name those the recordings cannot determine.

    The result is a robot file, for use with every command.

    [bold]Examples[/]

      gecar calibrate recordings/monday --out calibrated
      gecar calibrate recordings/bench --holdout step_040,step_080 --json
      gecar evolve --robot calibrated/robot.toml
    """
    from gecar.cli.inputs import warnings_of
    from gecar.files import json_text, write_whole
    from gecar.reality.calibrate.calibration import calibrate as calibrate_case
    from gecar.reality.recordings.recording import read_case
    from gecar.report.calibration import calibration_lines, calibration_table
    from gecar.world.robot import load_robot, write_robot

    output = Output(as_json)
    recorded = read_case(case)
    known = load_robot(robot or recorded.recordings[0].setup.robot)
    output.warn(warnings_of(recorded.recordings, known))
    result = calibrate_case(
        recorded,
        _names(holdout),
        known,
        _names(constants),
        lambda line: output.print(f"  {line}", style="dim"),
    )
    out.mkdir(parents=True, exist_ok=True)
    table = calibration_table(result)
    written = {"robot": str(out / "robot.toml"), "table": str(out / "calibration.json")}
    write_whole(out / "calibration.json", json_text(table))
    write_robot(result.robot, out / "robot.toml")
    if picture:
        from gecar.plots.reality.calibration import calibration_figure
        from gecar.plots.style import save

        written["picture"] = str(save(calibration_figure(result), out / "calibration.png"))
    for line in calibration_lines(result):
        output.print(line)
    output.print(f"Robot: {written['robot']}")
    output.print_json({**table, "written": written})


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]
