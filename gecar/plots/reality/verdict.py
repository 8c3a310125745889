"""Pictures of a verdict: the gap before and after, where it shows, what was tried, and the traces themselves."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from gecar.plots.courses.course import draw_course, show_whole
from gecar.plots.reality.law import along_ways, laws_figure, laws_map_figure, local_laws
from gecar.plots.style import (
    BLUE,
    FAINT,
    INK,
    LIGHT,
    SOFT,
    SPEED_COLOURS,
    VERMILION,
    headline,
    look,
    new_figure,
)
from gecar.reality.compare.choices import Told, tell
from gecar.reality.compare.side_by_side import UNITS, Beside, measure_of, typical, unit_of
from gecar.reality.evidence import Evidence
from gecar.reality.replay.channels import CHANNELS
from gecar.reality.verdict import Misfit, Place, Verdict
from gecar.world.course.course import load_course
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]

MOST_CHOICES = 4
SHOWN_REGIMES = 12


def verdict_figures(verdict: Verdict, told: Told | None = None) -> dict[str, Figure]:
    """Draw a verdict's pictures, by the name of their file.

    Parameters
    ----------
    verdict
        As `gecar.reality.discovery.discover` returns it.
    told
        What was replayed for it, where that was done before.
    """
    told = told or tell(verdict)
    return {name: draw(verdict) for name, draw in verdict_drawings(verdict, told).items()}


def verdict_drawings(verdict: Verdict, told: Told | None = None) -> dict[str, Callable[[Verdict], Figure]]:
    """Return what draws each of a verdict's pictures, by the name of its file."""
    drawings: dict[str, Callable[[Verdict], Figure]] = {
        "gap": gap_figure,
        "where": regimes_figure,
        "traces": partial(traces_figure, told=told),
        "tried": partial(tried_figure, told=told),
    }
    if any(run.replayer.has_poses for run in verdict.evidence.fitted.recordings):
        drawings["map"] = map_figure
    if verdict.invented:
        drawings["law"] = laws_figure
    if local_laws(verdict):
        drawings["law_map"] = laws_map_figure
    return drawings


def verdict_tables(verdict: Verdict, told: Told) -> dict[str, str]:
    """Return the data behind the pictures as CSV, by the name of the picture."""
    where = verdict.evidence.where
    rows: dict[str, list[list[Any]]] = {
        "gap": [
            ["channel", "nrmse_before", "nrmse_after", "nrmse_noise_alone", "standard_deviation_measured"]
        ],
        "where": [["channel", "motion", "mismatch_times_average"]],
        "tried": [["choice", "candidate", "left", "unit", "taken"]],
        "traces": [["recording", "channel", "unit", "t_s", "measured", "before", "after"]],
    }
    rows["gap"] += [
        [c, m.before, m.after, m.floor, m.deviation] for c, m in verdict.judgement.channels.items()
    ]
    for k, channel in enumerate(CHANNELS):
        found = [[channel, name, _density(where, k, mask)] for name, mask in where.masks.items()]
        rows["where"] += [row for row in found if not np.isnan(row[2])]
    for number, choice in enumerate(told.choices, start=1):
        unit = UNITS[choice.measure]
        rows["tried"].append([number, "none", choice.before, unit, "no"])
        rows["tried"] += [[number, r.effect, r.left, unit, "yes" if r.taken else "no"] for r in choice.rivals]
    if (run := _shown_run(verdict, told)) is not None:
        for name, curves in run.curves.items():
            rows["traces"] += [[run.name, name, unit_of(name), *at] for at in zip(*curves, strict=True)]
    if any(run.replayer.has_poses for run in verdict.evidence.fitted.recordings):
        rows["map"] = [["recording", "t_s", "x_m", "y_m", "mismatch"]]
        for one, path, loud in zip(where.runs, where.path, _loudness(verdict), strict=True):
            seen = np.flatnonzero(~np.isnan(path[:, 0]))
            rows["map"] += [[one.recording.name, 0.1 * k, *path[k], loud[k]] for k in seen]
    rows["law_map"] = [["law", "recording", "t_s", "x_m", "y_m", "value"]]
    for law in local_laws(verdict):
        for one, way in zip(verdict.evidence.fitted.recordings, along_ways(verdict, law), strict=True):
            rows["law_map"] += [[law.term.port, one.recording.name, *at] for at in way.tolist()]
    return {name: _csv(table) for name, table in rows.items() if len(table) > 1}


def _csv(rows: list[list[Any]]) -> str:
    stream = io.StringIO()
    words = [[f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row] for row in rows]
    csv.writer(stream, lineterminator="\n").writerows(words)
    return stream.getvalue()


