"""Laws as the language of physics writes them (``grammars/physics.bnf``), and as terms of a robot."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from gecar.errors import InputError
from gecar.language.grammar import Grammar, load_grammar
from gecar.world.ports import N_TERMS
from gecar.world.terms import POINT, Term

Laws = tuple[Term, ...]
"""Laws that belong together: at one port, or at two for a force or an error that has two axes."""

SHIPPED = "physics"
SINGLE = 5  # most choices of laws that are tried one by one
_KEPT = 32768  # sentences, and keys of laws, that are not worked out anew
_SHORT = 30  # choices within which every alternative must come to an end
_FREE = re.compile(r"\bc\b")
_LINEAR = re.compile(r"\bc\d+\b")
_ONE = re.compile(r" \* 1(?![\d.])")
_EACH = "side: each"
_AXIS = re.compile(r"\b(?:[xy]|sin\(heading|cos\(heading)\b")
_OTHER_AXIS = {"x": "y", "y": "x", "cos(heading": "sin(heading", "sin(heading": "cos(heading"}
_PLUS = re.compile(r" \+ (?=c\d*\b)")


def physics_grammar(file: str = SHIPPED) -> Grammar:
    """Load a language of laws, and check one that is not the shipped one by reading all of its short sentences.

    Raises
    ------
    InputError
        If there is no such grammar, or a sentence of it is no law.
    """
    grammar = load_grammar(file)
    if file == SHIPPED:  # tests read its sentences: it takes seconds, and not every discovery needs a law
        return grammar
    for number in range(len(grammar.rules[0].productions)):
        for sentence in sentences(_only(grammar, [number]), SINGLE):
            try:
                read_sentence(sentence)
            except ValueError as fault:
                found = str(fault).partition("Value error, ")[2].partition(" [type=")[0] or str(fault)
                raise InputError(f"{grammar.source}: '{sentence}' is no law: {found}") from None
    return grammar


@lru_cache(maxsize=_KEPT)
def read_sentence(sentence: str) -> Laws:
    """Read a sentence ``port: formula; store: formula; store_s: seconds; at: x y`` as terms whose constants are 1.

    Two ports, ``force_x and force_y: formula``, make two terms; in the second one's formula x and y change places, and
    the sine and the cosine of the heading. So does ``side: each``, one for either wheel.

    Raises
    ------
    ValueError
        If it is none.
    """
    first, *others = (part.strip() for part in sentence.split(";"))
    names, _, law = first.partition(":")
    ports = [name.strip() for name in names.split(" and ")]
    law = _ONE.sub("", law.strip())
    laws = [law, _AXIS.sub(lambda found: _OTHER_AXIS[found[0]], law)][: len(ports)]
    if _EACH in others:
        rest = [other for other in others if other != _EACH]
        return tuple(_read(ports[0], law, [*rest, f"side: {side}"]) for side in ("left", "right"))
    return tuple(_read(port, each, others) for port, each in zip(ports, laws, strict=True))


def _read(port: str, law: str, others: Sequence[str]) -> Term:
    free = (f"c{n}" for n in range(1, 100))
    table: dict[str, Any] = {"port": port, "law": _FREE.sub(lambda _: next(free), law)}
    table |= dict.fromkeys(sorted(set(_LINEAR.findall(table["law"]))), 1.0)
    for other in others:
        name, _, value = (part.strip() for part in other.partition(":"))
        if name == "at":
            table |= dict(zip(POINT, map(float, value.split()), strict=True))
        elif name in ("store", "store_s", "side"):
            table[name] = float(value) if name == "store_s" else value
        else:
            raise ValueError(f"found '{name}', expected store, store_s, at or side")
    return Term(**table)


def linear(term: Term) -> list[str]:
    """Return the names of a law's linear constants: those that stand for ``c`` in the language."""
    return [name for name in term.constants if _LINEAR.fullmatch(name)]


@lru_cache(maxsize=_KEPT)
def pieces(term: Term) -> tuple[Term, ...]:
    """Return the parts of a law's sum, each as a term of its own, with its one linear constant."""
    laws = _PLUS.split(term.law)
    return tuple(_with_law(term, law, term.constants) for law in laws) if len(laws) > 1 else (term,)


def parts_of(laws: Laws) -> list[Term]:
    """Return the parts of all sums, each as a term of its own."""
    return [part for term in laws for part in pieces(term)]


def shortened(laws: Laws) -> list[Laws]:
    """Return laws without one of their parts, each in turn; none of a law of one part."""
    of_each = [pieces(term) for term in laws]
    out = []
    for k, parts in enumerate(of_each):
        for part in range(len(parts)):
            rest = [*parts[:part], *parts[part + 1 :]]
            left = [joined(some) for some in (*of_each[:k], rest, *of_each[k + 1 :]) if some]
            out += [tuple(left)] if left else []
    return out


def joined(parts: Sequence[Term]) -> Term:
    """Return parts of one port, side and store as one sum, their constants numbered anew."""
    laws, constants = [], dict[str, float]()
    for part in parts:
        law, own = part.law, re.findall(r"\b[ck]\d+\b", part.law)
        names = {name: _next_name(name[0], constants, own) for name in dict.fromkeys(own)}
        for name, fresh in names.items():
            law = re.sub(rf"\b{name}\b", f"<{fresh}>", law)
        constants |= {fresh: part.constants[name] for name, fresh in names.items()}
        constants |= {name: value for name, value in part.constants.items() if name not in names}
        laws.append(law.replace("<", "").replace(">", ""))
    return _with_law(parts[0], " + ".join(laws), constants)


