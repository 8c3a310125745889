"""Whether stated limits hold: each effect concealed at the size that a verdict says these recordings would have shown.

The robot, its background, what it is told, how it is recorded, and the noise are those of a case that conceals nothing;
only the effect is added. A tool that states limits for 95 of 100 such cases names it in nearly all.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.concealed.cases import Hidden, Thing, record, redrawn, seal, seal_truth
from benchmarks.concealed.effects import EFFECTS, SEVERAL, Rng, at_size
from benchmarks.concealed.history import Array, ToppledError
from benchmarks.concealed.plan import read_label


class AtLimit(NamedTuple):
    """An effect to conceal: in the robot of which case, and how large, in the unit of its label."""

    case: str
    effect: str
    size: float


def stated(out: Path, verdicts: Path, count: int, rng: Rng) -> list[AtLimit]:
    """Choose limits that verdicts on cases with nothing concealed state, as many effects as there are, evenly.

    Parameters
    ----------
    out
        Holds ``sealed/``.
    verdicts
        Holds ``NAME/verdict.json``.
    count
        How many, at most.
    rng
        Which case of an effect comes first, and which effect.

    Raises
    ------
    ValueError
        If no case with nothing concealed has a verdict that states one.
    """
    found: dict[str, list[AtLimit]] = {effect: [] for effect in EFFECTS if effect not in SEVERAL}
    for path in sorted(verdicts.glob("*/verdict.json")):
        name = path.parent.name
        if read_label(out, name)["kind"] == "none":
            limits = json.loads(path.read_text(encoding="utf-8")).get("limits", {})
            for effect, limit in limits.items():
                if effect in found and limit:
                    found[effect].append(AtLimit(name, effect, float(limit["size"])))
    if not any(found.values()):
        message = f"{verdicts}: found no limit for a case with nothing concealed, expected one or more"
        raise ValueError(message)
    effects = rng.permutation([effect for effect, each in found.items() if each]).tolist()
    left = {effect: rng.permutation(len(found[effect])).tolist() for effect in effects}
    chosen = []
    while len(chosen) < count and any(left.values()):
        chosen += [found[effect][left[effect].pop()] for effect in effects if left[effect]]
    return chosen[:count]


def draw_at_limits(out: Path, chosen: list[AtLimit], to: Path, rng: Rng, workers: int) -> str:
    """Record robots with these effects, seal them in another folder, and return the hash of its manifest.

    A robot that falls over with its effect is left out.
    """
    seeds = rng.integers(2**32, size=len(chosen)).tolist()
    with ProcessPoolExecutor(workers) as pool:
        list(pool.map(partial(_draw, out, to), chosen, seeds, range(1, len(chosen) + 1)))
    return seal(to)


def _draw(out: Path, to: Path, chosen: AtLimit, seed: int, number: int) -> None:
    name = f"c{number:03d}"
    folder, sealed = to / "cases" / name, to / "sealed" / name
    label: Mapping[str, Any] = read_label(out, chosen.case)
    empty, case, _, _ = redrawn(out, label)
    runs = len(case.setting.runs)
    drawn = at_size(chosen.effect, chosen.size, np.random.default_rng(seed))
    thing = Thing(
        chosen.effect, (drawn.changes,) * runs, {"id": chosen.effect, "parameters": drawn.parameters}
    )
    about = {**empty.label, "effects": [thing.label], "empty_case": chosen.case}
    hidden = Hidden(thing.on((empty.off,) * runs), empty.off, {}, about, empty.plain)
    folder.mkdir(parents=True, exist_ok=True)
    worlds: dict[str, Array] = {}
    try:
        for run, kind in enumerate(case.setting.runs):
            worlds |= record(folder / f"run_{run + 1:02d}_{kind}.csv", run, hidden, case)
    except ToppledError:
        for path in (*folder.iterdir(), folder):
            path.rmdir() if path.is_dir() else path.unlink()
        return
    sealed.mkdir(parents=True, exist_ok=True)
    seal_truth(sealed, name, "single", tuple(label["seed"]), hidden, case, worlds)
