"""Deriving one genome step by step, for people: the paper's Table 2."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from gecar.language.grammar import Grammar


@dataclass(frozen=True)
class Step:
    """One line of the paper's Table 2.

    Attributes
    ----------
    codon, choices, chosen
        The codon (S_n), the number of productions (r_A) and the remainder (m); None where there was no
        choice.
    symbol
        The nonterminal replaced (A); empty in the first line, which only shows the start.
    selected
        What replaced it.
    form
        The whole after this step, leftmost nonterminal next.
    finished
        Whether no nonterminal is left.
    """

    codon: int | None
    choices: int | None
    chosen: int | None
    symbol: str
    selected: str
    form: str
    finished: bool


def derive(
    grammar: Grammar, reads: Sequence[bool], codons: Iterable[int], max_symbols: int
) -> Iterator[Step]:
    """Derive leftmost until nothing is left to replace, or codons or room run out.

    Parameters
    ----------
    grammar
        What the codons choose from.
    reads
        Whether choosing takes a codon (nonterminals,).
    codons
        In the order they are read.
    max_symbols
        Bound on the nonterminals replaced and waiting together.

    Yields
    ------
    Step
        First the start alone, then one for every nonterminal replaced.
    """
    codons = iter(codons)
    done, symbols = "", 1
    waiting: list[str | int] = [0]
    yield Step(None, None, None, "", "", grammar.start, False)
    while waiting:
        symbol = int(waiting.pop())  # text never stays on top
        rule = grammar.rules[symbol]
        codon = next(codons, None) if reads[symbol] else None
        chosen = None if codon is None else codon % len(rule.productions)
        production = rule.productions[chosen or 0]
        symbols += len(production.nonterminals)
        if (chosen is None and reads[symbol]) or symbols > max_symbols:
            return
        waiting += production.parts[::-1]
        while waiting and isinstance(text := waiting[-1], str):
            done += text
            waiting.pop()
        choices = None if chosen is None else len(rule.productions)
        form = done + grammar.shown(tuple(reversed(waiting)))
        yield Step(codon, choices, chosen, rule.name, grammar.shown(production.parts), form, not waiting)
