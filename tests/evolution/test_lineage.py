"""A run's lineage: who came from whom, what changed a program, and that a break changes nothing of it."""

from __future__ import annotations

import numpy as np
import pytest
from support.searching import MAPPER, SMALL, generations, new_evolution, resume_evolution

from gecar.evolution import lineage as lineage_module
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.lineage import CREEP, CROSSOVER, MUTATION, Lineage

VARIED = SMALL.model_copy(
    update={"crossover": "subtree", "mutation": "used_codon", "creep_rate": 0.2, "duplicates": "run"}
)


def kept(evolution: Evolution) -> Lineage:
    return Lineage.read(evolution.state().lineage, evolution.settings.population)


def test_every_program_can_be_read_again() -> None:
    evolving = generations(new_evolution(VARIED, MAPPER), 5)
    lineage, mapped = kept(evolving), MAPPER.map(evolving.genomes)
    for place in range(SMALL.population):
        assert lineage.codons_of((4, place)).tobytes() == mapped.key(place)


def test_what_changes_nothing_is_no_step() -> None:
    still = SMALL.model_copy(update={"crossover_rate": 0.0, "mutation_rate": 0.0})
    lineage = kept(generations(new_evolution(still, MAPPER), 4))
    assert not any(rows["changed"].any() for rows in lineage.generations)
    assert [len(codons) > 0 for codons in lineage.codons] == [True, False, False, False]


def test_each_operator_leaves_its_mark() -> None:
    changed = np.concatenate(
        [rows["changed"] for rows in kept(generations(new_evolution(VARIED, MAPPER), 6)).generations]
    )
    assert all((changed & bit).any() for bit in (CROSSOVER, MUTATION, CREEP))


def test_a_line_follows_one_parent_and_a_family_both() -> None:
    lineage = kept(generations(new_evolution(VARIED, MAPPER), 6))
    line, family = lineage.line((5, 7)), lineage.family((5, 7))
    assert [generation for generation, _ in line] == list(range(6))
    assert all(place in family[generation] for generation, place in line)
    assert 1 == len(family[5]) <= len(family[4]) <= 2 < len(family[0])


def test_nobody_is_a_parent_in_a_random_search() -> None:
    random = SMALL.model_copy(update={"mutation": "renew", "elites": 1})
    lineage = kept(generations(new_evolution(random, MAPPER), 4))
    assert [(rows["parent"] < 0).sum() for rows in lineage.generations] == [20, 19, 19, 19]
    assert lineage.line((3, 5)) == [(3, 5)]


def test_a_break_changes_nothing_of_a_lineage() -> None:
    whole, half = (generations(new_evolution(VARIED, MAPPER), n) for n in (6, 3))
    resumed = generations(resume_evolution(VARIED, MAPPER, half.state()), 3)
    assert resumed.state().lineage.tobytes() == whole.state().lineage.tobytes()


def test_too_long_a_run_keeps_no_lineage_with_or_without_a_break(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lineage_module, "MAX_BYTES", 2_000)
    state = generations(new_evolution(SMALL, MAPPER), 4).state()
    assert state.lineage.size == 0
    assert generations(resume_evolution(SMALL, MAPPER, state), 1).state().lineage.size == 0


@pytest.mark.parametrize("end", [1, 20, 400, -1])
def test_a_lineage_cut_short_is_refused(end: int) -> None:
    raw = generations(new_evolution(SMALL, MAPPER), 3).state().lineage
    with pytest.raises(ValueError, match=r"whole|multiple"):
        Lineage.read(raw[:end], SMALL.population)
