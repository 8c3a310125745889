"""What a verdict says besides: what was taken out, taken for granted, or could not be looked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gecar.reality.prove.holdout import Split
from gecar.reality.residuals.of_recording import Strip
from gecar.reality.selection.selection import Selection


def remarks(split: Split, strips: Sequence[Strip], motion: Selection, doubted: bool) -> tuple[str, ...]:
    """Return remarks, a sentence or two each.

    Parameters
    ----------
    split
        What was fitted on and set aside.
    strips
        Of what was fitted on.
    motion
        The selection of effects of motion.
    doubted
        Whether what was seen speaks against the path, not the sensor.
    """
    notes = []
    if split.by_time:
        notes.append(
            "Only one recording: its last part was set aside, so the proof is by time, not by another run."
        )
    if motion.clocked:
        late = ", ".join(f"{1e3 * o:.0f}" for o in motion.comparison.offsets)
        notes.append(f"The camera's clock was late by {late} ms in the recordings: taken out, no effect.")
    if doubted:
        notes.append(
            "Readings are right on even floor and wrong near lines, and neither the sensor nor the line explains it: "
            "look at the camera's path, and how the sensor is mounted."
        )
    measured = {name for r in split.fitted for name in r.measured}
    if not {"x_m", "heading_rad"} & measured:
        notes.append("No pose was recorded: what only a camera sees was not looked for.")
    located = [_beginning(strip) for strip in strips if strip.began is not None]
    if located:
        notes.append(
            f"Where no camera looked, readings tell the start, up to places that look the same: {'; '.join(located)}."
        )
    return tuple(notes)


def _beginning(strip: Strip) -> str:
    assert strip.began is not None
    x, y, heading = strip.began.start
    degrees = np.degrees(heading) % 360.0
    return f"{strip.recording.name} began at x {x:.3f} m, y {y:.3f} m, heading {degrees:.0f} degrees"
