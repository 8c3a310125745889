"""What a motor's recordings on a bench say of its speed: how fast it turned in the end at each duty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gecar.reality.recordings.recording import Recording


@dataclass(frozen=True)
class Steady:
    """A motor's speed at one duty held.

    Attributes
    ----------
    recording
        Its name.
    duty_pct
        Before any cap [%].
    speed_deg_s
        Over the second half [deg/s].
    """

    recording: str
    duty_pct: float
    speed_deg_s: float


def steady_speeds(recordings: Sequence[Recording]) -> list[Steady]:
    """Return the settled speed of each recording that holds one duty on a bench, by duty; others are passed over.

    Parameters
    ----------
    recordings
        Of one motor, in any order.
    """
    found = [_steady(recording) for recording in recordings if recording.setup.rig == "bench"]
    return sorted((steady for steady in found if steady), key=lambda steady: steady.duty_pct)


def _steady(recording: Recording) -> Steady | None:
    """Fit a line to the angle over the second half, where the shaft has long settled (time constant near 0.1 s)."""
    left = not np.isnan(recording.left_angle_rad).all()
    duty = recording.left_duty if left else recording.right_duty
    angle = recording.left_angle_rad if left else recording.right_angle_rad
    late = recording.t_s > recording.t_s[0] + 0.5 * recording.duration_s
    late &= ~np.isnan(angle)
    if np.isnan(duty).all() or np.nanmin(duty) != np.nanmax(duty) or late.sum() < 2:
        return None
    slope = np.polyfit(recording.t_s[late], angle[late], 1)[0]
    return Steady(recording.name, 100.0 * float(np.nanmax(duty)), float(np.degrees(slope)))
