"""A command's output: text for people, or one JSON object for programs with the text moved to stderr."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

import typer
from rich.console import Console

from gecar.files import json_text

JsonOption = Annotated[
    bool,
    typer.Option("--json", help="Print one JSON object on stdout; text goes to stderr.", show_default=False),
]


class Output:
    """Where a command prints.

    Parameters
    ----------
    as_json
        Whether stdout is kept for a JSON object.
    """

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json
        self.console = Console(stderr=as_json, highlight=False)
        if not self.console.is_terminal:
            self.console.width = 200  # a file has room for tables

    def print(self, words: object = "", style: str | None = None) -> None:
        """Print words or a table; long lines are the terminal's to break. Brackets are text, not markup."""
        if isinstance(words, str):
            self.console.print(words, style=style, markup=False, soft_wrap=True)
        else:
            self.console.print(words)

    def warn(self, lines: Iterable[str]) -> None:
        """Print warnings, a line each."""
        for line in lines:
            self.print(f"warning: {line}", style="yellow")

    def print_json(self, table: Mapping[str, Any]) -> None:
        """Print a command's JSON object, if that is what is wanted."""
        if self.as_json:
            sys.stdout.write(json_text(table))