def gap_figure(verdict: Verdict) -> Figure:
    """Draw each channel's misfit on the held-out recordings: before, after, and that of noise alone."""
    channels = verdict.judgement.channels
    names = list(channels)
    figure = new_figure(8.0, 2.2 + 0.5 * len(names))
    with look():
        axes = figure.add_subplot()
        at = np.arange(len(names))[::-1]
        for place, name in zip(at, names, strict=True):
            m = channels[name]
            axes.plot([m.before, m.after], [place, place], color=FAINT, linewidth=5, solid_capstyle="round")
        axes.plot([channels[n].before for n in names], at, "o", color=VERMILION, label="before")
        axes.plot([channels[n].after for n in names], at, "o", color=BLUE, label="after")
        axes.plot([channels[n].floor for n in names], at, "|", color=SOFT, markersize=13, label="noise alone")
        words = [f"{n.rsplit('_', 1)[0].replace('_', ' ')}\n{_in_units(n, channels[n])}" for n in names]
        axes.set(xscale="log", yticks=at, yticklabels=words)
        axes.set_xlabel("NRMSE on recordings not used for the fit (1: as bad as a constant)")
        axes.legend(loc="upper center", ncols=3, bbox_to_anchor=(0.5, 1.0 + 0.6 / max(len(names), 1)))
        headline(figure, "How much of the gap is closed", f"judged on {verdict.judgement.named}")
    return figure


def _in_units(column: str, misfit: Misfit) -> str:
    """Say what a column was off by and is now, in its unit."""
    unit = column.rsplit("_", 1)[1]
    factor, shown = {"m": (1e3, "mm"), "dps": (1.0, "deg/s"), "pct": (1.0, "%"), "v": (1.0, "V")}.get(
        unit, (1.0, unit)
    )
    was, now = (factor * misfit.deviation * v for v in (misfit.before, misfit.after))
    return f"{was:.2g} to {now:.2g} {shown}" if max(was, now) < 100.0 else f"{was:.0f} to {now:.2g} {shown}"


def regimes_figure(verdict: Verdict) -> Figure:
    """Draw how densely mismatch lies in each regime of motion, by channel: 1 is the average."""
    where = verdict.evidence.where
    every = np.array(
        [[_density(where, k, mask) for mask in where.masks.values()] for k in range(len(CHANNELS))]
    )
    rows = np.flatnonzero(~np.isnan(every).all(axis=1))
    if not len(rows):
        return _without_mismatch()
    density = every[rows]
    telling = np.argsort(-np.nan_to_num(np.log(np.maximum(density, 0.01))).max(axis=0))[:SHOWN_REGIMES]
    names = [list(where.masks)[k] for k in telling]
    figure = new_figure(8.6, 2.0 + 0.4 * len(rows))
    with look():
        axes = figure.add_subplot()
        image = axes.imshow(np.clip(density[:, telling], 0, 5), cmap="OrRd", vmin=0, vmax=5, aspect="auto")
        axes.set_xticks(range(len(names)), names, rotation=35, ha="right")
        axes.set_yticks(range(len(rows)), [CHANNELS[k].replace("_", " ") for k in rows])
        axes.grid(visible=False)
        figure.colorbar(image, label="mismatch, times the average", shrink=0.8)
        headline(
            figure,
            "Where simulation and reality part",
            "mismatch of the robot as it was, by channel and motion",
        )
    return figure


def _without_mismatch() -> Figure:
    """Return a figure that says that no channel is off by more than noise."""
    figure = new_figure(8.6, 2.0)
    with look():
        figure.text(0.5, 0.4, "no channel is off by more than its noise", ha="center", color=SOFT)
        headline(figure, "Where simulation and reality part", "nowhere")
    return figure


def _density(where: object, channel: int, mask: npt.NDArray[np.bool_]) -> float:
    energy, samples = where.energy[channel], where.samples[channel]  # type: ignore[attr-defined]
    inside = samples[mask].sum()
    if inside < 10 or energy.sum() <= 0.0:
        return float("nan")
    return float((energy[mask].sum() / inside) / (energy.sum() / samples.sum()))


