"""How programs arrive under random conditions, and the share that does, as it stands beside every time to GOAL."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gecar.language.program import Program
from gecar.search.chance import REPORT, REPORTED_DRAWS, arrivals, times_at_steps
from gecar.search.programs import noise_seed
from gecar.world.rollout import World


def arrives(world: World, program: Program | None, seed: int, others: Sequence[World] = ()) -> dict[str, Any]:
    """Return how a program arrives under `REPORTED_DRAWS` fresh conditions, and at other steps, for result.json."""
    if program is None:
        return {"share": 0.0, "of": 0, "median_s": None, "p95_s": None, "steps": {}}
    (times,) = arrivals(world, [program.opcodes], REPORTED_DRAWS, (seed, REPORT), others)
    return {
        "share": times.share,
        "of": REPORTED_DRAWS,
        "median_s": times.quantile_s(0.5),
        "p95_s": times.quantile_s(0.95),
        "steps": times_at_steps(world, program.opcodes, noise_seed(seed, program)),
    }


def shares(world: World, programs: Sequence[Program], seed: int, others: Sequence[World] = ()) -> list[float]:
    """Return the share of drives in which each program arrives, 0..1, under the conditions of `arrives`."""
    opcodes = [program.opcodes for program in programs]
    found = arrivals(world, opcodes, REPORTED_DRAWS, (seed, REPORT), others)
    return [times.share for times in found]


def share_of(result: Mapping[str, Any]) -> float | None:
    """Return the share of drives that arrive, 0..1, from result.json or a study's run; None where it is not there."""
    told = result.get("arrives")
    share = told.get("share") if isinstance(told, Mapping) else None
    return float(share) if isinstance(share, int | float) else None


def median_share(results: Sequence[Mapping[str, Any]]) -> float:
    """Return the median of runs' shares, 0..1; nan for no run, or where one does not say."""
    known = np.array([share_of(result) for result in results], float)
    return float(np.median(known)) if len(known) else math.nan


def percent(share: float | None) -> str:
    """Write a share, 0..1; a dash where it is not known. One of 200 drives shows: only all of them are 100 %."""
    return "- %" if share is None or math.isnan(share) else f"{100.0 * share:.3g} %"


def arriving(share: float | None) -> str:
    """Say which share of drives arrives, 0..1, in two words."""
    return f"{percent(share)} arrive"


def with_share(time_s: float, share: float | None) -> str:
    """Write a program's time to GOAL [s] and the share of drives that arrive, 0..1."""
    return f"{time_s:.2f} s, {arriving(share)}"
