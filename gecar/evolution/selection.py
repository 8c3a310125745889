"""Selection: which individuals become parents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.evolution.crossover import Genomes
from gecar.evolution.scores import Scores
from gecar.random_streams import Streams, below

Floats = npt.NDArray[np.float64]
Int32s = npt.NDArray[np.int32]


class Population(NamedTuple):
    """What parents are selected from.

    Attributes
    ----------
    genomes
        Codons (population, codons).
    scores
        The problem's (population,); see `gecar.evolution.scores.FIELDS`.
    merits
        What tournaments go by, lower is better (population,).
    cases
        The several scores of each, lower is better (population, cases); no columns where there is one score.
    """

    genomes: Genomes
    scores: Scores
    merits: Floats
    cases: Floats

    def part(self, places: npt.NDArray[Any]) -> Population:
        """Return the individuals at some places."""
        return Population(*(each[places] for each in self))


class Selection(Protocol):
    """Selects parents."""

    def __call__(self, population: Population, streams: Streams) -> Int32s:
        """Return the places of the parents, one from each stream (streams,); neighbours become pairs."""


@dataclass(frozen=True)
class Tournament:
    """Draws individuals with replacement and keeps the best.

    Attributes
    ----------
    size
        Individuals in a tournament.
    """

    size: int

    def __call__(self, population: Population, streams: Streams) -> Int32s:
        """Return the parents (streams,)."""
        return tournament(population.merits, self.size, streams)


@dataclass(frozen=True)
class Lexicase:
    """Goes through the cases in random order, within their median absolute deviation (Spector 2012, La Cava 2016)."""

    needs_cases = True

    def __call__(self, population: Population, streams: Streams) -> Int32s:
        """Return the parents (streams,)."""
        return lexicase(population.cases, deviations(population.cases), streams)


@compiled
def tournament(merit: Floats, size: int, streams: Streams) -> Int32s:
    """Draw individuals with replacement and keep the best; the first drawn where several are equal.

    Parameters
    ----------
    merit
        Lower is better (population,).
    size
        Individuals in a tournament.
    streams
        One for each parent wanted.

    Returns
    -------
    numpy.ndarray
        Indices of the parents (streams,).
    """
    winners = np.empty(streams.size, np.int32)
    for i in range(streams.size):
        winner = below(streams[i], merit.size)
        for _ in range(size - 1):
            other = below(streams[i], merit.size)
            if merit[other] < merit[winner]:
                winner = other
        winners[i] = winner
    return winners


def deviations(cases: Floats) -> Floats:
    """Return each case's median absolute deviation among those that have a value; 0 where none has (cases,)."""
    allowed = np.zeros(cases.shape[1])
    for k, column in enumerate(cases.T):
        known = column[np.isfinite(column)]
        if known.size:
            allowed[k] = np.median(np.abs(known - np.median(known)))
    return allowed


@compiled
def lexicase(cases: Floats, allowed: Floats, streams: Streams) -> Int32s:
    """Go through the cases in random order; keep those as good as the best there, to what is allowed.

    Parameters
    ----------
    cases
        Lower is better (population, cases).
    allowed
        How much worse than the best of those left still stays (cases,).
    streams
        One for each parent wanted.

    Returns
    -------
    numpy.ndarray
        Indices of the parents (streams,); one drawn from those left at the end.
    """
    n, n_cases = cases.shape
    winners = np.empty(streams.size, np.int32)
    pool, order = np.empty(n, np.int32), np.empty(n_cases, np.int32)
    for i in range(streams.size):
        left = n
        for k in range(n):
            pool[k] = k
        for k in range(n_cases):
            order[k] = k
        for k in range(n_cases):
            swap = k + below(streams[i], n_cases - k)
            order[k], order[swap] = order[swap], order[k]
            best = np.inf
            for j in range(left):
                best = min(best, cases[pool[j], order[k]])
            kept = 0
            for j in range(left):
                if cases[pool[j], order[k]] <= best + allowed[order[k]]:
                    pool[kept] = pool[j]
                    kept += 1
            left = kept
            if left == 1:
                break
        winners[i] = pool[below(streams[i], left)]
    return winners
