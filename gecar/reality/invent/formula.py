"""A formula for what nothing in the catalogue explains: a description in state variables, not a cause.

A wrong speed makes an angle or a place drift, and a following replay forgets that drift over its memory. So the
residual is regressed on candidate terms that went through the same forgetting: nothing noisy is differentiated, and
the terms come from simulated states. Terms are added one by one while left-out recordings gain; only those stay that
most resamples of the recordings choose too.

Sources: sparse regression of dynamics, Brunton, Proctor, Kutz, PNAS 113 (2016), without its derivatives; ensembles for
stability, Fasel et al., Proc. R. Soc. A 478 (2022).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.replay.kernel import (
    AHEAD,
    HEADING,
    LEFT_ANGLE,
    LEFT_SPEED,
    RIGHT_ANGLE,
    RIGHT_SPEED,
    YAW_RATE,
    X,
    Y,
)
from gecar.reality.residuals.of_recording import RecordingResiduals

Array = npt.NDArray[np.float64]

MOST_TERMS = 3
LEAST_GAIN = 0.04  # of the energy of left-out recordings: what a term must explain
LEAST_SHARE = 0.15  # of the energy of left-out recordings: less describes nothing
FEWEST = 3  # recordings to leave one out of; fewer are cut into as many parts in time
RESAMPLES = 20
STABLE = 0.6  # of the resamples must choose a term
FEWEST_SAMPLES = 20
CUT = 30.0  # standard deviations at which residuals are cut


@dataclass(frozen=True)
class Formula:
    """A description of a speed error.

    Attributes
    ----------
    target, unit
        Which speed is wrong.
    terms
        Coefficient and name of each term.
    share
        Of the residual's energy in that channel it explains, by leaving out one fitted recording after another.
    """

    target: str
    unit: str
    terms: tuple[tuple[float, str], ...]
    share: float

    def __str__(self) -> str:
        words = " ".join(
            f"{'-' if c < 0 else '+'} {abs(c):.3g}{'' if name == '1' else ' ' + name}"
            for c, name in self.terms
        )
        return f"{self.target} is off by {words.removeprefix('+ ')} [{self.unit}]"


@dataclass(frozen=True)
class _Signal:
    """One target in one recording: residuals, and each term as the replay would have let it through."""

    residual: Array
    terms: Array

    @cached_property
    def normal(self) -> Array:
        """Products of the terms with each other, shape (terms, terms)."""
        return self.terms.T @ self.terms

    @cached_property
    def pull(self) -> Array:
        """Products of the terms with the residual, shape (terms,)."""
        return self.terms.T @ self.residual

    @cached_property
    def energy(self) -> float:
        """Sum of the residual's squares."""
        return float(np.sum(self.residual**2))


TARGETS = (
    ("the left wheel's speed", "rad/s"), ("the right wheel's speed", "rad/s"),
    ("the speed ahead", "m/s"), ("the speed to the left", "m/s"), ("the turning rate", "rad/s"),
)  # fmt: skip


def describe(
    fitted: Sequence[RecordingResiduals], physics: npt.NDArray[Any], seed: int = 0
) -> tuple[Formula, ...]:
    """Return formulas that describe what a model leaves, the most telling first.

    Chosen by leaving out fitted recordings alone: those set aside are for the judge.

    Parameters
    ----------
    fitted
        Recordings to find them on.
    physics
        Record of the model, shape (1,).
    seed
        Random seed of the resamples.
    """
    found = []
    tables = [_signals(run, physics) for run in fitted]
    for number, (target, unit) in enumerate(TARGETS):
        signals = _enough([table[number] for table in tables if len(table[number].residual)])
        formula = _sparse(target, unit, signals, seed) if signals else None
        if formula is not None:
            found.append((formula.share * sum(s.energy for s in signals), formula))
    return tuple(formula for _, formula in sorted(found, key=lambda pair: -pair[0]))


