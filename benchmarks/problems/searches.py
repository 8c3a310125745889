"""The searches that are compared: the same problem, budget and rates."""

from __future__ import annotations

import contextlib
import io
import random
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from gecar.evolution.ask_tell import Evolution
from gecar.evolution.crossover import VariableOnePoint
from gecar.evolution.fitness import Fitness
from gecar.evolution.initialisation import Sensible
from gecar.evolution.mutation import Flip
from gecar.evolution.operators import Operators
from gecar.evolution.selection import Tournament
from gecar.evolution.settings import EvolutionSettings
from gecar.files import shipped
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.problems.ant import missed, read_ant
from gecar.problems.regression import keijzer_6

POPULATION, GENERATIONS = 300, 50
TOURNAMENT, CROSSOVER, MUTATION = 5, 0.8, 0.01
DEPTH, DEEPEST = 10, 35
"""Depth of first trees at most; of all trees, where a library wants to know."""
CODONS = 1_000
GRAPE_ALIKE = Operators(
    Sensible(CODONS, DEPTH, tail=0.5),
    Tournament(TOURNAMENT),
    (VariableOnePoint(CROSSOVER), Flip(MUTATION, within_used=True)),
)
"""GRAPE's operators."""


@dataclass(frozen=True)
class Case:
    """A problem: its grammar, what a word means, how good that is, and from which error on it is solved."""

    grammar: str
    read: Callable[[Any], Any]
    error: Callable[[Any], float]
    solved: float


class Ended(NamedTuple):
    """What a run came to: least error, and processor time [s]."""

    error: float
    cpu_s: float


_KEIJZER = keijzer_6()
CASES = {
    "Santa Fe ant": Case("santa_fe", read_ant, missed, 0.0),
    "Keijzer-6": Case("keijzer_6", _KEIJZER.read, _KEIJZER, 0.01),
}
"""Error: food left after 615 steps, solved where there is none; root mean square error for x = 1 to 50, solved by
0.01."""


def gecar_alike(case: Case, seed: int) -> Ended:
    """Run gecar with the operators that GRAPE has."""
    mapper = Mapper(load_grammar(case.grammar), MappingOptions(variable_length=True))
    return _gecar(case, seed, mapper, GRAPE_ALIKE)


def gecar_subtree(case: Case, seed: int) -> Ended:
    """Run gecar with subtree crossover and one codon mutated a child."""
    settings = EvolutionSettings(
        population=POPULATION, generations=GENERATIONS, codons=CODONS, initialisation="sensible",
        initial_depth=DEPTH, tournament=TOURNAMENT, crossover="subtree", crossover_rate=CROSSOVER,
        mutation="one_used_codon",
    )  # fmt: skip
    return _gecar(case, seed, Mapper(load_grammar(case.grammar)), Operators.of(settings), settings)


def _gecar(
    case: Case, seed: int, mapper: Mapper, operators: Operators, settings: EvolutionSettings | None = None
) -> Ended:
    settings = settings or EvolutionSettings(population=POPULATION, generations=GENERATIONS, codons=CODONS)
    began = time.process_time()
    evolution = Evolution(
        mapper, None, settings, seed, phenotype=case.read, fitness=Fitness(case.error), operators=operators
    )
    best = evolution.run()
    return Ended(best.merit, time.process_time() - began)


def grape(case: Case, seed: int) -> Ended:
    """Run GRAPE as its examples do."""
    import grape.grape as library  # noqa: PLC0415
    from deap import tools  # noqa: PLC0415
    from grape.algorithms import ge_eaSimpleWithElitism  # noqa: PLC0415

    toolbox, individual = _toolbox()

    def evaluate(one: Any, points: Any) -> tuple[float]:  # noqa: ARG001
        program = None if one.invalid else case.read(one.phenotype)
        return (float("nan") if program is None else float(case.error(program)),)

    toolbox.register("evaluate", evaluate)
    random.seed(seed)
    began = time.process_time()
    grammar = _grammar(case.grammar)
    shallowest = 1 + int(load_grammar(case.grammar).minimum_depth[0])  # it counts the start, too
    population = library.sensible_initialisation(
        individual, POPULATION, grammar, min_init_depth=shallowest, max_init_depth=DEPTH, codon_size=255,
        codon_consumption="lazy", genome_representation="list",
    )  # fmt: skip
    best = tools.HallOfFame(1)
    with contextlib.redirect_stdout(io.StringIO()):
        ge_eaSimpleWithElitism(
            population, toolbox, cxpb=CROSSOVER, mutpb=MUTATION, ngen=GENERATIONS, elite_size=1,
            bnf_grammar=grammar, codon_size=255, max_tree_depth=DEEPEST, codon_consumption="lazy",
            report_items=[], halloffame=best, verbose=False,
        )  # fmt: skip
    return Ended(best.items[0].fitness.values[0], time.process_time() - began)


@cache
def _toolbox() -> tuple[Any, Any]:
    import grape.grape as library  # noqa: PLC0415
    from deap import base, creator  # noqa: PLC0415

    creator.create("ErrorFitness", base.Fitness, weights=(-1.0,))
    creator.create("Individual", library.Individual, fitness=creator.ErrorFitness)
    toolbox = base.Toolbox()
    toolbox.register("select", library.selTournamentWithoutInvalids, tournsize=TOURNAMENT)
    toolbox.register("mate", library.crossover_onepoint)
    toolbox.register("mutate", library.mutation_int_flip_per_codon)
    return toolbox, creator.Individual


@cache
def _grammar(name: str) -> Any:
    """Return a grammar as GRAPE reads it: no comments, a rule a line."""
    import grape.grape as library  # noqa: PLC0415

    text = (shipped("grammars") / f"{name}.bnf").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{name}.bnf"
        file.write_text("\n".join(lines).replace("\n ", " ") + "\n", encoding="utf-8")
        return library.Grammar(str(file))


SEARCHES: dict[str, Callable[[Case, int], Ended]] = {
    "GRAPE": grape,
    "gecar, GRAPE's operators": gecar_alike,
    "gecar, subtree crossover": gecar_subtree,
}
