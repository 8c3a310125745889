"""A verdict's page: the recorded robot and its simulations, before and after, played over the course."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.plots.drives.classroom import course_json, filled, robot_json, script_json
from gecar.reality.compare.side_by_side import (
    PLACE,
    READING,
    UNITS,
    WHEELS,
    Beside,
    measure_of,
    typical,
    unit_of,
)
from gecar.reality.verdict import Verdict
from gecar.world.course.course import load_course

Array = npt.NDArray[np.float64]

TEMPLATE = Path(__file__).with_suffix(".html")
STEP_S, MOST_SAMPLES = 0.02, 600
LONGEST_GAP_S = 0.3  # between samples of a measurement that are drawn as one line
MARGIN_M, MOST_BEYOND_M = 0.15, 0.5
MOST_RECORDINGS = 16
_PLACES = {"mm": 1, "deg": 2, "V": 3, "deg/s": 1, "%": 1}
_TITLES = {
    "x": "x", "y": "y", "heading": "heading", "left_angle": "left wheel", "right_angle": "right wheel",
    "battery": "battery", "yaw_rate": "turning rate", "reflection": "colour sensor",
}  # fmt: skip


def replay_page(verdict: Verdict, shown: Sequence[Beside], head: str, article: str, title: str = "") -> str:
    """Return the page.

    Parameters
    ----------
    verdict
        What was found; it is drawn where it has a place.
    shown
        Recordings beside their simulations.
    head, article
        HTML: what stands above, and below.
    title
        Of the page.
    """
    played = replays_json(verdict, shown)
    words = {
        "@TITLE@": html.escape(title or f"{verdict.case}: what the simulation lacks"),
        "@HEAD@": head,
        "@ARTICLE@": article,
        "@PLAYED@": script_json(played),
    }
    return filled(TEMPLATE, words)


def replays_json(verdict: Verdict, shown: Sequence[Beside]) -> dict[str, Any]:
    """Return all the page plays, a typical recording first, as JSON has it; seconds, metres, and the units it shows."""
    measure = measure_of(verdict)
    first = typical(shown, measure)
    others = [each for each in shown if each is not first and each.curves]
    kept = [*([first] if first else []), *others][:MOST_RECORDINGS]
    course = verdict.evidence.fitted.recordings[0].recording.setup.course
    places = any(each.has(PLACE) for each in kept)
    floor = None
    if places:
        floor = _widened(course_json(load_course(course)), kept) if course != "none" else _bare_floor(kept)
    return {
        "course": floor,
        "robot": robot_json(verdict.robot),
        "wheel_mm": round(1e3 * verdict.robot.body.wheel_radius, 2),
        "measure": measure,
        "changed": verdict.found,
        "marks": _marks(verdict) if places else [],
        "recordings": [_recording(verdict, each, measure) for each in kept],
    }


def _recording(verdict: Verdict, each: Beside, measure: str) -> dict[str, Any]:
    step = max(STEP_S, each.duration_s / MOST_SAMPLES)
    t = np.arange(0.0, each.duration_s + 0.5 * step, step)
    channels = {}
    for name, curves in each.curves.items():
        unit = unit_of(name)
        series = _series(curves.t_s, curves[1:], t, _PLACES[unit])
        of_noise = round(each.noise[name], 3)
        channels[name] = {"title": _TITLES[name], "unit": unit, "noise": of_noise} | series
    used = next((m for m in (measure, PLACE, WHEELS, READING) if each.has(m)), None)
    off = None
    if used:
        at, before, after = each.apart(used)
        unit, noise = UNITS[used], round(each.off(used).noise, 2)
        off = {"unit": unit, "noise": noise} | _series(at, (before, before, after), t, 2)
    pointed = [p for p in verdict.located if p.recording == each.name and not verdict.judgement.by_time]
    return {
        "name": each.name,
        "set_aside": each.set_aside,
        "from_s": round(each.from_s, 2),
        "t": np.round(t, 3).tolist(),
        "channels": channels,
        "off": off,
        "off_of": used,
        "spans": [list(span) for span in pointed[0].times_s] if pointed else [],
        "span_channel": _TITLES[pointed[0].channel] if pointed else "",
    }


def _series(at: Array, series: Sequence[Array], t: Array, places: int) -> dict[str, list[float | None]]:
    """Return a measured series and two simulated ones at other times; None where nothing was measured."""
    after = np.minimum(np.searchsorted(at, t), len(at) - 1)
    near = np.minimum(np.abs(at[after] - t), np.abs(at[np.maximum(after - 1, 0)] - t)) < LONGEST_GAP_S
    drawn = ([*np.interp(t, at, values).round(places)] for values in series)
    return {
        name: [float(v) + 0.0 if there else None for v, there in zip(values, near, strict=True)]
        for name, values in zip(("measured", "before", "after"), drawn, strict=True)
    }


def _reach(shown: Sequence[Beside]) -> list[tuple[float, float]]:
    """Return from where to where robots went along x and y [m], recorded or simulated, with room for their bodies."""
    out = []
    for axis in ("x", "y"):
        ways = 1e-3 * np.concatenate([np.concatenate(b.curves[axis][1:]) for b in shown if b.has(PLACE)])
        out.append((float(ways.min()) - MARGIN_M, float(ways.max()) + MARGIN_M))
    return out


def _widened(floor: dict[str, Any], shown: Sequence[Beside]) -> dict[str, Any]:
    """Return a course with as much room about it as robots that leave it need, within bounds."""
    sizes = floor["width"], floor["height"]
    spans = [
        (max(min(low, 0.0), -MOST_BEYOND_M), min(max(high, size), size + MOST_BEYOND_M))
        for (low, high), size in zip(_reach(shown), sizes, strict=True)
    ]
    (x0, x1), (y0, y1) = spans
    return floor | {"field": sizes, "origin": [x0, y0], "width": x1 - x0, "height": y1 - y0}


def _bare_floor(shown: Sequence[Beside]) -> dict[str, Any]:
    """Return a floor with nothing on it, as large as the ways on it."""
    (x0, x1), (y0, y1) = _reach(shown)
    ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    empty: dict[str, Any] = {"labels": [], "walls": [], "obstacles": [], "line": [], "start": [], "goal": []}
    return empty | {"origin": [x0, y0], "width": x1 - x0, "height": y1 - y0, "tiles": [ring], "picture": None}


def _marks(verdict: Verdict) -> list[dict[str, Any]]:
    """Return what was found that has a place on the floor, and where the misfit sits."""
    out: list[dict[str, Any]] = []
    for found in verdict.effects:
        values = {label: interval.value for label, interval in found.parameters.items()}
        if found.id == "slippery_patch":
            where = {"x": values["x_m"], "y": values["y_m"], "r": values["radius_m"]}
            out.append({"kind": "patch", "words": "slippery here"} | where)
        if found.id == "line_shift":
            moved = {"dx": values["dx_m"], "dy": values["dy_m"], "angle": values["angle_rad"], "scale": 1.0}
            out.append({"kind": "line", "words": "where the line lies"} | moved)
        if found.id == "line_scale":
            printed = {"dx": 0.0, "dy": 0.0, "angle": 0.0, "scale": values["scale"]}
            out.append({"kind": "line", "words": "the line as it is printed"} | printed)
        if found.id == "floor_tilt":
            out.append({"kind": "tilt", "words": "downhill", "x": values["x_rad"], "y": values["y_rad"]})
    places = [place.place for place in verdict.located if place.place is not None]
    if places and not any(mark["kind"] == "patch" for mark in out):
        x, y, radius = places[0]
        out.append({"kind": "place", "words": "the misfit sits here", "x": x, "y": y, "r": radius})
    return out
