"""``gecar evolve``: evolve a program that drives the robot around a course."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gecar.cli.options import (
    RUN,
    CourseOption,
    EngineOption,
    MotorNoiseOption,
    NoiseOption,
    NoPicturesOption,
    QuietOption,
    RobotOption,
    SchedulerOption,
    TimeLimitOption,
    given,
    settings,
)
from gecar.cli.output import JsonOption, Output

SEARCH = "Search (default: the preset's)"


def _search(name: str, words: str, default: str | bool = False, metavar: str | None = None) -> Any:
    """Return an option of the search."""
    return typer.Option(name, help=words, show_default=default, metavar=metavar, rich_help_panel=SEARCH)


def evolve(
    config: Annotated[
        Path | None,
        typer.Argument(metavar="CONFIG.toml", show_default=False,
                       help="Settings, as in the config.toml of a run's folder; options override them."),
    ] = None,
    preset: Annotated[
        str | None,
        _search("--preset", "Search settings: better, paper (Table 4), random, nsga2 or map_elites.",
                "better; with goals nsga2", "NAME"),
    ] = None,
    goals: Annotated[
        str | None,
        _search("--goals", "Several goals: two or more of time, arrival, energy, length.", metavar="GOAL,GOAL"),
    ] = None,
    population: Annotated[int | None, _search("--population", "Programs per generation; paper: 200.")] = None,
    generations: Annotated[
        int | None, _search("--generations", "Number of generations after the initial one; paper: 50.")
    ] = None,
    codons: Annotated[int | None, _search("--codons", "Genome length in codons; paper: 1000.")] = None,
    elites: Annotated[int | None, _search("--elites", "Number of elites, copied unchanged; paper: 1.")] = None,
    tournament: Annotated[int | None, _search("--tournament", "Tournament size; paper: 5.")] = None,
    crossover_rate: Annotated[
        float | None, _search("--crossover-rate", "Crossover rate, per pair; paper: 0.4, 0.5, 0.7.")
    ] = None,
    mutation_rate: Annotated[
        float | None, _search("--mutation-rate", "Mutation rate, per codon; paper: 0.03, 0.05, 0.07.")
    ] = None,
    setting: Annotated[
        list[str] | None,
        _search("--set", "Any other search setting, as in config.toml: --set crossover=subtree.", metavar="NAME=VALUE"),
    ] = None,
    grammar: Annotated[
        str | None, _search("--grammar", "Grammar of the programs.", "paper", "NAME|FILE")
    ] = None,
    start_from: Annotated[
        list[Path] | None,
        _search("--start-from", "A program that the evolution starts from, of any origin; may be given several times.",
                metavar="FILE|RUN"),
    ] = None,
    wraps: Annotated[int | None, _search("--wraps", "Maximum genome wraps.", "0")] = None,
    course: CourseOption = None,
    robot: RobotOption = None,
    noise: NoiseOption = None,
    motor_noise: MotorNoiseOption = None,
    draws: Annotated[
        int | None,
        _search("--draws", "Drives per evaluation, under random conditions; 1: the nominal drive alone.",
                "16; paper: 1", "K"),
    ] = None,
    share: Annotated[
        float | None, _search("--share", "Share of drives that must arrive.", "0.96")
    ] = None,
    time_limit: TimeLimitOption = None,
    engine: EngineOption = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", help="Random seed.", show_default="1", rich_help_panel=RUN),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", help="Number of processes; it does not change the result.", show_default="cores",
                     rich_help_panel=RUN),
    ] = None,
    executor: Annotated[
        str | None,
        typer.Option("--executor", metavar="process|thread|serial|dask", help="How programs are simulated in parallel.",
                     show_default="process", rich_help_panel=RUN),
    ] = None,
    scheduler: SchedulerOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="A new folder for the results.",
                     show_default="runs/COURSE-PRESET-seedN", rich_help_panel=RUN),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the stopped run in --out.", rich_help_panel=RUN)
    ] = False,
    no_pictures: NoPicturesOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Evolve a program that drives the robot around a course.

    [bold]Examples[/]

      gecar evolve
      gecar evolve --course hairpin --seed 7 --out runs/hairpin-7
      gecar evolve --preset paper --crossover-rate 0.7 --mutation-rate 0.03
      gecar evolve runs/hairpin-7/config.toml --seed 8
      gecar evolve --course random:1-20 --grammar memory
      gecar evolve --course hairpin --start-from best.txt
      gecar evolve --goals time,length,energy
      gecar evolve --resume --out runs/hairpin-7
    """
    from gecar.parallel.executors import prepare_workers

    if workers != 1 and executor in (None, "process"):
        prepare_workers()  # they load beside this process
    output = Output(as_json)
    search = {
        "population": population, "generations": generations, "codons": codons, "elites": elites,
        "tournament": tournament, "crossover_rate": crossover_rate, "mutation_rate": mutation_rate,
        "draws": draws, "arrival_share": share, "goals": goals.split(",") if goals else None,
    }  # fmt: skip
    options: dict[str, Any] = {
        "preset": preset, "course": course, "grammar": grammar, "robot": robot, "seed": seed, "workers": workers,
        "time_limit_s": time_limit, "engine": engine, "noise": noise, "motor_noise": motor_noise, "wraps": wraps,
        "executor": executor or ("dask" if scheduler else None), "scheduler": scheduler,
    }  # fmt: skip
    if start_from:
        from gecar.cli.inputs import find_program
        from gecar.language.program import read_program

        options["start_from"] = [read_program(find_program(place)[0]).source for place in start_from]
    changes = given(options) | {"search": given(search) | settings(setting or [])}
    from gecar.cli.actions.evolve import begin, run_to_the_end

    run_to_the_end(output, begin(config, changes, out, resume), pictures=not no_pictures, quiet=quiet)
