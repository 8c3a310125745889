"""``gecar discover``: the verdict on what a simulation lacks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gecar.cli.voice import JsonOption, Voice, plain
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.reality.verdict import Verdict


def discover(
    case: Annotated[
        Path, typer.Argument(metavar="CASE", show_default=False, help="A folder of recordings of one robot.")
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Where verdict and pictures go.")
    ] = Path("verdict"),
    holdout: Annotated[
        str,
        typer.Option("--holdout", metavar="NAMES", show_default="every fourth",
                     help="Recordings to set aside for the proof, with commas between."),
    ] = "",
    robot: Annotated[
        str,
        typer.Option("--robot", metavar="NAME|FILE", help="The robot as it is known.",
                     show_default="what the recordings name"),
    ] = "",
    seed: Annotated[int, typer.Option("--seed", help="Of every draw of chance.")] = 0,
    workers: Annotated[int, typer.Option("--workers", help="Threads; 0: all cores.")] = 0,
    with_formula: Annotated[
        bool,
        typer.Option("--with-formula", show_default=False,
                     help="Add a formula for what nothing explains to the replays, and show what it gains."),
    ] = False,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw pictures and report.html.")] = True,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Find which physics the simulation left out, fit it, and prove it on recordings set aside.

    [bold]Examples[/]

      gecar discover recordings/monday --out verdicts/monday
      gecar discover recordings/monday --holdout run_07,run_08 --json
      gecar evolve --robot verdicts/monday/robot.toml
    """
    import json

    from gecar.files import write_whole
    from gecar.reality.discovery import discover as discover_case
    from gecar.reality.recording import read_case
    from gecar.report.verdict import sentences
    from gecar.world.robot import load_robot, write_robot

    if workers < 0:
        raise expected("--workers", workers, "a number of 0 or more")
    voice = Voice(as_json)
    verdict = discover_case(
        read_case(case),
        [name.strip() for name in holdout.split(",") if name.strip()],
        load_robot(robot) if robot else None,
        seed,
        workers or None,
        lambda line: voice.say(f"  {line}", style="dim"),
        with_formula,
    )
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "verdict.json", json.dumps(plain(verdict.as_json()), indent=1, allow_nan=False) + "\n")
    write_robot(verdict.robot, out / "robot.toml")
    if pictures:
        voice.say("  pictures", style="dim")
        _draw(verdict, out)
    for line in sentences(verdict):
        voice.say(line)
    voice.say(f"Written to {out}.")
    voice.answer(verdict.as_json())


def _draw(verdict: Verdict, out: Path) -> None:
    """Write the pictures, and report.html with the pictures inside."""
    from gecar.files import write_whole
    from gecar.plots.discovery import verdict_figures
    from gecar.plots.style import save
    from gecar.report.verdict_page import verdict_page

    paths = {name: save(figure, out / f"{name}.png") for name, figure in verdict_figures(verdict).items()}
    write_whole(
        out / "report.html", verdict_page(verdict, {name: path.read_bytes() for name, path in paths.items()})
    )
