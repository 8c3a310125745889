"""Ask and tell: the paper's settings, elitism, the score_cache, resuming, and what is refused."""

from itertools import pairwise

import numpy as np
import pytest
from support.searching import (
    MAPPER,
    N_ARRIVALS,
    SMALL,
    Toy,
    fingerprint,
    generations,
    new_evolution,
    resume_evolution,
)

from gecar.errors import InputError
from gecar.evolution import score_cache
from gecar.evolution.ask_tell import Evolution, run
from gecar.evolution.history import Patience, pace
from gecar.evolution.scores import UNSOLVED, merits
from gecar.search.programs import RobotPrograms
from gecar.search.settings import (
    PRESETS,
    TABLE_4_CROSSOVER_RATES,
    TABLE_4_MUTATION_RATES,
    Settings,
    preset,
)

VARIANTS = {
    "paper": {},
    "random": {"mutation": "renew"},
    "no elite, odd": {"elites": 0, "population": 21},
    "subtree, creep": {"crossover": "subtree", "mutation": "used_codon", "creep_rate": 0.2},
    "PonyGE2's": {"crossover": "variable_one_point", "mutation": "one_used_codon", "tournament": 2},
    "new programs": {"duplicates": "run", "mutation": "used_codon", "checkpoint_credit": True},
    "begins anew": {"restart_after": 1, "mutation_rate": 0.0},
    "grows": {
        "generations": 16,
        "restart_after": 1,
        "restart": "grown",
        "creep_rate": 0.3,
        "creep_most": 2.0,
    },
    "steady state": {"replacement": "worst", "offspring": 2},
    "islands": {"islands": 4, "migration_every": 2, "duplicates": "generation"},
    "islands, worst": {"islands": 2, "migration_every": 1, "replacement": "worst", "duplication_rate": 0.2},
    "lexicase, ptc2": {"selection": "lexicase", "initialisation": "ptc2", "duplicates": "generation"},
}


def small(name: str) -> Settings:
    return SMALL.model_copy(update=VARIANTS[name])


def evolution(name: str = "paper", seed: int = 1) -> Evolution:
    chosen = small(name)
    return new_evolution(chosen, MAPPER, seed, N_ARRIVALS if chosen.needs_arrivals else 0)


def test_the_paper_preset_is_table_4() -> None:
    paper = preset("paper")
    assert (paper.population, paper.generations, paper.codons, paper.elites) == (200, 50, 1_000, 1)
    assert (paper.selection, paper.tournament, paper.crossover) == ("tournament", 5, "one_point")
    assert (paper.mutation, paper.initialisation, paper.duplicates) == ("codon", "uniform", "kept")
    assert not paper.checkpoint_credit
    assert paper.crossover_rate in TABLE_4_CROSSOVER_RATES == (0.4, 0.5, 0.7)
    assert paper.mutation_rate in TABLE_4_MUTATION_RATES == (0.03, 0.05, 0.07)
    assert {chosen.evaluations for chosen in PRESETS.values()} == {10_200}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"population": 1}, "search.population: found 1, expected greater than or equal to 2"),
        ({"mutation_rate": 1.5}, "search.mutation_rate: found 1.5, expected less than or equal to 1"),
        ({"crossover_rate": float("nan")}, "search.crossover_rate: found nan"),
        ({"elites": 200}, "search: found elites = 200, expected fewer than population = 200"),
        ({"popluation": 7}, "search.popluation: found an unknown field, expected one of population, "),
        (
            {"mutation": "none"},
            "search.mutation: found 'none', expected 'codon', 'used_codon', 'one_used_codon' or 'renew'",
        ),
    ],
)
def test_settings_out_of_bounds_are_refused_by_name(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError) as error:
        preset("paper", changes)
    assert str(error.value).startswith(words)
    assert "\n" not in str(error.value)


def test_an_unknown_preset_is_refused() -> None:
    with pytest.raises(InputError, match="preset: found 'best', expected one of paper, random, better"):
        preset("best")


def test_evaluations_count_the_first_population_and_every_generation() -> None:
    run_to_end = generations(evolution(), 7)
    assert run_to_end.finished
    assert run_to_end.totals.evaluations == SMALL.evaluations == 20 * 7


