"""The operators one by one: what they change, how often, and what they must leave alone."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.searching import MAPPER, SMALL

from gecar.evolution.crossover import OnePoint, Subtree, VariableOnePoint
from gecar.evolution.mutation import Creep, Duplicate, Flip
from gecar.evolution.operators import Operators
from gecar.evolution.selection import deviations, lexicase, tournament
from gecar.language.grammar import parse_grammar
from gecar.language.mapping import Mapper
from gecar.random_streams import spawn
from gecar.search.programs import segment_times

RICH = Mapper(parse_grammar("<a> ::= <a><a> | <n>\n<n> ::= 3 | 1 | 2"))


def random_genomes(n: int, codons: int = 1_000, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (n, codons), dtype=np.uint8)


def test_a_stream_depends_on_nothing_but_seed_generation_attempt_and_place() -> None:
    assert np.array_equal(spawn(1, 2, 0, 5), spawn(1, 2, 0, 50)[:5])
    words = {
        int(spawn(*key, 1)["stream"][0])
        for key in ((1, 2, 0), (1, 2, 1), (1, 3, 0), (2, 2, 0), (2**40, 2, 0))
    }
    assert len(words) == 5


@pytest.mark.parametrize("rate", [0.03, 0.05, 0.07])
def test_mutation_draws_each_codon_anew_at_its_rate(rate: float) -> None:
    before = random_genomes(200)
    after = Flip(rate)(before.copy(), MAPPER, spawn(1, 1, 0, 200))
    expected = rate * 255 / 256  # a new codon may equal the old
    deviation = np.sqrt(expected * (1 - expected) / before.size)
    assert abs(np.mean(after != before) - expected) < 4 * deviation
    assert np.bincount(after[after != before], minlength=256).min() > 0


def test_mutation_within_used_codons_leaves_the_others_alone() -> None:
    before = random_genomes(50)
    used = MAPPER.map(before).used
    after = Flip(1.0, within_used=True)(before.copy(), MAPPER, spawn(1, 1, 0, 50))
    changed = after != before
    assert all(not changed[i, used[i] :].any() for i in range(50))
    assert sum(changed[i, : used[i]].sum() for i in range(50)) > 0.98 * used.sum()


@pytest.mark.parametrize("rate", [0.4, 0.5, 0.7])
def test_one_point_crossover_swaps_tails_of_its_share_of_pairs(rate: float) -> None:
    n = 4_000
    before = np.repeat(np.arange(n) % 2, 30).reshape(n, 30).astype(np.uint8)
    after = OnePoint(rate)(before.copy(), MAPPER, spawn(1, 1, 0, n))
    crossed = (after != before).any(axis=1)[::2]
    assert abs(crossed.mean() - rate) < 4 * np.sqrt(rate * (1 - rate) / (n / 2))
    assert np.array_equal(after[::2] + after[1::2], np.ones((n // 2, 30)))  # what one loses the other gains
    heads = np.argmax(after[::2][crossed] != 0, axis=1)
    assert set(heads) == set(range(1, 30))  # every point, and never the whole genome


def test_one_point_crossover_within_used_codons_always_touches_them() -> None:
    before = random_genomes(100)
    used = MAPPER.map(before).used
    after = OnePoint(1.0, within_used=True)(before.copy(), MAPPER, spawn(1, 1, 0, 100))
    for i in range(0, 100, 2):
        shared = min(used[i], used[i + 1])
        assert np.array_equal(after[i, 0], before[i, 0])
        assert shared < 2 or np.array_equal(after[i, shared - 1 :], before[i + 1, shared - 1 :])


def test_variable_one_point_crossover_joins_a_head_of_one_to_a_tail_of_the_other() -> None:
    before = np.tile(np.arange(60, dtype=np.uint8), (200, 1))
    before[1::2] += 100
    used = MAPPER.map(before).used
    after = VariableOnePoint(1.0)(before.copy(), MAPPER, spawn(1, 1, 0, 200)).astype(int)
    cuts = np.argmax(after[::2] >= 100, axis=1)
    assert (cuts >= 1).all()
    assert (cuts <= used[::2]).all()
    tails = {tuple(row[cut:][row[cut:] >= 100] - 100) for row, cut in zip(after[::2], cuts, strict=True)}
    assert {tail[0] for tail in tails} == set(range(1, used[1] + 1))  # the other's point is its own
    assert all(tail == tuple(range(tail[0], tail[0] + len(tail))) for tail in tails)


def test_mutation_of_one_used_codon_changes_one_on_average() -> None:
    before = random_genomes(2_000)
    after = Flip(None, within_used=True)(before.copy(), MAPPER, spawn(1, 1, 0, 2_000))
    assert abs((after != before).sum() / 2_000 - 255 / 256) < 0.1


@given(st.integers(0, 2**32), st.sampled_from([12, 60, 300]))
@settings(deadline=None, max_examples=25)
def test_subtree_crossover_of_valid_genomes_gives_valid_genomes(seed: int, codons: int) -> None:
    genomes = random_genomes(60, codons, seed)
    genomes = genomes[MAPPER.map(genomes).valid]
    before = MAPPER.map(genomes)
    after = MAPPER.map(Subtree(1.0)(genomes.copy(), MAPPER, spawn(seed, 1, 0, len(genomes))))
    assert after.valid.all()
    pairs = len(genomes) // 2 * 2
    sizes = [m.used[:pairs].reshape(-1, 2).sum(axis=1) for m in (before, after)]
    assert np.array_equal(*sizes)  # nothing is lost between the two


def test_subtree_crossover_only_moves_what_the_parents_had() -> None:
    genomes = random_genomes(2, 100, 5)
    before, after = MAPPER.map(genomes), MAPPER.map(Subtree(1.0)(genomes.copy(), MAPPER, spawn(3, 1, 0, 2)))
    assert sorted(before.key(0) + before.key(1)) == sorted(after.key(0) + after.key(1))


def test_creep_moves_numbers_by_one_step_and_nothing_else() -> None:
    before = random_genomes(100)
    first, second = MAPPER.map(before), MAPPER.map(Creep(1.0)(before.copy(), MAPPER, spawn(1, 1, 0, 100)))
    number = MAPPER.grammar.nonterminals.index("<num>")
    numeric = first.symbols == number
    step = second.choices.astype(int) - first.choices
    assert np.array_equal(np.abs(step), numeric)
    assert np.array_equal(first.symbols, second.symbols)


def test_creep_takes_short_steps_more_often_than_long_ones_and_none_beyond_its_reach() -> None:
    mapper = Mapper(parse_grammar("<n> ::= GE_RANGE:-100..100"))
    before = np.arange(201, dtype=np.uint8).repeat(100)[:, None]
    after = mapper.map(Creep(1.0, reach=0.1)(before.copy(), mapper, spawn(1, 1, 0, len(before)))).choices
    steps = np.abs(after.astype(int) - before.ravel())
    assert set(steps.tolist()) == set(range(1, 21))
    # Lengths below x have probability log x / log 20.1.
    assert np.mean(steps < 5) == pytest.approx(np.log(5) / np.log(20.1), abs=0.02)
    ends = np.mean(np.sign(after.astype(int) - before.ravel()) > 0)
    assert ends == pytest.approx(0.5, abs=0.02)


def test_creep_goes_by_the_numbers_values_not_by_their_place_in_the_file() -> None:
    genomes = np.array([[1, choice] for choice in (0, 1, 2)] * 20, np.uint8)
    moved = RICH.map(Creep(1.0)(genomes.copy(), RICH, spawn(1, 1, 0, 60)))
    after = {before: {moved.text(i) for i in range(60) if i % 3 == k} for k, before in enumerate("312")}
    assert after == {"3": {"2"}, "1": {"2"}, "2": {"1", "3"}}


def test_creep_moves_no_more_numbers_of_a_long_program_than_asked() -> None:
    before = random_genomes(400)
    first = MAPPER.map(before)
    second = MAPPER.map(Creep(1.0, most=2.0)(before.copy(), MAPPER, spawn(1, 1, 0, 400)))
    moved = [np.sum(first.choices[a:b] != second.choices[a:b]) for a, b in pairwise(first.offsets)]
    numbers = np.array(
        [
            np.sum(first.symbols[a:b] == MAPPER.grammar.nonterminals.index("<num>"))
            for a, b in pairwise(first.offsets)
        ]
    )
    long = numbers > 5
    assert np.mean(np.array(moved)[long]) == pytest.approx(2.0, abs=0.25)


def test_duplication_makes_a_subtree_stand_twice_in_a_row() -> None:
    grammar = Mapper(parse_grammar("<a> ::= x | <a><a> | <n>\n<n> ::= 1 | 2 | 3"))
    before = grammar.map(np.array([[1, 0, 2, k % 3, *[0] * 20] for k in range(60)], np.uint8))
    genomes = np.array([[1, 0, 2, k % 3, *[0] * 20] for k in range(60)], np.uint8)
    after = grammar.map(Duplicate(1.0, 99)(genomes, grammar, spawn(1, 1, 0, 60)))
    for k in range(60):
        number = before.text(k)[1:]
        assert after.valid[k]
        assert after.text(k) in {f"xx{number}", f"x{number}{number}", f"x{number}x{number}"}
    assert len({after.text(k) for k in range(60)}) == 9


def test_duplication_leaves_alone_what_has_no_room_and_what_cannot_stand_twice() -> None:
    full = np.array([[1, 0, 2, 2]], np.uint8)
    grammar = Mapper(parse_grammar("<a> ::= x | <a><a> | <n>\n<n> ::= 1 | 2 | 3"))
    assert np.array_equal(Duplicate(1.0, 99)(full.copy(), grammar, spawn(1, 1, 0, 1)), full)
    once = Mapper(parse_grammar("<a> ::= <n>y | <n>\n<n> ::= 1 | 2 | 3"))
    genomes = random_genomes(20, 10)
    assert np.array_equal(Duplicate(1.0, 99)(genomes.copy(), once, spawn(1, 1, 0, 20)), genomes)


def test_a_tournament_of_five_prefers_the_best_as_often_as_theory_says() -> None:
    merit = np.arange(10.0)[::-1].copy()
    winners = tournament(merit, 5, spawn(1, 1, 0, 20_000))
    shares = np.bincount(winners, minlength=10)[::-1] / 20_000
    ranks = np.arange(10)
    theory = ((10 - ranks) / 10) ** 5 - ((9 - ranks) / 10) ** 5
    assert np.abs(shares - theory).max() < 0.015


def test_lexicase_takes_specialists_and_never_the_dominated() -> None:
    cases = np.array([[1.0, 9.0, 9.0], [9.0, 1.0, 9.0], [9.0, 9.0, 1.0], [9.0, 9.0, 9.0], [2.0, 2.0, 2.0]])
    winners = lexicase(cases, np.zeros(3), spawn(1, 1, 0, 300))
    assert set(winners) == {0, 1, 2}
    assert 4 in set(lexicase(cases, np.ones(3), spawn(1, 1, 0, 300)))


def test_lexicase_cases_are_the_times_between_checkpoints() -> None:
    arrivals = np.array([[1.0, 3.0, 6.0], [2.0, np.nan, np.nan], [np.nan] * 3])
    times = segment_times(arrivals)
    assert times.tolist() == [[1, 2, 3], [2, np.inf, np.inf], [np.inf] * 3]
    assert deviations(times).tolist() == [0.5, 0.0, 0.0]


@pytest.mark.parametrize("plan", ["sensible", "ptc2"])
def test_planned_first_genomes_are_valid_and_varied(plan: str) -> None:
    chosen = SMALL.model_copy(update={"initialisation": plan, "codons": 400})
    mapped = MAPPER.map(Operators.of(chosen).initialise(MAPPER, spawn(1, 0, 0, 100)))
    assert mapped.valid.all()
    assert len({mapped.key(i) for i in range(100)}) > 90
    assert mapped.used.max() > 2 * mapped.used.min()


def test_ptc2_reaches_the_sizes_it_aims_at() -> None:
    chosen = SMALL.model_copy(update={"initialisation": "ptc2", "codons": 400, "initial_expansions": 60})
    used = MAPPER.map(Operators.of(chosen).initialise(MAPPER, spawn(1, 0, 0, 300))).used
    assert 25 < np.median(used) < 45
    assert used.max() < 60 + 20


@given(st.integers(0, 2**32), st.sampled_from(["uniform", "sensible", "ptc2"]), st.integers(1, 40))
@settings(deadline=None, max_examples=25)
def test_no_plan_crashes_on_genomes_too_short_for_it(seed: int, plan: str, codons: int) -> None:
    chosen = SMALL.model_copy(update={"initialisation": plan, "codons": codons})
    assert Operators.of(chosen).initialise(RICH, spawn(seed, 0, 0, 4)).shape == (4, codons)
