"""The paper's simulated robot: which draws of the prior drive Fig. 6 to GOAL, which in 16.74 s, and how robustly."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.paper_robot.drives import PAPER_S, TOLERANCE_S, Fleet, moved, turns
from benchmarks.paper_robot.inference import shrink
from benchmarks.paper_robot.prior import NAMES, UNKNOWNS, Floats, constants, from_unit, start_of
from gecar.world.rollout import Outcome

TOLERANCES_S = [2.0, 0.7, 0.25, 0.1, TOLERANCE_S]
STEPS_S = (0.004, 0.002, 0.001, 0.0005, 0.00025)
AROUND = 20


@dataclass(frozen=True)
class Found:
    """What the inference found.

    Attributes
    ----------
    tried
        Draws of the prior it took to find those possible.
    possible
        Draws of the prior that reach GOAL in four turns, in the unit cube, shape (n, unknowns).
    posterior
        Draws that do so within the tolerance on the paper's time, shape (m, unknowns); a draw
        whose moves were all refused stands there more than once.
    """

    tried: int
    possible: Floats
    posterior: Floats


def infer(out: Path, wanted: int, seed: int) -> Found:
    """Run the inference, or read what a former run left in ``out``/simulated.npz."""
    kept = out / "simulated.npz"
    if not kept.exists():
        rng = np.random.default_rng(seed)
        tried, possible, misfit = _rejection(wanted, rng)
        narrow = shrink(possible, misfit, TOLERANCES_S, Misfit(Fleet()), rng)
        np.savez(kept, tried=tried, possible=possible, posterior=narrow.cube)
    read = np.load(kept)
    return Found(int(read["tried"]), read["possible"], read["posterior"])


class Misfit:
    """How far from the paper's time a point of the unit cube arrives [s]; inf where it does not, in four turns."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet

    def __call__(self, point: Floats) -> float:
        """Return the misfit of a point."""
        draw = from_unit(point[None])[0]
        own, start = constants(draw), start_of(draw)
        drive = self.fleet.drive(own, start)
        # A trace costs as much as a drive, and few arrive.
        if drive.outcome != Outcome.GOAL or turns(self.fleet.drive(own, start, trace=True)) != 4:
            return float("inf")
        return abs(drive.time_s - PAPER_S)


def _rejection(wanted: int, rng: np.random.Generator) -> tuple[int, Floats, Floats]:
    """Draw from the prior until enough are possible; return how many it took, those, and their misfits [s]."""
    of, tried = Misfit(Fleet()), 0
    possible: list[Floats] = []
    misfits: list[float] = []
    while len(possible) < wanted:
        point = rng.random(len(NAMES))
        misfit, tried = of(point), tried + 1
        if np.isfinite(misfit):
            possible.append(point)
            misfits.append(misfit)
    return tried, np.array(possible), np.array(misfits)


def robustness(posterior: Floats) -> Floats:
    """Return, for each draw, shares that arrive in the paper's time: of `STEPS_S`, and of starts 0.5 mm away (n, 2)."""
    fleets = [Fleet(step_s=step) for step in STEPS_S]
    found = np.empty((len(posterior), 2))
    for k, draw in enumerate(from_unit(posterior)):
        own, start = constants(draw), start_of(draw)
        found[k, 0] = np.mean([on_time(fleet, own, start) for fleet in fleets])
        found[k, 1] = np.mean([on_time(fleets[1], own, near) for near in moved(start, AROUND, 5e-4, 0.0)])
    return found


def on_time(fleet: Fleet, own: dict[str, float], start: Floats) -> bool:
    """Whether a drive reaches GOAL within the tolerance on the paper's time."""
    drive = fleet.drive(own, start)
    return drive.outcome == Outcome.GOAL and abs(drive.time_s - PAPER_S) <= TOLERANCE_S


def table(found: Found) -> str:
    """Write the posterior as Markdown."""
    distinct = np.unique(found.posterior, axis=0)
    robust = robustness(distinct)
    draws, before = from_unit(found.posterior), from_unit(found.possible)
    lines = ["| unknown | prior | reaches GOAL in four turns | and in 16.74 +- 0.05 s |", "|---|---|---|---|"]
    for k, u in enumerate(UNKNOWNS):
        prior = f"{u.low * u.scale:.3g} to {u.high * u.scale:.3g}{', log' if u.logarithmic else ''}"
        words = [_interval(values[:, k] * u.scale) for values in (before, draws)]
        if u.name == "regulated":
            prior, words = "even", [f"{100 * np.mean(v[:, k] >= 0.5):.0f} %" for v in (before, draws)]
        lines.append(f"| {u.name.replace('_', ' ')} [{u.unit}] | {prior} | {words[0]} | {words[1]} |")
    regulated = distinct[:, NAMES.index("regulated")] >= 0.5
    note = [
        f"{len(before)} of {found.tried} draws of the prior reach GOAL in four turns.",
        f"{len(draws)} draws in time, {len(distinct)} distinct.",
    ]
    for name, those in (("share of duty", ~regulated), ("regulated", regulated)):
        if those.any():
            steps, starts = 100.0 * robust[those].T
            note.append(
                f"{name}: {those.sum()} draws; in time at all steps {np.mean(steps == 100.0):.0%}, at three or more "
                f"{np.mean(steps > 50.0):.0%}; from starts 0.5 mm away {np.mean(starts):.0f} % in the mean."
            )
    return "\n".join([*lines, "", *note]) + "\n"


def _interval(values: Floats) -> str:
    low, middle, high = np.percentile(values, [5.0, 50.0, 95.0])
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"
