"""The verdict: what is missing, how sure that is, where it shows, and what is left."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from gecar.displayed import Displayed
from gecar.reality.materiality import Size
from gecar.world.robot import Robot
from gecar.world.terms import Term

MOST_NAMED = 8  # recordings
CHANNEL_WORSE = 1.05  # times what it was off by before: a channel that was made worse
VISIBLE = 1.3  # times what noise leaves: a channel's misfit that is a gap to speak of


@dataclass(frozen=True)
class Misfit:
    """NRMSE of a channel over the recordings set aside: RMSE over the standard deviation of what was measured.

    Attributes
    ----------
    before, after, floor
        Of the robot as it was, of the robot found, and of what noise alone leaves.
    deviation
        That standard deviation, in the column's unit: times it, each is an RMSE.
    """

    before: float
    after: float
    floor: float
    deviation: float = math.nan

    @property
    def gaps(self) -> tuple[float, float]:
        """How far before and after are above the floor, in units of it."""
        return self.before / self.floor - 1.0, self.after / self.floor - 1.0

    @property
    def is_worse(self) -> bool:
        """Whether the channel is clearly farther off after than before."""
        return self.after > CHANNEL_WORSE * self.before

    def as_json(self) -> dict[str, float]:
        """Return the three figures as they are written."""
        return {"before": self.before, "after": self.after, "floor": self.floor}


@dataclass(frozen=True)
class Interval:
    """A parameter's value and 95 % interval, in its unit."""

    value: float
    low: float
    high: float
    unit: str

    def reaching(self, *values: float) -> Interval:
        """Return the interval made long enough to hold some values."""
        return replace(self, low=min(self.low, *values), high=max(self.high, *values))


@dataclass(frozen=True)
class Found:
    """An effect that was found.

    Attributes
    ----------
    id
        Its identifier.
    alternatives
        Effects these recordings cannot tell from it.
    parameters
        By label.
    holdout_gain
        What it lowers the cost by on the recordings set aside.
    null_95, p
        95 % quantile of the largest gain without a cause, and the share of nulls that gain as much.
    size
        What it does to the robot.
    """

    id: str
    alternatives: tuple[str, ...]
    parameters: Mapping[str, Interval]
    holdout_gain: float
    null_95: float
    p: float
    size: Size


@dataclass(frozen=True)
class Invented:
    """A law that was written for physics in no list.

    Attributes
    ----------
    term
        The law, as a part of the robot.
    alternatives
        Laws at other ports that these recordings can not tell from it.
    parameters
        Its constants, by name.
    looks_like
        In words.
    holdout_gain, left_out_gain
        What it lowers the cost by on the recordings set aside, 0 if they do not show it, and on those fitted to, each
        left out in turn.
    null_95, p
        95 % quantile of the largest gain of any law that was tried, without a cause; share of nulls that gain as much.
    spread
        Relative spread of its size over recordings.
    range
        From where to where its variables went in the recordings; beyond, the law is a guess.
    size
        What it does to the robot.
    """

    term: Term
    alternatives: tuple[Term, ...]
    parameters: Mapping[str, Interval]
    looks_like: str
    holdout_gain: float
    left_out_gain: float
    null_95: float
    p: float
    spread: float
    range: Mapping[str, tuple[float, float]]
    size: Size

    @property
    def shows(self) -> bool:
        """Whether the recordings set aside show it."""
        return self.holdout_gain != 0.0


@dataclass(frozen=True)
class Minor:
    """An effect that is visible and too small to matter: what there is could be it.

    Attributes
    ----------
    id
        Its identifier.
    parameters
        By label.
    size
        What it does to the robot.
    """

    id: str
    parameters: Mapping[str, Interval]
    size: Size


@dataclass(frozen=True)
class Limit:
    """The smallest size of an effect that would have been seen: a change from neutral, or a limit's or rate's value."""

    size: float
    unit: str


@dataclass(frozen=True)
class Place:
    """Where simulation and reality part.

    Attributes
    ----------
    channel, regime
        In which channel, in what motion.
    share
        Of the channel's excess energy.
    p
        From shifting the regime in time.
    times_s
        Spans [s] in the recording.
    recording
        The recording in which it shows most.
    place
        x, y [m] and radius [m] on the floor, or None.
    """

    channel: str
    regime: str
    share: float
    p: float
    times_s: tuple[tuple[float, float], ...]
    recording: str
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Judgement:
    """What the robot found is worth on the recordings set aside."""

    recordings: tuple[str, ...]
    by_time: bool
    channels: Mapping[str, Misfit]
    shows: bool = True
    """Whether these recordings show anything of what was found."""

    @property
    def named(self) -> str:
        """The names of the recordings, or their number where there are many."""
        many = len(self.recordings) > MOST_NAMED
        return f"{len(self.recordings)} recordings" if many else ", ".join(self.recordings)

    @property
    def before(self) -> float:
        """Mean NRMSE of the channels for the robot as it was."""
        return _mean([m.before for m in self.channels.values()])

    @property
    def after(self) -> float:
        """Mean NRMSE for the robot found."""
        return _mean([m.after for m in self.channels.values()])

    @property
    def floor(self) -> float:
        """Mean NRMSE that noise alone leaves."""
        return _mean([m.floor for m in self.channels.values()])

    @property
    def gap_closed(self) -> float | None:
        """Share of the gap to the floor that is closed; None where no channel has a gap to speak of.

        (before - after) / (before - floor), each summed over the channels that have a gap before or after, in units of
        the channel's floor: one that shows noise alone has nothing to close, one that is made worse counts, and none
        counts more because little varies in it.
        """
        seen = [m for m in self.channels.values() if max(m.before, m.after) > VISIBLE * m.floor]
        was, now = (sum(gaps) for gaps in zip(*(m.gaps for m in seen), strict=True)) if seen else (0.0, 0.0)
        return (was - now) / was if was > 0.0 else None

    @property
    def failed(self) -> bool:
        """Whether the robot found is further off than the robot as it was: the proof fails."""
        worse = (self.gap_closed or 0.0) < 0.0 and any(m.is_worse for m in self.channels.values())
        return worse and self.shows


