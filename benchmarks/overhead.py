"""What evolution itself costs beside a fitness written in Python, in microseconds of processor time an evaluation.

Whole runs are timed, and what phenotype and fitness took is taken off, and what it took to time them: what is left is
selection, variation, mapping, and the book-keeping of scores.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from benchmarks.problems.searches import CASES, GRAPE_ALIKE, POPULATION
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.fitness import Fitness
from gecar.evolution.operators import Operators
from gecar.evolution.settings import EvolutionSettings
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.problems.regression import read_formula

GENERATIONS, REPEATS = 50, 5
GOAL = "<= 20 us"


class Stopwatch:
    """Adds up the processor time of calls [s]."""

    def __init__(self) -> None:
        self.spent_s, self.calls = 0.0, 0

    def __call__(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, timed."""

        def timed(*words: Any) -> Any:
            began = time.thread_time()
            found = function(*words)
            self.calls += 1
            self.spent_s += time.thread_time() - began
            return found

        return timed


def timing_s(calls: int = 100_000) -> float:
    """Return what a call takes longer for being timed, beside what the stopwatch counts [s]."""
    watch = Stopwatch()
    timed = watch(len)
    began = time.thread_time()
    for _ in range(calls):
        timed(())
    between = time.thread_time()
    for _ in range(calls):
        len(())
    plain_s = time.thread_time() - between
    return (between - began - plain_s - watch.spent_s) / calls


def overhead_us(
    mapper: Mapper,
    phenotype: Callable[..., Any],
    error: Callable[..., Any],
    operators: Operators | None = None,
    population: int = 200,
    seed: int = 1,
) -> float:
    """Return what a run costs beside phenotype and fitness, an evaluation [us]."""
    watch, settings = Stopwatch(), EvolutionSettings(population=population, generations=GENERATIONS)
    watch_s = timing_s()
    began = time.thread_time()
    evolution = Evolution(
        mapper,
        None,
        settings,
        seed,
        phenotype=watch(phenotype),
        fitness=Fitness(watch(error)),
        operators=operators,
    )
    evolution.run()
    spent_s = time.thread_time() - began - watch.spent_s - watch.calls * watch_s
    return 1e6 * spent_s / evolution.totals.evaluations


def rows() -> list[tuple[str, str, str]]:
    """Measure; each row is a figure, its value and its goal."""
    measured = {
        "Table 1's formulas, Table 4's settings": lambda seed: overhead_us(
            Mapper(load_grammar("table1")), read_formula, lambda formula: float(len(formula.codes)), seed=seed
        )
    }
    for name, case in CASES.items():
        mapper = Mapper(load_grammar(case.grammar), MappingOptions(variable_length=True))
        measured[f"{name}, GRAPE's operators"] = lambda seed, mapper=mapper, case=case: overhead_us(
            mapper, case.read, case.error, GRAPE_ALIKE, POPULATION, seed
        )
    return [
        (f"{name}: overhead an evaluation", f"{_least(each):.1f} us", GOAL) for name, each in measured.items()
    ]


def _least(run: Callable[[int], float]) -> float:
    """Return the least of several runs with the same seed: other programs only ever make it longer."""
    run(0)
    return min(run(1) for _ in range(REPEATS))
