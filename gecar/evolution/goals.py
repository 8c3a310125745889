"""Several goals at once: NSGA-II, with pymoo's sorting, and MAP-Elites, with pyribs' archive.

The goals are a problem's cases (`gecar.evolution.problem.Problem.cases`), lower is better. Both libraries are optional:
``pip install 'gecar[goals]'``.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.selection import Population, tournament
from gecar.random_streams import Streams, generators

Floats = npt.NDArray[np.float64]
Int32s = npt.NDArray[np.int32]
Ints = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Nsga2:
    """Selection and replacement of NSGA-II (Deb, Pratap, Agarwal, Meyarivan, IEEE T-EC 6(2), 2002).

    Attributes
    ----------
    size
        Individuals in a tournament; 2 in the source.
    """

    size: int = 2
    needs_cases = True

    def __post_init__(self) -> None:
        _library("pymoo")

    def select(self, population: Population, streams: Streams) -> Int32s:
        """Return the winners of tournaments by front and crowding (streams,)."""
        places = np.empty(len(population.cases))
        places[crowded_order(population)] = np.arange(len(places))
        return tournament(places, self.size, streams)

    def replace(self, population: Population, n: int) -> Int32s:
        """Return the first n by front and crowding (n,)."""
        return np.sort(crowded_order(population)[:n]).astype(np.int32)


def crowded_order(population: Population) -> Ints:
    """Return individuals from the best to the worst: by front, in a front the least crowded first (population,).

    Individuals whose goals another one reaches exactly follow behind all fronts: in GE many programs do the same, and a
    crowd of copies would drive the others out (Fortin and Parizeau, GECCO 2013). Behind them are those that fail, by
    merit (constrained domination, section VI of the source).
    """
    cases, merits = population.cases, population.merits
    failed = np.array([not np.isfinite(row).all() for row in cases], bool)
    _, first = np.unique(cases, axis=0, return_index=True)
    different = np.sort(first[~failed[first]])
    order = []
    for rows in fronts(cases[different]):
        front = different[rows]
        order.append(front[np.argsort(-crowding(cases[front]), kind="stable")])
    last = np.setdiff1d(np.arange(len(merits)), different)
    return np.concatenate([*order, last[np.lexsort((merits[last], failed[last]))]])


def fronts(goals: Floats) -> list[Ints]:
    """Return the non-dominated fronts, the best first: rows of each.

    Parameters
    ----------
    goals
        Lower is better (n, goals).

    Raises
    ------
    InputError
        If pymoo is not installed.
    """
    if len(goals) == 0:
        return []
    sorting = _library("pymoo", "util.nds.non_dominated_sorting").NonDominatedSorting()
    return [np.asarray(front, np.intp) for front in sorting.do(goals)]


def crowding(goals: Floats) -> Floats:
    """Return the crowding distance of each member of a front, inf at its ends (n,)."""
    metrics = _library("pymoo", "operators.survival.rank_and_crowding.metrics")
    return np.asarray(metrics.get_crowding_function("cd").do(goals), float)


@dataclass(frozen=True)
class MapElites:
    """Selection and replacement of MAP-Elites (Mouret and Clune, arXiv:1504.04909, 2015).

    The first case is the quality. The others span a grid; the best of each cell are kept, and become parents with equal
    probability. Places of the population without a cell are kept by the best others, which move in where a cell's best
    turns out to be worse than it seemed.

    Attributes
    ----------
    ranges
        Of each case but the first; what is outside counts to the outermost cell.
    cells
        Number of cells at most; as many along each case.
    """

    ranges: tuple[tuple[float, float], ...]
    cells: int
    needs_cases = True

    def __post_init__(self) -> None:
        _library("ribs")
        if not self.ranges or self.along < 2:
            found = f"{len(self.ranges)} ranges and {self.cells} cells"
            raise expected(
                "map_elites", found, "a range for each case but the first, and two cells along each"
            )

    @property
    def along(self) -> int:
        """Number of cells along each range."""
        return int((self.cells + 0.5) ** (1.0 / len(self.ranges)))

    def select(self, population: Population, streams: Streams) -> Int32s:
        """Return parents drawn from the best of all cells (streams,); from all while no cell is filled."""
        best = self.best(population.cases)
        pool = best if len(best) else np.arange(len(population.merits))
        return np.array([pool[rng.integers(len(pool))] for rng in generators(streams)], np.int32)

    def replace(self, population: Population, n: int) -> Int32s:
        """Return the best of all cells, and of the others the best by merit (n,)."""
        best = self.best(population.cases)
        others = np.setdiff1d(np.argsort(population.merits, kind="stable"), best, assume_unique=True)
        return np.sort(np.concatenate([best, others])[:n]).astype(np.int32)

    def best(self, cases: Floats) -> Ints:
        """Return the place of the best in each cell that is filled (cells filled,).

        Parameters
        ----------
        cases
            Lower is better, inf where an individual fails (population, cases).
        """
        whole = np.flatnonzero(np.isfinite(cases).all(axis=1))
        archive = _library("ribs", "archives").GridArchive(
            solution_dim=1, dims=[self.along] * len(self.ranges), ranges=self.ranges
        )
        if len(whole):
            archive.add(whole[:, None], -cases[whole, 0], cases[whole, 1:])
        return np.sort(archive.data("solution")[:, 0].astype(np.intp))


def _library(name: str, module: str = "") -> Any:
    """Import a module of an optional library."""
    try:
        return import_module(f"{name}.{module}" if module else name)
    except ImportError:
        raise expected(f"library {name}", "none", "it installed: pip install 'gecar[goals]'") from None