def _next_name(letter: str, taken: dict[str, float], own: Sequence[str]) -> str:
    names = (f"{letter}{n}" for n in range(1, 100))
    fresh = next(name for name in names if name not in taken)
    taken[fresh] = float(len(own))  # kept free until its value is set
    return fresh


def _with_law(term: Term, law: str, constants: dict[str, float]) -> Term:
    """Return a term with another law, and of these constants those that it has."""
    used = re.findall(r"[a-z_]\w*", f"{law} {term.store}") + list(POINT)
    own = {name: value for name, value in constants.items() if name in used}
    return Term(**{**term.model_dump(include={"port", "side", "store", "store_s"}), "law": law, **own})


def complexity(laws: Laws) -> int:
    """Return how many tokens and free constants laws have: the length of their description."""
    return sum(
        len(t.parsed.tokens) + len(t.free) + 2 * bool(t.store) + 2 * ("at_x" in t.constants) for t in laws
    )


@lru_cache(maxsize=_KEPT)
def key(laws: Laws) -> str:
    """Return what is equal for laws that differ in linear constants, or in the order of their parts, alone."""
    return " & ".join(sorted(map(_key, parts_of(laws))))


def _key(part: Term) -> str:
    inner = {name: value for name, value in part.constants.items() if name not in linear(part)}
    formula = _LINEAR.sub("c", part.law)
    for name, value in inner.items():
        formula = re.sub(rf"\b{name}\b", f"{value:.6g}", formula)
    point = [inner.get(name) for name in POINT]
    return f"{part.port} {part.side} {' * '.join(sorted(formula.split(' * ')))} {part.store} {part.store_s} {point}"


def variables_of(laws: Laws) -> set[str]:
    """Return the variables that laws use; a law of a single wheel uses the side."""
    sides = {"side" for term in laws if term.side != "both"}
    return sides.union(*(term.parsed.variables for term in laws))


def single_laws(grammar: Grammar) -> list[Laws]:
    """Return all short laws of one part, each once; a law for each wheel may have two parts on either."""
    read = (read_sentence(sentence) for sentence in sentences(grammar, SINGLE))
    return list({key(laws): laws for laws in read if _is_single(laws)}.values())


def _is_single(laws: Laws) -> bool:
    of_each_wheel = len(laws) == 2 and laws[0].side != laws[1].side
    return all(len(linear(term)) == 1 or of_each_wheel for term in laws)


def sentences(grammar: Grammar, most: int) -> Iterator[str]:
    """Yield all sentences of at most so many choices, each once."""
    return iter(dict.fromkeys(_expanded(grammar, (0,), most)))


def _expanded(grammar: Grammar, parts: Sequence[str | int], left: int) -> Iterator[str]:
    """Yield the texts that parts can become with so many choices."""
    for at, part in enumerate(parts):
        if isinstance(part, int):
            before, after = "".join(str(each) for each in parts[:at]), parts[at + 1 :]
            if left < 1 + sum(isinstance(each, int) for each in after):
                return
            for production in grammar.rules[part].productions:
                for rest in _expanded(grammar, (*production.parts, *after), left - 1):
                    yield before + rest
            return
    yield "".join(str(part) for part in parts)


def at_ports(grammar: Grammar, ports: Sequence[str], most: int = N_TERMS) -> Grammar | None:
    """Return a grammar without the laws that act at other ports, or at too many at once; None if no law is left."""
    numbers = [k for k, names in enumerate(_ports_of(grammar)) if len(names) <= most and names <= set(ports)]
    return _only(grammar, numbers) if numbers else None


def elsewhere(grammar: Grammar, ports: Sequence[str]) -> Grammar | None:
    """Return a grammar of laws at all ports but some; None if it has none there."""
    numbers = [k for k, names in enumerate(_ports_of(grammar)) if not names & set(ports)]
    return _only(grammar, numbers) if numbers else None


def looking_at(grammar: Grammar, variables: frozenset[str]) -> Grammar | None:
    """Return the part of a grammar whose first laws use any of some variables; None if there is none."""
    numbers = [k for k, law in enumerate(_firsts(grammar)) if variables & variables_of(read_sentence(law))]
    return _only(grammar, numbers) if numbers else None


def _ports_of(grammar: Grammar) -> list[set[str]]:
    """Return the ports of each of the start's alternatives."""
    return [{name.strip() for name in first.partition(":")[0].split(" and ")} for first in _firsts(grammar)]


def _firsts(grammar: Grammar) -> list[str]:
    """Return the first short sentence of each of the start's alternatives."""
    return [_first(grammar, number) for number in range(len(grammar.rules[0].productions))]


def _first(grammar: Grammar, number: int) -> str:
    """Return the first short sentence of one of the start's alternatives."""
    return next(_expanded(_only(grammar, [number]), (0,), _SHORT), "")


def _only(grammar: Grammar, numbers: Sequence[int]) -> Grammar:
    """Return a grammar with some of the start's alternatives alone."""
    start = grammar.rules[0]
    kept = replace(start, productions=tuple(start.productions[number] for number in numbers))
    return replace(grammar, rules=(kept, *grammar.rules[1:]))
