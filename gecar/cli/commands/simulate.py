"""``gecar simulate``: drive a program, and draw or film the drive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.options import (
    CourseOption,
    EngineOption,
    MotorNoiseOption,
    NoiseOption,
    RobotOption,
    TimeLimitOption,
)
from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.language.program import Program
    from gecar.world.rollout import Drive, World

PICTURES = "Pictures"
LARGEST_SEED = 2**63 - 1

ProgramArgument = Annotated[
    Path,
    typer.Argument(
        metavar="PROGRAM",
        show_default=False,
        help="A program file in the paper's syntax, or the folder of a run.",
    ),
]


def simulate(
    program: ProgramArgument,
    course: CourseOption = None,
    robot: RobotOption = None,
    noise: NoiseOption = None,
    motor_noise: MotorNoiseOption = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", help="Seed of the noise.", show_default="as in the run, or 1", rich_help_panel="World"),
    ] = None,
    time_limit: TimeLimitOption = None,
    engine: EngineOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="Output folder for trajectory.png.",
                     show_default="beside the program",
                     rich_help_panel=PICTURES),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="Name of the picture: .png, .pdf or .svg.",
                     show_default="trajectory.png; of a run simulation.png", rich_help_panel=PICTURES),
    ] = None,
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Draw nothing.", rich_help_panel=PICTURES)] = False,
    colour: Annotated[
        str,
        typer.Option("--colour", metavar="auto|line|speed", rich_help_panel=PICTURES,
                     help="Colour the path by the program's line or by speed."),
    ] = "auto",
    animate: Annotated[
        Path | None,
        typer.Option("--animate", metavar="FILE", help="Film the drive: .gif, or .mp4 where ffmpeg is installed.",
                     show_default=False, rich_help_panel=PICTURES),
    ] = None,
    pace: Annotated[
        float, typer.Option("--pace", help="Playback speed of the film; 2: twice real time.", rich_help_panel=PICTURES)
    ] = 1.0,
    page: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write a page that plays the drive, for a classroom.",
                     show_default=False, rich_help_panel=PICTURES),
    ] = None,
    robustness: Annotated[
        Path | None,
        typer.Option("--robustness", metavar="FILE", show_default=False, rich_help_panel=PICTURES,
                     help="Draw the share of drives that arrive as start, battery, grip or noise go off nominal."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option("--record", metavar="FILE", show_default=False, rich_help_panel=PICTURES,
                     help="Save the drive as a recording (.csv), in the format of a real robot's."),
    ] = None,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Drive a program in the simulation; draw or film the drive.

    [bold]Examples[/]

      gecar simulate runs/evolve-001
      gecar simulate best.txt --course hairpin --animate drive.gif
      gecar simulate best.txt --html drive.html
      gecar simulate best.txt --robustness robustness.png
      gecar simulate best.txt --noise 2 --motor-noise 3 --seed 7 --no-picture --json
      gecar simulate best.txt --course random:101-200
    """
    from gecar.cli.inputs import build_world, drive_seed, find_program
    from gecar.language.program import read_program
    from gecar.report.drive import arrival_of, drive_table, sentence_of, standing_of, title_of
    from gecar.results.arrival import arrives
    from gecar.world.course.course import course_names
    from gecar.world.rollout import simulate as run

    output = Output(as_json)
    if seed is not None and not 0 <= seed <= LARGEST_SEED:
        raise expected("--seed", seed, f"a whole number from 0 to {LARGEST_SEED}")
    file, settings = find_program(program)
    if course is not None and len(course_names(course)) > 1:
        made = {"--animate": animate, "--html": page, "--robustness": robustness, "--record": record}
        wrong = next((option for option, value in made.items() if value is not None), None)
        if wrong:
            raise expected(wrong, f"several courses, '{course}'", "one")
        world = build_world(settings, course_names(course)[0], robot, noise, motor_noise, time_limit, engine)
        place = None if no_picture else picture or (out or file.parent) / "courses.png"
        _drive_all(output, world, read_program(file), course, 1 if seed is None else seed, place)
        return
    target = None if no_picture else _target(file, bool(settings), out, picture)
    _check_pictures(target, colour, animate, pace)
    if robustness is not None:
        _check_pictures(robustness, colour, None, pace)
    world = build_world(settings, course, robot, noise, motor_noise, time_limit, engine)
    loaded = read_program(file)
    which = drive_seed(seed, settings, loaded)
    drive = run(world, loaded.opcodes, which, trace=True)
    output.print(sentence_of(drive), style="bold")
    arrival = arrives(world, loaded, which)
    output.print(arrival_of(arrival))
    output.print(standing_of(world, drive))
    title = title_of(drive, world.course, arrival["share"])
    written: dict[str, Any] = _draw(output, world, loaded, drive, target, title, colour)
    written |= _film(output, world, loaded, drive, animate, title, pace)
    written |= _play(output, world, loaded, drive, page, title)
    written |= _robustness(output, world, loaded, robustness, which)
    written |= _record(output, world, loaded, drive, record, course)
    output.print_json(
        {"program": loaded.source, **drive_table(world, drive), "arrives": arrival, "seed": which, **written}
    )


