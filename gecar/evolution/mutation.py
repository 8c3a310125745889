"""Mutation: codons drawn anew, numbers moved to a neighbour, whole individuals renewed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.evolution.crossover import Genomes, lengths, used_codons
from gecar.evolution.initialisation import Initialisation
from gecar.evolution.lineage import CREEP, DUPLICATION, MUTATION
from gecar.language.grammar import Grammar, Rule
from gecar.language.mapping import Mapper
from gecar.random_streams import Streams, below, uniform

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Int32s = npt.NDArray[np.int32]
Int64s = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Flip:
    """Codons are drawn anew, each codon there is as likely as the others.

    Attributes
    ----------
    rate
        Probability of each; None for one codon on average.
    within_used
        Whether only codons that the derivation reads.
    """

    rate: float | None
    within_used: bool = False
    change = MUTATION

    @property
    def linear(self) -> bool:
        """Whether codons must be read from the first on."""
        return self.within_used

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        reach = lengths(genomes, mapper)
        if self.within_used:
            reach = used_codons(genomes, mapper)
        rates = 1.0 / np.maximum(reach, 1) if self.rate is None else np.full(len(genomes), self.rate)
        _flip(genomes, reach, rates, mapper.options.codon_size, streams)
        return genomes


@compiled
def _flip(genomes: Genomes, reach: Int32s, rates: Floats, size: int, streams: Streams) -> None:
    for i in range(genomes.shape[0]):
        for k in range(reach[i]):
            if uniform(streams[i]) < rates[i]:
                genomes[i, k] = below(streams[i], size)


@dataclass(frozen=True)
class Renew:
    """Every child is a new random individual."""

    initialise: Initialisation
    change = MUTATION
    fresh = True

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:  # noqa: ARG002
        """Return the children (genomes, codons)."""
        return self.initialise(mapper, streams)


class Scale(NamedTuple):
    """The order of a grammar's numbers.

    Attributes
    ----------
    numeric
        Whether all productions of a nonterminal are numbers (nonterminals,).
    rank
        Each production's place among its rule's, in order of value (productions,).
    at_rank
        The choice that stands at each place (productions,).
    first
        Where each nonterminal's productions begin (nonterminals + 1,).
    """

    numeric: Bools
    rank: Int32s
    at_rank: Int32s
    first: Int32s


@lru_cache(maxsize=8)
def _scale(grammar: Grammar, size: int) -> Scale:
    values = [_numbers(rule) for rule in grammar.rules]
    orders = [np.argsort(v, kind="stable") for v in values]
    ranks = [np.argsort(order, kind="stable") for order in orders]
    numeric = np.array([not np.isnan(v).any() and 1 < len(v) <= size for v in values])
    rank, at_rank = (np.concatenate(parts).astype(np.int32) for parts in (ranks, orders))
    return Scale(numeric, rank, at_rank, grammar.first_production)


def _numbers(rule: Rule) -> npt.NDArray[np.float64]:
    """Values of a rule's productions, nan where one is no number."""
    return np.array([_number(production.parts) for production in rule.productions])


def _number(parts: tuple[str | int, ...]) -> float:
    try:
        return float("".join(part if isinstance(part, str) else "?" for part in parts))
    except ValueError:
        return float("nan")


@dataclass(frozen=True)
class Creep:
    """Numbers move up or down in the list they are chosen from; a step that would pass an end goes the other way.

    Small steps are the more likely: the length's logarithm is uniform (as in Muehlenbein and Schlierkamp-Voosen's
    breeder GA, Evolutionary Computation 1(1), 1993), so that coarse and fine changes of a long list are equally tried.

    Attributes
    ----------
    rate
        Probability of each such codon.
    most
        How many of a genome step on average, at most, so that long programs are not changed all over.
    reach
        No step is as long as this share of its rule's numbers, or as two numbers if that is more.
    """

    rate: float
    most: float = math.inf
    reach: float = 0.0
    change = CREEP
    linear = True

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        mapped = mapper.map(genomes)
        size = mapper.options.codon_size
        scale = _scale(mapper.grammar, size)
        _creep(
            genomes, mapped.offsets, mapped.symbols, scale, self.rate, self.most, self.reach, size, streams
        )
        return genomes


