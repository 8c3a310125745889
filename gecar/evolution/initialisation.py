"""The first genomes: random codons, or codons that spell out a derivation tree made by some plan."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from gecar.evolution.settings import EvolutionSettings
from gecar.language.mapping import Mapper
from gecar.random_streams import Streams

Bytes = npt.NDArray[np.uint8]
Rng = np.random.Generator


def initialise(settings: EvolutionSettings, mapper: Mapper, streams: Streams) -> Bytes:
    """Return new random genomes, one from each stream (streams, codons)."""
    genomes = np.empty((len(streams), settings.codons), np.uint8)
    write = _PLANS[settings.initialisation]
    for i, seed in enumerate(streams["stream"].tolist()):
        rng = np.random.default_rng(seed)
        genomes[i] = rng.integers(0, 256, settings.codons, np.uint8)
        if write is not None:
            # The ramp over sizes goes by the stream, not the place, so that an individual needs no other.
            choices = write(settings, Plan(mapper, rng))[: settings.codons]
            genomes[i, : len(choices)] = choices
    return genomes


class Plan:
    """One derivation tree in the making.

    Parameters
    ----------
    mapper
        The grammar, and which nonterminals read a codon.
    rng
        What chooses.
    """

    def __init__(self, mapper: Mapper, rng: Rng) -> None:
        self.grammar, self.reads, self.rng = mapper.grammar, mapper.tables.reads, rng
        self._shortest: dict[int, int] = {}

    def options(self, symbol: int) -> npt.NDArray[np.intp]:
        """Productions of a nonterminal that a codon can choose."""
        first = self.grammar.first_production
        return np.arange(first[symbol], min(first[symbol + 1], first[symbol] + 256))

    def shallowest(self, symbol: int) -> npt.NDArray[np.intp]:
        """Productions that end soonest."""
        options = self.options(symbol)
        depth = self.grammar.production_depth[options]
        return options[depth == depth.min()]

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
        return [choice + n * int(self.rng.integers((255 - choice) // n + 1))]


def _sensible(settings: EvolutionSettings, plan: Plan) -> list[int]:
    """Grow a tree, or a full one, to a depth between the shallowest possible and the greatest allowed."""
    shallowest = int(plan.grammar.minimum_depth[0])
    depth = int(plan.rng.integers(shallowest, max(settings.initial_depth, shallowest) + 1))
    full = bool(plan.rng.integers(2))
    while True:
        codons = _tree(plan, depth, full, settings.codons)
        if len(codons) <= settings.codons or depth <= shallowest:
            return codons
        depth -= 1  # too large for the genome


def _tree(plan: Plan, depth: int, full: bool, most: int) -> list[int]:
    """Write a tree's codons, leftmost first; give up beyond the most."""
    codons: list[int] = []
    waiting = [(0, depth)]
    while waiting and len(codons) <= most:
        symbol, left = waiting.pop()
        options = plan.options(symbol)
        fitting = options[plan.grammar.production_depth[options] <= left]
        growing = fitting[plan.grammar.production_recursive[fitting]] if full else fitting[:0]
        production = plan.pick(next(p for p in (growing, fitting, plan.shallowest(symbol)) if len(p)))
        codons += plan.codon(symbol, production)
        waiting += [(child, left - 1) for child in reversed(plan.children(production))]
    return codons


def _ptc2(settings: EvolutionSettings, plan: Plan) -> list[int]:
    """Expand random open nonterminals until the tree will have the size drawn, then end each the shortest way."""
    target = int(plan.rng.integers(1, settings.initial_expansions + 1))
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


_PLANS: dict[str, Callable[[EvolutionSettings, Plan], list[int]] | None] = {
    "uniform": None,
    "sensible": _sensible,
    "ptc2": _ptc2,
}