def _enough(signals: list[_Signal]) -> list[_Signal]:
    """Return signals that can be left out in turn: few recordings are cut into parts in time."""
    if len(signals) >= FEWEST:
        return signals
    parts = [(np.array_split(s.residual, FEWEST), np.array_split(s.terms, FEWEST)) for s in signals]
    return [_Signal(*pair) for residuals, terms in parts for pair in zip(residuals, terms, strict=True)]


def _sparse(target: str, unit: str, signals: list[_Signal], seed: int) -> Formula | None:
    once = np.ones(len(signals), int)
    chosen = _chosen(signals, once)
    if not chosen:
        return None
    rng = np.random.default_rng((seed, len(signals)))
    votes = np.zeros(len(NAMES))
    for _ in range(RESAMPLES):
        counts = np.bincount(rng.integers(0, len(signals), len(signals)), minlength=len(signals))
        votes[_chosen(signals, counts)] += 1.0 / RESAMPLES
    kept = [k for k in chosen if votes[k] >= STABLE]
    if not kept:
        return None
    share = 1.0 - _left_out(signals, kept, once) / max(sum(s.energy for s in signals), 1e-12)
    if share < LEAST_SHARE:
        return None
    coefficients = _fitted(signals, kept)
    return Formula(
        target, unit, tuple((float(c), NAMES[k]) for c, k in zip(coefficients, kept, strict=True)), share
    )


def _chosen(signals: list[_Signal], counts: npt.NDArray[np.int_]) -> list[int]:
    """Return the terms that left-out recordings ask for, the most telling first; each counts so many times."""
    chosen: list[int] = []
    base = sum(n * s.energy for n, s in zip(counts, signals, strict=True))
    now = base
    while len(chosen) < MOST_TERMS:
        scores = {k: _left_out(signals, [*chosen, k], counts) for k in range(len(NAMES)) if k not in chosen}
        best = min(scores, key=lambda k: scores[k])
        if now - scores[best] < LEAST_GAIN * base:
            break
        chosen.append(best)
        now = scores[best]
    return chosen


def _left_out(signals: list[_Signal], chosen: list[int], counts: npt.NDArray[np.int_]) -> float:
    """Return the energy left in each recording by terms fitted to the others; all copies of one are left out."""
    at = np.ix_(chosen, chosen)
    drawn = [(int(n), s) for n, s in zip(counts, signals, strict=True) if n]
    normal = sum(n * s.normal[at] for n, s in drawn)
    pull = sum(n * s.pull[chosen] for n, s in drawn)
    ridge = 1e-6 * np.eye(len(chosen)) * (np.trace(normal) + 1e-12)
    left = 0.0
    for n, s in drawn:
        c = np.linalg.solve(normal - n * s.normal[at] + ridge, pull - n * s.pull[chosen])
        left += n * (s.energy - 2.0 * float(c @ s.pull[chosen]) + float(c @ s.normal[at] @ c))
    return left


def _fitted(signals: list[_Signal], chosen: list[int]) -> Array:
    at = np.ix_(chosen, chosen)
    normal, pull = sum(s.normal[at] for s in signals), sum(s.pull[chosen] for s in signals)
    return np.linalg.solve(normal + 1e-9 * np.eye(len(chosen)) * (np.trace(normal) + 1e-12), pull)


