"""``gecar import``: make recordings from the logs people have on disk."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.reality.recordings.columns import Series
    from gecar.reality.recordings.importing.frame import Frame
    from gecar.reality.recordings.importing.log import Commands
    from gecar.reality.recordings.importing.logs import Imported
    from gecar.reality.recordings.setup import Setup

FILES, CAMERA, RUN = "Contents of the files", "Camera", "The recording"


def import_(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", show_default=False,
                       help="Robot logs, each with one or more runs, and camera logs of these runs."),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE|FOLDER",
                     help="Output file (.csv; a .toml is written beside it), or output folder.",
                     show_default="recordings/LOG.csv"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing recordings.")] = False,
    column: Annotated[
        list[str] | None,
        typer.Option("--column", metavar="NAME=COLUMN[:UNIT]", rich_help_panel=FILES, show_default=False,
                     help="Meaning of a column, if the guess is wrong: lm=left_angle_deg:rad; speed=- ignores it."),
    ] = None,
    constant: Annotated[
        list[str] | None,
        typer.Option("--constant", metavar="COLUMN=VALUE", rich_help_panel=FILES, show_default=False,
                     help="A column that was constant and not logged: left_duty_pct=60."),
    ] = None,
    names: Annotated[
        str | None,
        typer.Option("--names", metavar="A,B,...", rich_help_panel=FILES, show_default=False,
                     help="Column names, for a file without them."),
    ] = None,
    command: Annotated[
        list[str] | None,
        typer.Option("--command", metavar="[COLUMN=]FORMULA", rich_help_panel=FILES, show_default=False,
                     help='A command that was not logged, as a formula of the time t in seconds: "100*sin(2*pi*t)".'),
    ] = None,
    counts: Annotated[
        float | None,
        typer.Option("--counts", metavar="N", rich_help_panel=FILES, show_default=False,
                     help="Encoder counts per wheel turn, if the encoders do not count degrees."),
    ] = None,
    run: Annotated[
        int | None,
        typer.Option("--run", metavar="N", rich_help_panel=FILES, help="Run to import, if a file holds several.",
                     show_default="all, each a recording"),
    ] = None,
    one_clock: Annotated[
        bool,
        typer.Option("--one-clock", rich_help_panel=FILES,
                     help="All files belong to one run with one clock, such as the topics of a ROS bag."),
    ] = False,
    offset: Annotated[
        float | None,
        typer.Option("--offset", metavar="S", rich_help_panel=CAMERA, show_default="found from motion",
                     help="Offset added to the camera's times, in seconds."),
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option("--scale", metavar="M", rich_help_panel=CAMERA, show_default="by name, size and encoders",
                     help="Length of the camera's unit, in metres."),
    ] = None,
    origin: Annotated[
        str, typer.Option("--origin", metavar="X,Y", rich_help_panel=CAMERA,
                          help="The course's lower left corner in the camera's frame, in its unit."),
    ] = "0,0",
    turn: Annotated[
        float, typer.Option("--turn", metavar="DEG", rich_help_panel=CAMERA,
                            help="Counter-clockwise angle from the course's x axis to the camera's."),
    ] = 0.0,
    y_down: Annotated[
        bool | None,
        typer.Option("--y-down/--y-up", rich_help_panel=CAMERA, show_default="by the encoders",
                     help="Direction of the camera's y axis."),
    ] = None,
    clockwise: Annotated[
        bool | None,
        typer.Option("--clockwise/--counter-clockwise", rich_help_panel=CAMERA, show_default="by the encoders",
                     help="Direction in which the camera's headings increase."),
    ] = None,
    heading_zero: Annotated[
        float | None,
        typer.Option("--heading-zero", metavar="DEG", rich_help_panel=CAMERA, show_default="from motion",
                     help="Heading that the camera reports for a robot facing along its x axis."),
    ] = None,
    mark: Annotated[
        str, typer.Option("--mark", metavar="AHEAD,LEFT", rich_help_panel=CAMERA,
                          help="Position of the mark on the robot, from the axle's centre, in metres."),
    ] = "0,0",
    place: Annotated[
        bool, typer.Option("--place", rich_help_panel=CAMERA, help="Move and turn the path to begin at START."),
    ] = False,
    robot: Annotated[
        str, typer.Option("--robot", metavar="NAME|FILE", rich_help_panel=RUN,
                          help="Robot; for a single motor, a file with motor, battery and drive."),
    ] = "ev3",
    course: Annotated[
        str, typer.Option("--course", metavar="NAME|FILE|none", rich_help_panel=RUN, help="Course, or none."),
    ] = "paper",
    duty_cap: Annotated[
        float | None,
        typer.Option("--duty-cap", metavar="PCT", rich_help_panel=RUN,
                     help="Largest duty that reached the motors, in percent; 100: no cap. Robot ev3 has 80.",
                     show_default="by the wheels' speeds, or the robot's"),
    ] = None,
    bench: Annotated[
        bool, typer.Option("--bench", rich_help_panel=RUN, help="Wheels in the air, or a single motor."),
    ] = False,
    program: Annotated[
        Path | None,
        typer.Option("--program", metavar="FILE", rich_help_panel=RUN, show_default=False,
                     help="Program that gave the commands."),
    ] = None,
    notes: Annotated[str, typer.Option("--notes", rich_help_panel=RUN, help="Notes to keep with the recording.")] = "",
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Convert logs of robots and cameras to recordings.

    Reads text (Pybricks DataLogs, output of Arduino and other terminals, Tracker exports, camera tables, ROS topics as
    CSV), MATLAB files up to version 7, and Excel workbooks. Columns, units and axes are guessed and reported. The
    camera's clock is aligned by motion. Damage that is safe to repair is repaired, with a line each; other damage is
    refused with a reason. Every run in a file becomes a recording.

    [bold]Examples[/]

      gecar import gecar_log_2026_11_21.csv
      gecar import terminal.txt tracker.txt --place --program best.txt
      gecar import log.csv camera.csv --origin 112,940 --mark 0.04,0 --out case/run_1.csv
      gecar import step_*.csv --bench --robot motor.toml --out bench/
      gecar import sine.csv --bench --command "100*sin(2*pi*t)" --duty-cap 100
      gecar import serial.txt --column lpwm=left_duty_pct:pwm255 --column rpwm=right_duty_pct:pwm255 --counts 1440
    """
    from gecar.reality.recordings.importing.logs import ImportOptions, import_logs
    from gecar.reality.recordings.importing.meaning import parse_said
    from gecar.reality.recordings.recording import write_recording
    from gecar.world.robot import load_robot

    output = Output(as_json)
    if duty_cap is not None and not 1.0 <= duty_cap <= 100.0:
        raise expected("--duty-cap", duty_cap, "a percentage from 1 to 100")
    if counts is not None and not 0.0 < counts < math.inf:
        raise expected("--counts", counts, "a number above 0")
    options = ImportOptions(
        said=parse_said(column or ()),
        names=tuple(name.strip() for name in names.split(",")) if names else (),
        run=run,
        commands={**_constants(constant or ()), **_formulas(command or (), bench)},
        counts=counts,
        one_clock=one_clock,
        frame=_frame(
            scale,
            y_down,
            clockwise,
            _pair("--origin", origin),
            turn,
            heading_zero,
            mark,
            course if place else None,
        ),
        offset_s=_finite("--offset", offset),
    )
    if out is not None:
        _check_ending(out)
    setup = _setup(robot, course, bench, duty_cap, program, notes)
    imported = import_logs(logs, load_robot(robot), setup, options)
    targets = _targets(out, [each.recording.name for each in imported])
    for target in targets:
        if target.exists() and not force:
            raise expected(target, "a file that is there", "none, or --force to write over it")
    for each, target in zip(imported, targets, strict=True):
        target.parent.mkdir(parents=True, exist_ok=True)
        write_recording(each.recording, target)
    _tell(output, imported, targets)


