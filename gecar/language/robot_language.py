"""Whether what a grammar derives are robot programs, found out before a run and not in the middle of one."""

from __future__ import annotations

from gecar.errors import InputError, expected
from gecar.language.grammar import Grammar, Production
from gecar.language.program import parse_program

_MAX_PARTS = 20_000

Parts = tuple[str | int, ...]


def check_robot_language(grammar: Grammar) -> None:
    """Check that a grammar speaks the robot language.

    Every production that can be reached is put into the shallowest phenotype that has it, and that is read
    as a program. This finds every word out of place; a sum of two numbers that each alone is within bounds
    can still leave them, and such a phenotype is then invalid (`gecar.language.mapping.Mapped.program`).

    Raises
    ------
    InputError
        If one is not a program; the message names the grammar's file, the production and its line, and the
        phenotype.
    """
    contexts = _contexts(grammar)
    best = [min(rule.productions, key=lambda p: _depth(grammar, p)).parts for rule in grammar.rules]
    for k, rule in enumerate(grammar.rules):
        for production in rule.productions if k in contexts else ():
            before, after = contexts[k]
            _check(grammar, production, _written((*before, *production.parts, *after), best))


def _check(grammar: Grammar, production: Production, text: str | None) -> None:
    where = f"{grammar.source}, line {production.line}"
    shown = repr(grammar.shown(production.parts)[:60])
    if text is None:
        raise expected(where, f"{shown}, whose shallowest phenotype is endlessly long", "robot programs")
    try:
        parse_program(text, "phenotype")
    except InputError as error:
        found = f"{shown}, which gives {text[:200]!r} ({error})"
        raise expected(where, found, "alternatives that give robot programs") from None


def _contexts(grammar: Grammar) -> dict[int, tuple[Parts, Parts]]:
    """Find what stands before and after each nonterminal, for those that can be reached."""
    contexts: dict[int, tuple[Parts, Parts]] = {0: ((), ())}
    found = [0]
    for parent in found:  # grows while it is walked through: breadth first
        before, after = contexts[parent]
        for production in grammar.rules[parent].productions:
            for at, part in enumerate(production.parts):
                if isinstance(part, int) and part not in contexts:
                    contexts[part] = (before + production.parts[:at], production.parts[at + 1 :] + after)
                    found.append(part)
    return contexts


def _written(parts: Parts, best: list[Parts]) -> str | None:
    """Write parts, putting for each nonterminal what is best for it; None if that goes on and on."""
    written: list[str] = []
    waiting = list(reversed(parts))
    for _ in range(_MAX_PARTS):
        if not waiting:
            return "".join(written)
        part = waiting.pop()
        if isinstance(part, str):
            written.append(part)
        else:
            waiting.extend(reversed(best[part]))
    return None


def _depth(grammar: Grammar, production: Production) -> int:
    return max((int(grammar.minimum_depth[k]) for k in production.nonterminals), default=0)
