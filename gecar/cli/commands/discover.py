"""``gecar discover``: the verdict on what a simulation lacks."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from gecar.cli.output import JsonOption, Output
from gecar.errors import InputError, expected, one_of
from gecar.reality.materiality import DEFAULT, Material


def discover(
    cases: Annotated[
        list[Path],
        typer.Argument(metavar="CASE...", show_default=False,
                       help="Folders, each with recordings of one robot; or one recording."),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FOLDER",
                     help="Output folder; with several cases, one subfolder for each."),
    ] = Path("verdict"),
    holdout: Annotated[
        str,
        typer.Option("--holdout", metavar="NAMES", show_default="every fourth",
                     help="Held-out recordings, for validation, separated by commas."),
    ] = "",
    robot: Annotated[
        str,
        typer.Option("--robot", metavar="NAME|FILE", help="The known robot: the simulation starts from its constants.",
                     show_default="what the recordings name"),
    ] = "",
    seed: Annotated[int, typer.Option("--seed", help="Random seed.")] = 0,
    workers: Annotated[
        int, typer.Option("--workers", help="Number of threads, or of processes with --executor; 0: one per core.")
    ] = 0,
    executor: Annotated[
        str,
        typer.Option("--executor", metavar="serial|process|dask", help="How several cases are run.",
                     show_default="serial: in this process, one after the other"),
    ] = "",
    scheduler: Annotated[
        str,
        typer.Option("--scheduler", metavar="ADDRESS", help="Dask scheduler; default: a cluster on this machine.",
                     show_default=False),
    ] = "",
    with_formula: Annotated[
        bool,
        typer.Option("--with-formula", show_default=False,
                     help="Add the formula for unexplained residuals to the replays, and report what it gains."),
    ] = False,
    material: Annotated[
        float,
        typer.Option("--material", metavar="MM",
                     help="Smallest error that counts, in mm per metre driven (in degrees: a fifth of it)."),
    ] = DEFAULT.mm,
    program: Annotated[
        Path | None,
        typer.Option("--program", metavar="FILE", show_default=False,
                     help="A program or a run folder: report errors as changes of its arrival time, too."),
    ] = None,
    invent: Annotated[
        bool | None,
        typer.Option("--invent/--no-invent", show_default="where a material error remains unexplained",
                     help="Write a law for the error that no effect explains, and add it to the robot."),
    ] = None,
    physics: Annotated[
        str,
        typer.Option("--physics", metavar="FILE", help="Grammar of the laws (BNF)."),
    ] = "physics",
    without: Annotated[
        str,
        typer.Option("--without", metavar="EFFECTS", show_default=False,
                     help="Effects to leave out of the catalogue, separated by commas."),
    ] = "",
    about: Annotated[
        str,
        typer.Option("--about", metavar="EFFECT", show_default="what helps most",
                     help="Effect that the suggested next recording should show."),
    ] = "",
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw pictures and report.html.")] = True,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Find the physics that the simulation lacks, fit it, and test it on held-out recordings.

    [bold]Examples[/]

      gecar discover recordings/monday --out verdicts/monday
      gecar discover recordings/monday --holdout run_07,run_08 --json
      gecar discover recordings/monday --material 2 --program runs/evolve-001
      gecar discover recordings/monday --without battery_resistance
      gecar discover recordings/* --out verdicts --executor process
      gecar evolve --robot verdicts/monday/robot.toml
    """
    from gecar.cli.actions.discover import Task, conclude, conclude_all, say, teller, usual_s
    from gecar.cli.inputs import find_program, warnings_of
    from gecar.cli.progress import Steps
    from gecar.language.program import read_program
    from gecar.parallel.executors import usable_cores
    from gecar.reality.invent.sentences import physics_grammar
    from gecar.reality.recordings.recording import read_case
    from gecar.world.effects import CATALOGUE
    from gecar.world.robot import load_robot

    if not material > 0.0:
        raise expected("--material", material, "a number above 0")
    if workers < 0:
        raise expected("--workers", workers, "a number of 0 or more")
    kind = executor or ("dask" if scheduler else "serial")
    if kind not in ("serial", "process", "dask"):
        raise expected("--executor", repr(kind), "serial, process or dask")
    output, names = Output(as_json), [name.strip() for name in holdout.split(",") if name.strip()]
    known, threads = load_robot(robot) if robot else None, (workers or None) if kind == "serial" else 1
    catalogue = [effect for effect in CATALOGUE if effect.id not in effects_named(without)]
    language = None if invent is False else physics_grammar(physics)
    driven = read_program(find_program(program)[0]) if program is not None else None
    line = Material(material)
    effects_named(about, "--about")
    tasks = {
        folder: Task(
            read_case(case),
            names,
            known,
            seed,
            threads,
            with_formula,
            pictures,
            catalogue,
            line,
            driven,
            language,
            bool(invent),
            about,
        )
        for folder, case in folders(out, cases).items()
    }
    for task in tasks.values():
        recordings = task.case.recordings
        with suppress(InputError):  # the case's own error says so
            output.warn(warnings_of(recordings, known or load_robot(recordings[0].setup.robot)))
    if kind != "serial" or len(tasks) > 1:
        conclude_all(output, tasks, kind, workers or usable_cores(), scheduler)
        return
    with Steps(teller(output), within_s=usual_s(tasks[out].case)) as tell:
        told = conclude(tasks[out], out, tell)
    say(output, told, out)
    output.print_json(told.table)


def effects_named(names: str, option: str = "--without") -> list[str]:
    """Return the effects of a list with commas between.

    Raises
    ------
    InputError
        If there is no such effect.
    """
    from gecar.world.effects import BY_ID

    found = [name.strip() for name in names.split(",") if name.strip()]
    for name in found:
        if name not in BY_ID:
            raise one_of(option, name, BY_ID)
    return found


def folders(out: Path, cases: Sequence[Path]) -> dict[Path, Path]:
    """Return which folder each case goes to: a single one to the given folder itself.

    Raises
    ------
    InputError
        If two cases would go to the same.
    """
    if len(cases) == 1:
        return {out: cases[0]}
    found: dict[Path, Path] = {}
    for case in cases:
        folder = out / case.resolve().name
        if folder in found:
            raise expected("CASE", f"{found[folder]} and {case}", f"different names, for both go to {folder}")
        found[folder] = case
    return found