def _check_ending(out: Path) -> None:
    if out.suffix not in ("", ".csv") and not out.is_dir():
        raise expected("--out", f"'{out}'", "a name that ends in .csv, or a folder")


def _targets(out: Path | None, names: Sequence[str]) -> list[Path]:
    """Return where each recording goes: to the file that was named, numbered if there are several, or into a folder.

    Raises
    ------
    InputError
        If two would go to the same file.
    """
    if out is not None and out.suffix == ".csv":
        if len(names) == 1:
            return [out]
        return [out.with_name(f"{out.stem}_{k}.csv") for k in range(1, len(names) + 1)]
    targets = [(out or Path("recordings")) / f"{name}.csv" for name in names]
    for target in targets:
        if targets.count(target) > 1:
            raise expected(
                f"--out {out or 'recordings'}", f"several logs named {target.stem}", "--out NAME.csv"
            )
    return targets


def _tell(output: Output, imported: Sequence[Imported], targets: Sequence[Path]) -> None:
    """Report what was guessed, repaired and written; what applies to all recordings, once."""
    found = []
    told: set[str] = set()
    for each, target in zip(imported, targets, strict=True):
        recording = each.recording
        for style, lines in ((None, each.guesses), ("yellow", each.repairs)):
            for line in lines:
                if line not in told:
                    output.print(line, style=style)
                told.add(line)
        rows, duration = len(recording.t_s), recording.duration_s
        output.print(
            f"Written: {target}, {rows} rows over {duration:.2f} s with {', '.join(recording.measured) or 'commands'}"
        )
        found.append({
            "recording": str(target),
            "rows": rows,
            "duration_s": duration,
            "measured": recording.measured,
            "duty_cap": recording.setup.duty_cap,
            "guesses": each.guesses,
            "repairs": each.repairs,
            "clock_offset": vars(each.offset) if each.offset else None,
        })  # fmt: skip
    output.print_json(found[0] if len(found) == 1 else {"recordings": found})


