"""Repair of logs that miss rows or whose times jitter, by how the wheels moved, or else by where the robot was seen.

A brick that is busy drops rows, and the command of such a row is not known: held on until the next row, a step comes
late by a row's time. One that writes a row a moment after it read its sensors gives a step the wrong time by as much.
Wheels are off by degrees then for as long as a replay remembers, which no effect of a robot looks like, and none may
make up for.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.optimisation.least_squares import costs
from gecar.reality.recordings.recording import Recording
from gecar.reality.replay.replayer import replayer_of

Array = npt.NDArray[np.float64]

WHEELS = frozenset({"left_angle_rad", "right_angle_rad", "yaw_rate_rad_s"})
LEAST_CHANGE = 0.005  # of duty: smaller ones move nothing
AFTER_S = 0.4  # for which wheels tell when a command changed
SHARES = np.array([0.5, 0.25, 0.75, 0.0, 1.0])  # of lost rows, with the next command; first: no answer
ROUNDS = 2
LEAST_JITTER = 0.001  # of the time between rows: less is nothing
JITTER = 0.25  # beyond it, rows are not meant to be even


def without_log_faults(
    recording: Recording, physics: npt.NDArray[Any], sd: Array, walk: Array, memory_s: float
) -> Recording:
    """Return a recording with even row times, where they fit the wheels better, and with commands inside its gaps.

    Parameters
    ----------
    recording
        Any; one that has neither fault is returned as it is.
    physics
        The robot as far as it is known, shape (1,).
    sd, walk, memory_s
        Noise and memory of the replays, as in `KernelInput`.
    """

    def off(tried: Recording) -> Array:
        """Return the robust cost of each row, shape (rows,): of angles and yaw rate; without these, of poses.

        It grows linearly, as a robot known only roughly is many standard deviations off whenever a command changed.
        """
        found = replayer_of(tried, sd, walk, memory_s).play(physics)
        errors = found.row_errors[:, [0, 1, 3]]
        if WHEELS.isdisjoint(tried.measured):
            errors[~np.isnan(tried.poses).all(axis=1)] = found.pose_errors
        return np.asarray(costs(np.nan_to_num(errors)).sum(axis=1))

    if len(recording.t_s) < 3:
        return recording
    even = _with_even_times(recording)
    if even is not None and off(even).sum() < off(recording).sum():
        recording = even
    t, commands = recording.t_s, recording.commands
    apart, usual = np.diff(t), float(np.median(np.diff(t)))
    changed = np.abs(np.diff(commands, axis=0)).max(axis=1) > LEAST_CHANGE
    gaps = recording.gaps[changed[recording.gaps]]
    until = np.searchsorted(t, t[gaps + 1] + AFTER_S)

    def with_shares(chosen: Array) -> Recording:
        early = t[gaps + 1] - chosen * (apart[gaps] - usual)
        return replace(recording, lost_t_s=early, lost_commands=commands[gaps + 1])

    def off_after(chosen: Array) -> Array:
        total = np.r_[0.0, np.cumsum(off(with_shares(chosen)))]
        return np.asarray(total[until] - total[gaps + 1])

    best = np.full(len(gaps), SHARES[0])
    for number in range(2 * ROUNDS if len(gaps) else 0):
        turn = np.arange(len(gaps)) % 2 == number % 2  # neighbours overlap: every other one at a time
        found = np.stack([off_after(np.where(turn, share, best)) for share in SHARES])
        best = np.where(turn, SHARES[np.argmin(found, axis=0)], best)
    return with_shares(best) if len(gaps) else recording


def _with_even_times(recording: Recording) -> Recording | None:
    """Return a recording with evenly spaced rows, gaps kept; None if they are even, or too uneven for that."""
    t = recording.t_s
    usual = float(np.median(np.diff(t)))
    number = np.r_[0.0, np.cumsum(np.maximum(np.round(np.diff(t) / usual), 1.0))]
    line = np.polynomial.Polynomial.fit(number, t, 1)(number)
    far = np.abs(line - t).max()
    return replace(recording, t_s=line) if LEAST_JITTER * usual < far < JITTER * usual else None
