"""Compare one verdict with one sealed label."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.concealed.effects import SEVERAL, is_below
from benchmarks.concealed.history import Array
from benchmarks.concealed.recording import CHANNELS, POSE
from benchmarks.concealed.sizes import is_material, sizes_in

LARGEST_SET = 4  # an `or` of more names than this names nothing
BIN_S = 0.2  # places in time are compared in steps of so long
_CHANNEL_SHARE = 0.25  # of the loudest group: a located channel at least that loud is where the effect shows
_TO_SI = {"deg": math.pi / 180.0, "ms": 1e-3, "mm": 1e-3, "cm": 1e-2, "%": 1e-2, "mV/s": 1e-3, "mohm": 1e-3}


@dataclass(frozen=True)
class Judged:
    """What one verdict got right.

    ``truth``: effects' identifiers, or the kind outside the catalogue, or nothing. ``named``: the sets of names
    given. ``d_prime``: per concealed thing. ``hits``: concealed effects named, each by a set of its own. ``covered``:
    for every parameter that could be compared, whether the interval holds the truth. ``gap_closed``: as the verdict
    has it, over the channels with a gap; ``gap_closed_over_all``: over all channels, those of noise alone as well.
    ``camera``: whether poses were recorded. ``invisible``: whether the verdict says, of every concealed effect, that
    these recordings would not show it, or not as little of it.
    ``world``, ``setting`` and ``sizes`` (per concealed thing, in mm, deg and %): as the label has them. Entries are
    nan, or empty, where a verdict or a label does not say.
    """

    name: str
    kind: str
    truth: tuple[str, ...]
    verdict: str
    named: tuple[frozenset[str], ...]
    d_prime: Mapping[str, float]
    hits: tuple[str, ...]
    covered: Mapping[str, bool] = field(default_factory=dict)
    gap_closed: float = math.nan
    gap_closed_over_all: float = math.nan
    channel_right: bool | None = None
    regime_overlap: float = math.nan
    world: str = "mujoco"
    setting: Mapping[str, Any] = field(default_factory=dict)
    sizes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    camera: bool = True
    invisible: bool = False

    @property
    def material(self) -> bool:
        """Whether anything concealed matters to somebody who drives a course; not known of the first examinations."""
        return any(self._material)

    @property
    def wrong(self) -> int:
        """How many of the names given are not there."""
        return len(self.named) - len(self.hits)

    @property
    def exact(self) -> bool:
        """Whether every concealed effect was named, and nothing else."""
        return self.wrong == 0 and len(self.hits) == len(self.truth)

    @property
    def says_more(self) -> bool:
        """Whether it says that something material is left which no name explains, or writes a law for it."""
        return "unexplained" in self.verdict or "invented" in self.verdict

    @property
    def all_material(self) -> bool:
        """Whether each thing concealed matters by itself; not known of the first examinations."""
        return bool(self._material) and all(self._material)

    @property
    def _material(self) -> list[bool]:
        """Whether it matters, of each thing concealed."""
        return [is_material(size) for name, size in self.sizes.items() if name != "background"]

    @property
    def half_explained(self) -> bool:
        """Whether the effects are named, nothing else is, and something is said to be left: right in mixed cases."""
        return self.wrong == 0 and len(self.hits) == len(self.truth) - 1 and self.says_more

    @property
    def right(self) -> bool:
        """Whether the verdict is what the case's kind asks for."""
        return {"outside": self.abstained, "mixed": self.half_explained}.get(self.kind, self.exact)

    @property
    def abstained(self) -> bool:
        """Whether it says that something is there and names nothing."""
        return not self.named and self.says_more


def judge(label: Mapping[str, Any], verdict: Mapping[str, Any], seen: Mapping[str, Any]) -> Judged:
    """Judge one case.

    Parameters
    ----------
    label
        The sealed label.
    verdict
        As ``design.md`` describes ``verdict.json``; missing parts count as not said.
    seen
        What :func:`benchmarks.concealed.sightings.sight` measured: ``d_prime``, ``groups``, ``timeline``.

    Returns
    -------
    Judged
    """
    effects = [effect for effect in verdict.get("effects") or [] if effect.get("id")]
    named = tuple(frozenset([effect["id"], *(effect.get("or") or [])]) for effect in effects)
    truth = tuple(effect["id"] for effect in label["effects"])
    matched = _matched(truth, named)
    outside = label.get("outside")
    holdout = verdict.get("holdout") or {}
    channel, overlap = _located(verdict.get("located") or [], seen, label["runs"])
    return Judged(
        name=label["case"],
        kind=label["kind"],
        truth=(*truth, outside["id"]) if outside else truth,
        verdict=str(verdict.get("verdict", "")),
        named=named,
        d_prime=seen["d_prime"],
        hits=tuple(matched),
        covered=_covered(label["effects"], {key: effects[place] for key, place in matched.items()}),
        gap_closed=_number(holdout.get("gap_closed")),
        gap_closed_over_all=_closed_over_all(holdout),
        channel_right=channel,
        regime_overlap=overlap,
        world=label.get("world", "mujoco"),
        setting=label.get("setting", {}),
        sizes=sizes_in(label),
        camera=not set(POSE).isdisjoint(label.get("conditions", {}).get("columns", POSE)),
        invisible=_invisible(label["effects"], verdict.get("limits") or {}),
    )


