"""Drive winners of gecar in other engines: ``python -m benchmarks.transfer RUN... --out DIR``; goes on when stopped."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from benchmarks.transfer.drives import ENGINES, Drives, Key
from benchmarks.transfer.driving import Drive
from benchmarks.transfer.pictures import draw_transfer
from benchmarks.transfer.sealing import Winner, find_winners, seal
from benchmarks.transfer.side_by_side import film
from benchmarks.transfer.table import table
from benchmarks.transfer.variations import COUNT
from gecar.errors import InputError, expected
from gecar.files import write_whole

STOPPED = "stopped; finished drives are kept, the same command goes on"


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse the command line and run the benchmark; return the exit code."""
    asked = _parser().parse_args(arguments)
    try:
        print(run(asked))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"\n{STOPPED}", file=sys.stderr)
        return 130
    return 0


def run(asked: Namespace) -> str:
    """Seal, drive, and write table, picture and film; return the table.

    Raises
    ------
    InputError
        If something asked for is not there, or is not what it must be.
    """
    if asked.variations < 0:
        raise expected("--variations", asked.variations, "0 or more")
    winners = find_winners(asked.runs)
    shown = _shown(winners, asked.film)
    sealed = seal(winners, asked.out)
    drives = perform(winners, asked.engines, asked.variations, asked.out)
    text = table(winners, drives, asked.engines, sealed)
    write_whole(asked.out / "table.md", text)
    if not asked.no_pictures:
        draw_transfer(winners, drives, asked.engines, shown, asked.out / "transfer.png")
        film(shown, drives, asked.engines, asked.out / "transfer.gif")
    return text


def perform(
    winners: Sequence[Winner], engines: Sequence[str], variations: int, out: Path
) -> dict[Key, Drive]:
    """Drive all that is not kept yet, and say how far it is on a terminal."""
    keeper, console, made = Drives(out, variations), Console(stderr=True), {}
    planned = keeper.plan(winners, engines)
    with Progress(console=console, disable=not console.is_terminal) as bar:
        for winner, engine, k in bar.track(planned, description="drives"):
            made[winner.name, engine, k] = keeper.perform(winner, engine, k)
    return made


def _shown(winners: Sequence[Winner], name: str) -> Winner:
    """Return the winner to be shown: the one asked for, or the first."""
    found = [winner for winner in winners if name in ("", winner.name)]
    if not found:
        raise expected("--film", f"'{name}'", f"one of {', '.join(winner.name for winner in winners)}")
    return found[0]


def _parser() -> ArgumentParser:
    parser = ArgumentParser(prog="python -m benchmarks.transfer", description=__doc__)
    parser.add_argument(
        "runs", metavar="RUN", nargs="+", type=Path, help="a run's folder, a study's, or a record"
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument(
        "--variations", type=int, default=COUNT, help="robots beside the nominal one (%(default)s)"
    )
    parser.add_argument(
        "--engines", nargs="+", choices=list(ENGINES), default=list(ENGINES), help="default: both"
    )
    parser.add_argument("--film", default="", metavar="NAME", help="winner to show; default: the first")
    parser.add_argument("--no-pictures", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
