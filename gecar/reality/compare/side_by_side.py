"""Recordings beside their simulation, before and after what was found, in units people use.

Every drive is replayed whole and open loop. Both simulations begin where the robot was in the first second, so that
what they are off by grows as it would on the floor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.prove.holdout import replayed
from gecar.reality.recordings.columns import COLUMNS
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.verdict import Verdict
from gecar.world.effects import BY_ID

Array = npt.NDArray[np.float64]
Physics = npt.NDArray[Any]

START_S = 1.0  # over which a simulation's start is fitted to the poses seen
_DEG = 180.0 / np.pi
PLACE, WHEELS, READING = "place", "wheels", "reading"
UNITS = {PLACE: "mm", WHEELS: "deg", READING: "%"}
# By channel: field of a recording, units shown in one of the field's, unit.
_SHOWN = {
    "x": ("x_m", 1e3, "mm"), "y": ("y_m", 1e3, "mm"), "heading": ("heading_rad", _DEG, "deg"),
    "left_angle": ("left_angle_rad", _DEG, "deg"), "right_angle": ("right_angle_rad", _DEG, "deg"),
    "battery": ("battery_v", 1.0, "V"), "yaw_rate": ("yaw_rate_rad_s", _DEG, "deg/s"),
    "reflection": ("reflection_pct", 1.0, "%"),
}  # fmt: skip
_ROW = {"left_angle": 0, "right_angle": 1, "battery": 2, "yaw_rate": 3}
_POSE = {"x": 0, "y": 1, "heading": 2}


class Curves(NamedTuple):
    """A channel over time, every series of shape (n,): times [s], and what was measured and simulated, in its unit."""

    t_s: Array
    measured: Array
    before: Array
    after: Array


class Off(NamedTuple):
    """What simulations are off by: before and after, and what noise alone leaves."""

    before: float
    after: float
    noise: float


@dataclass(frozen=True)
class Beside:
    """One recording beside its two simulations.

    Attributes
    ----------
    name
        The recording's.
    set_aside
        Whether it was set aside, and not fitted on.
    from_s
        From when on it was set aside: 0, but for the last part of an only recording [s].
    duration_s
        How long it lasts [s].
    curves
        By channel, those that were measured.
    noise
        Standard deviation of each channel's noise, in its unit.
    """

    name: str
    set_aside: bool
    from_s: float
    duration_s: float
    curves: Mapping[str, Curves]
    noise: Mapping[str, float]

    def has(self, measure: str) -> bool:
        """Whether there is something to measure by: ``place``, ``wheels`` or ``reading``."""
        needed = {PLACE: {"x", "y"}, READING: {"reflection"}}.get(measure)
        return needed <= set(self.curves) if needed else bool(self.wheels)

    @property
    def wheels(self) -> list[str]:
        """The wheels whose angle was measured."""
        return [name for name in ("left_angle", "right_angle") if name in self.curves]

    def apart(self, measure: str) -> tuple[Array, Array, Array]:
        """Return times [s] and what the simulations before and after are off by, shape (n,) each.

        A distance [mm], the angle of the wheel that is further off [deg], or a reading [%], averaged over a second.
        """
        names = {PLACE: ["x", "y"], READING: ["reflection"]}.get(measure, self.wheels)
        one = self.curves[names[0]]
        squares = np.array(
            [
                [(c.measured - c.before) ** 2, (c.measured - c.after) ** 2]
                for c in (self.curves[n] for n in names)
            ]
        )
        total = squares.sum(axis=0) if measure == PLACE else squares.max(axis=0)
        if measure == READING:
            total = np.stack([_running_mean(one.t_s, row) for row in total])
        return one.t_s, *np.sqrt(total)

    def off(self, measure: str) -> Off:
        """Return what the simulations are off by, root mean square over all that was set aside.

        Not at the end: paths of which one is wrong all along may cross there.
        """
        t, before, after = self.apart(measure)
        told = t >= self.from_s
        noise = {PLACE: np.sqrt(2.0) * self.noise["x"], READING: self.noise["reflection"]}
        of_wheel = self.noise["left_angle"]
        return Off(root_mean(before[told]), root_mean(after[told]), float(noise.get(measure, of_wheel)))


def measure_of(verdict: Verdict) -> str:
    """Return what a verdict is best told in: where the robot is, its wheels' angles, or what its sensor reads."""
    runs = verdict.evidence.held.recordings
    of_sight = all(BY_ID[found.id].of_sensor for found in verdict.effects)
    pointed = verdict.located[0].channel if verdict.located else ""
    if any(run.reads for run in runs) and (of_sight if verdict.effects else pointed == "reflection"):
        return READING
    if any(run.replayer.has_poses for run in runs):
        return PLACE
    wheels = any(not np.isnan(run.replayer.measured[:, :2]).all() for run in runs)
    return WHEELS if wheels else READING