@pytest.mark.parametrize("name", VARIANTS)
def test_equal_seeds_give_equal_runs_and_others_do_not(name: str) -> None:
    one, two, other = (generations(evolution(name, seed), 7) for seed in (1, 1, 2))
    assert fingerprint(one) == fingerprint(two) != fingerprint(other)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("broken_off", [1, 4])
def test_a_resumed_run_ends_like_one_never_stopped(name: str, broken_off: int) -> None:
    whole = generations(evolution(name), 7)
    first = generations(evolution(name), broken_off)
    again = resume_evolution(first.settings, MAPPER, first.state(), first.problem.n_cases)
    assert fingerprint(generations(again, 7 - broken_off)) == fingerprint(whole)


def test_an_elite_keeps_the_best_and_without_one_it_may_be_lost() -> None:
    best = [record.best for record in generations(evolution(), 7).history]
    assert best == sorted(best, reverse=True)
    histories = [generations(evolution("no elite, odd", seed), 7).history for seed in range(5)]
    assert any(h[k + 1].best > h[k].best for h in histories for k in range(6))


def test_a_second_population_may_begin_and_then_programs_grow_from_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    evolving, begun = evolution("grows"), []
    begin = evolving._reproduction.begin
    monkeypatch.setattr(evolving._reproduction, "begin", lambda *args: begun.append(args[0]) or begin(*args))
    lengths = []
    while not evolving.finished:
        longest = max(len(evolving.best.program.opcodes), 1) if evolving.history else 1
        asked = evolving.ask()
        lengths.append(max((len(one.program.opcodes) for one in asked), default=0) / longest)
        evolving.tell(Toy()(asked))
    assert len(begun) == 2
    assert evolving._patience.restarts > 2
    assert max(lengths[begun[1] + 1 :]) >= 2.0


def test_a_population_that_finds_nothing_faster_begins_anew_and_the_best_stays() -> None:
    evolving = evolution("begins anew")
    begun, bests = [], []
    for generation in range(7):
        generations(evolving, 1)
        begun += [generation] * bool((evolving.parents < 0).all())
        bests.append(evolving.best.merit)
    assert len(begun) > 1
    assert bests == sorted(bests, reverse=True)
    assert bests[-1] == min(record.best for record in evolving.history)
    for first, second in pairwise(begun):
        assert evolving.history[second - 1].best == evolving.history[second - 2].best
        assert second - first > 1


def test_patience_waits_while_nobody_is_at_goal() -> None:
    patience = Patience(2)
    ends = []
    for best_s in (UNSOLVED, UNSOLVED, UNSOLVED, 20.0, 19.0, 19.0, 19.0, 30.0, 30.0):
        patience.see(best_s)
        ends.append(patience.at_its_end)
    assert ends == [False] * 6 + [True] + [False] * 2


def test_a_program_is_asked_for_once_in_a_run() -> None:
    asked = []
    evolving = evolution()
    run(
        evolving,
        lambda candidates: (asked.extend(c.program.canonical for c in candidates), Toy()(candidates))[1],
    )
    assert len(asked) == len(set(asked)) == evolving.totals.simulated < evolving.totals.evaluations


def test_programs_that_differ_only_in_their_genomes_share_a_score() -> None:
    evolving = generations(evolution(), 1)
    by_program: dict[bytes, set[float]] = {}
    mapped = MAPPER.map(evolving.genomes)
    for i in np.flatnonzero(mapped.valid):
        program = mapped.program(int(i))
        assert program is not None
        by_program.setdefault(program.canonical, set()).add(float(evolving.scores["fitness_s"][i]))
    assert all(len(scores) == 1 for scores in by_program.values())


