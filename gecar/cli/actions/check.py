"""A fitness table for ``gecar check``: run again, compared, and reported."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import typer

import gecar
from gecar.cli.output import Output
from gecar.compiled import is_cold
from gecar.errors import expected
from gecar.parallel.executors import check_workers, open_executor, usable_cores
from gecar.report.check import as_rows, moves_table
from gecar.results.fitness_table import (
    DRIVE_FIGURES,
    DRIVE_TOLERANCE_PCT,
    SEARCH_FIGURES,
    SEARCH_TOLERANCE_PCT,
    SHARE_TOLERANCE,
    FitnessTable,
    Move,
    moves,
    other_versions,
    read_table,
    run_again,
    write_table,
)

TABLE = Path("benchmarks/fitness_table.toml")


def find_table() -> Path:
    """Return gecar's own table: below this folder, or beside the sources of gecar.

    Raises
    ------
    InputError
        If it is in neither; the message says where it was looked for.
    """
    places = [TABLE, Path(gecar.__file__).parents[1] / TABLE]
    for place in places:
        if place.is_file():
            return place
    looked = " and ".join(str(place.absolute()) for place in places)
    raise expected("check", f"no table at {looked}", "TABLE.toml; gecar's own comes with its repository")


def guard(output: Output, path: Path, update: bool, workers: int | None) -> None:
    """Run a fitness table again and tell what moved; exit code 1 where something did and is not written.

    Parameters
    ----------
    output
        Where words go.
    path
        The table.
    update
        Whether to write the fresh figures.
    workers
        Processes; None is one for each core.

    Raises
    ------
    InputError
        If the table is missing or wrong.
    """
    before, began = read_table(path), time.monotonic()
    if is_cold():
        print("Compiling the simulation; this once, it takes about 20 s ...", file=sys.stderr, flush=True)
    with open_executor("process", check_workers(usable_cores() if workers is None else workers)) as executor:
        now = run_again(before, executor)
    found, others = moves(before, now), other_versions(before, now)
    _tell(output, found, others, _count(now), time.monotonic() - began)
    failed = any(move.matters for move in found) and not update
    if update:
        write_table(path, now)
        output.print(f"Written: {path}")
    answer = {"table": str(path), "figures": _count(now), "moved": as_rows(found), "other_versions": others}
    output.print_json({**answer, "passed": not failed, "updated": update})
    if failed:
        raise typer.Exit(1)


def print_pins(path: Path) -> None:
    """Print the versions a table was made with, as pip reads them."""
    sys.stdout.writelines(f"{name}=={version}\n" for name, version in read_table(path).versions.items())


def _tell(output: Output, found: Sequence[Move], others: Sequence[str], count: int, wall_s: float) -> None:
    if others:
        output.print(
            f"Other versions than the table's ({'; '.join(others)}): drives may move by {DRIVE_TOLERANCE_PCT:g} %, "
            f"medians of searches by {SEARCH_TOLERANCE_PCT:g} %, shares that arrive by {SHARE_TOLERANCE:g}."
        )
    if found:
        output.print(moves_table(found))
        output.print()
    matter = sum(move.matters for move in found)
    excused = f", {len(found) - matter} within what is allowed" if matter < len(found) else ""
    verdict = f"{len(found)} moved{excused}" if found else "none moved"
    output.print(f"{count} figures, {verdict} ({wall_s:.1f} s)")


def _count(table: FitnessTable) -> int:
    return len(table.drives) * len(DRIVE_FIGURES) + len(table.searches) * len(SEARCH_FIGURES)
