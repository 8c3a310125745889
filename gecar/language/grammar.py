"""Context-free grammars: what a genome's codons choose from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.errors import InputError, expected, one_of
from gecar.files import is_file, is_folder, read_text, shipped
from gecar.language.bnf import RawRule, Reference, parse_rules
from gecar.language.source_position import place, plain

MAX_NONTERMINALS = 1_000
GRAMMARS = shipped("grammars")


@dataclass(frozen=True)
class Production:
    """One alternative of a rule.

    Attributes
    ----------
    parts
        What it puts in the nonterminal's place, in order: text as str, a nonterminal as its number.
    line
        The line of the grammar file it begins in.
    """

    parts: tuple[str | int, ...]
    line: int

    @cached_property
    def nonterminals(self) -> tuple[int, ...]:
        """Indices of the nonterminals in it, in order."""
        return tuple(part for part in self.parts if isinstance(part, int))


@dataclass(frozen=True)
class Rule:
    """A nonterminal, its brackets included, and what it may become."""

    name: str
    productions: tuple[Production, ...]
    line: int


@dataclass(frozen=True)
class Grammar:
    """A checked grammar: every nonterminal is defined, and every one can end in text.

    Nonterminals are numbered as their rules stand in the file; 0 is the start. Productions are numbered
    through all rules: those of nonterminal k are ``first_production[k]`` up to ``first_production[k + 1]``.

    Attributes
    ----------
    rules
        In the order of the file.
    source
        The file's name, for errors.
    """

    rules: tuple[Rule, ...]
    source: str

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """One line for each nonterminal no derivation can reach."""
        return tuple(
            f"{self.source}, line {rule.line}: {rule.name} cannot be reached from {self.start}"
            for k, rule in enumerate(self.rules)
            if k and not self.reaches[0, k]
        )

    @property
    def start(self) -> str:
        """The nonterminal every derivation begins with."""
        return self.rules[0].name

    @cached_property
    def nonterminals(self) -> tuple[str, ...]:
        """Names of the nonterminals, brackets included."""
        return tuple(rule.name for rule in self.rules)

    @cached_property
    def productions(self) -> tuple[Production, ...]:
        """Return all productions, rule after rule."""
        return tuple(production for rule in self.rules for production in rule.productions)

    @cached_property
    def n_choices(self) -> npt.NDArray[np.int32]:
        """Number of productions of each nonterminal (nonterminals,)."""
        return np.array([len(rule.productions) for rule in self.rules], np.int32)

    @cached_property
    def first_production(self) -> npt.NDArray[np.int32]:
        """Index of each nonterminal's first production, and at the end their number (nonterminals + 1,)."""
        return np.concatenate(([0], np.cumsum(self.n_choices))).astype(np.int32)

    @cached_property
    def minimum_depth(self) -> npt.NDArray[np.int32]:
        """Depth of each nonterminal's shallowest tree (nonterminals,); 1 if a production is only text."""
        return np.array(_minimum_depths(self.rules), np.int32)

    @cached_property
    def production_depth(self) -> npt.NDArray[np.int32]:
        """Depth of the shallowest tree that begins with each production (productions,)."""
        depth = self.minimum_depth
        return np.array(
            [1 + max((depth[k] for k in p.nonterminals), default=0) for p in self.productions], np.int32
        )

    @cached_property
    def reaches(self) -> npt.NDArray[np.bool_]:
        """Whether one nonterminal (row) can lead to another (column) in one step or more."""
        reaches = np.zeros((len(self.rules), len(self.rules)), np.bool_)
        for k, rule in enumerate(self.rules):
            for production in rule.productions:
                reaches[k, list(production.nonterminals)] = True
        while True:  # each round doubles the steps, so there are few
            further = reaches | (reaches.astype(np.float32) @ reaches.astype(np.float32) > 0)
            if np.array_equal(further, reaches):
                return reaches
            reaches = further

    @cached_property
    def recursive(self) -> npt.NDArray[np.bool_]:
        """Whether each nonterminal can lead to itself again (nonterminals,)."""
        return np.diagonal(self.reaches).copy()

    @cached_property
    def production_recursive(self) -> npt.NDArray[np.bool_]:
        """Whether each production can lead to its own left side again (productions,)."""
        return np.array(
            [
                any(child == k or self.reaches[child, k] for child in production.nonterminals)
                for k, rule in enumerate(self.rules)
                for production in rule.productions
            ],
            np.bool_,
        )

    def shown(self, parts: tuple[str | int, ...]) -> str:
        """Write text and nonterminals' names one after the other, as in the paper's Table 2."""
        return "".join(part if isinstance(part, str) else self.rules[part].name for part in parts)


