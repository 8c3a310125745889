"""Bounded robust least squares: Levenberg-Marquardt on whitened residuals, with derivatives by finite differences.

Large residuals count linearly (pseudo-Huber loss), so that a wheel that slips a moment too late does not dominate.

Sources: Levenberg-Marquardt, Nocedal and Wright, Numerical Optimization (2nd ed.), ch. 10; pseudo-Huber by
reweighting, Hartley and Zisserman, Multiple View Geometry (2nd ed.), appendix 6.8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
KNEE = 4.0  # standard deviations beyond which a residual counts linearly
RIDGE = 1e-6  # of the diagonal, where some coordinates do the same
LIGHT = 1e-3  # damping at first
STUCK = 1.0  # damping after which a step that does not help is one across a jump, or none is needed
WORTH_A_JUMP = 0.01  # share of the cost that a step across one gains, or it is not the end of something
HALVINGS = 5  # of a step that goes too far
FLAT = 2.0  # coordinates: a standard deviation so large comes from derivatives that say nothing
TOGETHER = 32  # vectors of residuals, a megabyte or less each


def cost(errors: Array) -> float:
    """Return the robust cost of whitened residuals; half their squares where they are small."""
    return float(np.sum(costs(errors)))


def costs(errors: Array) -> Array:
    """Return each residual's share of the cost."""
    return KNEE**2 * (np.sqrt(1.0 + (errors / KNEE) ** 2) - 1.0)


def weights(errors: Array) -> Array:
    """Return the weights that make squares behave as the robust cost does."""
    return 1.0 / np.sqrt(1.0 + (errors / KNEE) ** 2)


def curvatures(errors: Array) -> Array:
    """Return the second derivatives of each residual's cost."""
    return (1.0 + (errors / KNEE) ** 2) ** -1.5


@dataclass(frozen=True)
class Minimum:
    """Where a minimisation ended.

    Attributes
    ----------
    z
        Coordinates, shape (k,).
    errors
        Whitened residuals there, shape (n,).
    cost
        Robust cost.
    """

    z: Array
    errors: Array
    cost: float


Residual = Callable[[Array], Array]
"""Whitened residuals at a vector, shape (k,) to (n,), or at m of them, shape (m, k) to (m, n)."""


def row_by_row(residual: Residual) -> Residual:
    """Return a function of one vector as one of several, too."""
    return lambda z: residual(z) if z.ndim == 1 else np.array([residual(row) for row in z])


def residuals_of_each(residual: Callable[[Any], Array], vectors: Any) -> Iterator[Array]:
    """Yield the residuals at each of m vectors, shape (n,); only so many are held at a time."""
    for first in range(0, len(vectors), TOGETHER):
        yield from residual(vectors[first : first + TOGETHER])


def cost_of_each(residual: Callable[[Any], Array], vectors: Any) -> Array:
    """Return the robust cost at each of m vectors, shape (m,)."""
    return np.array([cost(errors) for errors in residuals_of_each(residual, vectors)])


def steps_inwards(z: Array, probes: Array, high: Array) -> Array:
    """Return the steps of one-sided differences: forward, or backward where the upper bound is nearer than a step."""
    return np.where(z + probes <= high, probes, -probes)


def jacobian(residual: Residual, z: Array, errors: Array, probes: Array, high: Array) -> Array:
    """Return forward differences, backward where a bound is near, shape (n, k)."""
    steps = steps_inwards(z, probes, high)
    moved = np.tile(z, (len(z), 1))
    np.fill_diagonal(moved, z + steps)
    return np.ascontiguousarray(((residual(moved) - errors) / steps[:, None]).T)


def least_squares(
    residual: Residual,
    start: Array,
    bounds: tuple[Array, Array],
    probes: Array,
    rounds: int = 12,
    close: float = 1e-3,
    past_jumps: bool = False,
) -> Minimum:
    """Minimise the robust cost of a residual function.

    Parameters
    ----------
    residual
        What is minimised.
    start, bounds
        Where to start, and the lowest and highest vectors.
    probes
        Steps of finite differences.
    rounds
        Most Jacobians to take.
    close
        Stop when a round lowers the cost by less than this share of it, and by less than 0.05.
    past_jumps
        Whether to go on by fewer coordinates where a step of all of them ends at a jump.
    """
    low, high = bounds
    z = np.clip(start, low, high)
    errors = residual(z)
    now = cost(errors)
    damping = LIGHT
    for _ in range(rounds):
        slopes = jacobian(residual, z, errors, probes, high)
        w = weights(errors)[:, None]
        normal, gradient = slopes.T @ (w * slopes), slopes.T @ (w[:, 0] * errors)
        before = now
        for _ in range(7):
            candidate = _step(z, normal, gradient, damping, low, high)
            if np.allclose(candidate, z, rtol=0.0, atol=1e-6):
                break
            tried = residual(candidate)
            if cost(tried) < now:
                z, errors, now = candidate, tried, cost(tried)
                damping = max(damping * 0.2, 1e-6)
                break
            damping *= 6.0
        if before - now < max(close * 1e-2 * before, 0.02):
            found, tried = z, errors
            if past_jumps and damping > STUCK:
                found = _past_a_jump(residual, z, normal, gradient, bounds)
                tried = residual(found)
            if cost(tried) > (1.0 - WORTH_A_JUMP) * before:
                break
            z, errors, now, damping = found, tried, cost(tried), LIGHT
    return Minimum(z, errors, now)


