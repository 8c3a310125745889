"""Measure, and print one table: ``python -m benchmarks``, or only some: ``python -m benchmarks mapper``.

Every module here that has ``rows()`` takes part; a row is a figure, its value, and what it should be.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from rich.console import Console
from rich.table import Table

from gecar.errors import InputError, expected

Rows = Callable[[], list[tuple[str, str, str]]]


def names() -> list[str]:
    """Return the names of modules that have ``rows()``, without importing them."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    return [source.stem for source in sources if "\ndef rows(" in source.read_text(encoding="utf-8")]


def chosen(wanted: list[str]) -> list[str]:
    """Return the wanted names, or all.

    Raises
    ------
    InputError
        If there is no such benchmark.
    """
    for name in wanted:
        if name not in names():
            raise expected("benchmark", f"'{name}'", f"one of {', '.join(names())}")
    return wanted or names()


def measured(name: str) -> list[tuple[str, str, str]]:
    """Return a module's rows; one that needs a library that is not installed says so."""
    try:
        rows: Rows = import_module(f"benchmarks.{name}").rows
    except ModuleNotFoundError as error:
        return [(f"skipped: needs {error.name}", "-", "pip install -e '.[bench,cluster]'")]
    return rows()


def main() -> None:
    """Run the benchmarks named on the command line, and print their table."""
    console, errors = Console(), Console(stderr=True)
    if not console.is_terminal:
        console.width = 140
    try:
        wanted = chosen(sys.argv[1:])
    except InputError as error:
        errors.print(f"error: {error}", markup=False)
        sys.exit(2)
    table = Table("benchmark", "figure", "value", "goal", box=None, pad_edge=False)
    table.columns[2].justify = "right"
    for name in wanted:
        with errors.status(f"measuring {name} ..."):
            rows = measured(name)
        for k, (figure, value, goal) in enumerate(rows):
            table.add_row(name if k == 0 else "", figure, value, goal)
    console.print(table)


if __name__ == "__main__":
    main()
