"""Grammar files: what is read, what is reported, and where."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gecar.errors import InputError
from gecar.language.grammar import Grammar, Production, load_grammar, parse_grammar


def alternatives(grammar: Grammar, k: int = 0) -> list[tuple[str | int, ...]]:
    return [production.parts for production in grammar.rules[k].productions]


def test_table_3_is_read_in_its_order() -> None:
    grammar = load_grammar("paper")
    assert grammar.nonterminals == ("<code>", "<op>", "<num>")
    assert alternatives(grammar, 0) == [
        (0, 0),
        (1,),
        ("if SensorValue>(100+", 2, ")/2{", 1, "} else{", 1, "}"),
    ]
    assert alternatives(grammar, 1) == [("motor(", 2, ", ", 2, ", 100+", 2, ")")]
    assert alternatives(grammar, 2) == [(str(number),) for number in range(-100, 101, 10)]


def test_table_1_is_read_in_its_order() -> None:
    grammar = load_grammar("table1")
    assert [grammar.shown(p.parts) for p in grammar.productions] == [
        *("<code><code>", "<op>", "<var>"),
        *("+", "-", "*", "/"),
        "x",
    ]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("<a> ::= x | y", [("x",), ("y",)]),
        ("<a> ::= x |\n  y\n  | z", [("x",), ("y",), ("z",)]),
        ("# head\n<a> ::= x # one\n | y # two\n\n# end", [("x",), ("y",)]),
        ("<a>::=x\r\n | y\r\n", [("x",), ("y",)]),
        ("\ufeff<a> ::= x", [("x",)]),
        ('<a> ::= " | # <a> "', [(" | # <a> ",)]),
        ("<a> ::= '\"' | \"'\"", [('"',), ("'",)]),
        ('<a> ::= "" | x', [(), ("x",)]),
        ('<a> ::= "if" <a> "x" | y', [("if ", 0, " x"), ("y",)]),
        ("<a> ::= (<a> + <a>) | y", [("(", 0, " + ", 0, ")"), ("y",)]),
        ("<a> ::= -<a>.<a> | y", [("-", 0, ".", 0), ("y",)]),
        ("<a> ::= v<=<a> | v < 3 > 2", [("v<=", 0), ("v < 3 > 2",)]),
        (r"<a> ::= \<a\> \| \# \" \\ \n\t", [('<a> | # " \\ \n\t',)]),
        ("<a> ::= one \\\n  two\n  three\n\n  four", [("one two\nthree\nfour",)]),
        ("<a> ::= x[GE_RANGE:2] | GE_RANGE:3 | 'GE_RANGE:3'", [("x[GE_RANGE:2]",), *"012", ("GE_RANGE:3",)]),
        ("<a> ::= GE_RANGE:dataset_n_vars", [*"01"]),
        ("<a> ::= GE_RANGE:-1..2", [("-1",), *"012"]),
    ],
)
def test_alternatives_are_read_as_ponyge2_does(text: str, wanted: list[tuple[str | int, ...]]) -> None:
    grammar = parse_grammar(text, ranges={"dataset_n_vars": 2})
    assert alternatives(grammar) == [tuple(parts) for parts in wanted]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "g.bnf: found no rules, expected a grammar: <name> ::="),
        ("# nothing\n", "g.bnf: found no rules"),
        ("code ::= x", "line 1, column 1: found 'code ::= x', expected a rule: <name> ::= "),
        ("<a> ::= x\nb ::= y", "line 2, column 3: found ::= without a <name>"),
        ("<a> ::= x <b> ::= y", "line 1, column 11: found <b> ::= in the middle of a line"),
        (
            "<a> ::= x\n<a> ::= y",
            "line 2, column 1: found a second rule for <a>, expected one (the first is in line 1)",
        ),
        ("<a> ::= x | | y", "line 1, column 13: found an empty alternative"),
        ("<a> ::= x |\n", "line 1, column 12: found an empty alternative"),
        ("<a> ::=\n<b> ::= x", "found an empty alternative"),
        ('<a> ::= "x\n | y', 'line 1, column 9: found a " that is not closed in its line'),
        ("<a> ::= \\q", "line 1, column 9: found \\q, expected"),
        ("<a> ::= x\\", "found a backslash at the very end"),
        ("<a> ::= x\n\n  | <b>", "line 3, column 5: found <b>, which no rule defines, expected one of <a>"),
        (
            "<a> ::= <b> | x\n<b> ::= <b>y | y<b>",
            "line 2: found <b>, whose every alternative leads to a nonterm",
        ),
        ("<a> ::= <a>", "line 1: found <a>, whose every alternative"),
        (
            "<a> ::= GE_RANGE:300",
            "line 1, column 9: found GE_RANGE:300, expected GE_RANGE: and one of 1..256",
        ),
        ("<a> ::= GE_RANGE:rows", "found GE_RANGE:rows, expected GE_RANGE: and one of 1..256, n_vars"),
        ("<a> ::= GE_RANGE:-200..200", "found GE_RANGE:-200..200, expected GE_RANGE: and one of 1..256"),
        ("<a> ::= GE_RANGE:2..1", "found GE_RANGE:2..1, expected GE_RANGE: and one of 1..256"),
        ("<a> ::= GE_RANGE:3 <a>", "found GE_RANGE:3 with more behind it"),
        ("<a> ::= GE_GENERATE:[]", "found GE_GENERATE, which runs code"),
        ("<a> ::= " + "|".join("x" * 257), "found alternative 257 of <a>, expected at most 256"),
        ("#" * 100_001, "found 100001 characters, expected a grammar of at most 100000"),
    ],
)
def test_a_bad_grammar_is_told_with_its_place(text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        parse_grammar(text, "g.bnf", {"n_vars": 2})
    assert str(error.value).startswith("g.bnf")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_what_cannot_be_reached_is_a_warning() -> None:
    grammar = parse_grammar("<a> ::= x\n<b> ::= <c>\n<c> ::= y", "g.bnf")
    assert grammar.warnings == (
        "g.bnf, line 2: <b> cannot be reached from <a>",
        "g.bnf, line 3: <c> cannot be reached from <a>",
    )


def test_depths_and_recursion_of_table_3() -> None:
    grammar = load_grammar("paper")
    assert grammar.minimum_depth.tolist() == [3, 2, 1]
    assert grammar.production_depth[:4].tolist() == [4, 3, 3, 2]
    assert grammar.recursive.tolist() == [True, False, False]
    assert np.flatnonzero(grammar.production_recursive).tolist() == [0]


def test_recursion_over_several_rules_is_seen() -> None:
    grammar = parse_grammar("<a> ::= <b> | x\n<b> ::= (<c>)\n<c> ::= <a> | <d>\n<d> ::= y")
    assert grammar.recursive.tolist() == [True, True, True, False]
    assert grammar.production_recursive.tolist() == [True, False, True, True, False, False]


def test_a_grammar_is_found_by_name_and_by_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.bnf").write_text("<a> ::= mine")
    Path("grammars").mkdir()
    Path("grammars/ours.bnf").write_text("<a> ::= ours")
    assert alternatives(load_grammar("mine.bnf")) == [("mine",)]
    assert alternatives(load_grammar("ours")) == alternatives(load_grammar("ours.bnf")) == [("ours",)]
    assert load_grammar("rich").start == "<code>"
    with pytest.raises(
        InputError,
        match=r"'none', expected a \.bnf file or one of fine, keijzer_6, memory, nested, ours, paper",
    ):
        load_grammar("none")
    with pytest.raises(InputError, match="directory"):
        load_grammar("grammars")


def test_blanks_without_end_take_no_time() -> None:
    assert alternatives(parse_grammar("<a> ::= x" + " " * 90_000 + "y"))[0][0] == "x" + " " * 90_000 + "y"


def test_a_long_chain_of_rules_is_checked_quickly() -> None:
    rules = [f"<n{k}> ::= <n{k + 1}> | <n{k + 1}><n0>" for k in range(299)]
    grammar = parse_grammar("\n".join([*rules, "<n299> ::= x"]))
    assert grammar.minimum_depth[0] == 300
    assert grammar.recursive.sum() == 299


@given(st.text(st.sampled_from("<>ab|:=\"'\\# \nGE_RANGE:3"), max_size=60))
@settings(deadline=None, max_examples=300)
def test_any_text_is_a_grammar_or_an_input_error(text: str) -> None:
    with suppress(InputError):
        assert parse_grammar("<a> ::= " + text).minimum_depth.min() >= 1


def quoted(part: str | int) -> str:
    if isinstance(part, int):
        return f"<n{part}>"
    return (
        '"' + part.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\r", "\\r") + '"'
    )


def merged(parts: list[str | int]) -> tuple[str | int, ...]:
    whole: list[str | int] = []
    for part in parts:
        if isinstance(part, str) and whole and isinstance(whole[-1], str):
            whole[-1] += part
        elif part != "":
            whole.append(part)
    return tuple(whole)


@given(st.lists(st.lists(st.text(max_size=5) | st.just(0), max_size=5), min_size=1, max_size=5))
@settings(deadline=None, max_examples=200)
def test_quoted_text_comes_back_letter_for_letter(written: list[list[str | int]]) -> None:
    text = "<n0> ::= " + "\n | ".join("".join(map(quoted, parts)) or '""' for parts in [*written, ["x"]])
    read = parse_grammar(text).rules[0].productions
    assert [Production(p.parts, 0) for p in read] == [Production(merged(p), 0) for p in [*written, ["x"]]]
