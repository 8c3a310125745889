"""``gecar effects``: the catalogue of physics a simulation may have left out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gecar.cli.output import JsonOption, Output
from gecar.errors import expected, one_of

if TYPE_CHECKING:
    from gecar.world.effects import Effect

WordsArgument = Annotated[
    list[str] | None,
    typer.Argument(metavar="[show] ID", help="One effect in detail; show: draw it.", show_default=False),
]


def effects(
    words: WordsArgument = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="show: name of the picture, .png, .pdf or .svg.",
            show_default="ID.png",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the effects that a simulation may lack.

    Each effect is a group of parameters. At their neutral values it vanishes. A robot file has a section for each
    effect of the robot; [bold]gecar discover[/] finds effects.

    [bold]Examples[/]

      gecar effects
      gecar effects backlash
      gecar effects show backlash
    """
    from rich.table import Table

    from gecar.plots.style import picture_kind
    from gecar.world.effects import BY_ID, CATALOGUE

    output = Output(as_json)
    show = bool(words) and words is not None and words[0] == "show"
    named = (words or [])[1:] if show else words or []
    if len(named) > 1 or (show and not named):
        raise expected("effects", f"'{' '.join(words or [])}'", "`show` and one effect's name")
    effect = named[0] if named else None
    if effect is not None and effect not in BY_ID:
        raise one_of("effect", effect, BY_ID)
    if out is not None:
        picture_kind(out, "--out")
    if effect is not None:
        _describe(output, BY_ID[effect])
        if show:
            _draw(output, effect, out or Path(f"{effect}.png"))
    else:
        table = Table("effect", "what it is", "where it shows", box=None, pad_edge=False)
        for each in CATALOGUE:
            table.add_row(each.id, each.title, each.signature)
        output.print(table)
    output.print_json({"effects": [_facts(each) for each in CATALOGUE if effect in (None, each.id)]})


def _draw(output: Output, effect: str, path: Path) -> None:
    from gecar.plots.reality.signature import signature_figure
    from gecar.plots.style import save
    from gecar.world.course.course import load_course
    from gecar.world.robot import load_robot

    path.parent.mkdir(parents=True, exist_ok=True)
    save(signature_figure(effect, load_robot("ev3"), load_course("paper")), path)
    output.print(f"Picture: {path}")


def _describe(output: Output, effect: Effect) -> None:
    output.print(f"{effect.id}: {effect.title}", style="bold")
    output.print(f"Shows in {', '.join(effect.channels)}: {effect.signature}.")
    output.print(f"Source: {effect.source}.")
    output.print(f"In a robot file:\n\n[effects.{effect.id}]")
    for p in effect.parameters:
        neutral = "the robot's own" if p.neutral is None else f"{p.neutral:g}"
        start = p.low if p.neutral is None else p.neutral
        output.print(f"{p.label} = {start:g}  # {p.unit}, {p.low:g} to {p.high:g}; neutral: {neutral}")


def _facts(effect: Effect) -> dict[str, Any]:
    parameters = {
        p.label: {
            "unit": p.unit,
            "low": p.low,
            "high": p.high,
            "neutral": p.neutral,
            "worthwhile": p.worthwhile,
        }
        for p in effect.parameters
    }
    return {"id": effect.id, "title": effect.title, "channels": effect.channels, "signature": effect.signature,
            "source": effect.source, "parameters": parameters}  # fmt: skip
