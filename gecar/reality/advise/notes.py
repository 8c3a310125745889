"""Notes on a verdict: nuisances that were fitted, assumptions, and what could not be tested."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gecar.reality.fitting.model import Step
from gecar.reality.materiality import Size
from gecar.reality.recordings.recording import Recording
from gecar.reality.recordings.split import ENOUGH_S, Split
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.residuals.regimes import spans_of
from gecar.reality.verdict import Invented
from gecar.world.effects import BY_ID
from gecar.world.robot import Robot

LIKE_WEAKENING = "supply_voltage", "viscous_friction", "clock_skew"
"""Effects that motors which weaken each other are mistaken for."""
APART_S = 1.0  # of one motor driven alone: 1.2 s and more told such motors that lose 2 % from a flat battery, 0.3 s not
NOT_CONFIRMED = "the held-out ones do not confirm it, or its interval contains its neutral value"
OR_PATH = ", or the measured path is what is wrong"
DRIFTS = "its size differs between recordings, times, headings or kinds of motion: it imitates something else"
WITHOUT = {
    "encoders": "The encoders have an error of their own, which no effect of the catalogue explains. They were left "
    "out: what was found explains the path. Compare the clock, the scale and the resets of the wheels' angles.",
    "poses": "The poses have an error of their own, which no effect of the catalogue explains. They were left out: "
    "what was found explains how the wheels turned. Check whether the camera was moved, and its frame.",
}
"""What a verdict says of an instrument that was left out, by its name."""
ALONG_ENCODERS = (
    "No effect of the catalogue explains how the commands turned the wheels. That was left out: what was found explains"
    " where the robot went while its wheels turned as the encoders say. Look at motors, gears, battery and commands."
)
MOST_MOMENTS = 4  # that are given


def notes_on_findings(
    split: Split,
    found: Robot,
    candidates: Sequence[Step] = (),
    unseen: Sequence[str] = (),
    invented: Sequence[Invented] = (),
    left_out: str = "",
    alike: Sequence[Sequence[str]] = (),
) -> tuple[str, ...]:
    """Return notes on what was found, a sentence or two each.

    Parameters
    ----------
    split
        What was fitted on and set aside.
    found
        The robot with the effects found.
    candidates
        Effects accepted on the recordings fitted on, and no findings: their size differs between recordings, times or
        regimes, or the recordings set aside do not confirm them.
    unseen
        Effects found that the recordings set aside do not show.
    invented
        Laws found.
    left_out
        What is said of an instrument, a place or times that were left out, or in which something unknown acts.
    alike
        Sets of effects of which one can be larger and another smaller at hardly any cost.
    """
    notes = [
        f"{step.effect} explains the fitted recordings, but {_why_refused(step)}: a candidate, not a finding."
        for step in candidates
    ]
    others, part = ("others", "of them") if len(split.fitted) > 1 else ("other one", "third of it")
    notes += [
        f"The held-out recordings do not show {effect}. It was found on the {others}, and each {part} that shows it,"
        " left out, confirms it."
        for effect in unseen
    ]
    notes += [
        f"The held-out recordings do not show the law at {law.term.port}. It was found on the {others}; parts of these,"
        " left out, confirm it."
        for law in invented
        if split.held and not law.shows
    ]
    notes += [*battery_at_its_end(found), *never_apart(split, found)]
    notes += [left_out] if left_out else []
    notes += [
        f"These recordings hardly tell {', '.join(together[:-1])} and {together[-1]} apart: more of one with less of "
        "another fits about as well. The intervals say how far."
        for together in alike
    ]
    return tuple(notes)


def notes_on_recordings(
    split: Split, as_logged: Split, fitted: Residuals, clocks_fitted: bool, doubted: bool
) -> tuple[str, ...]:
    """Return notes on the recordings, a sentence or two each.

    Parameters
    ----------
    split
        What was fitted on and set aside.
    as_logged
        The same recordings with the faults of their logs.
    fitted
        The recordings fitted on, with their nuisances.
    clocks_fitted
        Whether each camera's clock offset was fitted.
    doubted
        Whether a misfit of readings points to the measured path, rather than to the sensor.
    """
    notes = _log_faults(split, as_logged)
    if split.by_time:
        notes.append(
            "There is only one recording: its last part was held out, so validation uses later times of the same run."
        )
    if split.spare:
        notes.append(
            f"{ENOUGH_S:.0f} s of drives, spread over all recordings, are enough to fit on: {split.spare} more"
            " were set aside, too."
        )
    if clocks_fitted:
        early = max(fitted.clock_offsets_s) < 0.0
        word, sign = ("early", -1e3) if early else ("late", 1e3)
        by = ", ".join(f"{sign * o:.0f}" for o in fitted.clock_offsets_s)
        notes.append(f"The camera's clock was {word} by {by} ms in the recordings. This was corrected.")
    notes += _mark(fitted)
    if doubted:
        notes.append(
            "Readings are right on uniform floor and wrong near lines, and no effect of sensor or line explains it: "
            "check the camera's path and the mounting of the sensor."
        )
    measured = {name for r in split.fitted for name in r.measured}
    if not {"x_m", "heading_rad"} & measured:
        notes.append("No pose was recorded: effects that only a camera can show were not tested.")
    located = [_start(run) for run in fitted.recordings if run.nuisances.start is not None]
    if located:
        notes.append(
            f"Start poses found from sensor readings, up to places that look the same: {'; '.join(located)}."
        )
    return tuple(notes)


def note_on_place(place: tuple[float, float]) -> str:
    """Return a note on a place on the floor [m] that was left out."""
    x, y = place
    return (
        f"At about x {x:.2f} m, y {y:.2f} m something acts that no effect of the catalogue explains. What the robot did"
        " there was left out: what was found explains the rest. Look at the floor there, and beneath it."
    )


def note_on_moments(residuals: Residuals) -> str:
    """Return a note on the moments that were left out of recordings."""
    spans = []
    for run in residuals.recordings:
        t = run.replayer.t
        for first, after in spans_of(run.replayer.anew):
            begin, end = t[first], t[after - 1]
            spans.append((end - begin, f"{run.recording.name} at {begin:.1f}-{end:.1f} s"))
    longest = sorted(spans, reverse=True)[:MOST_MOMENTS]
    return (
        "At some moments something acts that no effect of the catalogue explains. They were left out, of those fitted"
        f" on mainly {', '.join(where for _, where in longest)}: what was found explains the others. Look at what"
        " happened then, and whether all commands arrived."
    )


def note_on_kind(kind: str, left: float, left_out: bool) -> str:
    """Return a note on a kind of driving in which something unknown acts.

    Parameters
    ----------
    kind
        As `gecar.reality.residuals.regimes.kinds_of_driving` says it.
    left
        The share of the residuals' energy that changes of constants leave without it.
    left_out
        Whether effects were found without it.
    """
    if left_out:
        return (
            f"Something acts that no effect of the catalogue explains, mainly {kind}. What the robot did then was left"
            " out: what was found explains the rest. Look at what the robot does then that it does at no other time."
        )
    return (
        f"What no effect of the catalogue explains acts mainly {kind}: without that, changes of the robot's constants"
        f" leave {100.0 * left:.0f} % of the residuals' energy."
    )


def note_on_astray(name: str, size: Size) -> str:
    """Return a note on a held-out recording that is off by far more than recordings fitted on, but for one at most."""
    off = f"is off by {size.mm_1m:.0f} mm and {size.deg_1m:.1f} degrees over a metre with all that was found"
    if size.reading_pct > 0.0:
        off = f"has readings that are off by {size.reading_pct:.0f} % beyond what the path explains"
    return (
        f"{name}, which was held out, {off}; at most one recording fitted on is off as far: it met something that"
        " the others did not. Record more like it, or hold out others (--holdout)."
    )


def _why_refused(candidate: Step) -> str:
    if candidate.drifts:
        return DRIFTS
    return NOT_CONFIRMED + OR_PATH * (BY_ID[candidate.effect].channels == ("sensor",))


def _mark(fitted: Residuals) -> list[str]:
    """Return a note where the camera's mark was found to lie off the axle's centre."""
    ahead, left, turned = fitted.mark
    if not (ahead or left or turned):
        return []
    along, across = "ahead of" if ahead > 0.0 else "behind", "left" if left > 0.0 else "right"
    turn = f"{math.degrees(abs(turned)):.1f} degrees {'counter-' if turned > 0.0 else ''}clockwise"
    where = f"{1e3 * abs(ahead):.1f} mm {along} the axle's centre, {1e3 * abs(left):.1f} mm to its {across}"
    note = f"The camera's mark lies {where}, turned by {turn}. This was corrected"
    return [f"{note}; gecar import --mark {ahead:.4f},{left:.4f} corrects recordings that it imports."]


def _start(run: RecordingResiduals) -> str:
    assert run.nuisances.start is not None
    x, y, heading = run.nuisances.start
    degrees = np.degrees(heading) % 360.0
    return f"{run.recording.name} began at x {x:.3f} m, y {y:.3f} m, heading {degrees:.0f} degrees"


def battery_at_its_end(robot: Robot) -> list[str]:
    """Return a note if the fitted battery voltage lies at an end of the range in the robot's file."""
    battery = robot.battery
    voltage = battery.voltage * robot.effects.get("supply_voltage", {}).get("scale", 1.0)
    ends = {"voltage_low": battery.voltage_low, "voltage_high": battery.voltage_high}
    return [
        f"The battery's voltage was fitted as {end:g} V, the end of what the robot's file allows (battery.{field}). "
        "Either the robot has another battery, or something else acts like its voltage."
        for field, end in ends.items()
        if "supply_voltage" in robot.effects and end is not None and math.isclose(voltage, end, rel_tol=1e-6)
    ]


