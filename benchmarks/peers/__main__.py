"""`python -m benchmarks.peers [PICTURE]`: print the table and draw the chart."""

from __future__ import annotations

import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.peers.chart import chart
from benchmarks.peers.measuring import measure
from gecar.plots.style import save

if __name__ == "__main__":
    measured = measure()
    table = Table("figure", "value", "goal", box=None, pad_edge=False)
    table.columns[1].justify = "right"
    for row in measured.rows():
        table.add_row(*row)
    console = Console()
    if not console.is_terminal:
        console.width = 120
    console.print(table)
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/peers.png")
    target.parent.mkdir(exist_ok=True)
    console.print(f"\nChart: {save(chart(measured), target)}")
