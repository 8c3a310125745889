"""The picture of a derivation tree: whole, readable, and true to the derivation."""

import numpy as np
import pytest

from gecar.language.grammar import load_grammar, parse_grammar
from gecar.language.mapping import Mapper
from gecar.plots.runs.derivation_tree import MAX_ROWS, _limbs, tree_of
from gecar.plots.style import is_whole

PAPER = Mapper(load_grammar("paper"))
DIGITS = Mapper(parse_grammar("<s> ::= motor(<n>, <n>)\n<n> ::= <d> | <d><n>\n<d> ::= 1 | 2 | 3"))


def words(figure):
    return [text.get_text().strip() for text in figure.axes[0].texts]


def leaves(mapper, codons):
    genome = np.array(codons)
    limbs, folded = _limbs(mapper.map(genome[None]).tree(0), mapper.grammar, genome)
    return [limb.words for limb in limbs if limb.words], folded


def grown(statements):
    """Codons of so many statements in the paper's grammar."""
    return [0] * (statements - 1) + [1, 17, 5, 9] * statements


def test_table_2_as_a_tree():
    shown = words(tree_of(Mapper(load_grammar("table1")), [3, 0, 2, 1, 2, 2]))
    assert [text for text in shown if text in ("x", "*")] == ["x", "*", "x"]
    assert {"3 mod 3 = 0", "1 mod 3 = 1 · 2 mod 4 = 2", "<code> › <var>"} <= set(shown)


def test_the_words_read_downwards_are_the_program():
    found, folded = leaves(PAPER, grown(12))
    assert "".join("".join(parts) for parts in found) == PAPER.map(np.array([grown(12)])).text(0)
    assert folded == 0


def test_a_number_of_several_digits_is_one_leaf():
    found, folded = leaves(DIGITS, [1, 0, 0, 1, 1, 1, 1, 1, 0, 2])
    assert found == [("motor(", "12", ", "), ("", "223", ")")]
    assert folded == 0


def test_what_is_too_much_to_read_is_folded():
    found, folded = leaves(PAPER, grown(300))
    assert len(found) <= MAX_ROWS
    assert folded > 0
    assert any(own.endswith("…") for _, own, _ in found)


@pytest.mark.parametrize("statements", [1, 12, 60])
def test_a_tree_is_within_its_edges(statements):
    assert is_whole(tree_of(PAPER, grown(statements)))
