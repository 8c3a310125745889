"""Operators for Structured Grammatical Evolution: genes change owners whole, and codons change that are read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gecar.compiled import compiled
from gecar.evolution.crossover import Genomes
from gecar.evolution.lineage import CROSSOVER, MUTATION
from gecar.language.derivation import Int32s, Int64s
from gecar.language.structured import StructuredMapper
from gecar.random_streams import Streams, below, uniform


@dataclass(frozen=True)
class GeneCrossover:
    """Genomes exchange genes, each with probability one half (Lourenço et al. 2016, section 3).

    Attributes
    ----------
    rate
        Share of pairs that do.
    """

    rate: float
    change = CROSSOVER

    def __call__(self, genomes: Genomes, mapper: StructuredMapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        _swap_genes(genomes, mapper.gene, self.rate, streams)
        return genomes


@compiled
def _swap_genes(genomes: Genomes, gene: int, rate: float, streams: Streams) -> None:
    for i in range(0, genomes.shape[0] - 1, 2):
        if uniform(streams[i]) >= rate:
            continue
        for begin in range(0, genomes.shape[1], gene):
            if uniform(streams[i]) < 0.5:
                for k in range(begin, begin + gene):
                    genomes[i, k], genomes[i + 1, k] = genomes[i + 1, k], genomes[i, k]


@dataclass(frozen=True)
class GeneFlip:
    """Codons that the derivation reads are drawn anew.

    Attributes
    ----------
    rate
        Probability of each.
    """

    rate: float
    change = MUTATION

    def __call__(self, genomes: Genomes, mapper: StructuredMapper, streams: Streams) -> Genomes:
        """Return the children (genomes, codons)."""
        mapped = mapper.map(genomes)
        _flip_read(
            genomes,
            mapper.gene,
            mapped.offsets,
            mapped.symbols,
            self.rate,
            mapper.options.codon_size,
            streams,
        )
        return genomes


@compiled
def _flip_read(
    genomes: Genomes, gene: int, offsets: Int64s, symbols: Int32s, rate: float, size: int, streams: Streams
) -> None:
    read_of = np.empty(genomes.shape[1] // gene, np.int32)
    for i in range(genomes.shape[0]):
        read_of[:] = 0
        for k in range(offsets[i], offsets[i + 1]):
            symbol = symbols[k]
            if read_of[symbol] < gene and uniform(streams[i]) < rate:
                genomes[i, symbol * gene + read_of[symbol]] = below(streams[i], size)
            read_of[symbol] += 1