@dataclass(frozen=True)
class Residual:
    """What is left.

    Attributes
    ----------
    white, p
        Whether it is white, and how likely that is by chance.
    size, material
        How far the robot found, its constants fitted, parts from the recordings it was fitted to; whether that matters.
    formula
        What describes it, the most telling first.
    described
        If asked for: NRMSE on the recordings set aside of the robot found, without and with the formulas added.
    """

    white: bool
    p: float
    size: Size
    material: bool
    formula: str | None = None
    described: Mapping[str, Misfit] | None = None


@dataclass(frozen=True)
class NextRecording:
    """The recording to make next: why, and its commands (time [s], left and right duty [%])."""

    why: str
    commands: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Verdict(Displayed):
    """What `gecar.reality.discovery.discover` found: `print` it, `plot` it, or let a notebook show it."""

    case: str
    verdict: str
    effects: tuple[Found, ...]
    located: tuple[Place, ...]
    judgement: Judgement
    residual: Residual
    next_recording: NextRecording
    robot: Robot
    minor: tuple[Minor, ...] = ()
    invented: tuple[Invented, ...] = ()
    limits: Mapping[str, Limit | None] = field(default_factory=dict)
    fitted_on: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    evidence: Any = field(default=None, repr=False)

    @property
    def found(self) -> bool:
        """Whether anything was found: effects, or laws that were written."""
        return bool(self.effects or self.invented)

    def as_json(self) -> dict[str, Any]:
        """Return the contents of ``verdict.json``."""
        judged = self.judgement
        return {
            "verdict": self.verdict,
            "effects": [_effect_json(found) for found in self.effects],
            "minor": [_minor_json(minor) for minor in self.minor],
            "invented": [_invented_json(law) for law in self.invented],
            "located": [_place_json(place) for place in self.located],
            "holdout": {
                "recordings": list(judged.recordings),
                "channels": {c: m.as_json() for c, m in judged.channels.items()},
                "before": judged.before,
                "after": judged.after,
                "floor": judged.floor,
                "gap_closed": None if self.verdict == "nothing" else judged.gap_closed,
            },
            "limits": {effect: limit and vars(limit) for effect, limit in self.limits.items()},
            "residual": _residual_json(self.residual),
            "next_recording": {
                "why": self.next_recording.why,
                "commands": [list(row) for row in self.next_recording.commands],
            },
        }


def _effect_json(found: Found) -> dict[str, Any]:
    return {
        "id": found.id,
        "or": list(found.alternatives),
        "parameters": {label: vars(interval) for label, interval in found.parameters.items()},
        "evidence": {"holdout_gain": found.holdout_gain, "null_95": found.null_95, "p": found.p},
    }


def _invented_json(law: Invented) -> dict[str, Any]:
    term = law.term
    return {
        "port": term.port,
        "side": term.side,
        "law": term.law,
        "store": {"law": term.store, "time_s": term.store_s} if term.store else None,
        "unit": term.unit,
        "variables": list(term.parsed.variables),
        "parameters": {name: vars(interval) for name, interval in law.parameters.items()},
        "looks_like": law.looks_like,
        "or": [{"port": other.port, "law": other.law, **other.constants} for other in law.alternatives],
        "evidence": {
            "holdout_gain": law.holdout_gain,
            "left_out_gain": law.left_out_gain,
            "null_95": law.null_95,
            "p": law.p,
            "spread": law.spread,
        },
        "range": {name: list(ends) for name, ends in law.range.items()},
        "moves": size_json(law.size),
    }


def _minor_json(minor: Minor) -> dict[str, Any]:
    parameters = {label: vars(interval) for label, interval in minor.parameters.items()}
    return {"id": minor.id, "parameters": parameters, "moves": size_json(minor.size)}


def size_json(size: Size) -> dict[str, float | None]:
    """Return a size as it is written: over a whole recording, and over a metre."""
    return {
        "mm": size.mm_drive,
        "deg": size.deg_drive,
        "arrival_s": size.arrival_s,
        "mm_1m": size.mm_1m,
        "deg_1m": size.deg_1m,
        "reading_pct": size.reading_pct,
    }


def _residual_json(residual: Residual) -> dict[str, Any]:
    table: dict[str, Any] = {"white": residual.white, "p": residual.p, "formula": residual.formula}
    table |= {"material": residual.material, "size": size_json(residual.size)}
    if residual.described is not None:
        table["with_formula"] = {c: m.as_json() for c, m in residual.described.items()}
    return table


def _place_json(place: Place) -> dict[str, Any]:
    spot = place.place
    return {
        "channel": place.channel,
        "regime": place.regime,
        "share": place.share,
        "p": place.p,
        "times_s": [list(span) for span in place.times_s],
        "place": None if spot is None else {"x_m": spot[0], "y_m": spot[1], "radius_m": spot[2]},
        "recording": place.recording,
    }


def _mean(values: list[float]) -> float:
    return sum(values) / len(values) if values else 0.0