def _past_a_jump(
    residual: Residual, z: Array, normal: Array, gradient: Array, bounds: tuple[Array, Array]
) -> Array:
    """Return the best vector that steps of a coordinate alone, or of all the others, lead to.

    Where a threshold makes residuals jump, a step of all coordinates fails, however short, because of one of them.
    """
    alone = np.eye(len(z), dtype=bool)
    tried = np.array([_step(z, normal, gradient, LIGHT, *bounds, held) for held in (*alone, *~alone)])
    best: Array = tried[int(np.argmin(cost_of_each(residual, tried)))]
    return best


def _step(
    z: Array,
    normal: Array,
    gradient: Array,
    damping: float,
    low: Array,
    high: Array,
    held: npt.NDArray[np.bool_] | None = None,
) -> Array:
    """Return the next vector; coordinates that are held, or at an active bound, stay there."""
    free = ~(((z <= low) & (gradient > 0.0)) | ((z >= high) & (gradient < 0.0)))
    if held is not None:
        free &= ~held
    move = np.zeros_like(z)
    if free.any():
        block = normal[np.ix_(free, free)]
        scale = np.maximum(np.diag(block), 1e-9)
        move[free] = -np.linalg.solve(block + damping * np.diag(scale), gradient[free])
    return np.clip(z + move, low, high)


def left_out_costs(
    minimum: Minimum,
    slopes: Array,
    bounds: tuple[Array, Array],
    residual: Residual,
    folds: npt.NDArray[np.integer[Any]],
    least: float = -1.0,
    still: npt.NDArray[np.bool_] | None = None,
) -> Array:
    """Return the robust cost of each fold at coordinates fitted without it, one Newton step from the minimum.

    A step after which the other folds cost more has left the range of its derivatives: it is halved until they do not
    (Dennis and Schnabel, Numerical Methods for Unconstrained Optimization, 1996, ch. 6.3).

    Parameters
    ----------
    minimum
        Of all residuals.
    slopes
        Jacobian there, shape (n, k).
    bounds
        Lowest and highest vectors.
    residual
        What was minimised.
    folds
        Fold of each residual, shape (n,).
    least
        Coordinates of which the other folds hold no more than this share of the information become 0; those of which
        derivatives say nothing, as of a threshold between two levels, stay as they are.
    still
        Which coordinates stay as they are, shape (k,); default: none.

    Returns
    -------
    numpy.ndarray
        Shape (largest fold + 1,); 0 for folds without residuals.
    """
    w, names = weights(minimum.errors), np.unique(folds)
    normal, starts, steps = slopes.T @ (w[:, None] * slopes), [], []
    moves = np.diag(normal) > FLAT**-2
    if still is not None:
        moves &= ~still
    for k in names:
        rows = folds == k
        rest = normal - slopes[rows].T @ (w[rows, None] * slopes[rows])
        pull = slopes[rows].T @ (w[rows] * minimum.errors[rows])
        known = np.flatnonzero(moves & (np.diag(rest) > least * np.diag(normal)))
        ridge = RIDGE * np.diag(np.maximum(np.diag(normal)[known], 1e-9))
        start, step = np.where(moves, 0.0, minimum.z), np.zeros(len(minimum.z))
        start[known] = minimum.z[known]
        step[known] = np.linalg.solve(rest[np.ix_(known, known)] + ridge, pull[known])
        starts.append(start)
        steps.append(step)
    found = _halved(np.array(starts), np.array(steps), minimum, bounds, residual, folds)
    out = np.zeros(int(names.max()) + 1)
    for k, errors in zip(names, found, strict=True):
        out[k] = cost(errors[folds == k])
    return out


def _halved(
    starts: Array,
    steps: Array,
    minimum: Minimum,
    bounds: tuple[Array, Array],
    residual: Residual,
    folds: npt.NDArray[np.integer[Any]],
) -> Array:
    """Return the residuals after each fold's step, halved while the other folds cost more than at the minimum."""
    names, share = np.unique(folds), np.ones(len(starts))
    before = np.array([cost(minimum.errors[folds != k]) for k in names])
    whole = (starts == minimum.z).all(axis=1)  # elsewhere a coordinate became 0, which may cost something
    for tried in range(HALVINGS + 2):
        errors = residual(np.clip(starts + share[:, None] * steps, *bounds))
        after = np.array([cost(e[folds != k]) for k, e in zip(names, errors, strict=True)])
        worse = whole & (after > before + 1.0)
        if not worse.any():
            break
        share[worse] *= 0.5 if tried < HALVINGS else 0.0
    return errors