def never_apart(split: Split, robot: Robot) -> list[str]:
    """Return a note if what was found may be motors that weaken each other, as one is hardly ever driven alone."""
    named = [effect for effect in LIKE_WEAKENING if effect in robot.effects]
    alone_s = sum(_one_alone_s(run) for run in (*split.fitted, *split.held))
    if not named or alone_s >= APART_S:
        return []
    note = f"One motor was driven alone for {alone_s:.1f} s: that each is weaker while the other is driven, too, would"
    return [f"{note} look like {named[0]}. A drive with one motor at a time tells."]


def _one_alone_s(run: Recording) -> float:
    """Return for how long a recording drives one motor alone [s]."""
    driven = run.commands[:-1] != 0.0
    return float(np.diff(run.t_s) @ (driven.any(axis=1) & ~driven.all(axis=1)))


def _log_faults(split: Split, as_logged: Split) -> list[str]:
    """Return a note on missing rows, and one on times that were made even."""
    runs, logged = ((*each.fitted, *each.held) for each in (split, as_logged))
    notes = []
    lost = sum(len(run.lost_t_s) for run in runs)
    if lost:
        gaps = "once" if lost == 1 else f"{lost} times"
        notes.append(
            f"The logs miss rows, and {gaps} the command changed there. When it did was told by how the robot moved."
        )
    even = [run.name for run, was in zip(runs, logged, strict=True) if not np.array_equal(run.t_s, was.t_s)]
    if even:
        notes.append(
            f"The times of rows in {', '.join(even)} jitter by more than the wheels' motion does: even times were used."
        )
    return notes
