"""Structured Grammatical Evolution: every nonterminal reads codons of its own.

A genome is a row of genes, one for each nonterminal, in the order of the grammar; so a codon that changes changes one
choice, and no other codon's meaning (Lourenço, Pereira, Costa, "Unveiling the properties of structured grammatical
evolution", Genetic Programming and Evolvable Machines 17, 2016). Trees are bounded as in the dynamic form (Lourenço et
al., "Structured Grammatical Evolution: A Dynamic Approach", Handbook of GE, 2018): where little depth is left, codons
choose among the productions that still fit, so every genome derives something.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from gecar.compiled import compiled
from gecar.errors import expected
from gecar.language.derivation import Bools, Codons, Int32s, Int64s, Tables
from gecar.language.grammar import Grammar
from gecar.language.mapping import Mapped, Mapper, MappingOptions
from gecar.language.steps import Step


class StructuredMapper(Mapper):
    """Maps genomes with one gene for each nonterminal.

    Parameters
    ----------
    grammar
        What codons choose from.
    gene
        Codons of each gene; one that is read beyond its end is read from its beginning again.
    depth
        Greatest depth of a derivation tree, or of the grammar's shallowest where that is deeper.
    options
        `codon_size` and `max_symbols` count; genomes are of one length.

    Attributes
    ----------
    codons
        Length of a genome.
    """

    linear = False

    def __init__(
        self, grammar: Grammar, gene: int = 20, depth: int = 12, options: MappingOptions | None = None
    ) -> None:
        super().__init__(grammar, options)
        if self.options.wraps or self.options.variable_length or self.options.single_choice_consumes:
            raise expected("options", "wraps, variable_length or single_choice_consumes", "none of them")
        if gene < 1:
            raise expected("gene", gene, "at least one codon")
        self.gene, self.codons = gene, gene * len(grammar.rules)
        self.depth = max(depth, int(grammar.minimum_depth[0]))

    def map(self, genomes: Any) -> Mapped:
        """Derive from every genome; one is invalid only if its derivation holds more than `max_symbols`.

        Parameters
        ----------
        genomes
            Codons (genomes, codons).

        Raises
        ------
        InputError
            If it is no such array.
        """
        rows = self.as_genomes(genomes)
        if rows.shape[1] != self.codons:
            found = f"genomes of {rows.shape[1]} codons"
            raise expected("genomes", found, f"{self.codons}: {self.gene} for each nonterminal")
        valid, used, offsets, node_offsets, choices = _derive_all(
            rows,
            self.gene,
            self.depth,
            self.options.max_symbols,
            self.grammar.production_depth,
            self.grammar.minimum_depth,
            self.tables,
        )
        return Mapped(self, valid, used, offsets, choices, node_offsets)

    def derive(self, genome: Any) -> Iterator[Step]:  # noqa: ARG002
        """Refuse: the steps of the paper's Table 2 read one row of codons."""
        raise expected("derive", "a genome of genes", "a Mapper; this one draws its tree with map")


@compiled
def _derive_all(
    genomes: Codons,
    gene: int,
    depth: int,
    max_symbols: int,
    production_depth: Int32s,
    minimum_depth: Int32s,
    table: Tables,
) -> tuple[Bools, Int32s, Int64s, Int64s, Int32s]:
    """Derive from every genome; see `gecar.language.mapping.Mapped` for what is returned."""
    n = genomes.shape[0]
    valid, used = np.zeros(n, np.bool_), np.zeros(n, np.int32)
    offsets, node_offsets = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    stack, below = np.empty(max_symbols, np.int32), np.empty(max_symbols, np.int32)
    read_of = np.empty(minimum_depth.size, np.int32)
    choices = np.empty(max_symbols + 64 * n, np.int32)
    for i in range(n):
        begin = offsets[i]
        if begin + max_symbols > choices.size:
            longer = np.empty(2 * choices.size + max_symbols, np.int32)
            for k in range(begin):
                longer[k] = choices[k]
            choices = longer
        read_of[:] = 0
        stack[0], below[0] = 0, depth
        waiting, replaced, read = 1, 0, 0
        while waiting > 0:
            waiting -= 1
            replaced += 1
            symbol, left = stack[waiting], max(below[waiting], minimum_depth[stack[waiting]])
            production = table.first_production[symbol]
            if table.reads[symbol]:
                codon = genomes[i, symbol * gene + read_of[symbol] % gene]
                read_of[symbol] += 1
                end = table.first_production[symbol + 1]
                production = _fitting(production, end, codon, left, production_depth)
                choices[begin + read] = production - table.first_production[symbol]
                read += 1
            first, end = table.first_child[production], table.first_child[production + 1]
            if replaced + waiting + end - first > max_symbols:
                break
            for child in range(first, end):
                stack[waiting], below[waiting] = table.children[child], left - 1
                waiting += 1
        valid[i] = waiting == 0 and replaced <= max_symbols
        used[i] = read
        offsets[i + 1] = begin + valid[i] * read
        node_offsets[i + 1] = node_offsets[i] + valid[i] * replaced
    return valid, used, offsets, node_offsets, choices[: offsets[n]].copy()


@compiled
def _fitting(first: int, end: int, codon: int, left: int, production_depth: Int32s) -> int:
    """Return the production a codon chooses among those whose shallowest tree is at most as deep as what is left."""
    n = 0
    for production in range(first, end):
        n += production_depth[production] <= left
    skip = codon % n
    for production in range(first, end):
        if production_depth[production] <= left:
            if skip == 0:
                return production
            skip -= 1
    return first  # not reached: left is at least the nonterminal's least depth
