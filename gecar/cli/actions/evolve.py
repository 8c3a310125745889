"""A run of ``gecar evolve``, from its start to its report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import typer

from gecar.calling import command
from gecar.cli.actions.run_pictures import draw_run
from gecar.cli.inputs import drive_seed
from gecar.cli.output import Output
from gecar.cli.progress import Watch
from gecar.compiled import is_cold, mark_warm
from gecar.evolution.scores import UNSOLVED
from gecar.report.drive import arrival_of, sentence_of, standing_of
from gecar.report.runs import courses_title, effort_of, front_table
from gecar.results.config import configure, merged, read_config
from gecar.results.folder import FRONT_FOLDER
from gecar.results.generalisation import sentence
from gecar.results.run import Started, finish, resume, start
from gecar.search.chance import AS_GOOD
from gecar.search.settings import default_preset
from gecar.world.rollout import simulate


def begin(file: Path | None, changes: dict[str, Any], out: Path | None, again: bool) -> Started:
    """Start a run, or go on with one.

    Parameters
    ----------
    file
        Settings; where neither it nor the options name a preset, it is that of `default_preset`.
    changes
        Options, laid over them.
    out
        The run's folder; by default named by course, preset and seed.
    again
        Whether to go on in it.

    Raises
    ------
    InputError
        As `gecar.results.run.start` or `resume`.
    """
    read = read_config(file) if file else {}
    begun = {"preset": default_preset({**read.get("search", {}), **changes.get("search", {})})} | read
    table = merged(begun, changes)
    wanted = configure(table, file or "options")
    folder = out or Path("runs") / f"{wanted.course_name}-{wanted.preset}-seed{wanted.seed}"
    return resume(folder, table if file else changes) if again else start(wanted, folder)


def run_to_the_end(output: Output, started: Started, pictures: bool, quiet: bool) -> None:
    """Run, draw and tell; Ctrl-C ends it with the run saved.

    Parameters
    ----------
    output
        Where words go.
    started
        New or resumed.
    pictures, quiet
        Whether to draw; whether to keep still until the end.
    """
    if not quiet:
        _announce(output, started)
    result = finish_watched(started, quiet)
    drawn = [str(path) for path in draw_run(started.folder.path)] if pictures else []
    _tell(output, started, result, drawn)
    world = started.task.world
    output.print_json(
        {
            **{name: value for name, value in result.items() if name != "genome"},
            "lower_bound_s": world.course.lower_bound_s(world.robot),
            "folder": str(started.folder.path),
            "pictures": drawn,
        }
    )


def _announce(output: Output, started: Started) -> None:
    task, settings = started.task, started.evolution.settings
    where = courses_title([world.course for world in (task.world, *task.others)])
    output.print(
        f"Evolving on {where}: {settings.population} programs, "
        f"{settings.generations} generations, preset {task.config.preset}, seed {started.evolution.seed}"
    )
    if started.evolution.history:
        output.print(f"Going on after generation {started.evolution.generation}")
    say_if_cold()


def say_if_cold() -> None:
    """Say that the simulation is compiled first, where it has not been."""
    if is_cold():
        print("Compiling the simulation; this once, it takes about 20 s ...", file=sys.stderr, flush=True)


def finish_watched(started: Started, quiet: bool) -> dict[str, Any]:
    """Run to the end with progress on stderr; return what result.json says."""
    evolution = started.evolution
    try:
        with Watch(evolution.history, evolution.settings.generations, quiet) as watch:
            result = finish(started, watch)
    except KeyboardInterrupt:  # how to go on has been said
        raise typer.Exit(130) from None
    mark_warm()
    return result


def _tell(output: Output, started: Started, result: dict[str, Any], pictures: list[str]) -> None:
    """Print the best program, how good it is, and where everything lies."""
    folder, best, world = started.folder.path, started.evolution.best, started.task.world
    if best.program is None:
        output.print("\nNo genome mapped to a program.\n", style="bold")
    else:
        output.print(f"\nThe best program, found in generation {best.generation}:\n")
        output.print(
            "\n".join(f"    {line}" for line in best.program.source.splitlines()) + "\n", style="bold"
        )
        seed = drive_seed(None, {"seed": started.evolution.seed}, best.program)
        drive = simulate(world, best.program.opcodes, seed)
        output.print(sentence_of(drive))
        output.print(arrival_of(result["arrives"]))
        fastest = min(generation.best for generation in started.evolution.history)
        if AS_GOOD * fastest < best.merit < UNSOLVED:
            output.print(
                f"What looked faster in the search ({fastest:.2f} s) was less reliable on fresh drives."
            )
        output.print(standing_of(world, drive))
        if "unseen" in result:
            output.print(f"The time is that on the first course. {sentence(result['unseen'])}")
        same = "ends the same" if result["verified_on_pymunk"] else "ENDS OTHERWISE; please report it"
        output.print(f"With pymunk moving the body, the drive {same}.")
    if "front" in result:
        _tell_front(output, started, result["front"])
    output.print(effort_of(result))
    output.print(f"\nResults:  {folder}")
    for picture in pictures:
        output.print(f"Picture:  {picture}")
    if best.program is not None:
        output.print(f"Film it:  {command()} simulate {folder} --animate drive.gif")


def _tell_front(output: Output, started: Started, points: list[dict[str, Any]]) -> None:
    """Print the programs that no other one of the run surpasses."""
    best = [point["program"] for point in points if point["on_front"]]
    names = ", ".join(started.task.config.search.goals)
    output.print(f"\nPareto front of {names}: {len(best)} of {len(points)} programs\n", style="bold")
    if best:
        output.print(front_table(points))
        place = started.folder.path / FRONT_FOLDER / f"{best[0]}.txt"
        output.print(f"\nEach is a program: {command()} simulate {place}\n")
