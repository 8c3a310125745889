"""Model discrepancy: what a simulation is off by even where nothing worth a name is missing.

No robot equals its file: its constants are slightly off, and there is always small physics in no catalogue. Both
are part of the noise here, so that an effect is named only where it stands out of them.

*Small changes.* Every parameter of the catalogue may be off by a small normal number. Integrated
out, these changes are correlated noise of covariance 1 + G G', where the columns of G are their sensitivities times its
standard deviation; residuals are multiplied by its inverse root. An effect can then gain no more than what its size
costs as a small change, and an imitation gains less than the small changes it imitates.

*Physics in no list.* What even large changes of all parameters together leave is as good as the model gets. By it the
variance of each channel is scaled: the Birge ratio, over half-second spans, so that what lasts counts as lasting.

Sources: Kennedy and O'Hagan, J. R. Statistical Society B 63 (2001) 425 (discrepancy); George and McCulloch, J. American
Statistical Association 88 (1993) 881 (small against free coefficients); Birge, Physical Review 40 (1932) 207; Golub and
Van Loan, Matrix Computations (4th ed.), ch. 2.4 (singular values), 6.1 (ridge), 6.3 (constraints).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from gecar.reality.noise.excess_energy import Blocks
from gecar.reality.optimisation.least_squares import weights
from gecar.reality.replay.channels import CHANNELS

Array = npt.NDArray[np.float64]
Single = npt.NDArray[np.float32]

ROUNDS = 3  # of weights and ratios, each from what the others leave
CLIP = 30.0  # standard deviations
FEW = 6  # rows, up to which a product for each takes less time than one for all


class _Shrinking(NamedTuple):
    """Vectors, shape (k, n), along which whitening shrinks weighted residuals, and by what share, shape (k,).

    In single precision, which is twice as fast: a good part of the time of all fits is spent here.
    """

    basis: Single
    by: Single

    @classmethod
    def of(cls, basis: Array, spread: Array) -> _Shrinking:
        by = 1.0 - 1.0 / np.sqrt(1.0 + spread**2)
        return cls(np.ascontiguousarray(basis.T, np.float32), by.astype(np.float32))

    def subtracted(self, scaled: Array, root_weight: Array) -> Array:
        """Return what is to be subtracted from scaled residuals, shape (n,) or (m, n)."""
        weighted = (scaled * root_weight).astype(np.float32)
        found: Array = ((weighted @ self.basis.T) * self.by) @ self.basis / root_weight
        return found


@dataclass(frozen=True)
class Discrepancy:
    """A model's discrepancy as noise: whitens residuals.

    Attributes
    ----------
    scale
        One over the root of each residual's variance, shape (n,).
    root_weight
        Root of each residual's weight, shape (n,): what no small change explains shall not bend them.
    basis, spread, back
        Singular vectors and values of the scaled, weighted sensitivities, shapes (n, k), (k,) and (k, changes).
    ratios
        Variance of each channel over its sensors' noise, shape (channels,).
    small
        Standard deviations of small changes, in the catalogue's sizes, shape (changes,).
    uncertain
        Which of the parameters' small changes residuals show, shape (parameters,); the changes after those are of
        instruments and ripples.
    parameters
        How many of the changes, the first, are of parameters.
    """

    scale: Array
    root_weight: Array
    basis: Array
    spread: Array
    back: Array
    ratios: Array
    small: Array
    uncertain: npt.NDArray[np.bool_]
    parameters: int

    def whitened(self, errors: Array) -> Array:
        """Return residuals of unit variance, shape (n,) or (m, n), from those in units of the sensors' noise."""
        return self._whitened(errors, self._shrinking)

    def whitened_beside_parameters(self, errors: Array) -> Array:
        """Return the same where the parameters' small changes are known, and those of instruments and ripples not."""
        return self._whitened(errors, self._shrinking_unnamed)

    def _whitened(self, errors: Array, shrinking: _Shrinking) -> Array:
        scaled: Array = errors * self.scale
        rows = scaled.reshape(-1, scaled.shape[-1])
        for part in rows if len(rows) <= FEW else [rows]:
            np.subtract(part, shrinking.subtracted(part, self.root_weight), out=part)
        return scaled

    @cached_property
    def _shrinking(self) -> _Shrinking:
        return _Shrinking.of(self.basis, self.spread)

    @cached_property
    def _shrinking_unnamed(self) -> _Shrinking:
        columns = self.spread[:, None] * self.back[:, self.parameters :]
        spread, back = _decomposed(columns.T @ columns)
        return _Shrinking.of(self.basis @ (columns @ (back / spread)), spread)

    def small_changes(self, errors: Array, low: Array, high: Array) -> Array:
        """Return the parameters' most likely small changes within bounds, in the catalogue's sizes.

        Shape (parameters,). Those of instruments and ripples, which have no bounds, are eliminated: that leaves a
        quarter of the unknowns.
        """
        if not self.parameters:
            return np.zeros(0)
        inside = (errors * self.scale * self.root_weight) @ self.basis
        pull = (self.spread * inside) @ self.back
        root, beside = self._beside_unnamed
        asked = solve_triangular(root, pull[: self.parameters] - beside @ pull[self.parameters :], trans="T")
        sd = self.small[: self.parameters]
        found: Array = sd * lsq_linear(root, -asked, (low / sd, high / sd), "bvls").x
        return found

    @cached_property
    def _beside_unnamed(self) -> tuple[Array, Array]:
        """The parameters' information with all others eliminated, as a Cholesky factor, and what eliminates these.

        Shapes (parameters, parameters) and (parameters, others). By the Schur complement of the others.
        """
        rows = self.spread[:, None] * self.back
        information = rows.T @ rows + np.eye(len(self.small))
        named, unnamed = slice(None, self.parameters), slice(self.parameters, None)
        between = information[named, unnamed]
        beside = np.linalg.solve(information[unnamed, unnamed], between.T).T
        return cholesky(information[named, named] - beside @ between.T), np.asarray(beside, float)


