"""Regimes of motion: from rest, reversing, fast, turning and so on, as masks over a case's recordings and times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.replay.kernel import AHEAD, HEADING, LEFT_SPEED, RIGHT_SPEED, YAW_RATE, X, Y
from gecar.reality.residuals.of_recording import RecordingResiduals

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

AFTER_S = 0.4  # how long an event has an effect
RESTING, SLOW_SHARE, FAST_SHARE = 0.15, 0.35, 0.7  # rad/s, and shares of the fastest shaft speed
SMALL_DUTY, STEP = 0.25, 0.15
TURNING, STRAIGHT = 1.5, 0.25  # rad/s
HARD, GENTLE, TOGETHER = 0.75, 0.5, 1.5  # of the largest duty; the last of both motors together
LEAST_CHANGE, HELD_S, THIRDS = 0.05, 1.0, 3
HEADINGS = "heading +x", "heading +y", "heading -x", "heading -y"


def regime_masks(
    runs: Sequence[RecordingResiduals], physics: npt.NDArray[Any], bins: int, bin_s: float
) -> tuple[dict[str, Mask], Array]:
    """Return regimes by name, each of shape (recordings, bins), and the path, shape (recordings, bins, 2) [m]."""
    tables = [_table(run, physics, bins, bin_s) for run in runs]
    names = tables[0][0].keys()
    masks = {name: np.stack([table[0][name] for table in tables]) for name in names}
    return masks, np.stack([table[1] for table in tables])


def motions(run: RecordingResiduals, physics: npt.NDArray[Any]) -> dict[str, Mask]:
    """Return when the robot moves fast, turns, heads along +x and so on, as masks by name, each of shape (rows,)."""
    lasting = max(int(AFTER_S / float(np.median(np.diff(run.replayer.t)))), 1)
    rows = run.replayer.play(physics)[0]
    pose, placed = _pose(run, rows)
    return {**_motions(rows, run.recording.commands, lasting), **_headings(pose[:, 2], placed)}


def kinds_of_driving(run: RecordingResiduals, largest: float) -> dict[str, Mask]:
    """Return at which rows commands are of a kind, as masks by the words that a note has for it, each of shape (rows,).

    ``largest`` is the largest duty of all recordings.
    """
    duty, t = run.recording.commands, run.replayer.t
    size, changes = np.abs(duty), np.diff(np.abs(duty), axis=0, prepend=np.abs(duty[:1]))
    driven = size > 0.0
    moved = _changes(duty)
    last_change = np.maximum.accumulate(np.where(moved > 0.0, t, t[0]))
    return {
        "while the motors were driven opposite ways": duty[:, 0] * duty[:, 1] < 0.0,
        "while one motor was driven alone": driven.any(axis=1) & ~driven.all(axis=1),
        "while a motor was driven backward": (duty < 0.0).any(axis=1),
        "while a motor was driven forward": (duty > 0.0).any(axis=1),
        "while both motors together were driven hard": size.sum(axis=1) > TOGETHER * largest,
        "while a motor was driven hard": size.max(axis=1) > HARD * largest,
        "while a motor was driven gently": (driven & (size < GENTLE * largest)).any(axis=1),
        "while a motor was not driven": ~driven.all(axis=1),
        "just after a command changed": moved > LEAST_CHANGE,
        "just after a duty grew": (changes > LEAST_CHANGE).any(axis=1),
        "just after a duty fell": (changes < -LEAST_CHANGE).any(axis=1),
        "just after a motor was reversed": _turned(duty[:, 0], 0.0) | _turned(duty[:, 1], 0.0),
        "where commands had not changed for a second": t - last_change >= HELD_S,
        "in the first third of recordings": t < t[-1] / THIRDS,
        "in the last third of recordings": t > t[-1] - t[-1] / THIRDS,
    }


def spans_of(mask: Mask) -> list[tuple[int, int]]:
    """Return where each unbroken span of a mask, shape (n,), begins, and where the first member after it is."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(int)))
    return [(int(first), int(after)) for first, after in edges.reshape(-1, 2)]