def _signals(run: RecordingResiduals, physics: npt.NDArray[Any]) -> list[_Signal]:
    """Return a recording's residuals by target, with the terms filtered alike."""
    replayer = run.replayer
    rows, row_errors, poses, _ = replayer.play(physics)
    terms = state_terms(rows, replayer.t, run.recording.commands)
    sd, walk, memory = replayer.inputs.sd, replayer.inputs.walk, replayer.inputs.memory
    out = [_signal(replayer.t, terms, replayer.t, row_errors[:, k] * sd[0], sd[0], memory) for k in (0, 1)]
    pose_t, raw = replayer.inputs.pose_t, replayer.inputs.pose - poses
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    gap = float(np.median(np.diff(pose_t))) if len(pose_t) > 2 else 1.0
    place, turn = (float(sd[k] * np.sqrt(gap) / max(walk[k - 3], 1e-9)) for k in (3, 4))
    ahead = raw[:, 0] * cos + raw[:, 1] * sin if len(pose_t) else np.zeros(0)
    aside = raw[:, 1] * cos - raw[:, 0] * sin if len(pose_t) else np.zeros(0)
    out.append(_signal(replayer.t, terms, pose_t, ahead, sd[3], place))
    out.append(_signal(replayer.t, terms, pose_t, aside, sd[3], place))
    out.append(_signal(replayer.t, terms, pose_t, raw[:, 2] if len(pose_t) else np.zeros(0), sd[4], turn))
    return out


def _signal(t: Array, terms: Array, at: Array, residual: Array, sd: float, memory: float) -> _Signal:
    """Return residuals, and terms added up with the replay's memory, on an even grid whatever the rows."""
    from scipy.signal import lfilter  # noqa: PLC0415  a quarter of a second of a command's start

    seen = ~np.isnan(residual)
    if seen.sum() < FEWEST_SAMPLES:
        return _Signal(np.zeros(0), np.zeros((0, len(NAMES))))
    step = float(np.median(np.diff(t)))
    even = np.arange(t[0], t[-1] + step, step)
    resampled = np.stack([np.interp(even, t, column) for column in terms.T], axis=1)
    keep = float(np.exp(-step / memory)) if np.isfinite(memory) else 1.0
    drift = lfilter([step], [1.0, -keep], resampled, axis=0)
    filtered = np.stack([np.interp(at[seen], even, column) for column in drift.T], axis=1) / sd
    return _Signal(np.clip(residual[seen] / sd, -CUT, CUT), filtered)


NAMES = (
    "1", "v", "omega", "v |v|", "omega |omega|", "sign(v)",
    "sin(left angle)", "cos(left angle)", "sin(right angle)", "cos(right angle)",
    "w_left sin(left angle)", "w_left cos(left angle)", "w_right sin(right angle)", "w_right cos(right angle)",
    "w_left sin(2 left angle)", "w_left cos(2 left angle)", "w_right sin(2 right angle)", "w_right cos(2 right angle)",
    "cos(heading)", "sin(heading)", "v x", "v y", "x", "y", "v t", "omega t", "left duty", "right duty",
)  # fmt: skip
"""Terms: v [m/s] ahead, omega [rad/s], w_left and w_right the shafts' speeds [rad/s], angles [rad], x, y [m], t [s]."""


def state_terms(rows: Array, t: Array, commands: Array) -> Array:
    """Return every term at every row, shape (rows, terms)."""
    v, omega = rows[:, AHEAD], rows[:, YAW_RATE]
    left, right = rows[:, LEFT_ANGLE], rows[:, RIGHT_ANGLE]
    w_left, w_right, heading = rows[:, LEFT_SPEED], rows[:, RIGHT_SPEED], rows[:, HEADING]
    columns = [
        np.ones(len(t)), v, omega, v * np.abs(v), omega * np.abs(omega), np.sign(v) * (np.abs(v) > 0.005),
        np.sin(left), np.cos(left), np.sin(right), np.cos(right),
        w_left * np.sin(left), w_left * np.cos(left), w_right * np.sin(right), w_right * np.cos(right),
        w_left * np.sin(2 * left), w_left * np.cos(2 * left), w_right * np.sin(2 * right), w_right * np.cos(2 * right),
        np.cos(heading), np.sin(heading), v * rows[:, X], v * rows[:, Y], rows[:, X], rows[:, Y], v * t, omega * t,
        commands[:, 0], commands[:, 1],
    ]  # fmt: skip
    return np.stack(columns, axis=1)
