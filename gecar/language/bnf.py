r"""Reading Backus-Naur form: a grammar's text to its rules, each with the place it was found.

A grammar file is read as PonyGE2 reads its own (Fenton et al. 2017, doi:10.1145/3067695.3082469)::

    <code> ::= <code><code> | <op>        # the first rule is the start; a comment runs to the end of the line
             | "if " <test> ":\n  " <op>  # alternatives may go on over several lines
    <op>   ::= motor(<num>, <num>, 100)
    <num>  ::= GE_RANGE:10                # 0 | 1 | ... | 9; or a name, GE_RANGE:dataset_n_vars
    <duty> ::= GE_RANGE:-100..100         # -100 | -99 | ... | 100, which PonyGE2 has not

- A nonterminal is ``<name>``: no blanks, ``<``, ``>`` or ``|`` within. A ``<`` that begins no name is text,
  so ``SensorValue<=<num>`` means what it seems to.
- Everything else is text. Blanks inside an alternative are part of it, blanks around it are not; a line end
  inside an alternative is one line end, without the blanks around it.
- Text in ``"..."`` or ``'...'`` keeps its blanks, and ``|``, ``#``, ``<`` in it are plain; ``""`` is the
  empty text.
- Everywhere, ``\n``, ``\t``, ``\r`` are control characters, a backslash takes the meaning from any other mark
  (``\|``, ``\<``, ``\#``, ``\"``, ``\\``), and a backslash at the end of a line joins it to the next.

Where PonyGE2 is silent, this reader is not: an empty alternative, a rule given twice or a quote that does
not end is an error. ``GE_GENERATE``, which evaluates code, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from gecar.errors import InputError, expected
from gecar.language.source_position import place

MAX_CHARACTERS = 100_000
MAX_ALTERNATIVES = 256  # a codon is 0..255: no codon could choose the 257th

_TOKEN = re.compile(
    r"""
      (?P<gap>[ \t]*(?:\#[^\n]*)?(?:\n\s*|\Z))    # a line end, its comment, blanks after
    | (?P<bar>\|)
    | (?P<head><[^<>|\s]+>\s*::=)
    | (?P<name><[^<>|\s]+>)
    | (?P<quoted>"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')
    | (?P<escape>\\\n[ \t]*|\\.)
    | (?P<text><|(?:[^|"'<\\\n\# \t]+|[ \t]+(?![ \t\#\n]|\Z))+)
    | (?P<open>["'])
    | (?P<stray>\\)
    """,
    re.VERBOSE | re.DOTALL,
)
_CONTROL = {"n": "\n", "t": "\t", "r": "\r", "\n": ""}  # the last joins two lines


@dataclass(frozen=True)
class Reference:
    """A nonterminal where an alternative uses it."""

    name: str
    offset: int


@dataclass
class Alternative:
    """One right-hand side: text and references in order, and where it begins."""

    offset: int
    parts: list[str | Reference]


@dataclass
class RawRule:
    """One rule as written, its references not yet looked up."""

    name: str
    offset: int
    alternatives: list[Alternative] = field(default_factory=list)


@dataclass(frozen=True)
class _Piece:
    """A stretch of an alternative; `plain` text gives up the blanks at the alternative's ends."""

    value: str | Reference
    plain: bool
    offset: int


def parse_rules(text: str, source: str, ranges: Mapping[str, int]) -> list[RawRule]:
    """Read a grammar's text.

    Parameters
    ----------
    text
        The grammar in Backus-Naur form, its line ends plain.
    source
        Its file's name, for errors.
    ranges
        What names after ``GE_RANGE:`` stand for.

    Returns
    -------
    list of RawRule
        In the order of the text; at least one.

    Raises
    ------
    InputError
        If the text is not a grammar; the message names line and column.
    """
    if len(text) > MAX_CHARACTERS:
        raise expected(source, f"{len(text)} characters", f"a grammar of at most {MAX_CHARACTERS}")
    return _Reader(text, source, ranges).read()


class _Reader:
    """One pass over the tokens; the current alternative grows in `pieces`."""

    def __init__(self, text: str, source: str, ranges: Mapping[str, int]) -> None:
        self.text = text
        self.source = source
        self.ranges = ranges
        self.rules: list[RawRule] = []
        self.seen: dict[str, int] = {}
        self.pieces: list[_Piece] = []

    def read(self) -> list[RawRule]:
        line_start = True
        for kind, token, offset in self.tokens():
            if kind == "head":
                self.begin_rule(token, offset, line_start)
            elif kind != "gap" and not self.rules:
                raise self.fault(offset, self.line_at(offset), "a rule: <name> ::= alternatives")
            elif kind == "bar":
                self.end_alternative(offset)
            else:
                self.add(kind, token, offset)
            line_start = kind == "gap"
        if not self.rules:
            raise expected(self.source, "no rules", "a grammar: <name> ::= alternatives")
        self.end_alternative(len(self.text))
        return self.rules

    def tokens(self) -> Iterator[tuple[str, str, int]]:
        start = len(self.text) - len(self.text.lstrip())
        for match in _TOKEN.finditer(self.text, start):
            if match.end() > match.start():
                yield str(match.lastgroup), match.group(), match.start()

    def begin_rule(self, token: str, offset: int, line_start: bool) -> None:
        name = token[: token.index(">") + 1]
        if not line_start:
            raise self.fault(offset, f"{name} ::= in the middle of a line", "every rule on a line of its own")
        if self.rules:
            self.end_alternative(offset)
        if name in self.seen:
            first = self.text.count("\n", 0, self.seen[name]) + 1
            raise self.fault(offset, f"a second rule for {name}", f"one (the first is in line {first})")
        self.seen[name] = offset
        self.rules.append(RawRule(name, offset))

    def add(self, kind: str, token: str, offset: int) -> None:
        if kind == "gap":
            self.end_line(offset)
        elif kind == "name":
            self.pieces.append(_Piece(Reference(token, offset), False, offset))
        elif kind == "quoted":
            self.pieces.append(_Piece(self.unescape(token[1:-1], offset + 1), False, offset))
        elif kind == "escape":
            self.pieces.append(_Piece(self.unescape(token, offset), False, offset))
        elif kind == "text":
            self.add_text(token, offset)
        elif kind == "open":
            wanted = f"{token}...{token}, or \\{token}"
            raise self.fault(offset, f"a {token} that is not closed in its line", wanted)
        else:
            raise self.fault(offset, "a backslash at the very end", "the character it stands before")

    def end_line(self, offset: int) -> None:
        line_end = self.pieces and self.pieces[-1].plain and self.pieces[-1].value == "\n"
        if self.pieces and not line_end:
            self.pieces.append(_Piece("\n", True, offset))

    def add_text(self, token: str, offset: int) -> None:
        if "::=" in token:
            wanted = 'a <name> before it on a new line, or "::=" in quotes'
            raise self.fault(offset + token.index("::="), "::= without a <name>", wanted)
        blanks = 0 if self.pieces else len(token) - len(token.lstrip())
        self.pieces.append(_Piece(token[blanks:], True, offset + blanks))

    def unescape(self, text: str, offset: int) -> str:
        def replace(match: re.Match[str]) -> str:
            mark: str = match[1][0]
            if mark.isalnum() and mark not in _CONTROL:
                wanted = "\\n, \\t, \\r, or a backslash before a mark"
                raise self.fault(offset + match.start(), f"\\{mark}", wanted)
            return _CONTROL.get(mark, mark)

        return re.sub(r"\\(\n[ \t]*|.)", replace, text, flags=re.DOTALL)

    def end_alternative(self, offset: int) -> None:
        pieces, self.pieces = self.pieces, []
        while pieces and pieces[0].plain and not str(pieces[0].value).strip():
            del pieces[0]
        while pieces and pieces[-1].plain and not str(pieces[-1].value).strip():
            del pieces[-1]
        if not pieces:
            wanted = 'text or a <name> between the |, or "" for the empty text'
            raise self.fault(offset, "an empty alternative", wanted)
        alternatives = self.rules[-1].alternatives
        alternatives.extend(self.ranged(pieces) or [Alternative(pieces[0].offset, _join(pieces))])
        if len(alternatives) > MAX_ALTERNATIVES:
            wanted = f"at most {MAX_ALTERNATIVES}, since a codon is 0..255"
            raise self.fault(
                pieces[0].offset, f"alternative {MAX_ALTERNATIVES + 1} of {self.rules[-1].name}", wanted
            )

    def ranged(self, pieces: list[_Piece]) -> list[Alternative]:
        """Spell out ``GE_RANGE:n`` and ``GE_RANGE:n..m``; nothing for any other alternative."""
        value, offset = pieces[0].value, pieces[0].offset
        if isinstance(value, Reference) or not pieces[0].plain:
            return []
        value = value.strip()
        if value.startswith("GE_GENERATE:"):
            wanted = "the alternatives themselves, or GE_RANGE"
            raise self.fault(offset, "GE_GENERATE, which runs code", wanted)
        if not value.startswith("GE_RANGE:"):
            return []
        name = value.removeprefix("GE_RANGE:").strip()
        ends = re.fullmatch(r"(-?[0-9]{1,9})\.\.(-?[0-9]{1,9})", name)
        if ends:
            numbers = range(int(ends[1]), int(ends[2]) + 1)
        else:
            numbers = range(int(name) if re.fullmatch(r"[0-9]{1,9}", name) else self.ranges.get(name, 0))
        if len(pieces) > 1 or not 1 <= len(numbers) <= MAX_ALTERNATIVES:
            known = "".join(f", {known}" for known in self.ranges)
            found = value if len(pieces) == 1 else f"{value} with more behind it"
            wanted = (
                f"GE_RANGE: and one of 1..{MAX_ALTERNATIVES}{known}, or the first and the last of as many numbers "
                "(-5..5), alone between the |"
            )
            raise self.fault(offset, found, wanted)
        return [Alternative(offset, [str(number)]) for number in numbers]

    def line_at(self, offset: int) -> str:
        line = self.text[offset : offset + 40].split("\n", 1)[0]
        return repr(line)

    def fault(self, offset: int, found: str, wanted: str) -> InputError:
        return expected(place(self.source, self.text, min(offset, len(self.text.rstrip()))), found, wanted)


def _join(pieces: list[_Piece]) -> list[str | Reference]:
    """Join neighbouring text, without the blanks at the end."""
    parts: list[str | Reference] = []
    last = len(pieces) - 1
    for k, piece in enumerate(pieces):
        value = piece.value
        if isinstance(value, str):
            value = value.rstrip() if piece.plain and k == last else value
            if parts and isinstance(parts[-1], str):
                parts[-1] += value
                continue
        if value:
            parts.append(value)
    return parts
