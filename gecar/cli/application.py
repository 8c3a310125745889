"""The commands, and how each is imported only when it is called.

``gecar --help`` names every command without importing one: the compiler and the plotting library alone take
longer to import than anyone waits for help.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from gecar import __version__

EVOLVE, COURSES, ROBOT = "Evolve", "Courses, robots and grammars", "The real robot"


@dataclass(frozen=True)
class CommandEntry:
    """A command's place in the list.

    Attributes
    ----------
    name
        As typed.
    panel
        The group it is listed in.
    words
        One line of help.
    place
        Module in `gecar.cli.commands`, and its function or `typer.Typer`: ``evolve:evolve``.
    """

    name: str
    panel: str
    words: str
    place: str

    @property
    def exists(self) -> bool:
        """Whether its module is there."""
        return find_spec(f"gecar.cli.commands.{self.place.partition(':')[0]}") is not None

    def load(self) -> Any:
        """Import it, as a command of the command line."""
        module, _, attribute = self.place.partition(":")
        found = getattr(import_module(f"gecar.cli.commands.{module}"), attribute)
        if isinstance(found, typer.Typer):
            command = typer.main.get_command(found)
        else:
            alone = typer.Typer(rich_markup_mode="rich", add_completion=False)
            alone.command(self.name, no_args_is_help=False)(found)
            command = typer.main.get_command(alone)
        for each in (command, *getattr(command, "commands", {}).values()):
            each.help = reflowed(each.help or "")
        return command


def reflowed(text: str) -> str:
    """Join the lines of each paragraph, for the terminal to break; indented ones are examples and stay."""
    paragraphs = (paragraph.splitlines() for paragraph in text.split("\n\n"))
    joined = ("\n".join(p) if any(line.startswith(" ") for line in p) else " ".join(p) for p in paragraphs)
    return "\n\n".join(joined)


COMMANDS = (
    CommandEntry(
        "demo", EVOLVE, "Show everything gecar does on one page, in under three minutes.", "demo:demo"
    ),
    CommandEntry(
        "evolve", EVOLVE, "Evolve a program that drives the robot around a course.", "evolve:evolve"
    ),
    CommandEntry("simulate", EVOLVE, "Simulate a program's drive; draw or film it.", "simulate:simulate"),
    CommandEntry("plot", EVOLVE, "Redraw a run's pictures, or compare several runs.", "plot:plot"),
    CommandEntry(
        "table", EVOLVE, "Run crossover x mutation x seeds: the paper's Table 5 and Fig. 5.", "table:table"
    ),
    CommandEntry(
        "report", EVOLVE, "Write a study's tables and figures for a paper, with provenance.", "report:report"
    ),
    CommandEntry("check", EVOLVE, "Rerun a table of fitness figures and report changes.", "check:check"),
    CommandEntry("course", COURSES, "List, show, print and make courses.", "course:course"),
    CommandEntry("robot", COURSES, "List, show and make robots.", "robot:robot"),
    CommandEntry("grammar", COURSES, "List, check and derive from grammars.", "grammar:grammar"),
    CommandEntry("export", ROBOT, "Write a program as main.py for the brick.", "export:export"),
    CommandEntry("import", ROBOT, "Convert logs of robots and cameras to recordings.", "import_:import_"),
    CommandEntry(
        "motor", ROBOT, "Plot motor speed against speed and duty commands: Figs 7, 8.", "motor:motor"
    ),
    CommandEntry(
        "compare", ROBOT, "Compare simulation and recordings: Tables 6, 7, Figs 9, 10.", "compare:compare"
    ),
    CommandEntry("calibrate", ROBOT, "Fit the robot's constants to recordings.", "calibrate:calibrate"),
    CommandEntry("discover", ROBOT, "Find the physics that the simulation lacks.", "discover:discover"),
    CommandEntry("effects", ROBOT, "List the effects that discover can find.", "effects:effects"),
)


class Commands(TyperGroup):
    """A group whose commands are listed from `COMMANDS` and imported when called."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._entries = {entry.name: entry for entry in COMMANDS if entry.exists}
        for entry in self._entries.values():
            self.add_command(TyperCommand(entry.name, help=entry.words, rich_help_panel=entry.panel))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Put the real command in the place of its line in the list."""
        name, command, rest = super().resolve_command(ctx, args)
        if name in self._entries:
            command = self._entries[name].load()
            command.name = name
        return name, command, rest

    def make_context(self, *words: Any, **settings: Any) -> Any:
        """Read the command line."""
        with _ctrl_c_answered():
            return super().make_context(*words, **settings)

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        with _ctrl_c_answered():
            return super().invoke(ctx)


@contextmanager
def _ctrl_c_answered() -> Iterator[None]:
    """End on Ctrl-C with one word and no traceback; typer would print neither."""
    try:
        yield
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        raise typer.Exit(130) from None


def _version(wanted: bool) -> None:
    if wanted:
        print(f"gecar {__version__}")
        raise typer.Exit


def _root(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Show the version and exit."
    ),
) -> None:
    """Evolve readable programs for a line-following robot, and close the gap to the real one.

    [bold]Start here[/]

      gecar demo               show everything on one page, in under three minutes
      gecar evolve             evolve a program for the paper's course, with pictures
      gecar simulate runs/...  simulate its drive again, or film it
      gecar course list        list the other courses

    Every command has help: [bold]gecar evolve --help[/]
    """


def application() -> typer.Typer:
    """Build the command line."""
    app = typer.Typer(
        name="gecar",
        cls=Commands,
        rich_markup_mode="rich",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["--help", "-h"]},
    )
    app.callback()(_root)
    return app
