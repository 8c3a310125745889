"""``gecar table``: a grid of runs, the paper's Table 5 and Fig. 5."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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

GRID, SEARCH = "Grid", "Search"


def table(
    config: Annotated[
        Path | None,
        typer.Argument(metavar="CONFIG.toml", show_default=False,
                       help="Settings that all runs share, as for gecar evolve."),
    ] = None,
    rows: Annotated[
        str | None,
        typer.Option("--rows", metavar="NAME=V1,V2,...", help="Setting varied over the rows, and its values.",
                     show_default="crossover_rate=0.4,0.5,0.7", rich_help_panel=GRID),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option("--columns", metavar="NAME=V1,V2,...", help="Setting varied over the columns, and its values.",
                     show_default="mutation_rate=0.03,0.05,0.07", rich_help_panel=GRID),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option("--seeds", min=1, help="Runs in each cell.", show_default="5", rich_help_panel=GRID),
    ] = None,
    first_seed: Annotated[
        int | None,
        typer.Option("--first-seed", min=0, help="First seed.", show_default="1", rich_help_panel=GRID),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option("--preset", metavar="NAME", help="Preset of the search settings.",
                     show_default="paper", rich_help_panel=SEARCH),
    ] = None,
    population: Annotated[
        int | None,
        typer.Option("--population", help="Programs per generation.", show_default=False, rich_help_panel=SEARCH),
    ] = None,
    generations: Annotated[
        int | None,
        typer.Option("--generations", help="Number of generations after the initial one.", show_default=False,
                     rich_help_panel=SEARCH),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", show_default=False, rich_help_panel=SEARCH,
                     help="Any other search setting, as for gecar evolve."),
    ] = None,
    grammar: Annotated[
        str | None,
        typer.Option("--grammar", metavar="NAME|FILE", help="Grammar of the programs.", show_default="paper",
                     rich_help_panel=SEARCH),
    ] = None,
    course: CourseOption = None,
    robot: RobotOption = None,
    noise: NoiseOption = None,
    motor_noise: MotorNoiseOption = None,
    time_limit: TimeLimitOption = None,
    engine: EngineOption = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", help="Number of runs in parallel; it does not change the table.",
                     show_default="cores", rich_help_panel=RUN),
    ] = None,
    executor: Annotated[
        str, typer.Option("--executor", metavar="process|thread|serial|dask", help="How runs are executed in parallel.",
                          rich_help_panel=RUN),
    ] = "process",
    scheduler: SchedulerOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="A new folder for runs, tables and pictures.",
                     show_default="runs/table-COURSE-PRESET", rich_help_panel=RUN),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Continue in --out: finished runs are kept, and the grid may be larger.",
                     rich_help_panel=RUN),
    ] = False,
    no_pictures: NoPicturesOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Run crossover x mutation x seeds, or any other grid: the paper's Table 5 and Fig. 5.

    [bold]Examples[/]

      gecar table                                      the paper's Table 5
      gecar table --seeds 20 --out runs/table-20
      gecar table --rows course=paper,hairpin,s_bends --columns preset=paper,random
      gecar table --rows population=100,200,400 --columns elites=0,1,5 --course hairpin
      gecar table --resume --out runs/table-20         go on where it was stopped
    """
    from gecar.parallel.executors import prepare_workers

    if executor == "process" and workers != 1:
        prepare_workers()  # they load beside this process
    from gecar.cli.actions.table import Asked, study

    search = {"population": population, "generations": generations}
    options = {
        "preset": preset, "course": course, "grammar": grammar, "robot": robot, "time_limit_s": time_limit,
        "engine": engine, "noise": noise, "motor_noise": motor_noise,
    }  # fmt: skip
    changes = given(options) | {"search": given(search) | settings(setting or [])}
    asked = Asked(
        config, changes, rows, columns, seeds, first_seed, out, resume, executor, workers, scheduler
    )
    study(Output(as_json), asked, pictures=not no_pictures, quiet=quiet)
