"""What moved in a fitness table, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from gecar.results.fitness_table import Move


def moves_table(moves: Sequence[Move]) -> Table:
    """Return a row for each figure that moved."""
    table = Table("what", "figure", "in the table", "now", "moved by", "", box=None, pad_edge=False)
    for k, move in enumerate(moves):
        name = move.row if k == 0 or moves[k - 1].row != move.row else ""
        table.add_row(name, move.figure, shown(move.before), shown(move.now), by(move), verdict(move))
    return table


def shown(value: Any) -> str:
    """Return a figure as people read it."""
    if value is None:
        return "not there"
    if isinstance(value, list):
        return ", ".join(map(shown, value))
    return f"{value:.3f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def by(move: Move) -> str:
    """Say by how much a figure moved, a list's median."""
    return "" if move.percent is None else f"{move.percent:+.2f} %"


def verdict(move: Move) -> str:
    """Say whether a move is more than is allowed."""
    return "" if move.matters else "allowed"


def as_rows(moves: Sequence[Move]) -> list[dict[str, Any]]:
    """Return moves for JSON."""
    return [
        {
            "row": move.row,
            "figure": move.figure,
            "before": move.before,
            "now": move.now,
            "percent": move.percent,
            "matters": move.matters,
        }
        for move in moves
    ]