def parse_grammar(text: str, source: str = "<grammar>", ranges: Mapping[str, int] | None = None) -> Grammar:
    """Read and check a grammar.

    Parameters
    ----------
    text
        Rules in Backus-Naur form; `gecar.language.bnf` says what may stand in them.
    source
        The file's name, for errors.
    ranges
        What names after ``GE_RANGE:`` stand for, as ``{"dataset_n_vars": 5}``.

    Returns
    -------
    Grammar
        Its `warnings` name nonterminals that cannot be reached.

    Raises
    ------
    InputError
        If it is not a grammar, uses a nonterminal it does not define, or has one that can never end.
    """
    text = plain(text)
    grammar = Grammar(_resolve(parse_rules(text, source, ranges or {}), text, source), source)
    for rule, depth in zip(grammar.rules, grammar.minimum_depth, strict=True):
        if depth == 0:
            found = f"{rule.name}, whose every alternative leads to a nonterminal that never ends"
            raise expected(f"{source}, line {rule.line}", found, "one alternative that ends in text")
    return grammar


def read_grammar(path: Path, ranges: Mapping[str, int] | None = None) -> Grammar:
    """Read a grammar file.

    Raises
    ------
    InputError
        If the file cannot be read, or as `parse_grammar`.
    """
    return parse_grammar(read_text(path, "a grammar file"), str(path), ranges)


def load_grammar(name: str | Path, ranges: Mapping[str, int] | None = None) -> Grammar:
    """Read a grammar by its path, or by its name in ``grammars/`` here or in the project.

    Raises
    ------
    InputError
        If there is no such grammar, or as `parse_grammar`.
    """
    path = Path(name)
    if is_file(path):
        return read_grammar(path, ranges)
    for folder in _folders():
        named = folder / (path.name if path.suffix == ".bnf" else f"{path.name}.bnf")
        if path.parent == Path() and is_file(named):
            return read_grammar(named, ranges)
    if is_folder(path):
        return read_grammar(path, ranges)  # the error says so
    raise one_of("grammar", str(name), sorted(list_grammars()), "a .bnf file")


def list_grammars() -> list[str]:
    """Return the names `load_grammar` knows, the paper's first."""
    names = sorted({file.stem for folder in _folders() for file in folder.glob("*.bnf")})
    return sorted(names, key=lambda name: name != "paper")


def _folders() -> tuple[Path, ...]:
    return Path("grammars"), GRAMMARS


def _resolve(raw: list[RawRule], text: str, source: str) -> tuple[Rule, ...]:
    """Look up every nonterminal's name."""
    if len(raw) > MAX_NONTERMINALS:
        raise expected(source, f"{len(raw)} rules", f"at most {MAX_NONTERMINALS}")
    index = {rule.name: k for k, rule in enumerate(raw)}

    def part(value: str | Reference) -> str | int:
        if isinstance(value, str):
            return value
        if value.name not in index:
            raise _undefined(value, place(source, text, value.offset), list(index))
        return index[value.name]

    def line(offset: int) -> int:
        return text.count("\n", 0, offset) + 1

    return tuple(
        Rule(
            rule.name,
            tuple(Production(tuple(part(p) for p in a.parts), line(a.offset)) for a in rule.alternatives),
            line(rule.offset),
        )
        for rule in raw
    )


def _undefined(reference: Reference, where: str, known: list[str]) -> InputError:
    few = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
    return expected(
        where, f"{reference.name}, which no rule defines", f"one of {few}, or \\{reference.name} for text"
    )


def _minimum_depths(rules: tuple[Rule, ...]) -> list[int]:
    """Find the depth of the shallowest tree of each nonterminal; 0 where there is none.

    Round d finds the nonterminals with a production whose nonterminals were all found in earlier rounds.
    """
    depths = [0] * len(rules)
    for depth in range(1, len(rules) + 1):
        found = [
            k
            for k, rule in enumerate(rules)
            if not depths[k] and any(all(depths[child] for child in p.nonterminals) for p in rule.productions)
        ]
        if not found:
            break
        for k in found:
            depths[k] = depth
    return depths
