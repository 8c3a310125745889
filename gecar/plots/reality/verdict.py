"""Pictures of a verdict: the gap before and after, where it shows, what was tried, and the traces themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from gecar.plots.courses.course import draw_course
from gecar.plots.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    LIGHT,
    ORANGE,
    SOFT,
    SPEED_COLOURS,
    VERMILION,
    headline,
    look,
    new_figure,
)
from gecar.reality.evidence import Evidence
from gecar.reality.locate.misfit_energy import STRETCH_S, stretch_errors
from gecar.reality.replay.channels import CHANNELS
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.verdict import Place, Verdict
from gecar.world.course.course import load_course

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

_DEG = 180.0 / np.pi
# Name and unit of each channel's errors, that unit in the channel's own, and whether traces always show it.
_SHOWN = {
    "left_angle": ("left wheel [deg]", _DEG, True), "right_angle": ("right wheel [deg]", _DEG, True),
    "battery": ("battery [V]", 1.0, False), "yaw_rate": ("gyro [deg/s]", _DEG, False), "x": ("x [mm]", 1e3, True),
    "y": ("y [mm]", 1e3, True), "heading": ("heading [deg]", _DEG, True), "reflection": ("reflection [%]", 1.0, False),
}  # fmt: skip
SHOWN_REGIMES = 12


def verdict_figures(verdict: Verdict) -> dict[str, Figure]:
    """Draw a verdict's pictures, by the name of their file.

    Parameters
    ----------
    verdict
        As `gecar.reality.discovery.discover` returns it.
    """
    return {name: draw(verdict) for name, draw in verdict_drawings(verdict).items()}


def verdict_drawings(verdict: Verdict) -> dict[str, Callable[[Verdict], Figure]]:
    """Return what draws each of a verdict's pictures, by the name of its file."""
    drawings: dict[str, Callable[[Verdict], Figure]] = {
        "gap": gap_figure,
        "where": regimes_figure,
        "traces": traces_figure,
        "tried": tried_figure,
    }
    if any(run.replayer.has_poses for run in verdict.evidence.fitted.recordings):
        drawings["map"] = map_figure
    return drawings


def gap_figure(verdict: Verdict) -> Figure:
    """Draw each channel's misfit on the recordings set aside: before, after, and what noise leaves."""
    channels = verdict.judgement.channels
    names = list(channels)
    figure = new_figure(8.0, 2.2 + 0.4 * len(names))
    with look():
        axes = figure.add_subplot()
        at = np.arange(len(names))[::-1]
        for place, name in zip(at, names, strict=True):
            m = channels[name]
            axes.plot([m.before, m.after], [place, place], color=FAINT, linewidth=5, solid_capstyle="round")
        axes.plot([channels[n].before for n in names], at, "o", color=VERMILION, label="before")
        axes.plot([channels[n].after for n in names], at, "o", color=BLUE, label="after")
        axes.plot([channels[n].floor for n in names], at, "|", color=SOFT, markersize=13, label="noise alone")
        axes.set(
            xscale="log", xlabel="NRMSE on recordings not used for the fit", yticks=at, yticklabels=names
        )
        axes.legend(loc="upper center", ncols=3, bbox_to_anchor=(0.5, 1.0 + 0.6 / max(len(names), 1)))
        headline(
            figure, "How much of the gap is closed", f"judged on {', '.join(verdict.judgement.recordings)}"
        )
    return figure


def regimes_figure(verdict: Verdict) -> Figure:
    """Draw how densely mismatch lies in each regime of motion, by channel: 1 is the average."""
    where = verdict.evidence.where
    rows = [k for k in range(len(CHANNELS)) if (where.samples[k] > 0).any()]
    density = np.array([[_density(where, k, mask) for mask in where.masks.values()] for k in rows])
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


def _density(where: object, channel: int, mask: npt.NDArray[np.bool_]) -> float:
    energy, samples = where.energy[channel], where.samples[channel]  # type: ignore[attr-defined]
    inside = samples[mask].sum()
    if inside < 10 or energy.sum() <= 0.0:
        return float("nan")
    return float((energy[mask].sum() / inside) / (energy.sum() / samples.sum()))


