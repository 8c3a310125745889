"""Invented laws: as curves with 95 % bands, grey where there is no data, and as maps along the paths driven."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from gecar.plots.courses.course import draw_course, show_whole
from gecar.plots.style import BLUE, FAINT, INK, SOFT, VERMILION, headline, look, new_figure
from gecar.reality.invent.states import states
from gecar.reality.verdict import Invented, Verdict
from gecar.world.course.course import load_course
from gecar.world.ports import AT_A_POINT, BY_PORT, VARIABLE, VARIABLES
from gecar.world.terms import Term

Array = npt.NDArray[np.float64]

BEYOND = 0.3  # of the range: how far the curve goes on where no recording went
POINTS = 400
CURVE_IN, ALWAYS_IN = 2.7, 1.2
DRAWS = 200  # of constants within their intervals, for the band
_VARIABLES = {variable.id: variable for variable in VARIABLES}
_NOWHERE = {"time": np.zeros(()), "side": np.ones(())}  # a law that is opposite on both sides: on the right
_ANGLES = ("angle", "other_angle", "heading")
_OF_PLACE = frozenset(("x", "y", "distance"))
MAP_IN = 4.3


def laws_figure(verdict: Verdict) -> Figure:
    """Draw every law a verdict holds: over the variable it depends on most, or as one value with its interval."""
    laws = verdict.invented
    telling = [_telling(law) for law in laws]
    heights = [ALWAYS_IN if name is None else CURVE_IN for name in telling]
    figure = new_figure(8.0, 1.0 + sum(heights))
    with look():
        panels = figure.subplots(len(laws), 1, squeeze=False, height_ratios=heights)[:, 0]
        for axes, law in zip(panels, laws, strict=True):
            axes.set_title(law.term.typeset, fontsize=9)
            draw_law(axes, law)
        drawn = "95 % band; grey: outside the recordings" if any(telling) else "95 % interval"
        headline(figure, "The law that was written", drawn)
    return figure


def draw_law(axes: Axes, law: Invented) -> None:
    """Draw a law over the variable it depends on most, or as one value with its interval."""
    name = _telling(law)
    if name is None:
        _draw_value(axes, law)
    else:
        _draw_curve(axes, law, name)


def local_laws(verdict: Verdict) -> tuple[Invented, ...]:
    """Return the laws that depend on the robot's position."""
    return tuple(law for law in verdict.invented if not _OF_PLACE.isdisjoint(law.term.parsed.variables))


def laws_map_figure(verdict: Verdict) -> Figure:
    """Draw the value of every law that depends on the position, along the paths of the recordings fitted on."""
    laws, setup = local_laws(verdict), verdict.evidence.fitted.recordings[0].recording.setup
    figure = new_figure(9.0, 0.8 + MAP_IN * len(laws))
    figure.set_layout_engine("compressed")
    with look():
        for axes, law in zip(figure.subplots(len(laws), 1, squeeze=False)[:, 0], laws, strict=True):
            axes.set_title(law.term.typeset, fontsize=9)
            if setup.course != "none":
                draw_course(axes, load_course(setup.course), marks=False)
            ways = along_ways(verdict, law)
            most = max(float(np.abs(way[:, 3]).max()) for way in ways) or 1.0
            for _, x, y, value in (way.T for way in ways):
                axes.plot(x, y, color=FAINT, linewidth=4.6, zorder=2.9)
                points = np.column_stack([x, y])
                pieces = list(np.stack([points[:-1], points[1:]], axis=1))
                lines = LineCollection(pieces, cmap="PuOr", linewidths=2.6, zorder=3, capstyle="round")
                lines.set_array(value[:-1])
                lines.set_clim(-most, most)
                axes.add_collection(lines)
            if _has_point(law):
                at = law.term.constants
                axes.plot(
                    at["at_x"], at["at_y"], "x", color=VERMILION, markersize=10, markeredgewidth=2.5, zorder=4
                )
            show_whole(axes, np.concatenate(ways)[:, 1:3])
            axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
            figure.colorbar(lines, ax=axes, label=_what(law), shrink=0.8)
        cross = "; cross: the point it is counted from" if any(map(_has_point, laws)) else ""
        headline(figure, "Where the law acts", f"along the ways driven; white: nothing{cross}")
    return figure


