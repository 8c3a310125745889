"""Repairs of damaged logs: made where the mend is certain, with a line each; refused elsewhere."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
import numpy.typing as npt

from gecar.errors import InputError
from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.encoder_zero import FASTEST_DPS

_SLACK_DEG = 25.0  # beyond what the fastest wheel turns: times are whole milliseconds
_WRAPS_DEG = (360.0, 65536.0, 32768.0, 4294967296.0)
_LONGEST_SPIKE = 3
_MOST_DROPPED = 0.2
_MOST_LOST = 0.3

Rows = npt.NDArray[np.bool_]


def increasing_rows(where: str, time: Series) -> tuple[Rows, list[str]]:
    """Choose the rows whose times increase.

    Times that repeat keep the last row (it holds the newest command); single rows out of order go.

    Parameters
    ----------
    where
        The file, for messages.
    time
        Times as the file has them, shape (rows,); NaN for a blank.

    Returns
    -------
    rows
        Which to keep, shape (rows,).
    repairs
        A line for each kind of repair.

    Raises
    ------
    InputError
        If a fifth of the rows is out of order, or half of them repeat a time.
    """
    repairs = []
    keep = ~np.isnan(time)
    if not keep.all():
        repairs.append(f"{where}: left out {int((~keep).sum())} rows without a time")
    counted = int(keep.sum())
    repeated = np.zeros_like(keep)
    kept = np.flatnonzero(keep)
    repeated[kept[:-1]] = time[kept[:-1]] == time[kept[1:]]
    if 2 * repeated.sum() > counted:
        raise InputError(
            f"{where}: {int(repeated.sum())} of {counted} rows repeat the time of the next: its clock is too coarse "
            "(is another column the time? --column NAME=t_s)"
        )
    if repeated.any():
        repairs.append(f"{where}: left out {int(repeated.sum())} rows whose time the next row repeats")
    keep &= ~repeated
    kept = np.flatnonzero(keep)
    ordered = np.zeros_like(keep)
    ordered[kept[_longest_increasing(time[kept])]] = True
    wild = keep & ~ordered
    if wild.sum() > max(3, _MOST_DROPPED * len(kept)):
        raise InputError(f"{where}: {int(wild.sum())} of {len(kept)} times are out of order: no safe repair")
    if wild.any():
        shown = ", ".join(f"{t:g}" for t in time[wild][:5])
        repairs.append(f"{where}: left out {int(wild.sum())} rows whose time is out of order ({shown})")
    return ordered, repairs


def clock_restarts(time: Series) -> list[int]:
    """Return the rows at which the clock starts again; times may be blank (NaN), shape (rows,)."""
    rows = np.flatnonzero(~np.isnan(time))
    values = time[rows]
    return [int(rows[k + 1]) for k in np.flatnonzero(np.diff(values) < 0.0) if _restarts(values, int(k) + 1)]


def _restarts(values: Series, k: int) -> bool:
    """Say whether the clock starts again at row k, and not just one time is wild: both sides agree."""
    before, after = values[max(0, k - 5) : k], values[k : k + 5]
    return min(len(before), len(after)) >= 3 and bool(np.median(before) > after.max())


def _longest_increasing(values: Series) -> npt.NDArray[np.int64]:
    """Return the indices of the longest strictly increasing subsequence (patience sorting)."""
    tails: list[float] = []
    ends: list[int] = []
    before = np.full(len(values), -1)
    for k, value in enumerate(values.tolist()):
        place = bisect_left(tails, value)
        tails[place : place + 1] = [value]
        ends[place : place + 1] = [k]
        before[k] = ends[place - 1] if place else -1
    chain = []
    k = ends[-1] if ends else -1
    while k >= 0:
        chain.append(k)
        k = int(before[k])
    return np.array(chain[::-1], dtype=np.int64)


def mend_encoder(where: str, t_s: Series, angle_deg: Series) -> tuple[Series, list[str]]:
    """Undo what an encoder's log can suffer: wraps, resets to zero and single wild values.

    Parameters
    ----------
    where
        File and column, for messages.
    t_s, angle_deg
        Times and angles, shape (rows,) [s, deg]; NaN where there is no sample.

    Returns
    -------
    angle_deg
        The angle, continuous; wild values are blank.
    repairs
        A line for each kind of repair.

    Raises
    ------
    InputError
        If the angle jumps as no wheel turns, and it is none of these.
    """
    angle = angle_deg.copy()
    times: dict[str, list[float]] = {}
    for _ in range(len(angle)):
        jump = _first_jump(t_s, angle)
        if jump is None:
            break
        kind = _mend_jump(t_s, angle, angle_deg, *jump)
        if kind is None:
            at = f"at {t_s[jump[1]]:g} s from {angle[jump[0]]:g} to {angle[jump[1]]:g} deg"
            raise InputError(
                f"{where}: the angle jumps {at}: no wheel turns so, and it is no wrap, reset or spike"
            )
        times.setdefault(kind, []).append(float(t_s[jump[1]]))
    if len(times.get("spike", ())) > max(5, 0.02 * len(angle)):
        raise InputError(f"{where}: {len(times['spike'])} wild values among {len(angle)}: no safe repair")
    words = {"spike": "blanked wild values", "reset": "carried on after resets to 0", "wrap": "unwrapped"}
    return angle, [f"{where}: {words[kind]} at {_listed(at)}" for kind, at in times.items()]


def _listed(times: list[float]) -> str:
    shown = ", ".join(f"{t:g}" for t in times[:4])
    return f"{shown} s" if len(times) <= 4 else f"{shown} s and {len(times) - 4} more times"


def _first_jump(t_s: Series, angle: Series) -> tuple[int, int] | None:
    """Return the rows of the first two samples a wheel can not have turned between."""
    rows = np.flatnonzero(~np.isnan(angle))
    jumps = np.flatnonzero(np.abs(np.diff(angle[rows])) > _reach(np.diff(t_s[rows])))
    return (int(rows[jumps[0]]), int(rows[jumps[0] + 1])) if len(jumps) else None


def _reach(step_s: Series) -> Series:
    return FASTEST_DPS * np.minimum(step_s, 1.0) + _SLACK_DEG


def _mend_jump(t_s: Series, angle: Series, logged: Series, before: int, after: int) -> str | None:
    """Mend one jump in place and name its kind; ``None`` if it is of no known kind."""
    if _ends_spike(t_s, angle, before, after):
        return "spike"
    reach = float(_reach(np.array([t_s[after] - t_s[before]]))[0])
    jump = angle[after] - angle[before]
    for period in _WRAPS_DEG:
        whole = np.nanmax(np.abs(logged)) <= 1.01 * period
        if whole and abs(abs(jump) - period) <= min(reach, 0.45 * period):
            angle[after:] -= np.copysign(period, jump)
            return "wrap"
    if abs(logged[after]) <= reach:
        angle[after:] += angle[before] + _step_before(angle, before) - angle[after]
        return "reset"
    return None


def _ends_spike(t_s: Series, angle: Series, before: int, after: int) -> bool:
    """Blank the samples from a jump to where the angle is back, if that is soon."""
    following = after + np.flatnonzero(~np.isnan(angle[after:]))[1 : 1 + _LONGEST_SPIKE]
    if not len(following):
        angle[after:] = np.nan
        return True
    for row in following:
        if abs(angle[row] - angle[before]) <= float(_reach(np.array([t_s[row] - t_s[before]]))[0]):
            angle[after:row] = np.nan
            return True
    return False


def _step_before(angle: Series, row: int) -> float:
    """Return the last step before a sample [deg]: about what the wheel turned while it was reset."""
    earlier = np.flatnonzero(~np.isnan(angle[:row]))
    return float(angle[row] - angle[earlier[-1]]) if len(earlier) else 0.0


def lost_poses(where: str, t_s: Series, x: Series, y: Series) -> tuple[Rows, list[str]]:
    """Find poses where the camera lost its mark: jumps many times faster than the robot ever moves.

    Parameters
    ----------
    where
        The file, for messages.
    t_s, x, y
        Times and positions, shape (rows,); positions in any unit, NaN where there is none.

    Returns
    -------
    lost
        Which to blank, shape (rows,).
    repairs
        A line, if there are any.

    Raises
    ------
    InputError
        If they are more than three in ten.
    """
    rows = np.flatnonzero(~np.isnan(x) & ~np.isnan(y))
    steps = np.hypot(np.diff(x[rows]), np.diff(y[rows])) / np.diff(t_s[rows])
    limit = 8.0 * float(np.quantile(steps, 0.8)) if len(steps) else 0.0
    chains = [_chain(t_s[rows], x[rows], y[rows], limit, first) for first in range(min(5, len(rows)))]
    best = max(chains, key=lambda chain: int(chain.sum()), default=np.zeros(0, dtype=bool))
    lost = np.zeros(len(x), dtype=bool)
    lost[rows[~best]] = True
    if lost.sum() > _MOST_LOST * max(len(rows), 1):
        raise InputError(
            f"{where}: {int(lost.sum())} of {len(rows)} positions jump: the camera lost its mark too often"
        )
    repairs = (
        [f"{where}: blanked {int(lost.sum())} positions where the camera lost its mark"] if lost.any() else []
    )
    return lost, repairs


def _chain(t_s: Series, x: Series, y: Series, limit: float, first: int) -> Rows:
    """Follow the path from one pose, and say which poses lie on it."""
    on = np.zeros(len(t_s), dtype=bool)
    last = first
    for k in range(first, len(t_s)):
        moved = np.hypot(x[k] - x[last], y[k] - y[last])
        if k == first or moved <= limit * min(t_s[k] - t_s[last], 1.0):
            on[k] = True
            last = k
    return on
