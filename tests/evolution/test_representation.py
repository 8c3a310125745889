"""Locality and redundancy of genomes."""

import numpy as np
import pytest

from gecar.errors import InputError
from gecar.evolution.representation import INVALID, TOO_LONG, _levenshtein, measure, random_genomes
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.structured import StructuredMapper
from gecar.plots.runs.representation import representation_figure, representation_title
from gecar.plots.style import is_whole


def levenshtein(one, other):
    """The textbook's table."""
    table = np.zeros((len(one) + 1, len(other) + 1), int)
    table[:, 0], table[0, :] = np.arange(len(one) + 1), np.arange(len(other) + 1)
    for i, a in enumerate(one, 1):
        for j, b in enumerate(other, 1):
            table[i, j] = min(table[i - 1, j] + 1, table[i, j - 1] + 1, table[i - 1, j - 1] + (a != b))
    return table[-1, -1]


def mapper_of(tmp_path, text, **options):
    (tmp_path / "g.bnf").write_text(text)
    return Mapper(load_grammar(str(tmp_path / "g.bnf")), MappingOptions(**options))


def test_a_codon_of_two_choices_is_neutral_as_often_as_its_other_values_choose_the_same(tmp_path):
    mapper = mapper_of(tmp_path, "<s> ::= a | b\n")
    found = measure(mapper, random_genomes(mapper, 5, 400), mutants=20_000)
    figures = found.figures()
    assert figures["neutral"] == pytest.approx(127 / 255, abs=0.015)
    assert figures["neutral"] + figures["one_word"] == pytest.approx(1.0)
    assert (figures["codons_used_median"], figures["phenotypes"], figures["entropy_bits"]) == (
        1.0, 2, pytest.approx(1.0, abs=0.01),
    )  # fmt: skip
    assert found.counts.sum() == 400


def test_distances_are_those_of_the_textbook(tmp_path):
    mapper = mapper_of(tmp_path, "<s> ::= x <s> | y <s> <s> | z | w\n")
    genomes = random_genomes(mapper, 9, 200, seed=4)
    found = measure(mapper, genomes, mutants=300, seed=9)
    seen = set(found.distances.tolist())
    assert INVALID in seen
    assert max(seen) > 3
    words = {"a": "xxyzwz", "b": "yxzwwzx"}
    numbers = {k: np.array([ord(c) for c in v], np.int32) for k, v in words.items()}
    begins = np.array([0, 6]), np.array([0, 7])
    (distance,) = _levenshtein(begins[0], numbers["a"], np.array([0]), begins[1], numbers["b"], 9)
    assert distance == levenshtein(words["a"], words["b"]) == 4
    assert _levenshtein(begins[0], numbers["a"], np.array([0]), begins[1], numbers["b"], 3)[0] == TOO_LONG


def test_genomes_of_any_length_and_codon_size_are_changed_within_themselves():
    mapper = Mapper(load_grammar("santa_fe"), MappingOptions(wraps=1, codon_size=1000, variable_length=True))
    genomes = random_genomes(mapper, 40, 100)
    genomes[:, 25:] = -1
    found = measure(mapper, genomes, mutants=500)
    assert found.figures()["neutral"] > 0.1
    assert 0.0 <= found.places.min() <= found.places.max() <= 1.0


def test_what_cannot_be_measured_is_said():
    grammar = load_grammar("santa_fe")
    with pytest.raises(InputError, match="StructuredMapper"):
        measure(StructuredMapper(grammar, gene=5, depth=4), np.zeros((3, 9), np.uint8))
    with pytest.raises(InputError, match="none"):
        measure(Mapper(grammar), np.zeros((0, 9), np.uint8))


def test_a_sample_without_a_phenotype_has_no_mutants_and_still_a_picture(tmp_path):
    mapper = mapper_of(tmp_path, "<s> ::= a <s> | b <s> | c\n")
    found = measure(mapper, np.zeros((20, 5), np.uint8))
    assert (found.figures()["valid"], found.figures()["mutants"]) == (0.0, 0)
    representation_figure({"random": found}, representation_title(found))


def test_the_picture_is_whole():
    mapper = Mapper(load_grammar("paper"))
    groups = {
        name: measure(mapper, random_genomes(mapper, 200, 100, seed), 200) for seed, name in enumerate("ab")
    }
    figure = representation_figure(groups, representation_title(groups["a"]), "a detail")
    assert is_whole(figure)
    assert "one word" in representation_title(groups["a"])


def test_commands_measure_and_draw(gecar, tmp_path):
    said = gecar(
        "grammar", "locality", "paper", "--count", 200, "--picture", tmp_path / "l.png", "--json"
    ).json
    assert said["mutants"] == 200
    assert 0.5 < said["one_word"] < 0.95
    assert (tmp_path / "l.png").stat().st_size > 10_000
    assert "neutral" in gecar("grammar", "locality", "table1", "--count", 100).out
    assert "--count" in gecar.error("grammar", "locality", "paper", "--count", 0)
    small = ("--population", 10, "--generations", 1, "--codons", 50, "--preset", "paper", "--no-pictures")
    gecar("evolve", *small, "--workers", 1, "--out", "run", "--quiet")
    drawn = gecar("plot", "run", "--locality", "l.pdf", "--json").json["pictures"]
    assert drawn == ["l.pdf"]
