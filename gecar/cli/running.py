"""A run of ``gecar evolve``, from its start to what is told of it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import typer

from gecar.calling import command
from gecar.cli.pictures import draw_run
from gecar.cli.progress import Watch
from gecar.cli.voice import Voice
from gecar.cli.worlds import drive_seed
from gecar.compiled import is_cold, mark_warm
from gecar.report.drive import arrival_of, sentence_of, standing_of
from gecar.report.run import effort_of
from gecar.results.config import configure, merged, read_config
from gecar.results.running import Started, finish, resume, start
from gecar.search.settings import DEFAULT_PRESET
from gecar.world.rollout import simulate


def begin(file: Path | None, changes: dict[str, Any], out: Path | None, again: bool) -> Started:
    """Start a run, or go on with one.

    Parameters
    ----------
    file
        Settings; where neither it nor the options name a preset, it is `DEFAULT_PRESET`.
    changes
        Options, laid over them.
    out
        The run's folder; by default named by course, preset and seed.
    again
        Whether to go on in it.

    Raises
    ------
    InputError
        As `gecar.results.running.start` or `resume`.
    """
    table = merged({"preset": DEFAULT_PRESET} | (read_config(file) if file else {}), changes)
    wanted = configure(table, file or "options")
    folder = out or Path("runs") / f"{Path(wanted.course).stem}-{wanted.preset}-seed{wanted.seed}"
    return resume(folder, table if file else changes) if again else start(wanted, folder)


def run_to_the_end(voice: Voice, started: Started, pictures: bool, quiet: bool) -> None:
    """Run, draw and tell; Ctrl-C ends it with the run saved.

    Parameters
    ----------
    voice
        Where words go.
    started
        New or resumed.
    pictures, quiet
        Whether to draw; whether to keep still until the end.
    """
    if not quiet:
        _announce(voice, started)
    result = _finish(started, quiet)
    mark_warm()
    drawn = [str(path) for path in draw_run(started.folder.path)] if pictures else []
    _tell(voice, started, result, drawn)
    world = started.task.world
    voice.answer(
        {
            **{name: value for name, value in result.items() if name != "genome"},
            "lower_bound_s": world.course.lower_bound_s(world.robot),
            "folder": str(started.folder.path),
            "pictures": drawn,
        }
    )


def _announce(voice: Voice, started: Started) -> None:
    settings, course = started.evolution.settings, started.task.world.course
    voice.say(
        f"Evolving on {course.title or course.name}: {settings.population} programs, "
        f"{settings.generations} generations, preset {started.task.config.preset}, seed {started.evolution.seed}"
    )
    if started.evolution.history:
        voice.say(f"Going on after generation {started.evolution.generation}")
    if is_cold():
        print("Compiling the simulation; this once, it takes about 20 s ...", file=sys.stderr, flush=True)


def _finish(started: Started, quiet: bool) -> dict[str, Any]:
    evolution = started.evolution
    try:
        with Watch(evolution.history, evolution.settings.generations, quiet) as watch:
            return finish(started, watch)
    except KeyboardInterrupt:  # how to go on has been said
        raise typer.Exit(130) from None


def _tell(voice: Voice, started: Started, result: dict[str, Any], pictures: list[str]) -> None:
    """Print the best program, how good it is, and where everything lies."""
    folder, best, world = started.folder.path, started.evolution.best, started.task.world
    if best.program is None:
        voice.say("\nNo genome mapped to a program.\n", style="bold")
    else:
        voice.say(f"\nThe best program, found in generation {best.generation}:\n")
        voice.say("\n".join(f"    {line}" for line in best.program.source.splitlines()) + "\n", style="bold")
        seed = drive_seed(None, {"seed": started.evolution.seed}, best.program)
        drive = simulate(world, best.program.opcodes, seed)
        voice.say(sentence_of(drive))
        voice.say(standing_of(world, drive))
        voice.say(arrival_of(result["arrives"]))
        same = "ends the same" if result["verified_on_pymunk"] else "ENDS OTHERWISE; please report it"
        voice.say(f"With pymunk moving the body, the drive {same}.")
    voice.say(effort_of(result))
    voice.say(f"\nResults:  {folder}")
    for picture in pictures:
        voice.say(f"Picture:  {picture}")
    if best.program is not None:
        voice.say(f"Film it:  {command()} simulate {folder} --animate drive.gif")
