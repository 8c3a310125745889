"""Recordings set aside before anything else: fitted to by nothing, judged on by everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gecar.errors import expected, one_of
from gecar.reality.recordings.columns import COLUMNS, POSE_FIELDS
from gecar.reality.recordings.recording import Case, Recording

EVERY = 4  # one recording in so many is set aside
FIRST_SHARE = 0.7  # of a single recording's time is fitted on
ENOUGH_S = 100.0  # of drives to fit on: more makes fits slower, and proves less than as many drives set aside
LINE_PCT = 30.0  # what readings differ by where a line was crossed, at least; on bare floor it is a few
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
LEAST = 6  # drives, however long: each is left out in turn


@dataclass(frozen=True)
class Split:
    """What is fitted on, and what is set aside.

    Attributes
    ----------
    fitted, held
        Recordings.
    by_time
        Whether the last part of the only recording is set aside.
    spare
        How many recordings are set aside because enough are left to fit on.
    """

    fitted: tuple[Recording, ...]
    held: tuple[Recording, ...]
    by_time: bool = False
    spare: int = 0


def hold_out(case: Case, names: Sequence[str] = ()) -> Split:
    """Set recordings aside: those named, or every fourth counted from the last, or the end of the only one.

    The count begins earlier where otherwise no recording that reads the line would be fitted on. The beginning of a
    name is enough where no other begins so.

    Raises
    ------
    InputError
        If a name is no recording of the case, or nothing is left to fit on.
    """
    known = [r.name for r in case.recordings]
    wanted = {_named(name.removesuffix(".csv"), known) for name in names if name}
    if not wanted and len(known) == 1:
        return _by_time(case.recordings[0])
    if not wanted:
        wanted = _every_fourth(case.recordings)
    fitted = tuple(r for r in case.recordings if r.name not in wanted)
    if not fitted:
        raise expected("--holdout", "all recordings", "at least one left to fit on")
    return Split(fitted, tuple(r for r in case.recordings if r.name in wanted))


def _every_fourth(recordings: Sequence[Recording]) -> set[str]:
    """Return the names of the recordings to hold out: every fourth counted from the last, or one of fewer."""
    names, every = [r.name for r in recordings[::-1]], min(EVERY, len(recordings))
    choices = [set(names[first::every]) for first in range(every)]
    lines = {r.name for r in recordings if _reads_a_line(r)}
    return next((held for held in choices if not lines <= held), choices[0])


def _reads_a_line(recording: Recording) -> bool:
    """Whether the colour sensor saw both the line and bare floor."""
    seen = recording.reflection_pct[~np.isnan(recording.reflection_pct)]
    return bool(np.ptp(seen) > LINE_PCT) if len(seen) else False


def with_enough(split: Split) -> Split:
    """Fit on no more drives than are enough, spread over all of them, and set the others aside, too.

    They are spread as multiples of the golden ratio are: evenly, and not at the pace of kinds that take turns.

    A search takes as long as what it fits, and what a simulation is off by is the same in the tenth drive and the
    thirtieth. Recordings of a motor on a bench stay, as each may be of a regime of its own.
    """
    total_s = sum(r.duration_s for r in split.fitted)
    count = max(int(len(split.fitted) * ENOUGH_S / total_s), LEAST)
    if count >= len(split.fitted) or any(r.setup.rig == "bench" for r in split.fitted):
        return split
    spread = (np.arange(1, 20 * len(split.fitted)) * GOLDEN) % 1.0 * len(split.fitted)
    kept = sorted(list(dict.fromkeys(spread.astype(int).tolist()))[:count])
    fitted = tuple(split.fitted[k] for k in kept)
    spare = tuple(r for k, r in enumerate(split.fitted) if k not in kept)
    return replace(split, fitted=fitted, held=(*split.held, *spare), spare=len(spare))


def _named(name: str, known: Sequence[str]) -> str:
    """Return the recording of a name, or the only one whose name begins so."""
    begun = [each for each in known if each.startswith(name)]
    if name in known or len(begun) == 1:
        return name if name in known else begun[0]
    if begun:
        raise expected("--holdout", f"'{name}', as {' and '.join(begun)} begin", "more of the name")
    raise one_of("--holdout", name, known)


def _by_time(recording: Recording) -> Split:
    """Set the last part aside; of the first it keeps the commands and the first pose: where the replay begins."""
    cut = recording.t_s[0] + FIRST_SHARE * recording.duration_s
    first = recording.t_s <= cut
    seen = ~np.isnan(recording.x_m)
    begun = seen & (np.cumsum(seen) == 1)
    early, late = recording, recording
    for field, _ in COLUMNS.values():
        values = getattr(recording, field)
        kept: dict[str, Any] = {field: values[first]}
        early = replace(early, **kept)
        if field not in ("t_s", "left_duty", "right_duty"):
            known = begun if field in POSE_FIELDS else False
            blanked: dict[str, Any] = {field: np.where(first & ~known, np.nan, values)}
            late = replace(late, **blanked)
    return Split((early,), (late,), by_time=True)
