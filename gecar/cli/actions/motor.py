"""A motor's speeds for ``gecar motor``: simulated, recorded, as a picture and a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from gecar.cli.output import Output
from gecar.errors import expected
from gecar.plots.reality.motor import Curve, motor_speed
from gecar.plots.style import picture_kind, save
from gecar.reality.recordings.bench_speed import steady_speeds
from gecar.reality.recordings.recording import read_recording
from gecar.world.motor_bench import altered, settled_speeds
from gecar.world.robot import Robot, load_robot

LEVELS_PCT = tuple(range(0, 101, 5))
Speeds = Mapping[float, float]
"""Speed [deg/s] by level [%]."""


def draw_motor(output: Output, benches: Sequence[Path], robot_name: str, out: Path) -> None:
    """Simulate a robot's motor, compare it with recordings in a picture, and print a table.

    Parameters
    ----------
    output
        Where text is printed.
    benches
        Folders of recordings, one for each motor.
    robot_name
        The robot's name or file.
    out
        The picture.

    Raises
    ------
    InputError
        If there is no such robot, a folder is absent or holds no motor with a duty held, or a recording is wrong.
    """
    picture_kind(out, "--out")
    robot = load_robot(robot_name)
    recorded = {_name(bench): bench_speeds(bench) for bench in benches}
    regulated, powered = (simulated(altered(robot, mode)) for mode in ("speed", "duty"))
    uncapped = simulated(altered(robot, "duty", 1.0))
    cap = 100.0 * robot.drive.duty_cap
    detail = f"robot {robot.name}, settled after 2 s at each level, wheels in the air"
    figure = motor_speed(
        _curve(regulated),
        _curve(powered),
        _curve(uncapped),
        {name: _curve(speeds) for name, speeds in recorded.items()},
        cap,
        f"The motor's limit: {cap:g} % of the supply, {max(powered.values()):.0f} deg/s",
        detail,
    )
    output.print(_table(regulated, powered, recorded))
    out.parent.mkdir(parents=True, exist_ok=True)
    output.print(f"\nPicture: {save(figure, out)}")
    output.print_json(
        {
            "robot": robot.name,
            "limit_pct": cap,
            "speed_command_deg_s": regulated,
            "duty_command_deg_s": powered,
            "without_cap_deg_s": uncapped,
            "recorded_deg_s": recorded,
            "picture": str(out),
        }
    )


def simulated(robot: Robot) -> Speeds:
    """Return the robot's settled speeds by level."""
    speeds = settled_speeds(robot, LEVELS_PCT)
    return {float(level): float(speed) for level, speed in zip(LEVELS_PCT, speeds, strict=True)}


def bench_speeds(folder: Path) -> Speeds:
    """Return a real motor's speeds by duty; levels recorded in both directions or more than once are averaged.

    Raises
    ------
    InputError
        If the folder is absent, or no recording in it holds one duty on a bench.
    """
    if not folder.is_dir():
        found = "no such folder" if not folder.exists() else "a file"
        raise expected(
            folder, found, 'a folder with a motor\'s recordings (.csv, with rig = "bench" in their .toml)'
        )
    steady = steady_speeds([read_recording(path) for path in sorted(folder.glob("*.csv"))])
    if not steady:
        raise expected(
            folder, "no recording of one duty held", 'recordings (.csv) with rig = "bench" in their .toml'
        )
    by_level: dict[float, list[float]] = {}
    for each in steady:
        by_level.setdefault(abs(round(each.duty_pct, 3)), []).append(abs(each.speed_deg_s))
    return {level: float(np.mean(speeds)) for level, speeds in sorted(by_level.items())}


def _curve(speeds: Speeds) -> Curve:
    return Curve(np.array(list(speeds), float), np.array(list(speeds.values()), float))


def _name(folder: Path) -> str:
    return folder.resolve().name.replace("_", " ")


def _table(regulated: Speeds, powered: Speeds, bench: Mapping[str, Speeds]) -> Table:
    """Return a row for each level: the simulated motor's speeds, and those of real ones under duty commands."""
    table = Table("level [%]", "speed command [deg/s]", "duty command [deg/s]", box=None, pad_edge=False)
    for name in bench:
        table.add_column(f"{name} [deg/s]")
    for column in table.columns:
        column.justify = "right"
    for level in sorted(set().union(powered, *bench.values())):
        speeds = [each.get(level) for each in (regulated, powered, *bench.values())]
        table.add_row(f"{level:g}", *("" if speed is None else f"{speed:.0f}" for speed in speeds))
    return table
