"""The first genomes: random codons, or codons that spell out a derivation tree made by some plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.crossover import Genomes
from gecar.language.mapping import Mapper
from gecar.random_streams import Streams

Rng = np.random.Generator


class Initialisation(Protocol):
    """Makes first genomes."""

    def __call__(self, mapper: Mapper, streams: Streams) -> Genomes:
        """Return new genomes, one from each stream (streams, codons)."""


@dataclass(frozen=True)
class Uniform:
    """Random codons.

    Attributes
    ----------
    codons
        Length of a genome; where genomes differ in length, the greatest.
    shortest
        Least length, where genomes differ in length; None: all begin with the greatest.
    """

    codons: int
    shortest: int | None = None

    def __call__(self, mapper: Mapper, streams: Streams) -> Genomes:
        """Return new genomes (streams, codons)."""
        return _random(mapper, streams, self.codons, self._length)

    def _length(self, genome: Genomes, mapper: Mapper, rng: Rng) -> int:  # noqa: ARG002
        return self.codons if self.shortest is None else int(rng.integers(self.shortest, self.codons + 1))


@dataclass(frozen=True)
class Sensible:
    """Derivation trees grown or full, of depths from the shallowest possible up (Ryan and Azad 2003).

    Attributes
    ----------
    codons
        Length of a genome; where genomes differ in length, the greatest.
    depth
        Greatest depth.
    tail
        Where genomes differ in length: random codons behind those a tree needs, as a share of these; None: to the end.
    """

    codons: int
    depth: int
    tail: float | None = None

    def __call__(self, mapper: Mapper, streams: Streams) -> Genomes:
        """Return new genomes (streams, codons)."""
        return _spelled(mapper, streams, self.codons, self.tail, self._choices)

    def _choices(self, plan: Plan) -> list[int]:
        return _sensible(plan, self.depth, self.codons)


@dataclass(frozen=True)
class Ptc2:
    """Derivation trees of drawn sizes, expanded at random places (Luke 2000, Nicolau 2017).

    Attributes
    ----------
    codons
        Length of a genome; where genomes differ in length, the greatest.
    expansions
        Most codons a tree aims at.
    tail
        As in `Sensible`.
    """

    codons: int
    expansions: int
    tail: float | None = None

    def __call__(self, mapper: Mapper, streams: Streams) -> Genomes:
        """Return new genomes (streams, codons)."""
        return _spelled(mapper, streams, self.codons, self.tail, self._choices)

    def _choices(self, plan: Plan) -> list[int]:
        return _ptc2(plan, self.expansions)


@dataclass(frozen=True)
class Seeded:
    """Given genomes first, one each, in every new population; the others are made as usual.

    Attributes
    ----------
    others
        Makes the others.
    given
        Genomes (n, codons), such as `gecar.language.inversion.genome_of` returns.
    """

    others: Initialisation
    given: Genomes

    def __call__(self, mapper: Mapper, streams: Streams) -> Genomes:
        """Return new genomes (streams, codons)."""
        genomes = self.others(mapper, streams)
        n = min(len(genomes), len(self.given))
        genomes[:n] = self.given[:n]
        return genomes


def _spelled(
    mapper: Mapper,
    streams: Streams,
    codons: int,
    tail: float | None,
    choices_of: Callable[[Plan], list[int]],
) -> Genomes:
    """Return genomes that begin with the codons of a tree."""
    if not mapper.linear:
        raise expected("initialisation", "trees for a mapper of genes", "Uniform, or one of your own")

    plan = Plan(mapper)

    def write(genome: Genomes, mapper: Mapper, rng: Rng) -> int:  # noqa: ARG001
        # The ramp over sizes goes by the stream, not the place, so that an individual needs no other.
        plan.rng = rng
        choices = choices_of(plan)[:codons]
        genome[: len(choices)] = choices
        return codons if tail is None else min(codons, len(choices) + round(tail * len(choices)))

    return _random(mapper, streams, codons, write)


def _random(
    mapper: Mapper, streams: Streams, codons: int, write: Callable[[Genomes, Mapper, Rng], int]
) -> Genomes:
    """Return random genomes, after something was written into each that says its length."""
    genomes: Genomes = np.empty((len(streams), codons), mapper.options.codon_type)
    for genome, seed in zip(genomes, streams["stream"].tolist(), strict=True):
        rng = np.random.default_rng(seed)
        genome[:] = rng.integers(0, mapper.options.codon_size, codons, genomes.dtype)
        length = write(genome, mapper, rng)
        if mapper.options.variable_length:
            genome[length:] = -1
    return genomes


class Plan:
    """Derivation trees in the making.

    Parameters
    ----------
    mapper
        The grammar, and which nonterminals read a codon.

    Attributes
    ----------
    rng
        What chooses.
    """

    def __init__(self, mapper: Mapper) -> None:
        self.grammar, self.reads = mapper.grammar, mapper.tables.reads
        self.rng = np.random.default_rng(0)
        self.size = mapper.options.codon_size
        self._shortest: dict[int, int] = {}
        self._fitting: dict[tuple[int, int, bool], npt.NDArray[np.intp]] = {}

    def options(self, symbol: int) -> npt.NDArray[np.intp]:
        """Productions of a nonterminal that a codon can choose."""
        first = self.grammar.first_production
        return np.arange(first[symbol], min(first[symbol + 1], first[symbol] + self.size))

    def shallowest(self, symbol: int) -> npt.NDArray[np.intp]:
        """Productions that end soonest."""
        options = self.options(symbol)
        depth = self.grammar.production_depth[options]
        return options[depth == depth.min()]

    def fitting(self, symbol: int, left: int, full: bool) -> npt.NDArray[np.intp]:
        """Productions that end within the depth left, or soonest; where it shall be full, those that grow, if any."""
        key = symbol, left, full
        if key not in self._fitting:
            options = self.options(symbol)
            fitting = options[self.grammar.production_depth[options] <= left]
            growing = fitting[self.grammar.production_recursive[fitting]] if full else fitting[:0]
            self._fitting[key] = next(p for p in (growing, fitting, self.shallowest(symbol)) if len(p))
        return self._fitting[key]

    def shortest(self, symbol: int) -> int:
        """Return how many codons a shallowest tree of a nonterminal reads."""
        if symbol not in self._shortest:
            below = self.children(int(self.shallowest(symbol)[0]))
            self._shortest[symbol] = int(self.reads[symbol]) + sum(map(self.shortest, below))
        return self._shortest[symbol]

    def pick(self, productions: npt.NDArray[np.intp]) -> int:
        """Choose a production."""
        return int(productions[self.rng.integers(len(productions))])

    def children(self, production: int) -> tuple[int, ...]:
        """Nonterminals a production puts in its place."""
        return self.grammar.productions[production].nonterminals

    def codon(self, symbol: int, production: int) -> list[int]:
        """Return a codon that chooses the production, any that does; nothing where there is no choice."""
        if not self.reads[symbol]:
            return []
        n, choice = (
            int(self.grammar.n_choices[symbol]),
            production - int(self.grammar.first_production[symbol]),
        )
        return [choice + n * int(self.rng.integers((self.size - 1 - choice) // n + 1))]


def _sensible(plan: Plan, most_depth: int, codons: int) -> list[int]:
    """Grow a tree, or a full one, to a depth between the shallowest possible and the greatest allowed."""
    shallowest = int(plan.grammar.minimum_depth[0])
    depth = int(plan.rng.integers(shallowest, max(most_depth, shallowest) + 1))
    full = bool(plan.rng.integers(2))
    while True:
        choices = _tree(plan, depth, full, codons)
        if len(choices) <= codons or depth <= shallowest:
            return choices
        depth -= 1  # too large for the genome


def _tree(plan: Plan, depth: int, full: bool, most: int) -> list[int]:
    """Write a tree's codons, leftmost first; give up beyond the most."""
    codons: list[int] = []
    waiting = [(0, depth)]
    while waiting and len(codons) <= most:
        symbol, left = waiting.pop()
        production = plan.pick(plan.fitting(symbol, left, full))
        codons += plan.codon(symbol, production)
        waiting += [(child, left - 1) for child in reversed(plan.children(production))]
    return codons


