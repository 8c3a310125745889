"""Whether wheels turn faster beyond a robot's cap on duty: then the recording was made without it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.recording import Recording
from gecar.world.robot import Robot

_LEAST_HOLD_S = 0.4  # four time constants of an EV3's motor
_LEVEL_PCT = 1.0  # levels closer than this are one
_LEAST_ABOVE_PCT = 2.0


def settled_speeds(recordings: Sequence[Recording]) -> list[tuple[float, float]]:
    """Return (duty [%], speed [deg/s]), magnitudes, of every command held long enough for a wheel to settle."""
    found = []
    for recording in recordings:
        for duty, angle in (
            (recording.left_duty, recording.left_angle_rad),
            (recording.right_duty, recording.right_angle_rad),
        ):
            found += _settled(recording.t_s, 100.0 * duty, np.rad2deg(angle))
    return found


def _settled(t_s: Series, duty_pct: Series, angle_deg: Series) -> list[tuple[float, float]]:
    """Fit a line to the angle over the second half of each command held."""
    if np.isnan(duty_pct).all() or np.isnan(angle_deg).all():
        return []
    edges = np.r_[0, np.flatnonzero(np.diff(duty_pct)) + 1, len(t_s)]
    found = []
    for first, end in pairwise(edges.tolist()):
        last = end - 1
        if t_s[last] - t_s[first] < _LEAST_HOLD_S:
            continue
        late = slice(int(np.searchsorted(t_s, 0.5 * (t_s[first] + t_s[last]))), end)
        seen = ~np.isnan(angle_deg[late])
        if seen.sum() > 2:
            slope = np.polyfit(t_s[late][seen], angle_deg[late][seen], 1)[0]
            found.append((abs(float(duty_pct[first])), abs(float(slope))))
    return found


def guess_cap(recordings: Sequence[Recording], robot: Robot) -> tuple[float | None, str]:
    """Guess whether the robot's cap on duty held in recordings of it, all made in one way.

    A wheel's settled speed beyond the cap tells, beside a line through those below it; without any below, beside the
    speed of the robot's own motors.

    Parameters
    ----------
    recordings
        Of one robot and rig, none with a cap of its own.
    robot
        As it is known, with its cap.

    Returns
    -------
    cap
        1: there was none; ``None``: the robot's own.
    reason
        In words; empty where no command goes beyond the cap.
    """
    cap = 100.0 * robot.drive.duty_cap
    most = 100.0 * max((float(np.abs(r.commands).max(initial=0.0)) for r in recordings), default=0.0)
    if most <= cap + _LEAST_ABOVE_PCT or robot.drive.mode == "speed":
        return None, ""
    reach = f"duties reach {most:.3g} %, beyond the cap of robot {robot.name}, {cap:.3g} %"
    speeds = settled_speeds(recordings)
    above = np.array([point for point in speeds if point[0] > cap + _LEAST_ABOVE_PCT])
    if not len(above):
        bench = recordings[0].setup.rig == "bench"
        told = (
            "on a bench: assumed not capped"
            if bench
            else "none was held long enough to decide: assumed capped"
        )
        return (1.0 if bench else None), f"{reach}; {told}"
    below = np.array([point for point in speeds if 0.25 * cap <= point[0] <= cap])
    start, slope = _line(below, no_load_speed(robot))
    free, capped = start + slope * above[:, 0], start + slope * cap
    if float(np.median((above[:, 1] - capped) / (free - capped))) > 0.5:
        return 1.0, f"{reach}; wheels turn faster beyond: not capped"
    return None, f"{reach}; wheels turn no faster beyond: capped"


def no_load_speed(robot: Robot) -> float:
    """Return how fast a robot's motors turn per percent of duty [deg/s], a little slower than without any load."""
    emf = robot.motor.back_emf_constant
    return 0.85 * float(np.rad2deg(robot.battery.voltage / 100.0 / emf))


def cap_warning(recordings: Sequence[Recording], robot: Robot) -> str:
    """Return a warning where recordings that name no cap were surely made without the robot's; else nothing."""
    cap, reason = guess_cap([r for r in recordings if r.setup.duty_cap is None], robot)
    return f"{reason}: write duty_cap = 1.0 into their TOML files" if cap else ""


def _line(below: Series, dps_per_pct: float) -> tuple[float, float]:
    """Return speed at no duty [deg/s], and speed per percent of duty, of a line through what is below the cap."""
    if not len(below):
        return 0.0, dps_per_pct
    if np.ptp(below[:, 0]) < _LEVEL_PCT:
        return 0.0, float(np.mean(below[:, 1]) / np.mean(below[:, 0]))
    slope, start = np.polyfit(below[:, 0], below[:, 1], 1)
    return float(start), float(slope)
