"""``gecar evolve``: evolve a program that brings the robot round a course."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gecar.cli.options import (
    CourseOption,
    EngineOption,
    MotorNoiseOption,
    NoiseOption,
    RobotOption,
    TimeLimitOption,
)
from gecar.cli.voice import JsonOption, Voice
from gecar.errors import expected

SEARCH, RUN = "Search (default: the preset's)", "Run"


def evolve(
    config: Annotated[
        Path | None,
        typer.Argument(metavar="[CONFIG.toml]", show_default=False,
                       help="Settings, as in the config.toml of a run's folder; options go before them."),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option("--preset", metavar="NAME", help="Search settings: paper is Table 4; random is random search.",
                     show_default="paper", rich_help_panel=SEARCH),
    ] = None,
    population: Annotated[
        int | None,
        typer.Option("--population", help="Programs in a generation.", show_default=False, rich_help_panel=SEARCH),
    ] = None,
    generations: Annotated[
        int | None,
        typer.Option("--generations", help="How often they are bred anew.", show_default=False, rich_help_panel=SEARCH),
    ] = None,
    codons: Annotated[
        int | None,
        typer.Option("--codons", "--gene-length", help="Codons in a genome.", show_default=False,
                     rich_help_panel=SEARCH),
    ] = None,
    elites: Annotated[
        int | None,
        typer.Option("--elites", help="Best ones that stay as they are.", show_default=False, rich_help_panel=SEARCH),
    ] = None,
    tournament: Annotated[
        int | None,
        typer.Option("--tournament", help="Candidates of a selection.", show_default=False, rich_help_panel=SEARCH),
    ] = None,
    crossover_rate: Annotated[
        float | None,
        typer.Option("--crossover-rate", help="Share of pairs that are crossed.", show_default=False,
                     rich_help_panel=SEARCH),
    ] = None,
    mutation_rate: Annotated[
        float | None,
        typer.Option("--mutation-rate", help="Share of codons drawn anew.", show_default=False, rich_help_panel=SEARCH),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", show_default=False, rich_help_panel=SEARCH,
                     help="Any other search setting, as in config.toml: --set crossover=subtree."),
    ] = None,
    grammar: Annotated[
        str | None,
        typer.Option("--grammar", metavar="NAME|FILE", help="What programs are made of.", show_default="paper",
                     rich_help_panel=SEARCH),
    ] = None,
    wraps: Annotated[
        int | None,
        typer.Option("--wraps", help="How often reading a genome starts again.", show_default="0",
                     rich_help_panel=SEARCH),
    ] = None,
    course: CourseOption = None,
    robot: RobotOption = None,
    noise: NoiseOption = None,
    motor_noise: MotorNoiseOption = None,
    time_limit: TimeLimitOption = None,
    engine: EngineOption = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", help="Where all randomness comes from.", show_default="1", rich_help_panel=RUN),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", help="Processes; the result is the same for any number.", show_default="cores",
                     rich_help_panel=RUN),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="A new folder for the results.",
                     show_default="runs/COURSE-PRESET-seedN", rich_help_panel=RUN),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in --out where it was stopped.", rich_help_panel=RUN)
    ] = False,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Draw nothing.", rich_help_panel=RUN)] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no progress.", rich_help_panel=RUN)] = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Evolve a program that brings the robot round a course.

    [bold]Examples[/]

      gecar evolve
      gecar evolve --course hairpin --seed 7 --out runs/hairpin-7
      gecar evolve --crossover-rate 0.7 --mutation-rate 0.03 --population 500
      gecar evolve runs/hairpin-7/config.toml --seed 8
      gecar evolve --resume --out runs/hairpin-7
    """
    from gecar.search.executors import prepare_workers

    if workers != 1:
        prepare_workers()  # they load beside this process
    voice = Voice(as_json)
    search = {
        "population": population, "generations": generations, "codons": codons, "elites": elites,
        "tournament": tournament, "crossover_rate": crossover_rate, "mutation_rate": mutation_rate,
    }  # fmt: skip
    options = {
        "preset": preset, "course": course, "grammar": grammar, "robot": robot, "seed": seed, "workers": workers,
        "time_limit_s": time_limit, "engine": engine, "noise": noise, "motor_noise": motor_noise, "wraps": wraps,
    }  # fmt: skip
    changes = given(options) | {"search": given(search) | settings(setting or [])}
    from gecar.cli.running import begin, run_to_the_end

    run_to_the_end(voice, begin(config, changes, out, resume), pictures=not no_pictures, quiet=quiet)


def given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were typed."""
    return {name: value for name, value in options.items() if value is not None}


def settings(words: list[str]) -> dict[str, Any]:
    """Read ``NAME=VALUE`` words; values are as in TOML, and words without quotes text.

    Raises
    ------
    InputError
        If there is no ``=``.
    """
    import tomllib

    found: dict[str, Any] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or not name:
            raise expected("--set", f"'{word}'", "NAME=VALUE")
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            found[name] = value
    return found
