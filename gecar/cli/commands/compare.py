"""``gecar compare``: simulation and recordings compared, as in the paper's Tables 6 and 7, Figs 9 and 10."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.options import CourseOption, RobotOption
from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.language.program import Program
    from gecar.reality.recordings.recording import Recording
    from gecar.world.robot import Robot

FRAMES = ("start", "course")
SEED = 1
"""Seed of the drawn conditions that a program's share of arrivals is measured under, as in ``gecar simulate``."""


def compare(
    recordings: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING", show_default=False,
                       help="Recordings (.csv) of one program, or from a bench, or folders of them."),
    ],
    program: Annotated[
        Path | None,
        typer.Option("--program", metavar="FILE", show_default="what the recordings name",
                     help="Program or run folder that gave the commands; without it, recorded commands are replayed."),
    ] = None,
    course: CourseOption = None,
    robot: RobotOption = None,
    frame: Annotated[
        str,
        typer.Option("--frame", metavar="start|course",
                     help="Align positions at the start, as the paper does, or compare them in the course's frame."),
    ] = "start",
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Output folder for compare.png, .md, .csv and .json.")
    ] = Path("compared"),
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Draw nothing.")] = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Compare simulation and recordings: arrival times, paths, displacement, correlation, error of each channel.

    For recordings from a bench: angles and speeds of simulated and measured shafts.

    [bold]Examples[/]

      gecar compare trials/ --program runs/evolve-001
      gecar compare trial_1.csv trial_2.csv --program best.txt --robot calibrated/robot.toml
    """
    from gecar.cli.inputs import warnings_of
    from gecar.reality.compare.gap import gap
    from gecar.report.gap import gap_csv, gap_detail, gap_lines, gap_markdown, gap_table, gap_title
    from gecar.results.arrival import arrives
    from gecar.world.course.course import load_course
    from gecar.world.robot import load_robot
    from gecar.world.rollout import World

    if frame not in FRAMES:
        raise expected("--frame", repr(frame), " or ".join(FRAMES))
    output = Output(as_json)
    trials = _read(recordings)
    driver = load_robot(robot or trials[0].setup.robot)
    output.warn(warnings_of(trials, driver))
    if trials[0].setup.rig == "bench":
        _compare_bench(output, trials, driver, program, out, not no_picture)
        return
    driven = _program(program, trials)
    place = course or trials[0].setup.course
    if driven is not None and place == "none":
        raise expected("--course", "none, a blank floor", "the course the program drove on")
    where = None if place == "none" else load_course(place)
    found = gap(trials, driver, where, driven, frame == "course")
    if driven is not None and where is not None:
        found = replace(found, arrives=arrives(World(driver, where), driven, SEED))
    for line in gap_lines(found):
        output.print(line)
    written = _write(out, gap_markdown(found), gap_csv(found), gap_table(found))
    if not no_picture:
        from gecar.plots.reality.gap import gap_figure
        from gecar.plots.style import save

        written["png"] = str(
            save(gap_figure(found, gap_title(found), gap_detail(found)), out / "compare.png")
        )
    output.print(f"Written: {', '.join(written.values())}")
    output.print_json({**gap_table(found), "written": written})


def _compare_bench(
    output: Output, trials: list[Recording], robot: Robot, program: Path | None, out: Path, picture: bool
) -> None:
    """Set simulated shafts beside those of a bench."""
    from gecar.reality.compare.bench import bench_gap
    from gecar.report.bench import (
        bench_csv,
        bench_detail,
        bench_lines,
        bench_markdown,
        bench_table,
        bench_title,
    )

    if program is not None:
        raise expected("--program", "recordings from a bench", "recordings of a program on the floor")
    found = bench_gap(trials, robot)
    for line in bench_lines(found):
        output.print(line)
    written = _write(out, bench_markdown(found), bench_csv(found), bench_table(found))
    if picture:
        from gecar.plots.reality.bench import bench_figure
        from gecar.plots.style import save

        written["png"] = str(
            save(bench_figure(found, bench_title(found), bench_detail(found)), out / "compare.png")
        )
    output.print(f"Written: {', '.join(written.values())}")
    output.print_json({**bench_table(found), "written": written})


def _read(places: list[Path]) -> list[Recording]:
    """Read recordings, and folders of them: all of a bench or all of the floor, and with a motion to compare."""
    from gecar.reality.recordings.recording import read_case, read_recording

    found: list[Recording] = []
    for place in places:
        found += read_case(place).recordings if place.is_dir() else (read_recording(place),)
    rigs = {recording.setup.rig for recording in found}
    if len(rigs) > 1:
        raise expected(
            "the recordings", "some from a bench and some from the floor", "recordings of one kind"
        )
    for recording in found:
        measured, angles = set(recording.measured), {"left_angle_rad", "right_angle_rad"}
        if recording.setup.rig == "bench" and not measured & angles:
            raise expected(recording.name, "no shaft's angle", "left_angle_deg or right_angle_deg")
        if recording.setup.rig == "floor" and not ({"x_m", "y_m"} <= measured or angles <= measured):
            raise expected(
                recording.name, "neither a pose nor both wheels' angles", "one of them, for the path"
            )
    return found


def _program(place: Path | None, trials: list[Recording]) -> Program | None:
    """Return the program given, or the one that all recordings name, or None."""
    from gecar.cli.inputs import find_program
    from gecar.language.program import parse_program, read_program

    if place is not None:
        return read_program(find_program(place)[0])
    named = {trial.setup.program for trial in trials}
    if len(named) > 1:
        raise expected("the recordings", "different programs", "recordings of one program, or --program")
    text = named.pop()
    return parse_program(text, f"{trials[0].name}, program") if text else None


def _write(out: Path, markdown: str, rows: str, table: dict[str, Any]) -> dict[str, str]:
    """Write the tables; return where."""
    from gecar.files import json_text, write_whole

    out.mkdir(parents=True, exist_ok=True)
    for ending, content in (("md", markdown), ("csv", rows), ("json", json_text(table))):
        write_whole(out / f"compare.{ending}", content)
    return {kind: str(out / f"compare.{kind}") for kind in ("md", "csv", "json")}