def tried_figure(verdict: Verdict, told: Told | None = None) -> Figure:
    """Draw the error each candidate leaves on the held-out recordings, choice by choice, and the error without any."""
    made = (told or tell(verdict)).choices[:MOST_CHOICES]
    rows = [len(choice.telling) + 1 for choice in made]
    figure = new_figure(8.6, 1.6 + 0.3 * sum(rows) + 0.5 * len(rows))
    with look():
        grid = figure.add_gridspec(max(len(made), 1), 1, height_ratios=rows or [1])
        for number, choice in enumerate(made):
            axes, unit = figure.add_subplot(grid[number]), UNITS[choice.measure]
            bars = [
                (
                    "without it" if any(r.taken for r in choice.rivals) else "nothing added",
                    choice.before,
                    VERMILION,
                )
            ]
            bars += [(BY_ID[r.effect].title, r.left, BLUE if r.taken else FAINT) for r in choice.telling]
            bars.sort(key=lambda bar: bar[1])
            axes.barh([name for name, *_ in bars], [left for _, left, _ in bars], color=[c for *_, c in bars])
            for row, (_, left, _) in enumerate(bars):
                axes.annotate(
                    f"{left:.3g}", (left, row), (4, 0), textcoords="offset points", va="center", size=8
                )
            axes.margins(x=0.1)
            axes.set_xlabel(f"off by [{unit}]" if choice is made[-1] else "")
            axes.grid(visible=False, axis="y")
        if not made:
            figure.add_subplot().set_axis_off()
        others = "; those without an effect are not shown"
        detail = (
            f"on held-out recordings, each fitted in turn; blue: chosen{others}"
            if made
            else "nothing stood out"
        )
        headline(figure, "Candidates, and the error each leaves", detail)
    return figure


def traces_figure(verdict: Verdict, told: Told | None = None) -> Figure:
    """Draw what was measured and simulated, before and after, in the recording where mismatch shows most."""
    run = _shown_run(verdict, told or tell(verdict))
    assert run is not None  # a case has a recording, and that has rows
    place = next((p for p in verdict.located if p.recording == run.name), None)
    names = list(run.curves)
    figure = new_figure(9.0, 1.6 + 1.25 * len(names))
    with look():
        for number, name in enumerate(names):
            axes, curves = figure.add_subplot(len(names), 1, number + 1), run.curves[name]
            _mark(axes, place)
            axes.plot(curves.t_s, curves.measured, color=FAINT, linewidth=4.0, label="measured")
            for values, colour, label in (
                (curves.before, VERMILION, "before"),
                (curves.after, BLUE, "after"),
            ):
                axes.plot(curves.t_s, values, color=colour, linewidth=1.1, label=label)
            axes.set(ylabel=f"{name.replace('_', ' ')} [{unit_of(name)}]", xlim=(0, run.duration_s))
            axes.yaxis.label.set_fontsize(8)
            axes.tick_params(labelbottom=name == names[-1])
            if number == 0:
                axes.legend(loc="lower right", ncols=3, bbox_to_anchor=(1.0, 1.0))
        if names:
            axes.set_xlabel("time [s]")
        loudest = f"; shaded: where {place.channel.replace('_', ' ')} is loudest" if place else ""
        headline(figure, f"Measured, and simulated before and after: {run.name}", f"whole replays{loudest}")
    return figure


def _shown_run(verdict: Verdict, told: Told) -> Beside | None:
    """Return the recording that is pointed at, or else a typical one."""
    pointed = verdict.located[0].recording if verdict.located else ""
    named = next((each for each in told.shown if each.name == pointed), None)
    return named or typical(told.shown, measure_of(verdict)) or next(iter(told.shown), None)


def _mark(axes: Axes, place: Place | None) -> None:
    for start, end in place.times_s if place else ():
        axes.axvspan(start, end, color=LIGHT, linewidth=0)


def map_figure(verdict: Verdict) -> Figure:
    """Draw the ways over the course, coloured by how much mismatch arises there."""
    evidence: Evidence = verdict.evidence
    where = evidence.where
    energy = _loudness(verdict)
    setup = evidence.fitted.recordings[0].recording.setup
    figure = new_figure(9.0, 5.6)
    with look():
        axes = figure.add_subplot()
        if setup.course != "none":
            draw_course(axes, load_course(setup.course), marks=False)
        top = max(float(np.quantile(energy[energy > 0], 0.97)) if (energy > 0).any() else 1.0, 1.0)
        for path, loud in zip(where.path, energy, strict=True):
            seen = ~np.isnan(path[:, 0])
            points = path[seen]
            if len(points) < 2:
                continue
            lines = LineCollection(
                list(np.stack([points[:-1], points[1:]], axis=1)), cmap=SPEED_COLOURS, linewidths=2.2
            )
            lines.set_array(np.sqrt(np.clip(loud[seen][:-1], 0, top)))
            lines.set_clim(0.0, np.sqrt(top))
            axes.add_collection(lines)
            show_whole(axes, points)
        for place in verdict.located:
            if place.place is not None:
                x, y, radius = place.place
                axes.add_patch(_circle(x, y, radius))
        axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
        headline(figure, "Where on the floor mismatch arises", "bright: large; circle: a significant place")
    return figure


def _loudness(verdict: Verdict) -> Array:
    """Return how much mismatch of wheels and pose arises, shape (recordings, bins)."""
    return np.asarray(np.maximum(verdict.evidence.where.energy[[0, 1, 4, 5, 6]].sum(axis=0), 0.0))


def _circle(x: float, y: float, radius: float) -> Circle:
    return Circle((x, y), radius, fill=False, color=INK, linewidth=1.6)
