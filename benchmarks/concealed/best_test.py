"""The best possible test: how well one who knows the truth's own laws could tell what a case conceals.

d' weighs an effect against the sensors' noise. But no robot is its file: a track 0.5 % wider by nature hides one that
is 0.6 % wider by design. Here the difference an effect makes is weighed against noise and backgrounds together: those
of the examination's other cases, thing by thing, each driven in the case's own world under the case's commands. Where
a case conceals several effects, each is weighed beside the others, of any strength, too. No linear test does better
than the filter matched to both (Kay, Fundamentals of Statistical Signal Processing II, ch. 4), and no tool can know
more than the laws, and how often each small thing is met.

What the colour sensor read is compared along the path the camera shows: its turn and lens displace that, and its noise
counts for nothing. For readings the figure is therefore an upper limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.background import Background
from benchmarks.concealed.cases import redrawn
from benchmarks.concealed.commands import SECONDS
from benchmarks.concealed.detectability import pairs_of, whitened
from benchmarks.concealed.history import Array
from benchmarks.concealed.plan import read_label
from benchmarks.concealed.recording import CHANNELS, even_ticks, seen_pose
from benchmarks.concealed.rehearsal import Rehearsal, along
from benchmarks.concealed.robot import Concealed

_KINDS = ("single", "double", "triple")
ANY = 100.0  # times their strength that other effects of a case may have
_LIGHT_AT = CHANNELS.index("reflection_pct")
_FIELDS = {field.name for field in fields(Concealed)}


def d_prime_beside_backgrounds(out: Path, name: str, count: int) -> dict[str, tuple[float, float]]:
    """Give the d' of each effect of a case, beside the sensors' noise, and beside backgrounds and the others as well.

    Parameters
    ----------
    out
        Holds ``sealed/``.
    name
        Of a case that conceals one, two or three effects.
    count
        Of how many other cases of its world the backgrounds are taken.

    Returns
    -------
    dict[str, tuple[float, float]]
        By the effect's id.

    Raises
    ------
    ValueError
        If the case conceals anything else, is not drawn anew as it was sealed, or no other has a background.
    """
    label: Mapping[str, Any] = read_label(out, name)
    if label["kind"] not in _KINDS:
        message = f"{name}: found a case of kind {label['kind']}, expected {', '.join(_KINDS)}"
        raise ValueError(message)
    others = _others(out, label, count)
    hidden, case, worlds, acts = redrawn(out, label)
    plain = hidden.plain or hidden.off
    rehearsal = Rehearsal(case.manner.world, plain, acts, SECONDS, case.conditions)
    ids = [effect["id"] for effect in label["effects"]]
    absent = {effect: f"without_{effect}" if len(ids) > 1 else "off" for effect in ids}
    shown = {e: whitened(pairs_of(worlds, "on", absent[e]), case.conditions).ravel() for e in ids}
    columns = []
    for background, amounts in _imperfections(others):
        robot = background.on(plain, amounts)
        pairs = rehearsal.pairs([robot] * len(acts))
        if not amounts:
            pairs = _displaced(pairs, rehearsal, robot, plain, case.conditions.row_ticks)
        columns.append(whitened(pairs, case.conditions).ravel() / math.sqrt(len(others)))
    return {e: _told(shown[e], [*columns, *(ANY * shown[other] for other in ids if other != e)]) for e in ids}


def _told(shown: Array, columns: Sequence[Array]) -> tuple[float, float]:
    """Give the d' of a whitened difference, shape (n,), and beside what differs by standard normal times columns."""
    small = np.stack(columns, axis=1)
    shared = small.T @ shown
    hides = shared @ np.linalg.solve(np.eye(small.shape[1]) + small.T @ small, shared)
    total = float(shown @ shown)
    return math.sqrt(total), math.sqrt(max(total - float(hides), 0.0))


def _others(out: Path, label: Mapping[str, Any], count: int) -> list[Mapping[str, Any]]:
    """Take the first labels of other cases with a background in the same world; there may be fewer."""
    labels: Iterator[Mapping[str, Any]] = (
        read_label(out, path.parent.name) for path in sorted(out.glob("sealed/*/label.json"))
    )
    world, case = label.get("world"), label["case"]
    same = [
        one for one in labels if "background" in one and one.get("world") == world and one["case"] != case
    ]
    if not same[:count]:
        message = f"{out}: found no other case of {case}'s world with a background, expected one or more"
        raise ValueError(message)
    return same[:count]


def _imperfections(labels: Sequence[Mapping[str, Any]]) -> Iterator[tuple[Background, dict[str, float]]]:
    """Give each small imperfection of other cases on its own, with its amount if it moves the robot."""
    for label in labels:
        kinds = dict(label["background"])
        amounts = kinds.pop("amounts")
        for kind, stored in kinds.items():
            changes = {key: tuple(v) if isinstance(v, list) else v for key, v in stored.items()}
            if kind in amounts:
                yield Background({kind: changes}, {}, {}), {kind: amounts[kind]}
            elif set(changes) <= _FIELDS:
                yield Background({}, {kind: changes}, {}), {}


def _displaced(
    pairs: Sequence[tuple[Array, Array]],
    rehearsal: Rehearsal,
    robot: Concealed,
    plain: Concealed,
    row_ticks: int,
) -> list[tuple[Array, Array]]:
    """Let the sensor read where a camera that is turned or has a lens shows the robot."""
    moved = []
    for (there, absent), history in zip(pairs, rehearsal.histories, strict=True):
        ticks = even_ticks(history, row_ticks)
        seen = np.column_stack(seen_pose(history, robot, ticks, 0.0))
        shifted = there.copy()
        shifted[:, _LIGHT_AT] += along(replace(history, pose=seen), plain) - history.light[ticks]
        moved.append((shifted, absent))
    return moved
