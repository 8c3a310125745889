"""The peers in one picture: how long a whole run takes, and how many genomes a second are mapped."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.peers.measuring import Measured
from gecar.plots.style import BLUE, SOFT, headline, look, new_figure


def chart(measured: Measured) -> Figure:
    """Draw both comparisons, on logarithmic scales."""
    engines = list(measured.per_second)
    steps = {"PyBullet": "PyBullet, 1/240 s", "MuJoCo": "MuJoCo, 2 ms", "pymunk": "pymunk in Python, 2 ms"}
    names = [steps.get(engine, f"{engine}, 2 ms") for engine in engines]
    times = [measured.whole_run_s(engine) for engine in engines]
    with look():
        figure = new_figure(9.6, 3.6)
        detail = "one core, processor time; peers drive every individual, gecar every program once"
        headline(figure, _title(measured), detail)
        left, right = figure.subplots(1, 2)
        _bars(left, names, times, [_duration(time) for time in times])
        left.set(title="A whole run: 200 programs, 50 generations", xlabel="time [s]")
        rates = measured.mapped
        _bars(right, list(rates), list(rates.values()), [f"{rate:,.0f}" for rate in rates.values()])
        right.set(title="Mapping Table 3: genomes to text", xlabel="genomes a second")
    return figure


def _title(measured: Measured) -> str:
    if "PyBullet" not in measured.per_second:
        return "gecar beside its peers"
    return f"A whole run takes PyBullet {measured.ratio('PyBullet'):,.0f} times as long"


def _bars(axes: Axes, names: Sequence[str], values: Sequence[float], words: Sequence[str]) -> None:
    colours = [BLUE if name.startswith("gecar") else SOFT for name in names]
    bars = axes.barh(range(len(names)), values, color=colours, height=0.62)
    axes.bar_label(bars, words, padding=4, size=9)
    axes.set_yticks(range(len(names)), names)
    axes.set_xscale("log")
    axes.set_xlim(0.4 * min(values), 8.0 * max(values))
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")


def _duration(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
