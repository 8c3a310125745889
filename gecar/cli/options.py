"""Options that several commands share, and which of them were given."""

from __future__ import annotations

import tomllib
from typing import Annotated, Any

import typer

from gecar.errors import expected

WORLD, RUN = "World", "Run"

CourseOption = Annotated[
    str | None,
    typer.Option("--course", metavar="NAME|FILE",
                 help="Course; [bold]gecar course list[/] lists them; random:7: a random one, random:1-20: twenty.",
                 show_default="paper", rich_help_panel=WORLD),
]  # fmt: skip
RobotOption = Annotated[
    str | None,
    typer.Option("--robot", metavar="NAME|FILE", help="Robot; [bold]gecar robot list[/] lists them.",
                 show_default="ev3", rich_help_panel=WORLD),
]  # fmt: skip
NoiseOption = Annotated[
    float | None,
    typer.Option("--noise", metavar="PCT", help="Standard deviation of each sensor reading, in percent.",
                 show_default="0", rich_help_panel=WORLD),
]  # fmt: skip
MotorNoiseOption = Annotated[
    float | None,
    typer.Option("--motor-noise", metavar="PCT", help="Standard deviation of each motor command, in percent of it.",
                 show_default="0", rich_help_panel=WORLD),
]  # fmt: skip
TimeLimitOption = Annotated[
    float | None,
    typer.Option("--time-limit", metavar="S", help="Time after which a drive without GOAL ends, in seconds.",
                 show_default="60", rich_help_panel=WORLD),
]  # fmt: skip
EngineOption = Annotated[
    str | None,
    typer.Option("--engine", metavar="auto|inline|pymunk", rich_help_panel=WORLD, show_default="auto",
                 help="Physics engine for the body; auto: pymunk on courses with walls or obstacles."),
]  # fmt: skip
SchedulerOption = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Dask scheduler; default: a cluster on this machine.",
                 show_default=False, rich_help_panel=RUN),
]  # fmt: skip
NoPicturesOption = Annotated[bool, typer.Option("--no-pictures", help="Draw nothing.", rich_help_panel=RUN)]
QuietOption = Annotated[bool, typer.Option("--quiet", help="Show no progress.", rich_help_panel=RUN)]


def given(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given."""
    return {name: value for name, value in options.items() if value is not None}


def settings(words: list[str]) -> dict[str, Any]:
    """Read ``NAME=VALUE`` words; values are as in TOML, and words without quotes text.

    Raises
    ------
    InputError
        If there is no ``=``.
    """
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
