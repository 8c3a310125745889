"""From genomes to derivations: the mapping of Grammatical Evolution, a population at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, repeat, takewhile
from typing import Any

import numpy as np

from gecar.errors import InputError, expected
from gecar.language import derivation
from gecar.language.derivation import Bools, Codons, Int32s, Int64s
from gecar.language.grammar import Grammar
from gecar.language.program import Program, parse_program
from gecar.language.steps import Step, derive

MAX_CODON_SIZE = 2**31 - 1


@dataclass(frozen=True)
class MappingOptions:
    """How codons are read.

    Attributes
    ----------
    wraps
        How often reading may start again at the first codon; 0 as in the paper.
    single_choice_consumes
        Whether a nonterminal with one production reads a codon too; in the paper's Table 2 it does not.
    max_symbols
        The most nonterminals one derivation may hold, replaced and waiting together. A derivation takes no
        more steps than this, and a call no more memory than four bytes for each, whatever the grammar; what
        goes beyond is invalid.
    codon_size
        Codons are whole numbers from 0 up to but without this. A rule with more productions needs larger ones.
    variable_length
        Whether genomes differ in length: a genome's row then ends with -1 in every place it does not fill.
    """

    wraps: int = 0
    single_choice_consumes: bool = False
    max_symbols: int = 100_000
    codon_size: int = 256
    variable_length: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.wraps <= 1_000_000:
            raise expected("wraps", self.wraps, "a whole number from 0 to 1000000")
        if not 1 <= self.max_symbols <= 10_000_000:
            raise expected("max_symbols", self.max_symbols, "a whole number from 1 to 10000000")
        if not 2 <= self.codon_size <= MAX_CODON_SIZE:
            raise expected("codon_size", self.codon_size, f"a whole number from 2 to {MAX_CODON_SIZE}")

    @property
    def codon_type(self) -> np.dtype[Any]:
        """Dtype of codons: bytes where they suffice, int32 otherwise."""
        return np.dtype(np.uint8 if self.codon_size <= 256 and not self.variable_length else np.int32)


@dataclass(frozen=True)
class Nodes:
    """The nonterminals of all derivation trees, each genome's in one stretch, a node before its children.

    Attributes
    ----------
    offsets
        Where each genome's nodes begin (genomes + 1,); an invalid genome has none.
    symbol
        The nonterminal, as index in ``grammar.nonterminals`` (nodes,).
    production
        What it became, as index in ``grammar.productions`` (nodes,).
    begin, end
        The subtree's codons, ``begin`` up to but without ``end`` (nodes,), counted from the genome's first
        reading: with wrapping they can pass the genome's length. Empty where a subtree reads no codon.
    """

    offsets: Int64s
    symbol: Int32s
    production: Int32s
    begin: Int32s
    end: Int32s


@dataclass(frozen=True)
class TreeNode:
    """One node of a drawn derivation tree.

    Attributes
    ----------
    symbol
        The nonterminal's name.
    production
        Index in ``grammar.productions``.
    codon
        Index of the codon that chose it; None where there was nothing to choose.
    parts
        What it became: text as str, a child as its index in the tree.
    """

    symbol: str
    production: int
    codon: int | None
    parts: tuple[str | int, ...]


class Mapper:
    """Maps genomes through one grammar.

    Parameters
    ----------
    grammar
        What codons choose from.
    options
        How they are read.

    Attributes
    ----------
    linear
        Whether derivations read codons from the first on, each one the next choice of a leftmost derivation, as
        operators on used codons and subtrees need.
    words
        The texts that words of the grammar are put together from.
    """

    linear = True

    def __init__(self, grammar: Grammar, options: MappingOptions | None = None) -> None:
        self.grammar = grammar
        self.options = options or MappingOptions()
        self.tables = derivation.tables(grammar, self.options.single_choice_consumes)
        self.words = derivation.words(grammar)

    def map(self, genomes: Any) -> Mapped:
        """Derive from every genome.

        Parameters
        ----------
        genomes
            Codons (genomes, codons), 0..255 unless the options say otherwise.

        Raises
        ------
        InputError
            If it is not such an array. A derivation that does not finish is no error, but invalid.
        """
        valid, used, offsets, node_offsets, choices = derivation.derive_all(
            self.as_genomes(genomes),
            self.options.wraps + 1,
            self.options.max_symbols,
            self.options.variable_length,
            self.tables,
        )
        return Mapped(self, valid, used, offsets, choices.copy(), node_offsets)

    def derive(self, genome: Any) -> Iterator[Step]:
        """Derive step by step, as in the paper's Table 2, until nothing is left to replace or codons run out.

        Raises
        ------
        InputError
            If it is not one genome.
        """
        codons = list(takewhile(lambda codon: codon >= 0, self.as_genomes([genome])[0].tolist()))
        readings = chain.from_iterable(repeat(codons, self.options.wraps + 1))
        return derive(self.grammar, self.tables.reads.tolist(), readings, self.options.max_symbols)

    def as_genomes(self, genomes: Any) -> Codons:
        """Return codons as the kind of array the kernels are compiled for.

        Raises
        ------
        InputError
            If they are no codons of this mapper.
        """
        return _as_genomes(genomes, self.options)


@dataclass(frozen=True)
class Mapped:
    """What a population's genomes derive.

    Attributes
    ----------
    mapper
        Grammar and options.
    valid
        Whether the derivation finished (genomes,).
    used
        Codons read (genomes,); with wrapping it can pass the genome's length, and codon k is then ``k %
        codons``. Of an invalid genome: those read before it was given up, without wrapping all of them.
    offsets
        Where each genome's choices begin (genomes + 1,); an invalid genome has none.
    choices
        What the codons chose, the production's index within its rule, genome after genome: those of genome i
        are ``choices[offsets[i]:offsets[i + 1]]``, ``used[i]`` of them.
    node_offsets
        Where each genome's nodes begin in `nodes` (genomes + 1,).
    """

    mapper: Mapper
    valid: Bools
    used: Int32s
    offsets: Int64s
    choices: Codons
    node_offsets: Int64s

    def __len__(self) -> int:
        return len(self.valid)

    def key(self, i: int) -> bytes:
        """Return genome i's choices as bytes; equal keys, equal phenotypes. Empty if it is invalid."""
        raw, ends = self._raw
        return raw[ends[i] : ends[i + 1]]

    def text(self, i: int) -> str:
        """Write genome i's phenotype.

        Raises
        ------
        InputError
            If genome i is invalid.
        """
        if not self.valid[i]:
            raise expected(f"genome {i}", "a derivation that does not finish", "a valid genome")
        begins, numbers = self._listed
        words = self.mapper.words
        return "".join([words[k] for k in numbers[begins[i] : begins[i + 1]]])

    @cached_property
    def _raw(self) -> tuple[bytes, list[int]]:
        """All choices as bytes, and where each genome's begin: an array's slices take longer one by one."""
        return self.choices.tobytes(), (self.choices.itemsize * self.offsets).tolist()

    @cached_property
    def _listed(self) -> tuple[list[int], list[int]]:
        """`words` as lists, for the same reason."""
        begins, numbers = self.words
        return begins.tolist(), numbers.tolist()

    @cached_property
    def words(self) -> tuple[Int64s, Int32s]:
        """Where each genome's words begin (genomes + 1,), and the words as numbers in ``mapper.words`` (words,)."""
        return derivation.write_words(self.offsets, self.choices, self.valid, self.mapper.tables)

    def program(self, i: int) -> Program | None:
        """Read genome i's phenotype as a robot program.

        Returns
        -------
        Program or None
            None if genome i is invalid, or its phenotype is no program; `check_robot_language` tells at once
            whether a grammar's phenotypes are programs, and ``parse_program(mapped.text(i))`` what is wrong
            with one.
        """
        if not self.valid[i]:
            return None
        try:
            return parse_program(self.text(i))
        except InputError:
            return None

    @cached_property
    def nodes(self) -> Nodes:
        """All derivation trees' nodes, for operators on subtrees."""
        room = np.empty(self.mapper.options.max_symbols, np.int32)
        return Nodes(
            self.node_offsets,
            *derivation.lay_nodes(self.node_offsets, self.offsets, self.choices, self.mapper.tables, room),
        )

    @cached_property
    def depths(self) -> Int32s:
        """Depth of each derivation tree, in nonterminals from the start down (genomes,); 0 of an invalid one."""
        room = np.empty(self.mapper.options.max_symbols, np.int32)
        return derivation.tree_depths(self.node_offsets, self.nodes.production, self.mapper.tables, room)

    @cached_property
    def symbols(self) -> Int32s:
        """The nonterminal each codon chose for, laid out as `choices`."""
        return self.nodes.symbol[self.mapper.tables.reads[self.nodes.symbol]]

    @cached_property
    def subtree_ends(self) -> Int32s:
        """Where the subtree each codon begins ends, laid out as `choices`.

        The subtree of genome i's codon k is its codons ``k`` up to ``subtree_ends[offsets[i] + k]``. Where
        no genome is read twice, putting it in the place of another subtree with the same symbol gives a
        valid genome again.
        """
        return self.nodes.end[self.mapper.tables.reads[self.nodes.symbol]]

    def tree(self, i: int) -> tuple[TreeNode, ...]:
        """Return genome i's derivation tree, each node before its children; empty if it is invalid."""
        nodes, reads = self.nodes, self.mapper.tables.reads
        first, last = int(nodes.offsets[i]), int(nodes.offsets[i + 1])
        tree: list[TreeNode] = []
        waiting: list[int] = []  # going backwards, a node's children are on top, its first child uppermost
        for node in range(last - 1, first - 1, -1):
            symbol, number = int(nodes.symbol[node]), int(nodes.production[node])
            parts = self.mapper.grammar.productions[number].parts
            linked = tuple(part if isinstance(part, str) else waiting.pop() for part in parts)
            waiting.append(node - first)
            codon = int(nodes.begin[node]) if reads[symbol] else None
            tree.append(TreeNode(self.mapper.grammar.nonterminals[symbol], number, codon, linked))
        return tuple(reversed(tree))


