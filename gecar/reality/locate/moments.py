"""Moments at which something acts that not even large changes of all of a robot's constants explain.

What acts now and then (a bump, a command that is lost, a limit that few commands reach) leaves most of a recording as
it is, and would count as noise in all of it. The changes of constants that explain the other moments best tell which
moments these are: in turns, until both agree.

Source: Rousseeuw and Van Driessen, Data Mining and Knowledge Discovery 12 (2006) 29 (least trimmed squares by
concentration steps).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.estimator import RIPPLE
from gecar.reality.fitting.model import Model
from gecar.reality.noise.excess_energy import BLOCK_S
from gecar.reality.optimisation.least_squares import weights
from gecar.reality.residuals.of_case import Residuals
from gecar.reality.residuals.of_recording import RecordingResiduals
from gecar.reality.selection.problem import Problem, small_sensitivities
from gecar.reality.selection.thresholds import LARGE

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

ROUNDS = 8
QUICK_S = 0.1  # memory of the replays that tell moments: what happened shall not last
ACTING = 4.0  # times a typical moment's energy: one of a thousand is as large where there is noise alone


def moments(problem: Problem, model: Model, held: Residuals) -> tuple[list[Mask], list[Mask]]:
    """Return when something acts that no change of a model's constants explains.

    Parameters
    ----------
    problem, model
        Of recordings that tell the changes.
    held
        Recordings set aside: of these no change is fitted.

    Returns
    -------
    tuple
        At which rows of each recording, shape (rows,), and of each that is set aside.
    """
    number = len(problem.recordings)
    # Hundreds of waves of a ripple could be fitted to anything that happens to one recording.
    catalogue = tuple(effect for effect in problem.catalogue if effect != RIPPLE)
    problem = replace(problem.on(problem.residuals.and_of(held).with_memory(QUICK_S)), catalogue=catalogue)
    index = problem.residuals.index
    acting = _acting(problem, problem.estimator.at(model, model.z), index.recording < number)
    rows = [
        _at_rows(run, index.t_s[acting & (index.recording == k)])
        for k, run in enumerate(problem.residuals.recordings)
    ]
    return rows[:number], rows[number:]


def _acting(problem: Problem, model: Model, telling: Mask) -> Mask:
    """Return at which residuals something acts, shape (n,); changes are fitted to those that are ``telling``, (n,)."""
    slopes = LARGE * np.concatenate([*small_sensitivities(problem, model).values()], axis=1)
    errors, blocks = problem.residuals.errors(model.physics), problem.estimator.blocks
    judged, scale = telling, telling.astype(float)
    for _ in range(ROUNDS):
        columns = slopes * scale[:, None]
        gram = columns.T @ columns + np.eye(slopes.shape[1])
        left = errors - slopes @ np.linalg.solve(gram, (errors * scale) @ columns)
        energy, sd = blocks.energy_by_moment(left, judged)
        acting = energy[blocks.moments] >= ACTING
        before, judged = judged, telling & ~acting
        scale = judged * np.sqrt(weights(left / sd)) / sd
        if np.array_equal(judged, before):
            break
    return acting


def _at_rows(run: RecordingResiduals, t_s: Array) -> Mask:
    """Return which rows of a recording lie in the same block's time as one of some times, shape (rows,)."""
    acting = np.unique((t_s / BLOCK_S).astype(np.int64))
    return np.isin((run.replayer.t / BLOCK_S).astype(np.int64), acting)
