"""Compiled leftmost derivation: codons to choices, and choices to the derivation tree.

Only nonterminals are ever put on a stack; text is written later, from the choices, for those that need it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.language.grammar import Grammar

Int32s = npt.NDArray[np.int32]
Int64s = npt.NDArray[np.int64]
Codons = npt.NDArray[np.integer[Any]]
Bools = npt.NDArray[np.bool_]


class Tables(NamedTuple):
    """A grammar as arrays.

    Attributes
    ----------
    chosen
        The production each codon below 256 chooses (nonterminals, 256); a table, since a division takes longer.
    reads
        Whether choosing takes a codon (nonterminals,).
    first_production
        Index of each nonterminal's first production (nonterminals + 1,).
    first_child
        Where each production's nonterminals begin in `children` (productions + 1,).
    children
        The nonterminals of all productions, the last of each production first, as a stack wants them.
    first_part
        Where each production's parts begin in `parts` (productions + 1,).
    parts
        The parts of all productions, the last of each production first: -1 - k is nonterminal k, others are numbers of
        words.
    """

    chosen: Int32s
    reads: Bools
    first_production: Int32s
    first_child: Int32s
    children: Int32s
    first_part: Int32s
    parts: Int32s


def tables(grammar: Grammar, single_choice_consumes: bool) -> Tables:
    """Lay a grammar out in arrays."""
    children = [production.nonterminals[::-1] for production in grammar.productions]
    number = {word: k for k, word in enumerate(words(grammar))}
    parts = [
        [number[part] if isinstance(part, str) else -1 - part for part in production.parts[::-1]]
        for production in grammar.productions
    ]
    return Tables(
        grammar.first_production[:-1, None] + np.arange(256, dtype=np.int32) % grammar.n_choices[:, None],
        (grammar.n_choices > 1) | single_choice_consumes,
        grammar.first_production,
        np.cumsum([0, *map(len, children)]).astype(np.int32),
        np.array([child for group in children for child in group], np.int32),
        np.cumsum([0, *map(len, parts)]).astype(np.int32),
        np.array([part for group in parts for part in group], np.int32),
    )


def words(grammar: Grammar) -> tuple[str, ...]:
    """Return the texts a grammar's words are put together from, each once."""
    parts = (part for production in grammar.productions for part in production.parts)
    return tuple(dict.fromkeys(part for part in parts if isinstance(part, str)))


@compiled
def derive_one(
    genome: Codons, limit: int, table: Tables, stack: Int32s, choices: Codons
) -> tuple[bool, int, int]:
    """Derive leftmost from the start until no nonterminal is left, or codons or room run out.

    Parameters
    ----------
    genome
        Codons (codons,).
    limit
        How many codons may be read, over again from the first after the last.
    table
        The grammar.
    stack
        Room for nonterminals; its length also bounds those replaced and waiting together.
    choices
        Receives the choice made at each codon.

    Returns
    -------
    finished, read, replaced
        Whether nothing was left to replace; the numbers of codons read and of nonterminals replaced.
    """
    stack[0] = 0
    waiting, replaced, read, at = 1, 0, 0, 0
    while waiting > 0:
        waiting -= 1
        replaced += 1
        symbol = stack[waiting]
        production = table.first_production[symbol]
        if table.reads[symbol]:
            if read == limit:
                return False, read, replaced
            codon = genome[at]
            if codon < 256:  # of bytes always, so this is not compiled for them
                choices[read] = table.chosen[symbol, codon] - production
                production = table.chosen[symbol, codon]
            else:
                choices[read] = codon % (table.first_production[symbol + 1] - production)
                production += choices[read]
            read += 1
            at += 1
            if at == genome.size:
                at = 0
        first, end = table.first_child[production], table.first_child[production + 1]
        if first == end:  # predicted well, it frees the next step from waiting for this one: twice as fast
            continue
        if replaced + waiting + end - first > stack.size:
            return False, read, replaced
        for child in range(first, end):
            stack[waiting] = table.children[child]
            waiting += 1
    return True, read, replaced


