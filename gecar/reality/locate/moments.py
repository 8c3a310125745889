"""When something acts that not even large changes of all constants explain: at moments, or in a kind of driving.

What acts now and then (a bump, a command that is lost), or in one kind of driving (gears that bind while the wheels
turn opposite ways), leaves most of a recording as it is, and would count as noise in all of it. The changes of
constants that explain the rest best tell when it acts: for moments in turns, until both agree; of kinds of driving that
one counts without which they explain the rest far better.

Source: Rousseeuw and Van Driessen, Data Mining and Knowledge Discovery 12 (2006) 29 (least trimmed squares by
concentration steps).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import RIPPLE
from gecar.reality.fitting.model import Model
from gecar.reality.locate.shift_test import regime_p
from gecar.reality.noise.excess_energy import BLOCK_S, Blocks
from gecar.reality.optimisation.least_squares import weights
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.residuals.regimes import kinds_of_driving
from gecar.reality.selection.problem import Problem, small_sensitivities
from gecar.reality.selection.thresholds import LARGE, SIGNIFICANCE

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

ROUNDS = 8
QUICK_S = 0.1  # memory of the replays that tell when something acts: what happened shall not last
ACTING = 4.0  # times a typical moment's energy: one of a thousand is as large where there is noise alone
KIND = 0.7  # of the energy may be left without a kind of driving; right kinds left 0.11 to 0.67 in development cases
AS_WELL = 1.1  # times the least energy left: of kinds that tell as well the one that leaves most counts
MOST_LEFT_OUT = 0.5  # of all residuals, with a kind of driving
CLIP = 100.0  # energy of a block in units of the sensors' noise: what is larger is not told apart


class Acting(NamedTuple):
    """The rows of recordings at which something unknown acts.

    Attributes
    ----------
    kind
        In which kind of driving; empty for moments.
    fitted, held
        At which rows of each recording, shape (rows,), and of each that is set aside.
    left
        The share of the energy that changes of constants leave without a kind of driving.
    """

    kind: str
    fitted: list[Mask]
    held: list[Mask]
    left: float = 1.0


@dataclass(frozen=True)
class _Quick:
    """Quick replays of recordings fitted on and of others, and what large changes of all constants do to them.

    Attributes
    ----------
    residuals
        Of these replays; the first ``number`` recordings tell the changes.
    errors, slopes
        The residuals, shape (n,), and their derivatives by large changes, shape (n, changes).
    telling
        Which residuals tell the changes, shape (n,).
    """

    residuals: Residuals
    blocks: Blocks
    number: int
    errors: Array
    slopes: Array
    telling: Mask

    @classmethod
    def of(cls, problem: Problem, model: Model, held: Residuals) -> _Quick:
        # Hundreds of waves of a ripple could be fitted to anything that happens to one recording.
        catalogue = tuple(effect for effect in problem.catalogue if effect != RIPPLE)
        number = len(problem.recordings)
        problem = replace(
            problem.on(problem.residuals.and_of(held).with_memory(QUICK_S)), catalogue=catalogue
        )
        model = problem.estimator.at(model, model.z)
        slopes = LARGE * np.concatenate([*small_sensitivities(problem, model).values()], axis=1)
        residuals = problem.residuals
        errors, telling = residuals.errors(model.physics), residuals.index.recording < number
        return cls(residuals, problem.estimator.blocks, number, errors, slopes, telling)

    def left(self, scale: Array) -> Array:
        """Fit the changes to residuals times a scale, shape (n,), and return what they leave, unscaled, (n,)."""
        columns = self.slopes * scale[:, None]
        gram = columns.T @ columns + np.eye(self.slopes.shape[1])
        out: Array = self.errors - self.slopes @ np.linalg.solve(gram, (self.errors * scale) @ columns)
        return out

    def acting(self, rows: list[Mask], kind: str = "", left: float = 1.0) -> Acting:
        """Return when something acts, given rows of all recordings."""
        return Acting(kind, rows[: self.number], rows[self.number :], left)


def moments(problem: Problem, model: Model, held: Residuals) -> Acting:
    """Return the moments at which something acts that no change of a model's constants explains.

    Parameters
    ----------
    problem, model
        Of recordings that tell the changes.
    held
        Recordings set aside: of these no change is fitted.
    """
    quick = _Quick.of(problem, model, held)
    acting, index = _acting(quick), quick.residuals.index
    rows = [
        _at_rows(run, index.t_s[acting & (index.recording == k)])
        for k, run in enumerate(quick.residuals.recordings)
    ]
    return quick.acting(rows)


def kind_of_driving(problem: Problem, model: Model, held: Residuals) -> Acting | None:
    """Return the kind of driving in which something acts, or None; parameters as for `moments`.

    Without it, changes of a model's constants must leave far less energy of all the rest than of everything.
    """
    quick = _Quick.of(problem, model, held)
    runs = quick.residuals.recordings
    largest = max(float(np.abs(run.recording.commands).max()) for run in runs)
    tables = [kinds_of_driving(run, largest) for run in runs]
    whole = _beside(quick, "", np.zeros(len(quick.errors), bool)).energy
    inside = {name: _without(quick.residuals, [table[name] for table in tables]) for name in tables[0]}
    kinds = [
        _beside(quick, name, mask)
        for name, mask in inside.items()
        if 0.0 < mask[quick.telling].mean() <= MOST_LEFT_OUT
    ]
    least = min((kind.energy for kind in kinds), default=np.inf) / whole
    if least > KIND:
        return None
    as_well = [kind for kind in kinds if kind.energy / whole <= min(AS_WELL * least, KIND)]
    found = min(as_well, key=lambda kind: kind.share)
    if _by_chance(quick, found) > SIGNIFICANCE / len(tables[0]):  # Bonferroni
        return None
    return quick.acting([table[found.name] for table in tables], found.name, found.energy / whole)


class _Kind(NamedTuple):
    """A kind of driving, and what the changes leave that explain all other driving best.

    Attributes
    ----------
    name, inside
        As a note says it, and which residuals would drop out with it, shape (n,).
    share
        Of the residuals that tell the changes, which would drop out.
    blocks, energy
        The energy of each block, shape (blocks,), and the mean over the blocks of all other driving.
    """

    name: str
    inside: Mask
    share: float
    blocks: Array
    energy: float


def _beside(quick: _Quick, name: str, inside: Mask) -> _Kind:
    """Fit the changes to all driving but one kind."""
    blocks, judged = quick.blocks, quick.telling & ~inside
    scale = judged.astype(float)
    for _ in range(ROUNDS // 2):
        left = quick.left(scale)
        _, sd = blocks.energy_by_moment(left, judged)
        scale = _scale(judged, left, sd)
    energy = np.minimum(blocks.sums(left) ** 2 / blocks.samples, CLIP)
    mean = float(energy[blocks.sums(judged.astype(float)) > 0.0].mean())
    return _Kind(name, inside, float(inside[quick.telling].mean()), energy, mean)


def _by_chance(quick: _Quick, kind: _Kind) -> float:
    """Return the p-value of the energy in a kind of driving: how often as much is there where its times are shifted."""
    blocks = quick.blocks
    own = blocks.recording < quick.number
    run, bins = blocks.recording[own], (blocks.t_s[own] / BLOCK_S).astype(np.int64)
    lengths = np.array([bins[run == number].max(initial=0) + 1 for number in range(quick.number)])
    energies, masks = np.zeros((quick.number, lengths.max())), np.zeros((quick.number, lengths.max()), bool)
    np.add.at(energies, (run, bins), kind.blocks[own])
    np.logical_or.at(masks, (run, bins), (blocks.sums(kind.inside.astype(float)) > 0.0)[own])
    return regime_p(energies, masks, lengths, np.random.default_rng(0))


def _scale(judged: Mask, left: Array, sd: Array) -> Array:
    """Return what scales residuals of a standard deviation in the next fit: outliers count less, others not at all."""
    out: Array = judged * np.sqrt(weights(left / sd)) / sd
    return out


def _without(residuals: Residuals, rows: list[Mask]) -> Mask:
    """Return which residuals drop out if some rows of their recordings are left out, shape (n,)."""
    out = []
    for run, part in zip(residuals.recordings, residuals.except_at(rows).recordings, strict=True):
        (_, there), (_, kept) = (each.motion_index(0) for each in (run, part))
        out.append(~kept[there])
    return np.concatenate(out)


def _acting(quick: _Quick) -> Mask:
    """Return which residuals lie in moments at which something acts, shape (n,)."""
    blocks, telling = quick.blocks, quick.telling
    judged, scale = telling, telling.astype(float)
    for _ in range(ROUNDS):
        left = quick.left(scale)
        energy, sd = blocks.energy_by_moment(left, judged)
        acting = energy[blocks.moments] >= ACTING
        before, judged = judged, telling & ~acting
        scale = _scale(judged, left, sd)
        if np.array_equal(judged, before):
            break
    return acting


def _at_rows(run: RecordingResiduals, t_s: Array) -> Mask:
    """Return which rows of a recording lie in the same block's time as one of some times, shape (rows,)."""
    acting = np.unique((t_s / BLOCK_S).astype(np.int64))
    return np.isin((run.replayer.t / BLOCK_S).astype(np.int64), acting)
