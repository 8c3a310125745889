"""``gecar course``: list, show, print and make courses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.output import JsonOption, Output
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.world.course.course import Course
    from gecar.world.robot import Robot

RANDOM = "A random course"

course = typer.Typer(
    name="course",
    help="List, show, print and make courses.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    add_completion=False,
)

NameArgument = Annotated[
    str, typer.Argument(metavar="COURSE", help="A name or a course file (.toml).", show_default=False)
]
RobotOption = Annotated[
    str, typer.Option("--robot", metavar="NAME|FILE", help="Robot that the lower bound is for.")
]


@course.command("list")
def list_all(robot: RobotOption = "ev3", as_json: JsonOption = False) -> None:
    """List the courses that ship with gecar."""
    from rich.table import Table

    from gecar.world.course.course import list_courses, load_course
    from gecar.world.robot import load_robot

    output = Output(as_json)
    driver = load_robot(robot)
    table = Table("course", "tiles", "line", "checkpoints", "lower bound", "", box=None, pad_edge=False)
    found = {name: facts(load_course(name), driver) for name in list_courses()}
    for name, each in found.items():
        size = f"{each['columns']} x {each['rows']}"
        table.add_row(
            name,
            size,
            f"{each['line_m']:.1f} m",
            str(each["checkpoints"]),
            f"{each['lower_bound_s']:.2f} s",
            each["title"],
        )
    output.print(table)
    output.print_json({"courses": found})


@course.command()
def show(
    name: NameArgument,
    robot: RobotOption = "ev3",
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture", metavar="FILE", help="Draw it to a .png, .pdf or .svg file.", show_default=False
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a course's tiles, its size and the lower bound on the time to GOAL; draw it if asked.

    [bold]Example[/]

      gecar course show hairpin --picture hairpin.png
    """
    from gecar.world.course.course import load_course
    from gecar.world.course.lower_bound.fastest_time import bound_words
    from gecar.world.robot import load_robot

    output = Output(as_json)
    loaded, driver = load_course(name), load_robot(robot)
    if picture is not None:
        from gecar.plots.courses.course import course_figure
        from gecar.plots.style import save

        save(course_figure(loaded, driver), picture)
    each = facts(loaded, driver)
    output.print(each["title"], style="bold")
    output.print(loaded.notes)
    output.print("\n" + "\n".join(f"  {line}" for line in loaded.layout.lines(drawn=True)) + "\n")
    output.print(
        f"{each['width_m']:g} x {each['height_m']:g} m, {each['checkpoints']} checkpoints, "
        f"line {each['line_m']:.2f} m, shortest way {each['shortest_way_m']:.2f} m; "
        + bound_words(each["lower_bound_s"])
        + " (not proven where they slide)"
        + (
            f"; the fastest drive an optimiser found takes {each['reference_s']:.2f} s."
            if each["reference_s"]
            else "."
        )
    )
    if picture is not None:
        output.print(f"Picture: {picture}")
    output.print_json(
        {"course": name, **each, "map": loaded.layout.lines(), "picture": str(picture) if picture else None}
    )