def _invisible(
    concealed: Sequence[Mapping[str, Any]], limits: Mapping[str, Mapping[str, Any] | None]
) -> bool:
    """Check whether the limits stated leave room for all that is concealed; that of several numbers has no one size."""
    stated = [(effect["id"], effect["parameters"], limits.get(effect["id"])) for effect in concealed]
    return bool(stated) and all(
        name in limits
        and (limit is None or (name not in SEVERAL and is_below(name, numbers, float(limit["size"]))))
        for name, numbers, limit in stated
    )


def _closed_over_all(holdout: Mapping[str, Any]) -> float:
    """Return the share of the gap closed over the channels' means; nan where there is none."""
    before, after, floor = (_number(holdout.get(key)) for key in ("before", "after", "floor"))
    return (before - after) / (before - floor) if before > floor else math.nan


def _matched(truth: Sequence[str], named: Sequence[frozenset[str]]) -> dict[str, int]:
    """Give each concealed effect a set of its own that names it, the smallest first."""
    free = sorted(
        (place for place, names in enumerate(named) if len(names) <= LARGEST_SET), key=lambda p: len(named[p])
    )
    matched: dict[str, int] = {}
    for effect in truth:
        place = next((p for p in free if effect in named[p] and p not in matched.values()), None)
        if place is not None:
            matched[effect] = place
    return matched


def _covered(
    concealed: Sequence[Mapping[str, Any]], found: Mapping[str, Mapping[str, Any]]
) -> dict[str, bool]:
    """Check the intervals of every parameter that label and verdict share under the effect's own name."""
    covered = {}
    for effect in concealed:
        said = found.get(effect["id"], {})
        if said.get("id") != effect["id"]:
            continue
        for name, true in effect["parameters"].items():
            claim = (said.get("parameters") or {}).get(name)
            if claim is not None and claim.get("low") is not None and claim.get("high") is not None:
                low, high = (_si(claim[end], claim.get("unit", "-")) for end in ("low", "high"))
                covered[f"{effect['id']}.{name}"] = low <= _si(true["value"], true["unit"]) <= high
    return covered


def _located(
    located: Sequence[Mapping[str, Any]], seen: Mapping[str, Any], runs: Sequence[str]
) -> tuple[bool | None, float]:
    """Check whether, in the channel and at the times a verdict points at first, the difference is loud."""
    if not located or not seen["groups"]:
        return None, math.nan
    first = located[0]
    groups = seen["groups"]
    loud = groups.get(group_of(str(first.get("channel", ""))), 0.0) >= _CHANNEL_SHARE * max(groups.values())
    return loud, _overlap(first, np.asarray(seen["timeline"]), runs)


# A verdict may leave units and sides away; the first prefix that fits decides.
_PREFIXES = {
    "gyro": ("yaw", "gyro"),
    "pose": ("x", "y", "heading", "pose", "position"),
    "encoders": ("left", "right", "angle", "encoder", "wheel"),
    "reflection": ("reflection", "light", "sensor"),
    "battery": ("battery", "voltage"),
}


def group_of(channel: str) -> str:
    """Sort a channel into gyro, pose, encoders, reflection or battery."""
    return next((group for group, starts in _PREFIXES.items() if channel.startswith(starts)), channel)


def _overlap(place: Mapping[str, Any], timeline: Array, runs: Sequence[str]) -> float:
    """Energy inside the time spans, over the most that spans of the same total length could hold."""
    chosen = np.zeros(timeline.shape, dtype=bool)
    recording, step = str(place.get("recording", "")), BIN_S
    for run in range(len(runs)):
        if recording and not recording.startswith(f"run_{run + 1:02d}"):
            continue
        for start, end in place.get("times_s") or []:
            chosen[run, int(start / step) : max(math.ceil(end / step), int(start / step) + 1)] = True
    count = int(chosen.sum())
    if count == 0 or timeline.sum() <= 0.0:
        return math.nan
    best = float(np.sort(timeline, axis=None)[-count:].sum())
    return float(timeline[chosen].sum()) / best


def group_shares(by_channel: Mapping[str, float]) -> dict[str, float]:
    """Add up the energy of the channels of each group."""
    shares: dict[str, float] = {}
    for name in CHANNELS:
        shares[group_of(name)] = shares.get(group_of(name), 0.0) + by_channel[name]
    return shares


def _si(number: float, unit: str) -> float:
    return float(number) * _TO_SI.get(unit, 1.0)


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) else math.nan