def tried_figure(verdict: Verdict) -> Figure:
    """Draw what each effect refitted would gain, stage by stage, beside the null."""
    evidence: Evidence = verdict.evidence
    stages = [*evidence.motion.tried, *(evidence.sensing.tried if evidence.sensing else ())]
    stages = [s for s in stages if s][:4]
    figure = new_figure(8.0, 2.0 + 1.5 * max(len(stages), 1))
    taken = {found.id: found.null_95 for found in verdict.effects}
    with look():
        for number, steps in enumerate(stages):
            axes = figure.add_subplot(len(stages), 1, number + 1)
            at = np.arange(len(steps))[::-1]
            colours = [GREEN if s.effect in taken else (ORANGE if s.worthwhile else FAINT) for s in steps]
            axes.barh(at, [max(s.gain, 1.0) for s in steps], color=colours)
            axes.set_yticks(at, [s.effect.replace("_", " ") for s in steps])
            null = next((taken[s.effect] for s in steps if s.effect in taken), None)
            if null is not None:
                axes.axvline(null, color=INK, linewidth=1.0, linestyle=(0, (4, 3)))
            axes.set(
                xscale="log", xlabel="gain: what the effect lowers the cost by" if steps is stages[-1] else ""
            )
        detail = "green: taken; grey: too small for a name; dashed: largest gain without a cause, 95 %"
        headline(figure, "What was tried", detail)
    return figure


def traces_figure(verdict: Verdict) -> Figure:
    """Draw what replays of short stretches leave in the recording where mismatch shows most, its spans marked."""
    evidence: Evidence = verdict.evidence
    place = verdict.located[0] if verdict.located else None
    run = next(
        (s for s in evidence.fitted.recordings if place and s.recording.name == place.recording),
        evidence.fitted.recordings[0],
    )
    before = _traces(run, evidence.before.physics, evidence.motion.taken.physics)
    after = _traces(run, verdict.robot.physics, verdict.robot.physics)
    loudest = f"; shaded: where {place.channel.replace('_', ' ')} is loudest" if place else ""
    pointed = {p.channel for p in verdict.located}
    seen = [name for name in before if _SHOWN[name][2] or name in pointed]
    figure = new_figure(9.0, 2.2 + 1.1 * len(seen))
    with look():
        for number, name in enumerate(seen):
            axes = figure.add_subplot(len(seen), 1, number + 1)
            _mark(axes, place)
            for traces, colour, label in ((before, VERMILION, "before"), (after, BLUE, "after")):
                axes.plot(*traces[name], color=colour, linewidth=0.9, label=label)
            axes.set(ylabel=_SHOWN[name][0], xlim=(0, run.replayer.t[-1]))
            axes.tick_params(labelbottom=name == seen[-1])
            if number == 0:
                axes.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 1.0))
        if seen:
            axes.set_xlabel("time [s]")
        headline(
            figure,
            f"Measured less simulated, in {run.recording.name}",
            f"replays of {STRETCH_S:g} s, each from where the robot was" + loudest,
        )
    return figure


def _traces(run: RecordingResiduals, motion: Physics, sight: Physics) -> dict[str, tuple[Array, Array]]:
    """Return times and errors by channel, in the units shown; stretches are parted by a gap."""
    sd = run.replayer.inputs.sd[[0, 0, 1, 2, 3, 3, 4]]
    out = {}
    for channel, t, errors in stretch_errors(run, motion):
        if len(t):
            name = CHANNELS[channel]
            cuts = 1 + np.flatnonzero(np.diff((t / STRETCH_S).astype(int)))
            values = _SHOWN[name][1] * sd[channel] * errors
            out[name] = (np.insert(t, cuts, np.nan), np.insert(values, cuts, np.nan))
    if run.reads:
        out["reflection"] = (run.replayer.t, run.recording.reflection_pct - run.readings(sight))
    return out


def _mark(axes: Axes, place: Place | None) -> None:
    for start, end in place.times_s if place else ():
        axes.axvspan(start, end, color=LIGHT, linewidth=0)


def map_figure(verdict: Verdict) -> Figure:
    """Draw the ways over the course, coloured by how much mismatch arises there."""
    evidence: Evidence = verdict.evidence
    where = evidence.where
    energy = np.maximum(where.energy[[0, 1, 4, 5, 6]].sum(axis=0), 0.0)
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
        for place in verdict.located:
            if place.place is not None:
                x, y, radius = place.place
                axes.add_patch(_circle(x, y, radius))
        axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
        headline(
            figure, "Where on the floor mismatch arises", "bright: much; circle: a place that stands out"
        )
    return figure


def _circle(x: float, y: float, radius: float) -> Circle:
    return Circle((x, y), radius, fill=False, color=VERMILION, linewidth=1.6)