@dataclass(frozen=True)
class Derivation:
    """What one genome derives: its text, or its tree for those who want to know how the text came about.

    Attributes
    ----------
    mapped, index
        The population, and which of its genomes; it is valid.
    """

    mapped: Mapped
    index: int

    @cached_property
    def text(self) -> str:
        """What stands there when no nonterminal is left."""
        return self.mapped.text(self.index)

    @property
    def words(self) -> Int32s:
        """What the text is put together from, as numbers in ``mapped.mapper.words`` (words,)."""
        begins, numbers = self.mapped.words
        return numbers[begins[self.index] : begins[self.index + 1]]

    @property
    def tree(self) -> tuple[TreeNode, ...]:
        """The derivation tree, each node before its children."""
        return self.mapped.tree(self.index)

    def __str__(self) -> str:
        return self.text


def _as_genomes(genomes: Any, options: MappingOptions) -> Codons:
    lowest, highest = -1 if options.variable_length else 0, options.codon_size - 1
    wanted = f"codons {lowest}..{highest}"
    try:
        array = np.asarray(genomes)
    except ValueError:
        raise expected("genomes", "rows of different length", f"{wanted} (genomes, codons)") from None
    if array.ndim != 2:
        raise expected("genomes", f"an array of shape {array.shape}", f"{wanted} (genomes, codons)")
    if array.dtype != np.uint8 or options.codon_size != 256:
        whole = array.size == 0 or np.issubdtype(array.dtype, np.integer)
        if not whole or (array.size and not lowest <= array.min() <= array.max() <= highest):
            raise expected(
                "genomes",
                f"{array.dtype} codons, not all {lowest}..{highest}",
                f"whole numbers {lowest}..{highest}",
            )
    return np.require(array, options.codon_type, ["C", "W"])
