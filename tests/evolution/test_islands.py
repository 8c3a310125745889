"""Who lives on, and where: steady state, islands, and migrants."""

import numpy as np
import pytest
from support.searching import MAPPER, SMALL, generations, new_evolution

from gecar.errors import InputError
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.operators import Operators
from gecar.search.programs import RobotPrograms
from gecar.search.settings import preset

STEADY = SMALL.model_copy(update={"replacement": "worst", "offspring": 2, "generations": 30})
ISLANDS = SMALL.model_copy(update={"islands": 4, "migration_every": 3})


def test_in_a_steady_state_the_worst_make_room() -> None:
    evolution = generations(new_evolution(STEADY), 1)
    for _ in range(30):
        before = np.sort(evolution.scores["merit"])
        generations(evolution, 1)
        assert (np.sort(evolution.scores["merit"]) <= before).all()
        assert np.count_nonzero(evolution.parents[:, 0] != np.arange(20)) <= 20
    assert evolution.totals.evaluations == STEADY.evaluations == 20 + 2 * 30


def test_parents_that_live_on_keep_genome_and_score() -> None:
    evolution = generations(new_evolution(STEADY), 5)
    genomes, scores = evolution.genomes, evolution.scores
    generations(evolution, 1)
    stayed = np.flatnonzero(evolution.parents[:, 0] == evolution.parents[:, 1])
    assert len(stayed) >= 18
    for place in stayed:
        assert (evolution.genomes[place] == genomes[evolution.parents[place, 0]]).all()
        assert evolution.scores[place] == scores[evolution.parents[place, 0]]


@pytest.mark.parametrize("replacement", ["generational", "worst"])
def test_parents_come_from_the_same_island_but_for_migrants(replacement: str) -> None:
    evolution = generations(new_evolution(ISLANDS.model_copy(update={"replacement": replacement})), 1)
    home = np.repeat(np.arange(4), 5)
    for generation in range(1, 7):
        merits = evolution.scores["merit"].reshape(4, 5)
        generations(evolution, 1)
        came_from = evolution.parents // 5
        strangers = np.flatnonzero((came_from != home[:, None]).any(axis=1))
        if generation % 3 or replacement == "worst":  # there a migrant may die before it is seen
            assert len(strangers) <= (0 if generation % 3 else 4)
            continue
        assert (came_from[strangers, 0] == (home[strangers] - 1) % 4).all()
        best = 5 * np.arange(4) + merits.argmin(axis=1)
        assert sorted(evolution.parents[strangers, 0].tolist()) == best.tolist()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"offspring": 2}, "found offspring with replacement = generational"),
        ({"islands": 3}, "found 3 islands for 200 individuals and 200 children, expected numbers that"),
        (
            {"islands": 4, "replacement": "worst", "offspring": 2},
            "found 4 islands for 200 individuals and 2 children",
        ),
        ({"islands": 100}, "found 100 islands, expected room for elites, a migrant and a child on each"),
    ],
)
def test_populations_that_cannot_be_divided_are_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError) as error:
        preset("paper", changes)
    assert words in str(error.value)


def test_a_replacement_of_ones_own_chooses_who_lives_on() -> None:
    def youngest(population, n):
        return np.arange(len(population.merits) - n, len(population.merits), dtype=np.int32)

    operators = Operators.of(SMALL, replace=youngest)
    evolution = Evolution(MAPPER, RobotPrograms.of(SMALL), SMALL, 1, operators=operators)
    generations(evolution, 3)
    assert evolution.history[-1].evaluations == 60
