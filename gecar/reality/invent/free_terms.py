"""A model's parameters and the constants of laws as one vector near 0, as `gecar.reality.fitting.parameters` has it."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.reality.fitting.parameters import Parameters
from gecar.reality.invent.sentences import linear
from gecar.world.ports import AT_X, AT_Y, BY_PORT, CONSTANTS, STORE_S, VARIABLES
from gecar.world.terms import POINT, Term

Array = npt.NDArray[np.float64]

INNER_STEP = 0.1  # of an inner constant's size: one coordinate
POINT_STEP_M = 0.05
FARTHEST = 20.0  # coordinates of an inner constant: from a sixth of its size to six times
SHORTEST_S = 0.01  # of a store's time constant: five steps, so that the law does the same at half the step
SHORTEST_OWN_S = 0.0025  # of one that moves by its own law: a ramp is the same at half the step
PROBE = 0.1  # step of finite differences, in coordinates
_STEP = re.compile(r"\bpositive\((?:[^()]|\([^()]*\))*\)")
_TURN = re.compile(r"\b(?:sin|cos)\(\w+ \* angle\)")
_SUM = re.compile(r"store \+ \w+")
_USUAL = {variable.id: variable.scale for variable in VARIABLES}


@dataclass(frozen=True)
class Constant:
    """One constant of a term: which term, its name, its place in the term's row, and what one coordinate is.

    ``ratio`` says whether it runs as its logarithm.
    """

    term: int
    name: str
    slot: int
    value: float
    step: float
    ratio: bool

    def at(self, z: Any) -> Any:
        """Return the constant at coordinates."""
        return self.value * np.exp(self.step * z) if self.ratio else self.value + self.step * z

    def coordinate(self, value: float) -> float:
        """Return the coordinate at which a constant that runs as its logarithm has a value."""
        return math.log(value / self.value) / self.step


@dataclass(frozen=True)
class FreeTerms:
    """Free parameters: those of a model's effects, and constants of terms that the robot gets beside its own.

    Attributes
    ----------
    model
        The effects' parameters.
    start
        Their vector, shape (effects' parameters,).
    terms
        Laws whose constants are free.
    """

    model: Parameters
    start: Array
    terms: tuple[Term, ...]
    constants: tuple[Constant, ...] = field(init=False)

    def __post_init__(self) -> None:
        found = [c for k, term in enumerate(self.terms) for c in _constants(k, term)]
        object.__setattr__(self, "constants", tuple(found))

    @property
    def z(self) -> Array:
        """The vector of the model as it is, and of the laws as they are written."""
        return np.r_[self.start, np.zeros(len(self.constants))]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest vectors."""
        low, high = self.model.bounds
        reach = np.array(
            [FARTHEST if c.name not in linear(self.terms[c.term]) else np.inf for c in self.constants]
        )
        shortest = np.array(
            [
                c.coordinate(_shortest(self.terms[c.term])) if c.slot == STORE_S else -np.inf
                for c in self.constants
            ]
        )
        return np.r_[low, np.maximum(-reach, shortest)], np.r_[high, reach]

    @property
    def probes(self) -> Array:
        """Steps of finite differences."""
        return np.r_[self.model.probes, np.full(len(self.constants), PROBE)]

    def physics(self, z: Array) -> npt.NDArray[Any]:
        """Return the physics records of a vector, shape (size,), or of m of them, (m, size); shape (1,) or (m,)."""
        vectors = np.atleast_2d(z)
        records = self.model.physics(vectors[:, : self.model.size])
        own = len(self.model.robot.term)
        records["n_terms"] = own + len(self.terms)
        for k, term in enumerate(self.terms):
            records["terms"][:, own + k] = term.row
        for c, column in zip(self.constants, vectors[:, self.model.size :].T, strict=True):
            records["terms"][:, own + c.term, c.slot] = c.at(column)
        return records

    def fitted(self, z: Array) -> tuple[Term, ...]:
        """Return the terms with their constants at a vector."""
        values: list[dict[str, float]] = [{} for _ in self.terms]
        for c, at in zip(self.constants, z[self.model.size :], strict=True):
            values[c.term][c.name] = float(c.at(at))
        return tuple(term.with_constants(v) for term, v in zip(self.terms, values, strict=True))


def _shortest(term: Term) -> float:
    """Return the shortest time constant of a term's store [s]."""
    return SHORTEST_OWN_S if term.of_itself else SHORTEST_S


@lru_cache(maxsize=8192)
def usual_size(term: Term) -> float:
    """Return the size of a linear constant whose law gives about a hundredth of what is much at its port."""
    at_one = term.with_constants(dict.fromkeys(linear(term), 1.0))
    shape = abs(float(at_one.value({name: np.array(scale) for name, scale in _USUAL.items()})))
    return 0.01 * BY_PORT[term.port].worth / (shape if shape > 1e-6 else 1.0)


def _constants(k: int, term: Term) -> list[Constant]:
    """Return the constants of a term that a fit may change.

    It may not change where a step stands, because residuals have no derivative by it, nor how often something repeats
    in a turn of the wheel, because that is a whole number; nor how fast a store adds something up, because the law's
    own constant says as much.
    """
    free, of_law = [], linear(term)
    for number, name in enumerate(term.free):
        value = term.constants[name]
        if not re.search(rf"\b{name}\b", _TURN.sub("", _STEP.sub("", term.law))):
            continue
        if name in of_law:
            size = max(abs(value) * INNER_STEP, usual_size(term))
            free.append(Constant(k, name, CONSTANTS + number, value, size, False))
        elif value:
            free.append(Constant(k, name, CONSTANTS + number, value, INNER_STEP, True))
    for name, slot in zip(POINT, (AT_X, AT_Y), strict=True):
        if name in term.constants:
            free.append(Constant(k, name, slot, term.constants[name], POINT_STEP_M, False))
    if term.store and not _SUM.fullmatch(term.store):
        free.append(Constant(k, "store_s", STORE_S, term.store_s, INNER_STEP, True))
    return free
