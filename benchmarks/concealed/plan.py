"""The examination as a whole: which cases, in which order, drawn by all cores and sealed."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.concealed.cases import (
    SENSORS,
    Manner,
    broken_seals,
    draw_case,
    seal,
    unlike_neutral,
)
from benchmarks.concealed.effects import EFFECTS, PLANNED
from benchmarks.concealed.kinds import ALL_OUTSIDE, MET, SETS
from benchmarks.concealed.kinds.outside import OUTSIDE
from benchmarks.concealed.worlds import holds

_MIXED = (MET, "last")  # sets that hold the kinds of the first examinations, and later ones
_ALIKE = 1.0 / 3.0  # share of pairs from one group


@dataclass(frozen=True)
class Counts:
    """How many cases of each kind; single and outside ones are spread evenly over what there is to conceal.

    ``triple`` and ``mixed`` cases have a background: the first examinations had none of them.
    """

    none: int = 100
    single: int = 5 * len(PLANNED)
    double: int = 40
    outside: int = 3 * len(OUTSIDE)
    triple: int = 0
    mixed: int = 0


@dataclass(frozen=True)
class Planned:
    """One case to draw; arguments of :func:`benchmarks.concealed.cases.draw_case`."""

    name: str
    kind: str
    effects: tuple[str, ...]
    seed: tuple[int, ...]
    manner: Manner


def plan(
    seed: int,
    counts: Counts | Mapping[str, Counts],
    *,
    background: bool = False,
    kinds: str = MET,
    pace: float = 1.0,
    without: str = "",
    material: bool = False,
) -> list[Planned]:
    """List the cases of an examination.

    Parameters
    ----------
    seed
        Of the whole examination.
    counts
        How many of each kind, in MuJoCo's world or by world.
    background
        Whether robots have a background; see :class:`benchmarks.concealed.cases.Manner`.
    kinds
        One of ``SETS``, from which physics outside the catalogue is drawn.
    pace
        Share of the usual duties; see :class:`benchmarks.concealed.cases.Manner`.
    without
        A sensor that no case has; what it alone shows is not concealed.
    material
        Whether all that is concealed is material; see :class:`benchmarks.concealed.cases.Manner`.

    Returns
    -------
    list[Planned]
        In an order, and under names, that give nothing away.
    """
    rng = np.random.default_rng(np.random.SeedSequence((seed, 0)))
    contents: list[tuple[str, tuple[str, ...], Manner]] = []
    for world, each in (counts if isinstance(counts, Mapping) else {"mujoco": counts}).items():
        manner = Manner(world, background, pace, without, material)
        drawable = outside_kinds(manner, kinds)
        contents += [(kind, effects, manner) for kind, effects in _contents(each, rng, manner, drawable)]
    order = rng.permutation(len(contents))
    return [
        Planned(f"c{place + 1:03d}", *contents[index][:2], (seed, 1 + int(index)), contents[index][2])
        for place, index in enumerate(order)
    ]


def outside_kinds(manner: Manner, kinds: str = MET) -> list[str]:
    """List the kinds outside the catalogue that can be drawn.

    Parameters
    ----------
    manner
        Of the cases.
    kinds
        One of ``SETS``. Without a background, ``met`` and ``last`` are both those of the first examinations.

    Returns
    -------
    list[str]
    """
    drawable = SETS[kinds] if manner.background or kinds not in _MIXED else OUTSIDE
    rng = np.random.default_rng(0)
    return [
        name
        for name, kind in drawable.items()
        if holds(manner.world, unlike_neutral(kind.draw(rng, 1, 0.0)[0][0]))
    ]


def _contents(
    counts: Counts, rng: np.random.Generator, manner: Manner, drawable: Sequence[str]
) -> list[tuple[str, tuple[str, ...]]]:
    """Say what the cases of one world conceal."""
    hidden = SENSORS.get(manner.without, set())
    effects = [name for name in PLANNED if hidden.isdisjoint(EFFECTS[name].needs)]
    kinds = [name for name in drawable if hidden.isdisjoint(ALL_OUTSIDE[name].needs)]
    contents: list[tuple[str, tuple[str, ...]]] = [("none", ())] * counts.none
    contents += [("single", (effect,)) for effect in _spread(effects, counts.single, rng)]
    for _ in range(counts.double):
        contents.append(("double", _several(effects, 2, rng, alike=manner.background)))
    contents += [("outside", (kind,)) for kind in _spread(kinds, counts.outside, rng)]
    contents += [("triple", _several(effects, 3, rng, alike=False)) for _ in range(counts.triple)]
    for kind in _spread(kinds, counts.mixed, rng):
        contents.append(("mixed", (_several(effects, 1, rng, alike=False)[0], kind)))
    return contents


def draw_all(cases: Iterable[Planned], out: Path, workers: int) -> str:
    """Draw what is not there yet, then seal everything.

    Parameters
    ----------
    cases
        As :func:`plan` lists them.
    out
        Holds ``cases/`` and ``sealed/``.
    workers
        Processes.

    Returns
    -------
    str
        Hash of the manifest.

    Raises
    ------
    ValueError
        If a case is not what it was when it was sealed.
    """
    # What is sealed stays so: an examination that goes on is not sealed anew, unless there are more cases.
    if (out / "manifest.sha256").exists() and (broken := broken_seals(out)):
        message = f"changed since sealed: {', '.join(broken[:5])}"
        raise ValueError(message)
    # The label is written last: a case that has one is whole.
    missing = [case for case in cases if not (out / "sealed" / case.name / "label.json").exists()]
    with ProcessPoolExecutor(workers) as pool:
        jobs = [
            pool.submit(draw_case, case.name, case.kind, case.effects, case.seed, out, case.manner)
            for case in missing
        ]
        for done, job in enumerate(as_completed(jobs), start=1):
            job.result()
            print(f"\rdrawn {done} of {len(jobs)}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return seal(out)


def read_label(out: Path, name: str) -> dict[str, object]:
    """Open one sealed label; for the scorer only."""
    label: dict[str, object] = json.loads((out / "sealed" / name / "label.json").read_text(encoding="utf-8"))
    return label


def _spread(names: Iterable[str], count: int, rng: np.random.Generator) -> list[str]:
    """Take names in a drawn order, round and round."""
    order = rng.permutation(list(names)).tolist()
    return [order[place % len(order)] for place in range(count)]


def _several(names: Sequence[str], count: int, rng: np.random.Generator, *, alike: bool) -> tuple[str, ...]:
    """Draw effects that do not imitate each other; or, if wanted, in a third of the draws some that may."""
    may = alike and rng.random() < _ALIKE
    while True:
        drawn = tuple(names[int(k)] for k in rng.choice(len(names), count, replace=False))
        groups = len({EFFECTS[name].group for name in drawn})
        if groups == (1 if may else count):
            return drawn
