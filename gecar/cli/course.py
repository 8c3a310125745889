"""``gecar course``: list, show, print and make courses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.voice import JsonOption, Voice
from gecar.errors import expected

if TYPE_CHECKING:
    from gecar.world.course import Course
    from gecar.world.robot import Robot

course = typer.Typer(
    name="course", help="List, show, print and make courses.", no_args_is_help=True, rich_markup_mode="rich"
)

NameArgument = Annotated[
    str, typer.Argument(metavar="COURSE", help="A name or a course file (.toml).", show_default=False)
]
RobotOption = Annotated[
    str, typer.Option("--robot", metavar="NAME|FILE", help="For whom the lower bound holds.")
]


@course.command("list")
def list_all(robot: RobotOption = "ev3", as_json: JsonOption = False) -> None:
    """List the courses that ship with gecar."""
    from rich.table import Table

    from gecar.world.course import list_courses, load_course
    from gecar.world.robot import load_robot

    voice = Voice(as_json)
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
    voice.say(table)
    voice.answer({"courses": found})


@course.command()
def show(
    name: NameArgument,
    robot: RobotOption = "ev3",
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="Draw it: .png, .pdf or .svg.", show_default=False),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a course's tiles and what no program can beat on it; draw it if asked.

    [bold]Example[/]

      gecar course show hairpin --picture hairpin.png
    """
    from gecar.world.course import load_course
    from gecar.world.robot import load_robot

    voice = Voice(as_json)
    loaded, driver = load_course(name), load_robot(robot)
    if picture is not None:
        from gecar.plots.course import course_figure
        from gecar.plots.style import save

        save(course_figure(loaded, driver), picture)
    each = facts(loaded, driver)
    voice.say(each["title"], style="bold")
    voice.say(loaded.notes)
    voice.say("\n" + "\n".join(f"  {line}" for line in loaded.layout.lines(drawn=True)) + "\n")
    voice.say(
        f"{each['width_m']:g} x {each['height_m']:g} m, {each['checkpoints']} checkpoints, "
        f"line {each['line_m']:.2f} m, shortest way {each['shortest_way_m']:.2f} m; "
        f"no program is faster than {each['lower_bound_s']:.2f} s."
    )
    if picture is not None:
        voice.say(f"Picture: {picture}")
    voice.answer(
        {"course": name, **each, "map": loaded.layout.lines(), "picture": str(picture) if picture else None}
    )


@course.command("print")
def print_out(
    name: NameArgument,
    paper: Annotated[
        str,
        typer.Option("--paper", metavar="A4|A3|sheet", help="Paper; sheet: the whole course on one page."),
    ] = "A4",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Where to.", show_default="COURSE-PAPER.pdf")
    ] = None,
    no_guides: Annotated[bool, typer.Option("--no-guides", help="Leave out tiles, START and GOAL.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Make a PDF of a course at true scale, as one sheet or tiled with cut and joint marks.

    Print it at 100 % (not "fit to page"), and check the 100 mm ruler on each sheet.

    [bold]Examples[/]

      gecar course print paper
      gecar course print hairpin --paper A3 --out hairpin.pdf
    """
    from gecar.plots.course_print import print_course
    from gecar.plots.sheets import PAPERS
    from gecar.world.course import load_course

    voice = Voice(as_json)
    known = {each.lower(): each for each in PAPERS}
    if paper.lower() not in known:
        raise expected("--paper", f"'{paper}'", " or ".join(PAPERS))
    loaded = load_course(name)
    target = out or Path(f"{loaded.name}-{known[paper.lower()]}.pdf")
    if target.suffix.lower() != ".pdf":
        raise expected("--out", f"'{target}'", "a name that ends in .pdf")
    plan = print_course(loaded, target, known[paper.lower()], guides=not no_guides)
    sheets = "1 sheet" if len(plan.sheets) == 1 else f"{len(plan.sheets)} sheets and an overview"
    voice.say(f"{target}: {sheets}. Print at 100 %, and check the ruler.")
    voice.answer({"course": name, "file": str(target), "sheets": len(plan.sheets), "page_mm": plan.page})


TEMPLATE = '''\
# A course for gecar. Look at it with: gecar course show {file}
# Tiles: - | straight   F 7 L J sharp corner   f ? l j curved corner   + crossing   = : gap   ~ u S Z zigzag
#        . bare floor the robot may drive on   # not part of the course; gecar/world/tiles.py draws them all
title = "{title}"
tile_size_m = 0.30
line_width_m = 0.025
map = """
f--?##
|##l-?
|####|
L----J
"""
goal = [0, 1]         # column and row from the lower left tile, which is [0, 0]

[start]
tile = [0, 2]
heading = "up"        # up, down, left, right, or degrees counter-clockwise from +x
left_m = -0.025       # from the tile's middle, as seen from the robot

# [[walls]]           # ends of a wall [m]
# from_m = [0.5, 0.5]
# to_m = [0.9, 0.5]

# [[obstacles]]       # a box, or kind = "disc" with diameter_m
# kind = "box"
# at_m = [1.2, 0.15]
# size_m = [0.1, 0.06]
# mass_kg = 0.2
'''


@course.command()
def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Where to write it: NAME.toml.", show_default=False)
    ],
    as_json: JsonOption = False,
) -> None:
    """Write a course file to begin with: a small loop, to be edited by hand.

    [bold]Example[/]

      gecar course new mine.toml && gecar course show mine.toml --picture mine.png
    """
    from gecar.files import write_whole
    from gecar.world.course import parse_course

    voice = Voice(as_json)
    if file.suffix != ".toml":
        raise expected("FILE", f"'{file}'", "a name that ends in .toml")
    if file.exists():
        raise expected(file, "a file that exists", "a new name")
    text = TEMPLATE.format(file=file, title=file.stem.replace("_", " ").replace('"', "").replace("\\", ""))
    parse_course(text, str(file))
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, text)
    voice.say(f"Wrote {file}. Edit its map, then: gecar course show {file}")
    voice.answer({"file": str(file)})


def facts(loaded: Course, robot: Robot) -> dict[str, Any]:
    """Return a course's figures, ready for JSON."""
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
        "walls": len(loaded.walls),
        "obstacles": len(loaded.obstacles),
    }