def _drive_all(
    output: Output, world: World, program: Program, courses: str, seed: int, target: Path | None
) -> None:
    """Drive a program on several courses; say and draw which it drives."""
    from gecar.cli.actions.run_pictures import draw_drives
    from gecar.plots.style import picture_kind
    from gecar.results.generalisation import drives_on, sentence, summed_up

    if target is not None:
        picture_kind(target)
        target.parent.mkdir(parents=True, exist_ok=True)
    drives = drives_on(world, program, courses, seed)
    told = summed_up(drives)
    output.print(sentence(told, "courses"), style="bold")
    if target is not None:
        output.print(f"Picture: {draw_drives(drives, target, 'courses')}")
    output.print_json(
        {"program": program.source, "courses": courses, **told, "drives": [each._asdict() for each in drives]}
    )


def _target(file: Path, of_run: bool, out: Path | None, picture: Path | None) -> Path:
    """Return where the picture goes: as told, or beside the program, where a run's own picture stays as it is."""
    if picture is not None:
        return (out or Path()) / picture
    return (out or file.parent) / ("simulation.png" if of_run and out is None else "trajectory.png")


def _check_pictures(target: Path | None, colour: str, animate: Path | None, pace: float) -> None:
    """Refuse before the drive what could not be drawn after it, and make room for the rest."""
    if target is not None:
        from gecar.plots.drives.trajectory import check_colour
        from gecar.plots.style import picture_kind

        picture_kind(target)
        check_colour(colour)
        target.parent.mkdir(parents=True, exist_ok=True)
    if animate is not None:
        from gecar.plots.drives.animation import check_film

        check_film(animate, pace)
        animate.parent.mkdir(parents=True, exist_ok=True)


def _draw(
    output: Output, world: World, program: Program, drive: Drive, target: Path | None, title: str, colour: str
) -> dict[str, str]:
    """Draw the drive if a picture is wanted."""
    if target is None:
        return {}
    from gecar.plots.drives.trajectory import trajectory
    from gecar.plots.style import save
    from gecar.report.drive import detail_of

    detail = detail_of(world, drive)
    save(trajectory(world, program, drive, title=title, detail=detail, colour=colour), target)
    output.print(f"Picture: {target}")
    return {"picture": str(target)}


def _film(
    output: Output, world: World, program: Program, drive: Drive, target: Path | None, title: str, pace: float
) -> dict[str, str]:
    """Film the drive if that is wanted."""
    if target is None:
        return {}
    from gecar.plots.drives.animation import film

    film(world, program, drive, target, title=title, pace=pace)
    output.print(f"Film: {target}")
    return {"film": str(target)}


def _play(
    output: Output, world: World, program: Program, drive: Drive, target: Path | None, title: str
) -> dict[str, str]:
    """Write the drive as a page if that is wanted."""
    if target is None:
        return {}
    from gecar.plots.drives.classroom import write_classroom_page
    from gecar.report.drive import detail_of

    target.parent.mkdir(parents=True, exist_ok=True)
    write_classroom_page(world, program, drive, target, title, detail_of(world, drive))
    output.print(f"Page: {target}")
    return {"page": str(target)}


def _robustness(
    output: Output, world: World, program: Program, target: Path | None, seed: int
) -> dict[str, Any]:
    """Drive the program under conditions that go off nominal one by one if that is wanted; draw it and say it."""
    if target is None:
        return {}
    from gecar.plots.drives.robustness import robustness_figure
    from gecar.plots.style import save
    from gecar.report.drive import robustness_lines, robustness_table
    from gecar.search.robustness import DRAWS, ENOUGH, robustness

    sweeps = robustness(world, program.opcodes, DRAWS, seed)
    enough = f"at least {100 * ENOUGH:.0f} % of drives arrive"
    course = world.course.title or world.course.name
    detail = f"{course} · {DRAWS} drives a point, all else drawn · yellow: {enough}"
    save(robustness_figure(sweeps, "How far off nominal the program still arrives", detail), target)
    output.print("\n".join([f"{enough.capitalize()} with:", *robustness_lines(sweeps)]))
    output.print(f"Picture: {target}")
    return {"robustness": robustness_table(sweeps) | {"picture": str(target)}}


def _record(
    output: Output, world: World, program: Program, drive: Drive, target: Path | None, course: str | None
) -> dict[str, str]:
    """Keep the drive as a recording if that is wanted."""
    if target is None:
        return {}
    from gecar.reality.recordings.recording import write_recording
    from gecar.reality.recordings.synthetic import rehearsal

    target.parent.mkdir(parents=True, exist_ok=True)
    place = str(Path(course).resolve()) if course and Path(course).is_file() else ""
    write_recording(rehearsal(world, program, drive, target.stem, place), target)
    output.print(f"Recording: {target}")
    return {"recording": str(target)}