def _setup(
    robot: str, course: str, bench: bool, duty_cap: float | None, program: Path | None, notes: str
) -> Setup:
    """Return what goes into the recording's TOML; files of one's own become absolute paths."""
    from gecar.language.program import read_program
    from gecar.reality.recordings.setup import Setup
    from gecar.world.course.course import load_course

    if course != "none":
        load_course(course)
    text = read_program(program).source if program else None
    rig = "bench" if bench else "floor"
    cap = None if duty_cap is None else duty_cap / 100.0
    return Setup(robot=_kept(robot), course=_kept(course), rig=rig, duty_cap=cap, program=text, notes=notes)


def _kept(name: str) -> str:
    return str(Path(name).resolve()) if Path(name).is_file() else name


def _frame(
    scale: float | None, y_down: bool | None, clockwise: bool | None, origin: tuple[float, float], turn: float,
    heading_zero: float | None, mark: str, start_of: str | None,
) -> Frame:  # fmt: skip
    """Return the camera's frame; ``start_of`` is the course whose START the path begins at."""
    from gecar.reality.recordings.importing.frame import Frame
    from gecar.world.course.course import load_course

    if scale is not None and not 0.0 < scale < math.inf:
        raise expected("--scale", scale, "a length above 0")
    start = None
    if start_of == "none":
        raise expected("--place", "the course none", "a course with a START")
    if start_of is not None:
        pose = load_course(start_of).start
        start = (pose.x_m, pose.y_m, pose.heading_rad)
    return Frame(
        scale=scale,
        y_down=y_down,
        heading_clockwise=clockwise,
        origin=origin if any(origin) else None,
        turn_deg=_finite("--turn", turn) or 0.0,
        heading_zero_deg=_finite("--heading-zero", heading_zero),
        mark=_pair("--mark", mark),
        start=start,
    )


def _finite(option: str, value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise expected(option, value, "a number")
    return value


def _number(option: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise expected(option, f"'{text}'", "a number")
    return value


def _pair(option: str, text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise expected(option, f"'{text}'", "two numbers with a comma between")
    return _number(option, parts[0]), _number(option, parts[1])


def _constants(texts: Sequence[str]) -> Commands:
    """Read ``COLUMN=VALUE`` options."""
    from gecar.reality.recordings.columns import COLUMNS

    constants = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name not in COLUMNS or name == "t_s":
            raise expected(
                "--constant", f"'{text}'", f"COLUMN=VALUE with one of {', '.join(list(COLUMNS)[1:])}"
            )
        constants[name] = partial(_constantly, _number("--constant", value))
    return constants


def _constantly(value: float, t_s: Series) -> Series:
    return 0.0 * t_s + value


def _formulas(texts: Sequence[str], bench: bool) -> Commands:
    """Read ``[COLUMN=]FORMULA`` options; without a column it is the left motor's on a bench, both motors' elsewhere."""
    from gecar.reality.recordings.importing.command_formula import command_of
    from gecar.reality.recordings.importing.log import DUTIES

    formulas = {}
    for text in texts:
        name, equals, formula = text.partition("=")
        if equals and name.strip().isidentifier() and not formula.startswith("="):
            if name.strip() not in DUTIES:
                raise expected("--command", f"the column '{name.strip()}'", " or ".join(DUTIES))
            formulas[name.strip()] = command_of(formula)
        else:
            formulas |= dict.fromkeys(DUTIES[:1] if bench else DUTIES, command_of(text))
    return formulas