def along_ways(verdict: Verdict, law: Invented) -> list[Array]:
    """Return time [s], position [m, m] and the law's value [the port's unit], shape (rows, 4), for each recording.

    As the robot with the laws has them; of a law of each wheel the mean of both.
    """
    physics, out = verdict.robot.physics, list[Array]()
    for run in verdict.evidence.fitted.recordings:
        seen = states(run, physics, law.term)
        value = law.term.value(seen).mean(axis=1)
        out.append(np.column_stack([run.replayer.t, seen["x"][:, 0], seen["y"][:, 0], value]))
    return out


def _has_point(law: Invented) -> bool:
    return law.term.port in AT_A_POINT


def _draw_value(axes: Axes, law: Invented) -> None:
    """Draw a law that is always the same."""
    value = float(law.term.value(_NOWHERE))
    low, high = sorted(float(law.term.with_constants(_ends(law, k)).value(_NOWHERE)) for k in (0, 1))
    axes.errorbar([value], [0.0], xerr=[[value - low], [high - value]], fmt="o", color=BLUE, capsize=4)
    axes.axvline(0.0, color=INK, linewidth=0.6)
    always = "on the right wheel; the opposite on the left" if "side" in law.range else "always the same"
    axes.set(yticks=[], ylim=(-1.0, 1.0), xlabel=f"{_what(law)}, {always}")
    axes.margins(x=0.1)


def _draw_curve(axes: Axes, law: Invented, name: str) -> None:
    """Draw a law over a variable."""
    low, high = _ends_of(law, name)
    beyond = 0.0 if name in _ANGLES else BEYOND * (high - low)
    at = np.linspace(low - beyond, high + beyond, POINTS)
    inside = (at >= low) & (at <= high)
    curve = _curve(law, law.term, name, at)
    rng = np.random.default_rng(0)
    drawn = np.array([_curve(law, _drawn(law, rng), name, at) for _ in range(DRAWS)])
    band = np.quantile(drawn, (0.025, 0.975), axis=0)
    axes.fill_between(at[inside], band[0, inside], band[1, inside], color=BLUE, alpha=0.18, linewidth=0)
    axes.axvspan(at[0], low, color=FAINT, alpha=0.6, linewidth=0)
    axes.axvspan(high, at[-1], color=FAINT, alpha=0.6, linewidth=0)
    axes.plot(at, curve, color=SOFT, linestyle="--", linewidth=1.0)
    axes.plot(at[inside], curve[inside], color=BLUE)
    axes.axhline(0.0, color=INK, linewidth=0.6)
    variable = _VARIABLES[name]
    shown = "" if variable.unit == "-" else f" [{variable.unit}]"
    axes.set(xlim=(at[0], at[-1]), xlabel=f"{variable.title}{shown}", ylabel=_what(law).replace(" [", "\n["))


def _what(law: Invented) -> str:
    port = BY_PORT[law.term.port]
    return port.title + ("" if port.unit == "-" else f" [{port.unit}]")


def _telling(law: Invented) -> str | None:
    """Return the variable that a law changes most with over its range; None where it is always the same."""
    spread = {
        name: float(np.ptp(_curve(law, law.term, name, np.linspace(*_ends_of(law, name), POINTS))))
        for name in law.range
        if name != "side"
    }
    return max(spread, key=lambda name: spread[name], default=None)


def _ends_of(law: Invented, name: str) -> tuple[float, float]:
    return (0.0, 2.0 * np.pi) if name in _ANGLES else law.range[name]


def _curve(law: Invented, term: Term, name: str, at: Array) -> Array:
    """Return a law over one variable, the others at what is usual."""
    usual: dict[str, Array] = {}
    for other in VARIABLE:
        low, high = law.range.get(other, (0.0, 0.0))
        middle = max((low, high), key=abs) if low * high < 0.0 or other == "side" else 0.5 * (low + high)
        usual[other] = np.full(len(at), middle)
    return term.value({**usual, name: at})


def _drawn(law: Invented, rng: np.random.Generator) -> Term:
    """Return a law with its constants drawn from their intervals."""
    values = {n: float(rng.normal(i.value, (i.high - i.low) / 3.92)) for n, i in law.parameters.items()}
    return law.term.with_constants({n: v for n, v in values.items() if n != "store_s"})


def _ends(law: Invented, which: int) -> Mapping[str, float]:
    return {n: (i.low, i.high)[which] for n, i in law.parameters.items() if n != "store_s"}