@compiled
def derive_all(
    genomes: Codons, readings: int, max_symbols: int, variable: bool, table: Tables
) -> tuple[Bools, Int32s, Int64s, Int64s, Codons]:
    """Derive from every genome.

    Parameters
    ----------
    genomes
        Codons (genomes, codons).
    readings
        How often each genome may be read, 1 without wrapping.
    max_symbols
        Bound on the nonterminals of one derivation, replaced and waiting.
    variable
        Whether a genome ends before its first negative codon.
    table
        The grammar.

    Returns
    -------
    valid, used, offsets, node_offsets, choices
        As in `gecar.language.mapping.Mapped`.
    """
    n, codons = genomes.shape
    limit = min(codons * readings, max_symbols)
    valid = np.zeros(n, np.bool_)
    used = np.zeros(n, np.int32)
    offsets, node_offsets = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    stack = np.empty(max_symbols, np.int32)
    choices = np.empty(limit + 16 * n, genomes.dtype)
    for i in range(n):
        begin = offsets[i]
        if begin + limit > choices.size:
            longer = np.empty(2 * choices.size + limit, genomes.dtype)
            for k in range(begin):  # a slice assignment takes a second to compile
                longer[k] = choices[k]
            choices = longer
        length = codons
        if variable:
            length = 0
            while length < codons and genomes[i, length] >= 0:
                length += 1
        most = min(length * readings, limit)
        valid[i], used[i], replaced = derive_one(genomes[i, :length], most, table, stack, choices[begin:])
        offsets[i + 1] = begin + valid[i] * used[i]
        node_offsets[i + 1] = node_offsets[i] + valid[i] * replaced
    return valid, used, offsets, node_offsets, choices[: offsets[n]]


@compiled
def lay_nodes(
    node_offsets: Int64s, offsets: Int64s, choices: Codons, table: Tables, stack: Int32s
) -> tuple[Int32s, Int32s, Int32s, Int32s]:
    """Write the nodes of every derivation tree, a node before its children, left before right.

    Returns
    -------
    symbol, production, begin, end
        Each (nodes,): the nonterminal, its production, and the codons of its subtree, ``begin`` up to
        ``end``, counted from the genome's first reading.
    """
    n_nodes = node_offsets[-1]
    symbol, production = np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32)
    begin, end = np.empty(n_nodes, np.int32), np.empty(n_nodes, np.int32)
    for i in range(node_offsets.size - 1):
        stack[0] = 0
        waiting, read = 1, 0
        for node in range(node_offsets[i], node_offsets[i + 1]):
            waiting -= 1
            symbol[node] = stack[waiting]
            production[node] = table.first_production[symbol[node]]
            begin[node] = read
            if table.reads[symbol[node]]:
                production[node] += choices[offsets[i] + read]
                read += 1
            end[node] = read
            for child in range(table.first_child[production[node]], table.first_child[production[node] + 1]):
                stack[waiting] = table.children[child]
                waiting += 1
        # Going backwards, a node meets the ends of its children on top of the stack, its last child's lowest.
        waiting = 0
        for node in range(node_offsets[i + 1] - 1, node_offsets[i] - 1, -1):
            children = table.first_child[production[node] + 1] - table.first_child[production[node]]
            if children > 0:
                waiting -= children
                end[node] = stack[waiting]
            stack[waiting] = end[node]
            waiting += 1
    return symbol, production, begin, end


@compiled
def tree_depths(node_offsets: Int64s, production: Int32s, table: Tables, stack: Int32s) -> Int32s:
    """Return the depth of every derivation tree, in nonterminals from the start down; 0 where there is none."""
    depths = np.zeros(node_offsets.size - 1, np.int32)
    for i in range(depths.size):
        stack[0] = 1
        waiting = 1
        for node in range(node_offsets[i], node_offsets[i + 1]):
            waiting -= 1
            depth = stack[waiting]
            depths[i] = max(depths[i], depth)
            for _ in range(table.first_child[production[node]], table.first_child[production[node] + 1]):
                stack[waiting] = depth + 1
                waiting += 1
    return depths


@compiled
def write_words(offsets: Int64s, choices: Codons, valid: Bools, table: Tables) -> tuple[Int64s, Int32s]:
    """Write the words every derivation consists of, by their numbers.

    Returns
    -------
    offsets, numbers
        Where each genome's begin (genomes + 1,); the words of all (words,).
    """
    begins = np.zeros(valid.size + 1, np.int64)
    written, stack = np.empty(1_024, np.int32), np.empty(1_024, np.int32)
    n = 0
    for i in range(valid.size):
        read = offsets[i]
        waiting = 1 if valid[i] else 0
        stack[0] = -1
        while waiting > 0:
            waiting -= 1
            part = stack[waiting]
            if part >= 0:
                if n == written.size:
                    written = _longer(written)
                written[n] = part
                n += 1
                continue
            production = table.first_production[-1 - part]
            if table.reads[-1 - part]:
                production += choices[read]
                read += 1
            first, end = table.first_part[production], table.first_part[production + 1]
            while waiting + end - first > stack.size:
                stack = _longer(stack)
            for k in range(first, end):
                stack[waiting] = table.parts[k]
                waiting += 1
        begins[i + 1] = n
    return begins, written[:n].copy()


@compiled
def _longer(numbers: Int32s) -> Int32s:
    longer = np.empty(2 * numbers.size, np.int32)
    for k in range(numbers.size):
        longer[k] = numbers[k]
    return longer
