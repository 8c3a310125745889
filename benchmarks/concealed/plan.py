"""The examination as a whole: which cases, in which order, drawn by all cores and sealed."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.concealed.cases import broken_seals, draw_case, seal
from benchmarks.concealed.effects import EFFECTS
from benchmarks.concealed.outside import OUTSIDE


@dataclass(frozen=True)
class Counts:
    """How many cases of each kind; single and outside ones are spread evenly over what there is to conceal."""

    none: int = 100
    single: int = 5 * len(EFFECTS)
    double: int = 40
    outside: int = 3 * len(OUTSIDE)


@dataclass(frozen=True)
class Planned:
    """One case to draw; arguments of :func:`benchmarks.concealed.cases.draw_case`."""

    name: str
    kind: str
    effects: tuple[str, ...]
    seed: tuple[int, ...]


def plan(seed: int, counts: Counts) -> list[Planned]:
    """List the cases of an examination.

    Parameters
    ----------
    seed
        Of the whole examination.
    counts
        How many of each kind.

    Returns
    -------
    list[Planned]
        In an order, and under names, that give nothing away.
    """
    rng = np.random.default_rng(np.random.SeedSequence((seed, 0)))
    contents: list[tuple[str, tuple[str, ...]]] = [("none", ())] * counts.none
    contents += [("single", (effect,)) for effect in _spread(EFFECTS, counts.single, rng)]
    contents += [("double", _pair(rng)) for _ in range(counts.double)]
    contents += [("outside", (kind,)) for kind in _spread(OUTSIDE, counts.outside, rng)]
    order = rng.permutation(len(contents))
    return [
        Planned(f"c{place + 1:03d}", contents[index][0], contents[index][1], (seed, 1 + int(index)))
        for place, index in enumerate(order)
    ]


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
            pool.submit(draw_case, case.name, case.kind, case.effects, case.seed, out) for case in missing
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


def _pair(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw two effects that do not imitate each other."""
    names = list(EFFECTS)
    while True:
        first, second = (names[int(k)] for k in rng.choice(len(names), 2, replace=False))
        if EFFECTS[first].group != EFFECTS[second].group:
            return first, second