def side_by_side(verdict: Verdict, only_set_aside: bool = False) -> tuple[Beside, ...]:
    """Set recordings beside the robot as it was and the robot found, those set aside first."""
    evidence, judged = verdict.evidence, verdict.judgement
    robots = evidence.before.physics, verdict.robot.physics
    held, before = (_whole(r, verdict) for r in (evidence.held, evidence.held_before))
    out = [beside(one, other, *robots, True) for one, other in zip(before, held, strict=True)]
    if judged.by_time:
        cut = float(evidence.fitted.recordings[0].replayer.t[-1])
        return tuple(replace(each, from_s=cut) for each in out)
    if not only_set_aside:
        out += [beside(run, run, *robots, False) for run in evidence.fitted.recordings]
    return tuple(out)


def typical(shown: Sequence[Beside], measure: str) -> Beside | None:
    """Return the recording set aside that is off by a typical amount (upper median); None if none tells."""
    telling = [each for each in shown if each.set_aside and each.has(measure)]
    telling.sort(key=lambda each: max(each.off(measure)[:2]))
    return telling[len(telling) // 2] if telling else None


def _whole(residuals: Residuals, verdict: Verdict) -> list[RecordingResiduals]:
    """Return recordings with what an only recording showed before its last part was set aside."""
    if not verdict.judgement.by_time:
        return list(residuals.recordings)
    early, late = verdict.evidence.fitted.recordings[0].recording, residuals.recordings[0]
    rows = len(early.t_s)
    first = {
        field: np.r_[getattr(early, field), getattr(late.recording, field)[rows:]]
        for field, _ in COLUMNS.values()
    }
    return [replace(late, recording=replace(late.recording, **first))]


def beside(
    was: RecordingResiduals, now: RecordingResiduals, before: Physics, after: Physics, set_aside: bool
) -> Beside:
    """Set a recording beside two robots, each with the nuisances fitted under it."""
    recording = now.recording
    one, other = (replayed(run, physics, START_S) for run, physics in ((was, before), (now, after)))
    curves = {}
    for name, (field, factor, _) in _SHOWN.items():
        if name in _POSE:
            k, seen_at = _POSE[name], other.replayer.inputs
            t = seen_at.pose_t
            series = seen_at.pose[:, k], one.prediction.poses[:, k], other.prediction.poses[:, k]
        elif name in _ROW:
            k, t = _ROW[name], other.replayer.t
            series = getattr(recording, field), one.prediction.rows[:, k], other.prediction.rows[:, k]
        elif now.reads:
            t = other.replayer.t
            series = recording.reflection_pct, was.readings(before), now.readings(after)
        else:
            continue
        seen = ~np.isnan(series[0]) & ~np.isnan(series[1]) & ~np.isnan(series[2])
        if seen.any():
            curves[name] = Curves(t[seen], *(factor * s[seen] for s in series))
    angle, battery, rate, place, heading = now.noise.sd
    noise = {
        "left_angle": angle * _DEG, "right_angle": angle * _DEG, "battery": battery, "yaw_rate": rate * _DEG,
        "x": 1e3 * place, "y": 1e3 * place, "heading": heading * _DEG, "reflection": now.noise.reflection_sd,
    }  # fmt: skip
    noise = {name: float(sd) for name, sd in noise.items()}
    return Beside(recording.name, set_aside, 0.0, float(now.replayer.t[-1]), curves, noise)


def unit_of(channel: str) -> str:
    """Return the unit a channel's curves are in."""
    return _SHOWN[channel][2]


def _running_mean(t: Array, values: Array, over_s: float = 1.0) -> Array:
    """Return the mean over a second about each time, shape (n,)."""
    total = np.r_[0.0, np.cumsum(values)]
    first, last = np.searchsorted(t, t - 0.5 * over_s), np.searchsorted(t, t + 0.5 * over_s, side="right")
    return (total[last] - total[first]) / (last - first)


def root_mean(values: Array) -> float:
    """Return the root of the mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
