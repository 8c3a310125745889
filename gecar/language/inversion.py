"""From a program back to a genome: the derivation that a grammar has for it.

A program's text is not the grammar's: numbers are worked out, parentheses and braces differ. So both are cut into
tokens and brought to one form (`_tokens_of`, `_Table`), and the tokens are parsed (`gecar.language.earley`). What that
finds counts only if it is the program, row by row.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.language.earley import Chart, Choices, Rule, Symbol
from gecar.language.mapping import Mapper
from gecar.language.program import Program, parse_program

_TOKEN = re.compile(r"\d+\.?\d*|\.\d+|\w+|[<>=!]=|\S")
_NUMBER = re.compile(r"\d+\.?\d*|\.\d+")
_LEFT_OUT = {";", ":", "pass"}
_MOST_VALUES = 2_000


class Token(NamedTuple):
    """A word of a program, and its line."""

    word: str
    line: int = 0


def genome_of(mapper: Mapper, program: Program, codons: int, seed: int = 0) -> npt.NDArray[Any]:
    """Return a genome that derives a program.

    Parameters
    ----------
    mapper
        Grammar, and how codons are read.
    program
        What to derive.
    codons
        Length of the genome; behind those that the program needs they are random.
    seed
        Of these, and of which codon stands for a choice.

    Raises
    ------
    InputError
        If the grammar has no derivation for the program, or it takes more codons.
    """
    choices = choices_of(mapper, program)
    if len(choices) > codons:
        raise expected("program", f"one that takes {len(choices)} codons", f"at most {codons}; raise codons")
    rng, size = np.random.default_rng(seed), mapper.options.codon_size
    genome = rng.integers(0, size, codons, mapper.options.codon_type)
    for place, (choice, n) in enumerate(choices):
        genome[place] = choice + n * rng.integers((size - 1 - choice) // n + 1)
    return genome


def choices_of(mapper: Mapper, program: Program) -> list[tuple[int, int]]:
    """Return the choices of a leftmost derivation of a program, each with the number of choices there were.

    Raises
    ------
    InputError
        If there is none; the error names the line of the program up to which there is one.
    """
    grammar, table = mapper.grammar, _Table(mapper)
    furthest = 0
    for closed in (True, False):  # whether a negated comparison stands in parentheses
        tokens = _tokens_of(program, closed)
        chart = Chart(table.rules, [token.word for token in tokens])
        if chart.whole:
            choices = chart.choices()
            found = _derived(mapper, [choice for choice, _ in choices])
            if found is not None and found.canonical == program.canonical:
                return choices
        furthest = max(furthest, min(chart.reached, len(tokens) - 1))
    lines = program.source.splitlines()
    line = tokens[furthest].line if tokens else 0
    shown = f"line {line + 1}, '{lines[line].strip()}'" if lines else "an empty program"
    raise expected(f"program, {shown}", f"what {grammar.source} does not derive", "a program of the grammar")


def _derived(mapper: Mapper, choices: list[int]) -> Program | None:
    genome = np.array([choices or [0]], mapper.options.codon_type)
    return mapper.map(genome).program(0)


def _tokens_of(program: Program, closed: bool) -> list[Token]:
    """Cut a program into tokens: braces for indentation, and no parentheses around a whole condition."""
    tokens: list[Token] = []
    depth = 0
    for number, line in enumerate(program.source.splitlines()):
        indent = (len(line) - len(line.lstrip())) // 4
        tokens += [Token("}", number)] * (depth - indent)
        depth = indent
        words = _words(line)
        if line.endswith(":"):
            if words[0] in ("if", "while"):
                words = [words[0], *words[2:-1]]
            words.append("{")
            depth += 1
        tokens += [Token(word, number) for word in (_with_closed(words) if closed else words)]
    return tokens + [Token("}", tokens[-1].line)] * depth if tokens else tokens


def _with_closed(words: list[str]) -> list[str]:
    """Put what a ``not`` negates into parentheses: up to the next ``and``, ``or`` or end at its own depth."""
    for at in [k for k, word in enumerate(words) if word == "not"][::-1]:
        depth, end = 0, at + 1
        while end < len(words) and not (depth == 0 and words[end] in ("and", "or", ")", "{", ",")):
            depth += (words[end] == "(") - (words[end] == ")")
            end += 1
        if not _is_closed(words[at + 1 : end]):
            words = [*words[: at + 1], "(", *words[at + 1 : end], ")", *words[end:]]
    return words


def _is_closed(words: Sequence[Symbol]) -> bool:
    """Whether one pair of parentheses encloses all words."""
    depths = np.cumsum([(word == "(") - (word == ")") for word in words])
    return words[0] == "(" and bool((depths[:-1] > 0).all()) and int(depths[-1]) == 0


def _words(text: str) -> list[str]:
    """Cut a text into words; equal numbers are equal words."""
    words = (word for word in _TOKEN.findall(text) if word not in _LEFT_OUT)
    return [f"{float(word):.12g}" if _NUMBER.fullmatch(word) else word for word in words]


class _Table:
    """A grammar's rules over tokens; constant terms with nonterminals, such as ``(100+<num>)/2``, are worked out.

    Attributes
    ----------
    rules
        Of each nonterminal; those beyond the grammar's own stand for constant terms.
    """

    def __init__(self, mapper: Mapper) -> None:
        self.grammar, self.reads = mapper.grammar, mapper.tables.reads
        self.rules: list[list[Rule]] = [[] for _ in self.grammar.rules]
        self._texts: dict[int, dict[str, Choices] | None] = {}
        for number, rule in enumerate(self.grammar.rules):
            for choice, production in enumerate(rule.productions):
                symbols = self._with_constants(_symbols(production.parts))
                self.rules[number].append(Rule(symbols, self._choice(number, choice)))

    def _choice(self, nonterminal: int, choice: int) -> Choices:
        return ((choice, int(self.grammar.n_choices[nonterminal])),) if self.reads[nonterminal] else ()

    def _with_constants(self, symbols: list[Symbol]) -> tuple[Symbol, ...]:
        """Replace each constant term of several symbols by a nonterminal of its values."""
        done: list[Symbol] = []
        at = 0
        while at < len(symbols):
            end = self._end_of_constant(symbols, at)
            if end > at + 2 or (end > at + 1 and any(isinstance(s, int) for s in symbols[at:end])):
                self.rules.append(self._values(symbols[at:end]))
                done.append(len(self.rules) - 1)
                at = end
            else:
                done.append(symbols[at])
                at += 1
        return tuple(done)

    def _end_of_constant(self, symbols: list[Symbol], at: int) -> int:
        """Return where the longest constant term that begins here ends; here, if none does."""
        before = symbols[at - 1] if at else ","
        if isinstance(before, int) or before not in _BEFORE_TERM:
            return at
        end = at
        while end < len(symbols) and self._is_numeric(symbols[end]):
            end += 1
        for stop in range(end, at, -1):
            after = symbols[stop] if stop < len(symbols) else ","
            if isinstance(after, str) and after in _AFTER_TERM and _is_term(symbols[at:stop]):
                return stop
        return at

    def _is_numeric(self, symbol: Symbol) -> bool:
        if isinstance(symbol, str):
            return symbol in "+-*/()" or _NUMBER.fullmatch(symbol) is not None
        return self._written(symbol) is not None

    def _written(self, nonterminal: int) -> dict[str, Choices] | None:
        """Return all texts of a nonterminal that only writes numbers, with their choices; None for others."""
        if nonterminal not in self._texts:
            self._texts[nonterminal] = None  # where it leads to itself
            self._texts[nonterminal] = self._all_texts(nonterminal)
        return self._texts[nonterminal]

    def _all_texts(self, nonterminal: int) -> dict[str, Choices] | None:
        texts: dict[str, Choices] = {}
        for choice, production in enumerate(self.grammar.rules[nonterminal].productions):
            pieces = []
            for part in production.parts:
                known = self._written(part) if isinstance(part, int) else _number(part)
                if known is None:
                    return None
                pieces.append(known)
            own = self._choice(nonterminal, choice)
            for combined in product(*(piece.items() for piece in pieces)):
                text = "".join(word for word, _ in combined)
                texts.setdefault(text, own + tuple(c for _, choices in combined for c in choices))
                if len(texts) > _MOST_VALUES:
                    return None
        return texts

    def _values(self, symbols: list[Symbol]) -> list[Rule]:
        """Return a rule for every value of a constant term: its tokens, and the choices that lead to it."""
        pieces = [{s: ()} if isinstance(s, str) else self._written(s) or {} for s in symbols]
        rules: dict[tuple[str, ...], Rule] = {}
        for combined in product(*(piece.items() for piece in pieces)):
            text = "".join(word for word, _ in combined)
            words = tuple(_words(parse_program(f"r0 = {text}").source)[2:])
            rules.setdefault(words, Rule(words, tuple(c for _, choices in combined for c in choices)))
        return list(rules.values())


_BEFORE_TERM = frozenset({",", "(", ">", "<", ">=", "<=", "==", "!=", "=", "{", "}"})
_AFTER_TERM = frozenset({",", ")", "{", "}", "and", "or", ">", "<", ">=", "<=", "==", "!="})


def _symbols(parts: tuple[str | int, ...]) -> list[Symbol]:
    """Cut a production into words and nonterminals, without parentheses around a whole condition."""
    symbols = [symbol for part in parts for symbol in ([part] if isinstance(part, int) else _words(part))]
    for at in [k for k, symbol in enumerate(symbols) if symbol in ("if", "while")][::-1]:
        end = next((k for k in range(at, len(symbols)) if symbols[k] == "{"), at)
        if end > at and _is_closed(symbols[at + 1 : end]):
            symbols[at + 1 : end] = symbols[at + 2 : end - 1]
    return symbols


def _number(text: str) -> dict[str, Choices] | None:
    """Return a text that is part of a number; None for others."""
    return {text.strip(): ()} if re.fullmatch(r"\s*-?[\d.]*\s*", text) else None


def _is_term(symbols: list[Symbol]) -> bool:
    """Whether symbols are a whole term: parentheses that match, and operators between and before operands only."""
    depth, operand = 0, False
    before: Symbol = ""
    for symbol in symbols:
        if symbol in ("(", ")"):
            depth += 1 if symbol == "(" else -1
            if depth < 0 or (symbol == "(") == operand:
                return False
        elif isinstance(symbol, str) and symbol in "+-*/":
            if not operand and symbol != "-":
                return False
            operand = False
        elif before == ")":
            return False
        else:  # one operand behind the other: digits of one number
            operand = True
        before = symbol
    return depth == 0 and operand
