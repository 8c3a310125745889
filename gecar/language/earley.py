"""Earley's parser (Communications of the ACM 13(2), 1970): the derivation of words in any context-free grammar."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

Symbol = str | int
"""A word, or the number of a nonterminal."""


Choices = tuple[tuple[int, int], ...]
"""Choices, each with the number of choices there were."""


class Rule(NamedTuple):
    """One alternative: what it consists of, and the choices it takes, those of the nonterminals below apart."""

    symbols: tuple[Symbol, ...]
    choices: Choices


_Item = tuple[int, int, int, int]
"""A nonterminal, its rule, how many of the rule's symbols are found, and the word where it begins."""


_Origin = tuple[_Item, int, _Item | None]


class Chart:
    """What a grammar derives of a list of words; parentheses of the grammar may be missing among the words.

    Parameters
    ----------
    rules
        Of each nonterminal; the first one is the start.
    words
        What to derive.

    Attributes
    ----------
    reached
        Words up to which there is a derivation.
    """

    def __init__(self, rules: Sequence[Sequence[Rule]], words: Sequence[str]) -> None:
        self._rules, self._words = rules, words
        # Where each item comes from: the item before and its place, and the finished item that took it a symbol on.
        self._sets: list[dict[_Item, _Origin | None]] = [{} for _ in range(len(words) + 1)]
        self._waiting: list[dict[int, list[_Item]]] = [{} for _ in self._sets]
        self._sets[0] = {(0, rule, 0, 0): None for rule in range(len(self._rules[0]))}
        self.reached = 0
        for at in range(len(self._sets)):
            if self._sets[at]:
                self.reached = at
                self._fill(at)

    @property
    def whole(self) -> bool:
        """Whether the start derives all words."""
        return self._end is not None

    @property
    def _end(self) -> _Item | None:
        ends = ((0, rule, len(each.symbols), 0) for rule, each in enumerate(self._rules[0]))
        return next((end for end in ends if end in self._sets[-1]), None)

    def choices(self) -> list[tuple[int, int]]:
        """Return the choices of the derivation found first, leftmost first."""
        found: list[tuple[int, int]] = []
        end = self._end
        waiting = [] if end is None else [(end, len(self._words))]
        while waiting:
            item, at = waiting.pop()
            found += self._rules[item[0]][item[1]].choices
            waiting += self._children(item, at)
        return found

    def _children(self, item: _Item, at: int) -> list[tuple[_Item, int]]:
        """Return the finished items of a finished item's nonterminals and where they end, the last first."""
        children = []
        while (origin := self._sets[at][item]) is not None:
            item, before, child = origin
            if child is not None:
                children.append((child, at))
            at = before
        return children

    def _fill(self, at: int) -> None:
        """Take every item at a place on as far as it goes there."""
        finished: dict[int, _Item] = {}  # nonterminals that derive nothing at all
        work = list(self._sets[at])
        for item in work:  # which grows
            number, rule, dot, begin = item
            symbols = self._rules[number][rule].symbols
            if dot == len(symbols):
                if begin == at:
                    finished.setdefault(number, item)
                for parent in list(self._waiting[begin].get(number, ())):
                    self._add(at, _next(parent), (parent, begin, item), work)
            elif isinstance(symbol := symbols[dot], str):
                if at < len(self._words) and self._words[at] == symbol:
                    self._sets[at + 1].setdefault(_next(item), (item, at, None))
                if symbol in "()":
                    self._add(at, _next(item), (item, at, None), work)
            else:
                self._predict(at, symbol, item, work)
                if symbol in finished:
                    self._add(at, _next(item), (item, at, finished[symbol]), work)

    def _predict(self, at: int, symbol: int, item: _Item, work: list[_Item]) -> None:
        if symbol not in self._waiting[at]:
            self._waiting[at][symbol] = []
            for rule in range(len(self._rules[symbol])):
                self._add(at, (symbol, rule, 0, at), None, work)
        self._waiting[at][symbol].append(item)

    def _add(self, at: int, item: _Item, origin: _Origin | None, work: list[_Item]) -> None:
        if item not in self._sets[at]:
            self._sets[at][item] = origin
            work.append(item)


def _next(item: _Item) -> _Item:
    number, rule, dot, begin = item
    return number, rule, dot + 1, begin