def test_a_forgotten_program_is_simulated_again_with_the_same_end(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = generations(evolution("subtree, creep"), 7)
    monkeypatch.setattr(score_cache, "CAPACITY", 25)
    small_cache = generations(evolution("subtree, creep"), 4)
    small_cache = resume_evolution(small_cache.settings, MAPPER, small_cache.state())
    generations(small_cache, 3)
    assert np.array_equal(small_cache.genomes, whole.genomes)
    assert small_cache.totals.simulated > whole.totals.simulated
    assert len(small_cache.state().digests) == 25


def test_asking_twice_and_telling_twice_are_refused() -> None:
    evolving = evolution()
    with pytest.raises(
        InputError, match="tell: found no generation that waits for scores, expected ask first"
    ):
        evolving.tell([])
    asked = evolving.ask()
    with pytest.raises(
        InputError, match="ask: found generation 0 asked for and not told, expected tell with the"
    ):
        evolving.ask()
    with pytest.raises(InputError, match="state: found generation 0 asked for"):
        evolving.state()
    evolving.tell(Toy()(asked))
    with pytest.raises(InputError, match="expected ask first"):
        evolving.tell(Toy()(asked))


@pytest.mark.parametrize(
    ("results", "words"),
    [([1.0], "one score for each of the"), ([np.nan] * 99, "not a number"), (["a"] * 99, "results of dtype")],
)
def test_results_that_do_not_fit_are_refused_and_can_be_told_again(results: list[object], words: str) -> None:
    evolving = evolution()
    asked = evolving.ask()
    with pytest.raises(InputError, match=words):
        evolving.tell(results[: len(asked)])
    assert evolving.tell(Toy()(asked)).generation == 0


def test_a_finished_run_is_not_asked_again() -> None:
    with pytest.raises(InputError, match="ask: found all 6 generations done"):
        generations(evolution(), 7).ask()


def test_plain_seconds_are_scores_too() -> None:
    evolving = evolution()
    record = evolving.tell([float(len(candidate.program.source)) for candidate in evolving.ask()])
    assert record.best == evolving.best.merit < UNSOLVED
    assert evolving.best.program is not None
    assert len(evolving.best.program.source) == record.best


def test_credit_orders_what_misses_goal_and_never_reaches_above_the_cliff() -> None:
    scores = RobotPrograms().failed(4)
    scores["merit"][3] = 59.9
    scores["share"][1:3] = 0.1, 0.8
    assert np.argsort(merits(scores, partial_credit=True)).tolist() == [3, 2, 1, 0]
    assert merits(scores, partial_credit=True)[:3].min() > UNSOLVED
    assert merits(scores, partial_credit=False).tolist() == [UNSOLVED] * 3 + [59.9]


def test_invalid_genomes_score_ten_thousand() -> None:
    evolving = new_evolution(Settings(population=30, generations=1, codons=3), MAPPER, 1)
    assert evolving.ask() == []  # three codons are too few for any statement
    record = evolving.tell([])
    assert (record.best, record.mean, record.valid, record.solved) == (UNSOLVED, UNSOLVED, 0.0, 0.0)
    assert evolving.best.program is None


def test_duplicates_are_bred_again() -> None:
    chosen = SMALL.model_copy(update={"population": 60, "generations": 20, "mutation_rate": 0.02})
    avoiding = chosen.model_copy(update={"duplicates": "run"})
    runs = [generations(new_evolution(each, MAPPER), 21) for each in (chosen, avoiding)]
    assert runs[1].history[-1].distinct > 0.9 > runs[0].history[-1].distinct
    assert runs[1].totals.simulated > 1.5 * runs[0].totals.simulated


def test_parents_say_whom_each_child_comes_from() -> None:
    evolving = generations(new_evolution(SMALL.model_copy(update={"mutation_rate": 0.0}), MAPPER), 1)
    assert (evolving.parents == -1).all()
    before = evolving.genomes
    evolving.ask()
    for child, (one, other) in zip(evolving._offspring.genomes, evolving.parents, strict=True):
        assert child[0] == before[one, 0]
        assert ((child == before[one]) | (child == before[other])).all()


def test_the_pace_is_that_of_the_latest_generations() -> None:
    record = generations(evolution(), 1).history[0]
    slow_start = [
        record._replace(generation=k, evaluations=20 * (k + 1), wall_s=100.0 + k) for k in range(21)
    ]
    assert pace(slow_start, 50).evaluations_per_s == pytest.approx(20.0)
    assert pace(slow_start, 50).left_s == pytest.approx(30.0)
    assert pace(slow_start[:1], 50).left_s == pytest.approx(5_000.0)


@pytest.mark.parametrize("seed", [-1, 2**64])
def test_a_seed_that_is_none_is_refused(seed: int) -> None:
    with pytest.raises(InputError, match="seed: found"):
        evolution(seed=seed)