@compiled
def _creep(
    genomes: Genomes,
    offsets: Int64s,
    symbols: Int32s,
    scale: Scale,
    rate: float,
    most: float,
    reach: float,
    size: int,
    streams: Streams,
) -> None:
    for i in range(genomes.shape[0]):
        read = min(offsets[i + 1] - offsets[i], genomes.shape[1])
        while read > 0 and genomes[i, read - 1] < 0:  # read again from the first on: the genome is shorter
            read -= 1
        numbers = 0
        for k in range(read):
            numbers += scale.numeric[symbols[offsets[i] + k]]
        chance = min(rate, most / max(numbers, 1))
        for k in range(read):
            symbol = symbols[offsets[i] + k]
            if scale.numeric[symbol] and uniform(streams[i]) < chance:
                first, n = scale.first[symbol], scale.first[symbol + 1] - scale.first[symbol]
                codon = int(genomes[i, k])
                step = 1 - 2 * below(streams[i], 2)
                if reach * n > 2.0:
                    step *= int(math.exp(uniform(streams[i]) * math.log(reach * n)))
                rank = scale.rank[first + codon % n]
                rank = rank + step if 0 <= rank + step < n else rank - step
                moved = codon - codon % n + scale.at_rank[first + rank]
                genomes[i, k] = moved if moved < size else moved - n


@dataclass(frozen=True)
class Duplicate:
    """Duplicates a subtree: a copy follows it, by a production that holds its nonterminal twice, as <code><code>.

    A robot that does the same twice mostly drives as before, and later one copy may change while the other stays: gene
    duplication (Ohno 1970; in GE O'Neill and Ryan, IEEE T-EC 5(4), 2001, who copy codons wherever they stand).

    Attributes
    ----------
    rate
        Probability of each genome that is valid and has room.
    longest
        Most codons a derivation may read afterwards; one that would read more stays as it is.
    """

    rate: float
    longest: int
    change = DUPLICATION
    linear = True

    def __call__(self, genomes: Genomes, mapper: Mapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        mapped = mapper.map(genomes)
        whole = mapped.valid & (mapped.used <= lengths(genomes, mapper))
        longest = min(self.longest, genomes.shape[1])
        twice = _twice(mapper.grammar)
        _duplicate(
            genomes,
            whole,
            mapped.offsets,
            mapped.symbols,
            mapped.subtree_ends,
            twice,
            self.rate,
            longest,
            streams,
        )
        return genomes


@lru_cache(maxsize=8)
def _twice(grammar: Grammar) -> Int32s:
    """Return each nonterminal's choice that holds itself twice and no other nonterminal, -1 without (nonterminals,)."""
    choices = np.full(len(grammar.rules), -1, np.int32)
    for symbol, rule in enumerate(grammar.rules):
        for choice, production in reversed(list(enumerate(rule.productions))):
            if [part for part in production.parts if not isinstance(part, str)] == [symbol, symbol]:
                choices[symbol] = choice
    return choices


@compiled
def _duplicate(
    genomes: Genomes,
    whole: Bools,
    offsets: Int64s,
    symbols: Int32s,
    ends: Int32s,
    twice: Int32s,
    rate: float,
    longest: int,
    streams: Streams,
) -> None:
    codons = genomes.shape[1]
    for i in range(genomes.shape[0]):
        if uniform(streams[i]) >= rate or not whole[i]:
            continue
        first, used = offsets[i], offsets[i + 1] - offsets[i]
        places = 0
        for k in range(used):
            places += twice[symbols[first + k]] >= 0
        if places == 0:
            continue
        skip = below(streams[i], places)
        begin = 0
        while twice[symbols[first + begin]] < 0 or skip > 0:
            skip -= twice[symbols[first + begin]] >= 0
            begin += 1
        length = ends[first + begin] - begin
        if used + 1 + length <= longest:
            for k in range(codons - 1, begin, -1):
                genomes[i, k] = genomes[i, k - 1 - length] if k > begin + length else genomes[i, k - 1]
            genomes[i, begin] = twice[symbols[first + begin]]
