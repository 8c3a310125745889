"""Crossover: genomes side by side, 0 with 1, 2 with 3 and so on, exchange codons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.evolution.lineage import CROSSOVER
from gecar.language.mapping import Mapper
from gecar.random_streams import Streams, below, uniform

Bools = npt.NDArray[np.bool_]
Genomes = npt.NDArray[np.integer[Any]]
"""Codons, of the mapper's `codon_type` (genomes, codons)."""
Int32s = npt.NDArray[np.int32]
Int64s = npt.NDArray[np.int64]


def used_codons(genomes: Genomes, mapper: Mapper) -> Int32s:
    """Return how many codons of each genome its derivation reads (genomes,)."""
    return np.minimum(mapper.map(genomes).used, lengths(genomes, mapper))


def lengths(genomes: Genomes, mapper: Mapper) -> Int32s:
    """Return how many codons each genome has (genomes,)."""
    if not mapper.options.variable_length:
        return np.full(len(genomes), genomes.shape[1], np.int32)
    return _lengths(genomes)


@compiled
def _lengths(genomes: Genomes) -> Int32s:
    found = np.full(genomes.shape[0], genomes.shape[1], np.int32)
    for i in range(genomes.shape[0]):
        for k in range(genomes.shape[1]):
            if genomes[i, k] < 0:
                found[i] = k
                break
    return found


@dataclass(frozen=True)
class OnePoint:
    """Genomes exchange what stands behind one point, the same in both.

    Attributes
    ----------
    rate
        Share of pairs that do.
    within_used
        Whether the point lies within the codons that both use, or anywhere.
    """

    rate: float
    within_used: bool = False
    change = CROSSOVER

    @property
    def linear(self) -> bool:
        """Whether codons must be read from the first on."""
        return self.within_used

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        reach = lengths(genomes, mapper)
        if self.within_used:
            reach = used_codons(genomes, mapper)
        _swap_tails(genomes, reach, self.rate, streams)
        return genomes


@compiled
def _swap_tails(genomes: Genomes, reach: Int32s, rate: float, streams: Streams) -> None:
    for i in range(0, genomes.shape[0] - 1, 2):
        shared = min(reach[i], reach[i + 1])
        if uniform(streams[i]) < rate and shared > 1:
            for k in range(1 + below(streams[i], shared - 1), genomes.shape[1]):
                genomes[i, k], genomes[i + 1, k] = genomes[i + 1, k], genomes[i, k]


@dataclass(frozen=True)
class VariableOnePoint:
    """Genomes exchange what stands behind a point of its own in either, within what it uses (PonyGE2's default).

    What grows beyond the genome's room is cut. What is missing at its end stays as it was; genomes of variable length
    get shorter.

    Attributes
    ----------
    rate
        Share of pairs that do.
    """

    rate: float
    change = CROSSOVER
    linear = True

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        children = genomes.copy()
        reach = used_codons(genomes, mapper)
        _swap_any_tails(genomes, children, reach, self.rate, mapper.options.variable_length, streams)
        return children


@compiled
def _swap_any_tails(
    genomes: Genomes, children: Genomes, reach: Int32s, rate: float, variable: bool, streams: Streams
) -> None:
    codons = genomes.shape[1]
    for i in range(0, genomes.shape[0] - 1, 2):
        if uniform(streams[i]) < rate and reach[i] > 0 and reach[i + 1] > 0:
            a, b = 1 + below(streams[i], reach[i]), 1 + below(streams[i], reach[i + 1])
            end_a, end_b = min(codons, a + codons - b), min(codons, b + codons - a)
            _splice(children[i], genomes[i], a, codons, genomes[i + 1], b, end_b, variable)
            _splice(children[i + 1], genomes[i + 1], b, codons, genomes[i], a, end_a, variable)


@dataclass(frozen=True)
class Subtree:
    """Genomes exchange the codons of two subtrees with the same nonterminal (Harper and Blair 2005, LHS crossover).

    Attributes
    ----------
    rate
        Share of pairs that do, where both are valid and the children fit into their genomes.
    """

    rate: float
    change = CROSSOVER
    linear = True

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        mapped = mapper.map(genomes)
        children = genomes.copy()
        whole = mapped.valid & (mapped.used <= lengths(genomes, mapper))
        _swap_subtrees(
            genomes,
            children,
            whole,
            mapped.offsets,
            mapped.symbols,
            mapped.subtree_ends,
            self.rate,
            mapper.options.variable_length,
            streams,
        )
        return children


@compiled
def _swap_subtrees(
    genomes: Genomes,
    children: Genomes,
    whole: Bools,
    offsets: Int64s,
    symbols: Int32s,
    ends: Int32s,
    rate: float,
    variable: bool,
    streams: Streams,
) -> None:
    codons = genomes.shape[1]
    for i in range(0, genomes.shape[0] - 1, 2):
        if uniform(streams[i]) >= rate or not whole[i] or not whole[i + 1] or offsets[i] == offsets[i + 1]:
            continue
        first, second = offsets[i], offsets[i + 1]
        a = first + below(streams[i], second - first)
        b = _draw_alike(symbols, second, offsets[i + 2], symbols[a], streams, i)
        if b < 0:
            continue
        begin_a, end_a, begin_b, end_b = a - first, ends[a], b - second, ends[b]
        growth = (end_b - begin_b) - (end_a - begin_a)
        if second - first + growth <= codons and offsets[i + 2] - second - growth <= codons:
            _splice(children[i], genomes[i], begin_a, end_a, genomes[i + 1], begin_b, end_b, variable)
            _splice(children[i + 1], genomes[i + 1], begin_b, end_b, genomes[i], begin_a, end_a, variable)


@compiled
def _draw_alike(symbols: Int32s, first: int, last: int, symbol: int, streams: Streams, i: int) -> int:
    """Draw one of the places from first up to last that hold the symbol; -1 if none does."""
    alike = 0
    for k in range(first, last):
        alike += symbols[k] == symbol
    if alike == 0:
        return -1
    skip = below(streams[i], alike)
    for k in range(first, last):
        if symbols[k] == symbol:
            if skip == 0:
                return k
            skip -= 1
    return -1


@compiled
def _splice(
    child: Genomes, own: Genomes, begin: int, end: int, donor: Genomes, first: int, last: int, variable: bool
) -> None:
    """Write own codons with ``begin`` up to ``end`` replaced by the donor's ``first`` up to ``last``.

    The codons behind move along; what is missing at the genome's end stays as it was, or ends it if it may vary.
    """
    at = begin
    for k in range(first, last):
        child[at] = donor[k]
        at += 1
    for k in range(end, own.size):
        if at == own.size:
            break
        child[at] = own[k]
        at += 1
    if variable:
        for k in range(at, own.size):
            child[k] = -1
