"""Ask and tell knows no robot: any grammar, any score."""

import math

import pytest

from gecar.errors import InputError
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.history import Totals, summary
from gecar.evolution.settings import EvolutionSettings
from gecar.language.grammar import parse_grammar
from gecar.language.mapping import Mapper

SUMS = Mapper(parse_grammar("<sum> ::= <sum> + <sum> | <sum> * <sum> | x | 1\n"))
SMALL = EvolutionSettings(
    population=60, generations=20, codons=60, initialisation="sensible", crossover="subtree", mutation="used_codon"
)  # fmt: skip
TARGET = [(x, x**3 + x + 1.0) for x in (-2.0, -0.5, 0.5, 1.0, 3.0)]


def value(text: str, x: float) -> float:
    return sum(
        math.prod(x if word.strip() == "x" else 1.0 for word in term.split("*")) for term in text.split("+")
    )


def evolved(seed: int) -> Evolution[str]:
    evolution: Evolution[str] = Evolution(SUMS, settings=SMALL, seed=seed)
    while not evolution.finished:
        texts = [candidate.program for candidate in evolution.ask()]
        evolution.tell([sum(abs(value(text, x) - y) for x, y in TARGET) for text in texts])
    return evolution


def test_a_formula_is_found_from_numbers_alone() -> None:
    evolution = evolved(seed=1)
    assert evolution.best.merit < 1e-9
    assert value(evolution.best.program, 7.0) == 351.0  # where it was never scored
    assert evolution.totals.simulated < evolution.totals.evaluations  # equal texts share a score


def test_equal_seeds_find_the_same() -> None:
    assert evolved(seed=2).genomes.tobytes() == evolved(seed=2).genomes.tobytes()


def test_lexicase_needs_cases() -> None:
    with pytest.raises(InputError, match="selection: found lexicase without cases"):
        Evolution(SUMS, settings=SMALL.model_copy(update={"selection": "lexicase"}))


def test_the_history_tells_size_depth_and_diversity() -> None:
    evolution = evolved(seed=1)
    for record in evolution.history:
        assert record.size >= 1.0
        assert record.depth >= 2.0 or record.size < 2.0
        assert 0.0 <= record.entropy <= math.log2(SMALL.population)
    mapped = SUMS.map([[2] * 60, [0, 2, 3] + [0] * 57])  # x, and x + 1
    scores = evolution.problem.failed(2)
    programs = [b"a", b"a", b"b", b"c"]
    record = summary(0, scores, programs, mapped, Totals(), 0.0)
    assert (record.size, record.depth, record.entropy) == (2.0, 1.5, 1.5)
