"""Small evolutions with a fitness that costs nothing: what several tests of the search share."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gecar.evolution.ask_tell import Evolution
from gecar.evolution.scores import UNSOLVED, Scores
from gecar.evolution.state import Candidate, State
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper
from gecar.language.program import Program
from gecar.search.evaluation import Opcodes
from gecar.search.fitness import score_type
from gecar.search.programs import RobotPrograms
from gecar.search.settings import Settings

MAPPER = Mapper(load_grammar("paper"))
SMALL = Settings(population=20, generations=6, codons=60)
N_ARRIVALS = 3


def toy_scores(
    programs: Sequence[Opcodes], seeds: Sequence[int] = (), to_beat_s: float = math.inf, n_arrivals: int = 0
) -> Scores:
    """Score programs by a rugged function of all their numbers; half of them fail. In the place of a simulation."""
    scores = np.zeros(len(programs), score_type(n_arrivals))
    for score, opcodes in zip(scores, programs, strict=True):
        total = int(np.abs(opcodes[:, 1:4]).sum())
        score["fitness_s"] = score["merit"] = UNSOLVED if total % 2 else 10.0 + 7919 * total % 1_000 / 100
        score["share"] = (total % 7) / 7
        score["outcome"] = 2 if total % 2 else 1
        score["steps"] = total
        score["arrival_s"] = [total % (k + 2) if total % 3 else np.nan for k in range(n_arrivals)]
    return scores


class Toy:
    """`toy_scores` for candidates."""

    def __init__(self, n_arrivals: int = 0) -> None:
        self.n_arrivals = n_arrivals

    def __call__(self, asked: list[Candidate[Program]]) -> Scores:
        return toy_scores([candidate.program.opcodes for candidate in asked], n_arrivals=self.n_arrivals)


def new_evolution(
    settings: Settings, mapper: Mapper = MAPPER, seed: int = 1, n_arrivals: int = 0
) -> Evolution[Program]:
    """An evolution of robot programs."""
    return Evolution(mapper, RobotPrograms.of(settings, n_arrivals), settings, seed)


def resume_evolution(
    settings: Settings, mapper: Mapper, state: State, n_arrivals: int = 0
) -> Evolution[Program]:
    """The same from a state on."""
    return Evolution.resume(state, mapper, RobotPrograms.of(settings, n_arrivals), settings)


def generations(evolution: Evolution[Program], n: int) -> Evolution[Program]:
    """Ask and tell n times."""
    for _ in range(n):
        evolution.tell(Toy(evolution.problem.n_cases)(evolution.ask()))
    return evolution


def fingerprint(evolution: Evolution[Program]) -> tuple[object, ...]:
    """Everything a run ends with, the clock apart."""
    records = [
        record._replace(wall_s=0.0, mean_solved=str(record.mean_solved)) for record in evolution.history
    ]
    best = evolution.best
    return (
        evolution.genomes.tobytes(), evolution.scores.tobytes(), tuple(records),
        best.genome.tobytes(), best.score.tobytes(), best.generation, str(best.program),
    )  # fmt: skip