def discrepancy(
    slopes: Array,
    errors: Array,
    blocks: Blocks,
    channel: npt.NDArray[np.int32],
    small: Array,
    large: Array,
    parameters: int,
) -> Discrepancy:
    """Return the discrepancy of a model.

    Parameters
    ----------
    slopes
        Derivatives of its residuals by every small change, in the catalogue's sizes, shape (n, changes).
    errors
        Its residuals, in units of the sensors' noise, shape (n,).
    blocks
        How they are grouped.
    channel
        Of each, shape (n,).
    small, large
        Standard deviations of small changes, and of those whose remainder is physics in no list, shape (changes,).
    parameters
        How many of the changes, the first, are of parameters.
    """
    ratios, weight = np.ones(len(CHANNELS)), np.ones(len(errors))
    wide, columns = slopes * large, np.empty_like(slopes)
    for _ in range(ROUNDS):
        scale = 1.0 / np.sqrt(ratios[channel])
        np.multiply(wide, (scale * weight)[:, None], out=columns)
        gram = columns.T @ columns + np.eye(len(large))
        explained = columns @ np.linalg.solve(gram, (errors * scale * weight) @ columns)
        left = errors * scale - explained / weight
        weight = np.sqrt(weights(left))
        ratios = np.maximum(blocks.variances(np.clip(left, -CLIP, CLIP)) * ratios, 1.0)
    scale = 1.0 / np.sqrt(ratios[channel])
    columns = slopes * small * (scale * weight)[:, None]
    spread, back = _decomposed(columns.T @ columns)
    uncertain = np.any(slopes[:, :parameters], axis=0)
    basis = columns @ (back / spread)
    return Discrepancy(scale, weight, basis, spread, back.T, ratios, small, uncertain, parameters)


def _decomposed(gram: Array) -> tuple[Array, Array]:
    """Return a matrix's singular values, shape (k,), and right singular vectors, (columns, k), from its Gram matrix."""
    squares, back = np.linalg.eigh(gram)
    felt = squares > 1e-6 * max(float(squares.max(initial=0.0)), 1.0)
    return np.sqrt(squares[felt]), back[:, felt]
