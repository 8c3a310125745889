"""Genomes to derivations: the paper's example, the options, the bounds, and the trees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gecar.errors import InputError
from gecar.language import derivation
from gecar.language.grammar import Grammar, load_grammar, parse_grammar
from gecar.language.mapping import Mapped, Mapper, MappingOptions
from gecar.language.structured import StructuredMapper

SMALL = MappingOptions(max_symbols=500)


@st.composite
def grammars(draw: st.DrawFn) -> Grammar:
    """Any small grammar whose nonterminals can all end."""
    n = draw(st.integers(1, 4))
    part = st.sampled_from(["x", "y z", "", *(f"<n{k}>" for k in range(n))])
    alternative = st.lists(part, max_size=4).map(lambda parts: "".join(parts).strip() or '""')
    rules = [draw(st.lists(alternative, max_size=4)) for _ in range(n)]
    ends = [["end"] if draw(st.booleans()) or k == n - 1 else [f"<n{k + 1}>"] for k in range(n)]
    text = [
        f"<n{k}> ::= " + " | ".join(rule + end) for k, (rule, end) in enumerate(zip(rules, ends, strict=True))
    ]
    return parse_grammar("\n".join(text))


def genomes(codons: int = 30) -> st.SearchStrategy[list[list[int]]]:
    genome = st.lists(st.integers(0, 255), min_size=codons, max_size=codons)
    return st.lists(genome, min_size=1, max_size=6)


def map_one(grammar: Grammar, genome: list[int], options: MappingOptions | None = None) -> Mapped:
    return Mapper(grammar, options).map([genome])


def test_the_paper_s_genome_302122_gives_x_times_x() -> None:
    mapped = map_one(load_grammar("table1"), [3, 0, 2, 1, 2, 2])
    assert mapped.text(0) == "x*x"
    assert mapped.used.tolist() == [6]
    assert list(mapped.key(0)) == [0, 0, 2, 1, 2, 2]


def test_derive_gives_table_2_line_by_line() -> None:
    steps = Mapper(load_grammar("table1")).derive([3, 0, 2, 1, 2, 2])
    assert [(s.codon, s.choices, s.chosen, s.symbol, s.selected, s.form) for s in steps] == [
        (None, None, None, "", "", "<code>"),
        (3, 3, 0, "<code>", "<code><code>", "<code><code>"),
        (0, 3, 0, "<code>", "<code><code>", "<code><code><code>"),
        (2, 3, 2, "<code>", "<var>", "<var><code><code>"),
        (None, None, None, "<var>", "x", "x<code><code>"),
        (1, 3, 1, "<code>", "<op>", "x<op><code>"),
        (2, 4, 2, "<op>", "*", "x*<code>"),
        (2, 3, 2, "<code>", "<var>", "x*<var>"),
        (None, None, None, "<var>", "x", "x*x"),
    ]


def test_a_single_choice_reads_a_codon_only_on_request() -> None:
    options = MappingOptions(single_choice_consumes=True)
    mapped = map_one(load_grammar("table1"), [3, 0, 2, 9, 1, 2, 2, 9], options)
    assert mapped.text(0) == "x*x"
    assert mapped.used.tolist() == [8]


def test_codons_that_run_out_make_the_genome_invalid() -> None:
    mapped = map_one(load_grammar("table1"), [3, 0, 2, 1, 2])
    assert not mapped.valid[0]
    assert mapped.used.tolist() == [5]
    assert mapped.key(0) == b""
    assert mapped.program(0) is None
    assert mapped.tree(0) == ()
    with pytest.raises(InputError, match="genome 0: found a derivation that does not finish"):
        mapped.text(0)


@pytest.mark.parametrize(("wraps", "valid"), [(0, False), (1, False), (2, True), (3, True)])
def test_wrapping_reads_the_genome_again(wraps: int, valid: bool) -> None:
    mapped = map_one(load_grammar("table1"), [0, 1], MappingOptions(wraps=wraps))  # reads 0 1 0 1 0
    assert mapped.valid.tolist() == [valid]
    assert mapped.used.tolist() == [5 if valid else 2 * (wraps + 1)]
    assert not valid or mapped.text(0) == "++"


@pytest.mark.parametrize(
    "text",
    [
        "<a> ::= <a><a> | x",
        "<a> ::= <a>x | x",
        "<a> ::= <b><b> | x\n<b> ::= <c><c>\n<c> ::= <d><d>\n<d> ::= <a><a>",
        "<a> ::= <b> | x\n"
        + "\n".join(
            f"<{x}> ::= <{y}><{y}>" for x, y in zip("bcdefghijklm", "cdefghijklmb"[:11] + "n", strict=True)
        )
        + "\n<n> ::= x",
    ],
)
def test_runaway_derivations_are_bounded(text: str) -> None:
    options = MappingOptions(wraps=1_000_000, max_symbols=3_000)
    mapped = Mapper(parse_grammar(text), options).map(np.zeros((50, 1000), np.uint8))
    assert not mapped.valid.any()
    assert mapped.used.max() <= 3_000


def test_a_genome_without_codons_maps_where_nothing_is_chosen() -> None:
    nothing = np.zeros((2, 0), np.uint8)
    assert Mapper(parse_grammar("<a> ::= <b>y\n<b> ::= x")).map(nothing).text(1) == "xy"
    assert not Mapper(load_grammar("paper")).map(nothing).valid.any()
    assert len(Mapper(load_grammar("paper")).map(np.zeros((0, 9), np.uint8))) == 0


@pytest.mark.parametrize(
    ("codons", "message"),
    [
        ([1, 2], "found an array of shape (2,)"),
        ([[1, 256]], "found int64 codons, not all 0..255"),
        ([[1, -1]], "found int64 codons, not all 0..255"),
        ([[1.0, 2.0]], "found float64 codons"),
        ([[1, 2], [1]], "found rows of different length"),
        ([["a"]], "expected whole numbers 0..255"),
    ],
)
def test_what_are_no_genomes_is_told(codons: object, message: str) -> None:
    with pytest.raises(InputError) as error:
        Mapper(load_grammar("paper")).map(codons)
    assert message in str(error.value)


@pytest.mark.parametrize("option", [{"wraps": -1}, {"max_symbols": 0}, {"max_symbols": 10**9}])
def test_options_out_of_bounds_are_told(option: dict[str, int]) -> None:
    with pytest.raises(InputError, match=next(iter(option))):
        MappingOptions(**option)


def test_every_kind_of_array_uses_the_same_compiled_code() -> None:
    codons = np.random.default_rng(1).integers(0, 256, (40, 60), dtype=np.uint8)
    frozen = codons.copy()
    frozen.setflags(write=False)
    mapper = Mapper(load_grammar("paper"))
    keys = [
        mapper.map(g).choices.tobytes()
        for g in (codons, frozen, codons.astype(np.int64), np.asfortranarray(codons))
    ]
    assert len(set(keys)) == 1
    compiled_for = [str(kinds[0]) for kinds in derivation.derive_all.signatures]  # type: ignore[attr-defined]
    assert sum("uint8" in kind for kind in compiled_for) == 1


def test_choices_outgrowing_their_first_room_are_kept() -> None:
    codons = np.tile(np.array([0, 1, 5, 6, 7], np.uint8), 40)
    codons[195:] = [1, 5, 6, 7, 0]
    mapped = Mapper(load_grammar("paper")).map(np.tile(codons, (300, 1)))
    assert mapped.valid.all()
    assert {mapped.key(i) for i in range(300)} == {mapped.key(0)}
    assert len(mapped.key(0)) == 199


@given(grammars(), genomes(), st.booleans(), st.integers(0, 2))
@settings(deadline=None, max_examples=150)
def test_the_kernel_derives_what_the_steps_show(
    grammar: Grammar, codons: list[list[int]], single: bool, wraps: int
) -> None:
    mapper = Mapper(grammar, MappingOptions(wraps, single, max_symbols=500))
    mapped = mapper.map(codons)
    for i, genome in enumerate(codons):
        steps = list(mapper.derive(genome))
        assert steps[-1].finished == mapped.valid[i]
        if mapped.valid[i]:
            assert steps[-1].form == mapped.text(i)
            assert [s.chosen for s in steps if s.chosen is not None] == list(mapped.key(i))
            assert len(mapped.key(i)) == mapped.used[i]


@given(grammars(), genomes(), st.booleans())
@settings(deadline=None, max_examples=100)
def test_trees_hold_the_text_and_the_codons(grammar: Grammar, codons: list[list[int]], single: bool) -> None:
    mapped = Mapper(grammar, MappingOptions(0, single, max_symbols=500)).map(codons)
    for i in np.flatnonzero(mapped.valid).tolist():
        tree = mapped.tree(i)
        texts: dict[int, str] = {}
        for k in range(len(tree) - 1, -1, -1):
            texts[k] = "".join(part if isinstance(part, str) else texts[part] for part in tree[k].parts)
        assert texts[0] == mapped.text(i)
        assert [n.codon for n in tree if n.codon is not None] == list(range(mapped.used[i]))
        assert mapped.nodes.end[mapped.nodes.offsets[i]] == mapped.used[i]


@given(grammars(), genomes(), st.data())
@settings(deadline=None, max_examples=100)
def test_subtrees_of_one_symbol_can_be_exchanged(
    grammar: Grammar, codons: list[list[int]], data: st.DataObject
) -> None:
    mapper = Mapper(grammar, SMALL)
    mapped = mapper.map(codons)
    trees = [i for i in np.flatnonzero(mapped.valid) if mapped.used[i]]
    if not trees:
        return
    a, b = data.draw(st.sampled_from(trees)), data.draw(st.sampled_from(trees))
    at = data.draw(st.integers(0, int(mapped.used[a]) - 1))
    symbols = mapped.symbols[mapped.offsets[b] : mapped.offsets[b + 1]]
    same = np.flatnonzero(symbols == mapped.symbols[mapped.offsets[a] + at])
    if not same.size:
        return
    by = int(data.draw(st.sampled_from(same.tolist())))
    end_a, end_b = mapped.subtree_ends[mapped.offsets[a] + at], mapped.subtree_ends[mapped.offsets[b] + by]
    child = [*codons[a][:at], *codons[b][by:end_b], *codons[a][end_a : mapped.used[a]]]
    assert mapper.map([child]).used.tolist() == [len(child)]


def test_paper_phenotypes_are_programs() -> None:
    codons = np.random.default_rng(7).integers(0, 256, (200, 1000), dtype=np.uint8)
    mapped = Mapper(load_grammar("paper")).map(codons)
    assert mapped.valid.all()
    program = mapped.program(0)
    assert program is not None
    assert program.source.startswith(("motor(", "if(SensorValue > "))
    assert all(mapped.program(i) is not None for i in range(200))


def test_a_phenotype_that_is_no_program_is_none() -> None:
    assert map_one(load_grammar("table1"), [3, 0, 2, 1, 2, 2]).program(0) is None


def test_depths_count_nonterminals_from_the_start_down():
    mapper = Mapper(load_grammar("nested"))
    mapped = mapper.map(np.random.default_rng(2).integers(0, 256, (30, 200), np.uint8))
    assert not mapped.depths[~mapped.valid].any()
    for i in np.flatnonzero(mapped.valid):
        tree = mapped.tree(int(i))
        depth = [1] * len(tree)
        for node, each in enumerate(tree):
            for child in (part for part in each.parts if isinstance(part, int)):
                depth[child] = depth[node] + 1
        assert mapped.depths[i] == max(depth)


def test_genes_of_a_structured_genome_have_depths_too():
    mapper = StructuredMapper(load_grammar("santa_fe"), gene=10, depth=6)
    mapped = mapper.map(np.random.default_rng(2).integers(0, 256, (10, mapper.codons), np.uint8))
    assert mapped.valid.any()
    assert (mapped.depths[mapped.valid] >= 3).all()