def _ptc2(plan: Plan, expansions: int) -> list[int]:
    """Expand random open nonterminals until the tree will have the size drawn, then end each the shortest way."""
    target = int(plan.rng.integers(1, expansions + 1))
    chosen: dict[int, int] = {}  # production of each node
    symbols, below, waiting, read = [0], {0: range(0)}, [0], 0
    while waiting:
        node = waiting.pop(int(plan.rng.integers(len(waiting))))
        symbol = symbols[node]
        growing = read + sum(plan.shortest(symbols[w]) for w in (node, *waiting)) < target
        production = plan.pick(_ptc2_options(plan, symbol, [symbols[w] for w in waiting], growing))
        chosen[node] = production
        read += int(plan.reads[symbol])
        children = plan.children(production)
        below[node] = range(len(symbols), len(symbols) + len(children))
        waiting += below[node]
        symbols += children
    return _leftmost(plan, symbols, chosen, below)


def _ptc2_options(plan: Plan, symbol: int, waiting: list[int], growing: bool) -> npt.NDArray[np.intp]:
    """Any production; but only growing ones where nothing else is left that can grow, and none after."""
    if not growing:
        return plan.shallowest(symbol)
    options = plan.options(symbol)
    recursive = options[plan.grammar.production_recursive[options]]
    alone = not plan.grammar.recursive[waiting].any()
    return recursive if alone and len(recursive) else options


def _leftmost(plan: Plan, symbols: list[int], chosen: dict[int, int], below: dict[int, range]) -> list[int]:
    """Write a finished tree's codons in the order the mapper reads them."""
    codons: list[int] = []
    waiting = [0]
    while waiting:
        node = waiting.pop()
        codons += plan.codon(symbols[node], chosen[node])
        waiting += reversed(below[node])
    return codons