@course.command("print")
def print_out(
    name: NameArgument,
    paper: Annotated[
        str,
        typer.Option(
            "--paper", metavar="A4|A3|Letter|sheet", help="Paper size; sheet: the whole course on one page."
        ),
    ] = "A4",
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Output file.", show_default="COURSE-PAPER.pdf"),
    ] = None,
    no_guides: Annotated[bool, typer.Option("--no-guides", help="Leave out tiles, START and GOAL.")] = False,
    only_line: Annotated[
        bool, typer.Option("--only-line", help="Print only the line, on the sheets it crosses.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Make a PDF of a course at true scale, as one sheet or tiled with cut and joint marks.

    Print it at 100 % (not "fit to page"), and check the 100 mm ruler on each sheet.

    [bold]Examples[/]

      gecar course print paper
      gecar course print hairpin --paper A3 --out hairpin.pdf
    """
    from gecar.plots.courses.course_print import print_course
    from gecar.plots.courses.sheets import PAPERS, plan_sheets
    from gecar.world.course.course import load_course

    output = Output(as_json)
    known = {each.lower(): each for each in PAPERS}
    if paper.lower() not in known:
        raise expected("--paper", f"'{paper}'", " or ".join(PAPERS))
    loaded = load_course(name)
    target = out or Path(f"{loaded.name}-{known[paper.lower()]}.pdf")
    if target.suffix.lower() != ".pdf":
        raise expected("--out", f"'{target}'", "a name that ends in .pdf")
    count = len(plan_sheets(loaded, known[paper.lower()], only_line).sheets)
    sheets = "1 sheet" if count == 1 else f"{count} sheets of {known[paper.lower()]} and an overview"
    output.print(f"{loaded.title or loaded.name}: {sheets}.")
    plan = print_course(loaded, target, known[paper.lower()], guides=not no_guides, only_line=only_line)
    output.print(f"Written: {target}. Print at 100 %, and check the ruler.")
    output.print_json({"course": name, "file": str(target), "sheets": len(plan.sheets), "page_mm": plan.page})


@course.command()
def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="File to write, NAME.toml.", show_default=False)
    ],
    size: Annotated[
        str | None,
        typer.Option(
            "--size", metavar="COLUMNSxROWS", help="Number of tiles.", show_default="8x4; random: at most 8x6"
        ),
    ] = None,
    tile: Annotated[
        float | None,
        typer.Option(
            "--tile", metavar="M", help="Edge length of a tile, in metres.", show_default="0.3; random: drawn"
        ),
    ] = None,
    at_random: Annotated[
        bool, typer.Option("--random", help="A random course instead of a template.", rich_help_panel=RANDOM)
    ] = False,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Random seed.", show_default="1", rich_help_panel=RANDOM)
    ] = None,
    tiles: Annotated[
        int | None,
        typer.Option(
            "--tiles", help="Length of the line in tiles.", show_default="drawn", rich_help_panel=RANDOM
        ),
    ] = None,
    turns: Annotated[
        float | None,
        typer.Option(
            "--turns",
            metavar="SHARE",
            help="Share of the tiles in which the line turns.",
            show_default="drawn",
            rich_help_panel=RANDOM,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a template for a course: a loop, with every field explained; or a random course.

    [bold]Examples[/]

      gecar course new mine.toml --size 6x4
      gecar course new random_7.toml --random --seed 7 --turns 0.5
    """  # fmt: skip
    from gecar.calling import command
    from gecar.world.course.new_course import new_course, write_course
    from gecar.world.course.random_course import MOST_COLUMNS, MOST_ROWS, random_text
    from gecar.world.course.schema import TILE_SIZE_M

    output = Output(as_json)
    for option, value in (("--seed", seed), ("--tiles", tiles), ("--turns", turns)):
        if value is not None and not at_random:
            raise expected("course new", f"{option} without --random", "both, or neither")
    if at_random:
        field = (MOST_COLUMNS, MOST_ROWS) if size is None else _tiles(size)
        write_course(file, random_text(1 if seed is None else seed, tiles, turns, tile, field))
        advice = "Look at it"
    else:
        new_course(file, *_tiles(size or "8x4"), TILE_SIZE_M if tile is None else tile)
        advice = "Edit its map, then"
    output.print(f"Wrote {file}. {advice}: {command()} course show {file} --picture {file.stem}.png")
    output.print_json({"file": str(file)})


def _tiles(size: str) -> tuple[int, int]:
    """Read COLUMNSxROWS."""
    columns, _, rows = size.lower().partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise expected("--size", f"'{size}'", "tiles across x tiles up, as 8x4")
    return int(columns), int(rows)


def facts(loaded: Course, robot: Robot) -> dict[str, Any]:
    """Return a course's figures, ready for JSON."""
    from gecar.world.course.reference_times import reference_s

    return {
        "title": loaded.title or loaded.name,
        "columns": loaded.columns,
        "rows": loaded.rows,
        "width_m": round(loaded.width_m, 6),
        "height_m": round(loaded.height_m, 6),
        "line_m": loaded.length_m,
        "checkpoints": len(loaded.checkpoints),
        "shortest_way_m": loaded.shortest.length_m,
        "lower_bound_s": loaded.lower_bound_s(robot),
        "reference_s": reference_s(loaded, robot),
        "walls": len(loaded.walls),
        "obstacles": len(loaded.obstacles),
    }
