"""A table of a simulated motor's speeds and of real ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.table import Table

Speeds = Mapping[float, float]
"""Speed [deg/s] by level [%]."""


def motor_table(regulated: Speeds, powered: Speeds, bench: Mapping[str, Speeds]) -> Table:
    """Return a row for each level: the simulated motor's speeds, and those of real ones under duty commands."""
    table = Table("level [%]", "speed command [deg/s]", "duty command [deg/s]", box=None, pad_edge=False)
    for name in bench:
        table.add_column(f"{name} [deg/s]")
    for column in table.columns:
        column.justify = "right"
    for level in levels(powered, *bench.values()):
        speeds = [each.get(level) for each in (regulated, powered, *bench.values())]
        table.add_row(f"{level:g}", *("" if speed is None else f"{speed:.0f}" for speed in speeds))
    return table


def levels(*speeds: Speeds) -> Sequence[float]:
    """Return all levels, in order, each once."""
    return sorted({level for each in speeds for level in each})