def _table(
    run: RecordingResiduals, physics: npt.NDArray[Any], bins: int, bin_s: float
) -> tuple[dict[str, Mask], Array]:
    rows, t = run.replayer.play(physics)[0], run.replayer.t
    pose, placed = _pose(run, rows)
    centres = (np.arange(bins) + 0.5) * bin_s
    at = np.minimum(np.searchsorted(t, centres), len(t) - 1)
    there = centres <= t[-1]
    masks = _motions(rows[at], run.recording.commands[at], max(int(AFTER_S / bin_s), 1))
    masks["early"], masks["late"] = centres < t[-1] / 3.0, centres > 2.0 * t[-1] / 3.0
    for name, mask in _headings(pose[at, 2], placed).items():
        masks[name] = mask & ~masks["standing"]
    masks["on the line's edge"] = _edges(run, physics, at) if run.reads else np.zeros(bins, bool)
    path = np.where(there[:, None] & placed, pose[at, :2], np.nan)
    return {name: mask & there for name, mask in masks.items()}, path


def _pose(run: RecordingResiduals, rows: Array) -> tuple[Array, bool]:
    """Return the axle's pose at every row, shape (rows, 3) [m, m, rad], and whether its place on the floor is known."""
    sensor_path, located = run.nuisances.path, run.nuisances.start is not None
    pose = sensor_path.poses if located and sensor_path is not None else rows[:, [X, Y, HEADING]]
    return pose, located or run.replayer.has_poses


def _headings(heading: Array, placed: bool) -> dict[str, Mask]:
    """Return when a robot heads along +x, +y, -x and -y, within 45 degrees, as masks by name."""
    ways = zip(HEADINGS, (0.0, 0.5, 1.0, 1.5), strict=True)
    return {name: (np.cos(heading - way * np.pi) > np.sqrt(0.5)) & placed for name, way in ways}


def _motions(rows: Array, duty: Array, lasting: int) -> dict[str, Mask]:
    """Return regimes that the motion and the commands themselves tell, by name; an event lasts for so many bins."""
    left, right, yaw, ahead = (rows[:, k] for k in (LEFT_SPEED, RIGHT_SPEED, YAW_RATE, AHEAD))
    fastest = max(float(np.abs(rows[:, [LEFT_SPEED, RIGHT_SPEED]]).max()), 1e-9)
    speed = np.maximum(np.abs(left), np.abs(right))
    moving = speed > RESTING
    stepped = _changes(duty) > STEP
    return {
        "from rest": _after(_risen(moving), lasting),
        "reversal": _after(_turned(left) | _turned(right), lasting),
        "change of command": _after(stepped, lasting),
        "steady": ~_after(stepped, lasting) & moving,
        "standing": ~moving,
        "slow": moving & (speed < SLOW_SHARE * fastest),
        "fast": speed > FAST_SHARE * fastest,
        "small duty": (np.abs(duty).max(axis=1) < SMALL_DUTY) & (np.abs(duty).max(axis=1) > 0.0),
        "turning": np.abs(yaw) > TURNING,
        "straight": (np.abs(yaw) < STRAIGHT) & moving,
        "forward": ahead > 0.02,
        "backward": ahead < -0.02,
    }


def _changes(duty: Array) -> Array:
    """Return by how much the command of either motor, whichever more, changed at every row, shape (rows,)."""
    return np.asarray(np.abs(np.diff(duty, axis=0, prepend=duty[:1])).max(axis=1))


def _after(event: Mask, length: int) -> Mask:
    return np.convolve(event, np.ones(length))[: len(event)] > 0


def _risen(mask: Mask) -> Mask:
    return mask & ~np.r_[False, mask[:-1]]


def _turned(speed: Array, rest: float = RESTING) -> Mask:
    """Return where a speed, or a duty, has changed its sign since it last was more than rest."""
    sign = np.where(np.abs(speed) > rest, np.sign(speed), 0.0)
    known = np.maximum.accumulate(np.where(sign != 0.0, np.arange(len(sign)), 0))
    held = sign[known]
    return np.r_[False, held[1:] * held[:-1] < 0.0]


def _edges(run: RecordingResiduals, physics: npt.NDArray[Any], at: npt.NDArray[np.intp]) -> Mask:
    readings = run.readings(physics)
    slope = np.abs(np.gradient(readings))
    return np.convolve(slope, np.ones(9), "same")[at] > 10.0
