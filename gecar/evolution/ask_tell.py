"""The evolution: any grammar, any phenotype, any fitness.

evolution = Evolution(Mapper(load_grammar("table1")), phenotype=formula, fitness=error, seed=1)
evolution.run()
print(evolution.best.program, evolution.best.fitness)

Without a fitness, use ask and tell: `ask` returns the programs to score, `tell` takes their scores.

evolution = Evolution(Mapper(load_grammar("table1")), seed=1)
while not evolution.finished:
    evolution.tell([my_error(candidate.program) for candidate in evolution.ask()])
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any, Generic, cast

import numpy as np
import numpy.typing as npt

from gecar.errors import InputError, expected
from gecar.evolution.crossover import Genomes
from gecar.evolution.fitness import Fitness, FitnessProblem
from gecar.evolution.history import HISTORY, Generation, Patience, Totals, summary
from gecar.evolution.lineage import Ledger
from gecar.evolution.operators import Operators
from gecar.evolution.problem import P, Problem
from gecar.evolution.reproduction import Offspring, Reproduction
from gecar.evolution.score_cache import ScoreCache
from gecar.evolution.scores import Scores, merits
from gecar.evolution.settings import EvolutionSettings
from gecar.evolution.state import Best, Candidate, State
from gecar.language.mapping import Derivation, Mapper

CONTENDERS = 40
"""Number of best programs kept for the choice of the winner."""
BARREN = 1_000
"""Genomes without a single phenotype after which an evolution stops with an error."""


class Evolution(Generic[P]):
    """An evolution of programs.

    Parameters
    ----------
    mapper
        Maps genomes to derivations.
    problem
        Instead of phenotype and fitness, for problems whose scores are not plain numbers.
    settings
        Sizes, rates and names of operators; by default the paper's Table 4.
    seed
        Random seed; equal seeds, equal runs.
    phenotype
        Returns the program of a derivation, or None if it has none; by default the derivation's text. Derivations of
        equal text share a score.
    fitness
        A function that returns a number for a program, lower is better, or a `gecar.evolution.fitness.Fitness`.
    operators
        Operators that replace those named in the settings.

    Raises
    ------
    InputError
        If the seed is not a whole number from 0 up, or operators, mapper and scores are not compatible.
    """

    def __init__(
        self,
        mapper: Mapper,
        problem: Problem[P] | None = None,
        settings: EvolutionSettings | None = None,
        seed: int = 1,
        *,
        phenotype: Callable[[Derivation], P | None] | None = None,
        fitness: Fitness[P] | Callable[[P], Any] | None = None,
        operators: Operators | None = None,
    ) -> None:
        if not 0 <= seed < 2**64:
            raise expected("seed", seed, "a whole number from 0 to 2^64 - 1")
        if problem is None:
            given = fitness if isinstance(fitness, Fitness) else Fitness(fitness)
            problem = FitnessProblem(phenotype or cast("Any", str), given)
        elif phenotype is not None or fitness is not None:
            raise expected("problem", "one beside a phenotype or a fitness", "either the one or the others")
        settings = settings or EvolutionSettings()
        operators = operators or Operators.of(settings)
        grows = settings.restart_after > 0 and settings.restart == "grown"
        operators.check(mapper, problem.n_cases, grows)
        self.settings, self.mapper, self.problem, self.seed = settings, mapper, problem, seed
        self.operators = operators
        self.history: list[Generation] = []
        self.genomes: Genomes = np.zeros((0, 0), mapper.options.codon_type)
        self.scores: Scores = problem.failed(0)
        self._best: Best[P] | None = None
        self._contenders: dict[bytes, Best[P]] = {}
        self._cache = ScoreCache(problem.score_type)
        self._reproduction = Reproduction(settings, operators, mapper, problem, seed)
        self._barren = 0
        self._offspring: Offspring[P] | None = None
        self._parents = np.zeros((0, 2), np.int32)
        self._ledger = Ledger()
        self._patience = Patience(settings.restart_after, problem.failure)
        self._asked: dict[bytes, list[int]] = {}
        self._began: float | None = None
        self._earlier_s = 0.0

    @classmethod
    def resume(
        cls,
        state: State,
        mapper: Mapper,
        problem: Problem[P],
        settings: EvolutionSettings | None = None,
        operators: Operators | None = None,
    ) -> Evolution[P]:
        """Continue from a state; the result is the same as without interruption.

        Parameters
        ----------
        state
            Returned by `state`.
        mapper, problem, settings, operators
            Those of the interrupted evolution, which has its problem as attribute `problem`.
        """
        evolution = cls(mapper, problem, settings, state.seed, operators=operators)
        evolution.history = [Generation(*row.tolist()) for row in state.history]
        for generation in evolution.history:
            evolution._patience.see(generation.best)
        evolution.genomes, evolution.scores = state.genomes, state.scores
        evolution._ledger = Ledger(state.lineage, going_on=True)
        evolution._earlier_s = evolution.history[-1].wall_s
        evolution._cache.add([row.tobytes() for row in state.digests], state.cached)
        (found,) = evolution._reproduction.read(state.best_genome[None])
        program = None if found is None else found.program
        evolution._best = Best(state.best_genome, state.best_score, state.best_generation, program)
        known = zip(
            state.contenders, state.contender_scores, state.contender_generations.tolist(), strict=True
        )
        for phenotype, (genome, score, generation) in zip(
            evolution._reproduction.read(state.contenders), known, strict=True
        ):
            if phenotype is not None:
                best = Best(
                    genome.copy(), np.array([score], state.scores.dtype), generation, phenotype.program
                )
                evolution._contenders[phenotype.digest] = best
        return evolution

    def state(self) -> State:
        """Return the state for `resume`.

        Raises
        ------
        InputError
            If no generation is finished, or one waits for its scores.
        """
        self._refuse_while_asked("state")
        best = self.best
        digests, cached = self._cache.dump()
        history = np.array(self.history, HISTORY)
        return State(
            self.seed,
            self.genomes,
            self.scores,
            best.genome,
            best.score,
            best.generation,
            *self._dump_contenders(),
            history,
            digests,
            cached,
            self._ledger.dump(),
        )

    @property
    def generation(self) -> int:
        """Number of the last generation that has its scores; -1 before the first."""
        return len(self.history) - 1

    @property
    def finished(self) -> bool:
        """Whether the last generation has its scores, or the best program reaches the problem's target."""
        solved = self._best is not None and self.problem.solved(self._best.score[0])
        return self.generation == self.settings.generations or solved

    @property
    def totals(self) -> Totals:
        """Evaluations, simulated programs and steps so far."""
        last = self.history[-1] if self.history else None
        return Totals(last.evaluations, last.simulated, last.steps) if last else Totals()

    @property
    def best(self) -> Best[P]:
        """The best individual so far; among failures the one with the greatest share.

        Raises
        ------
        InputError
            If no generation has its scores yet.
        """
        if self._best is None:
            raise expected("best", "no generation with scores", "ask and tell first")
        return self._best

    @property
    def contenders(self) -> list[Best[P]]:
        """The best programs so far by merit, the best first; only the best if scores never change."""
        ranked = sorted(self._contenders.values(), key=lambda contender: _rank(contender.score[0]))
        return ranked or [self.best]

    def choose(self, contender: Best[P]) -> None:
        """Make a contender the best, for instance after new draws showed that another one was lucky."""
        self._best = contender

    @property
    def parents(self) -> npt.NDArray[np.int32]:
        """Parents of the latest generation; see `gecar.evolution.reproduction.Offspring`."""
        return self._parents

    def ask(self) -> list[Candidate[P]]:
        """Make the next generation and return the programs in it without a score, each once.

        So are programs for which the problem `wants_more` scores. Call `tell` even if the list is empty.

        Raises
        ------
        InputError
            If the last generation has no scores yet, the run is finished, or no genome so far had a phenotype.
        """
        self._refuse_while_asked("ask")
        if self.finished:
            raise expected("ask", f"all {self.generation} generations done", "an unfinished run")
        if self._began is None:
            self._began = time.perf_counter()
        self._offspring = self._reproduce()
        self._refuse_barren(self._offspring)
        self._parents = self._offspring.parents
        programs: dict[bytes, P] = {}
        self._asked = {}
        for i, phenotype in enumerate(self._offspring.phenotypes):
            if phenotype is not None and self._wants_drives(phenotype.digest):
                programs[phenotype.digest] = phenotype.program
                self._asked.setdefault(phenotype.digest, []).append(i)
        # What is known of the best by now: one that was lucky must not end the race for all others.
        to_beat = math.inf if self._best is None else self.contenders[0].merit
        generation, seed = len(self.history), self.seed
        return [
            Candidate(program, self.problem.seed(program, digest, seed), to_beat, generation)
            for digest, program in programs.items()
        ]

    def tell(self, results: Any) -> Generation:
        """Take the scores of the programs that `ask` returned.

        Parameters
        ----------
        results
            In the order of `ask`: scores of the problem's dtype, or plain numbers as the fitness would return them,
            the problem's `failure` for failure.

        Returns
        -------
        Generation
            The generation's record.

        Raises
        ------
        InputError
            If no generation waits for scores, or the results do not match it.
        """
        if self._offspring is None:
            raise expected("tell", "no generation that waits for scores", "ask first")
        told = self._pooled(self.problem.check(results, len(self._asked)))
        made, scores = self._offspring, self._score(self._offspring, told)
        self._cache.add(list(self._asked), told)
        self._offspring = None
        if self.problem.rescored:
            self._keep_contenders(made, scores)
        living = self._reproduction.survivors(made, scores)
        offspring, scores = made.part(living), scores[living]
        self.genomes, self.scores, self._parents = offspring.genomes, scores, offspring.parents
        replaced = len(made.genomes) > len(living)
        self._record(offspring, told, int((~made.copied).sum()) if replaced else len(living))
        keys = [b"" if phenotype is None else phenotype.key for phenotype in offspring.phenotypes]
        ranked = merits(scores, True, self.problem.failure)
        self._ledger.add(offspring.parents, offspring.changed, ranked, keys)
        return self.history[-1]

    def run(
        self,
        after: Callable[[Generation], None] = lambda generation: None,  # noqa: ARG005
        map: Callable[..., Iterable[Any]] = map,  # noqa: A002
    ) -> Best[P]:
        """Score generations with the fitness until the evolution is finished; return the best program.

        If the fitness is random (`Fitness.draws`), the best programs of the run are scored again at the end, and the
        best of these is chosen, so that the winner is not a lucky draw.

        Parameters
        ----------
        after
            Called with each generation's record.
        map
            Applies a function to each element of a list, such as the ``map`` of an executor with several processes.

        Raises
        ------
        InputError
            If there is no fitness, it does not return numbers, or no genome had a phenotype.
        """
        if not isinstance(self.problem, FitnessProblem):
            raise expected("run", f"a {type(self.problem).__name__}", "a fitness; otherwise ask and tell")
        score = partial(self.problem.score, map=map)
        while not self.finished:
            after(self.tell(score(self.ask())))
        if self.best.program is None:
            raise self._no_phenotype(self.totals.evaluations)
        if self.problem.rescored:
            means = self.problem.afresh(self.contenders, self.seed, self.settings.generations + 1, map)
            self.choose(self.contenders[int(np.argmin(means))])
        return self.best

    def _refuse_barren(self, offspring: Offspring[P]) -> None:
        """Raise an error if no genome has a phenotype, instead of running for ever."""
        if self._best is not None and self._best.program is not None:
            return
        if any(phenotype is not None for phenotype in offspring.phenotypes):
            self._barren = 0
            return
        self._barren += len(offspring.genomes)
        if self._barren >= BARREN:
            self._offspring = None
            raise self._no_phenotype(self._barren, offspring.genomes)

    def _no_phenotype(self, n: int, genomes: Genomes | None = None) -> InputError:
        mapped = self.mapper.map(self.genomes if genomes is None else genomes)
        whole = np.flatnonzero(mapped.valid)
        what = "genomes without a derivation that finishes"
        if len(whole):
            what = f"genomes without a phenotype, such as {mapped.text(int(whole[0]))[:60]!r}"
        return expected(
            f"grammar {self.mapper.grammar.source}",
            f"{n:,} {what}",
            "a grammar whose derivations finish and mean something to the problem",
        )

    def _wants_drives(self, digest: bytes) -> bool:
        if digest not in self._cache:
            return True
        return self.problem.rescored and self.problem.wants_more(self._cache.look_up([digest])[0])

    def _pooled(self, told: Scores) -> Scores:
        """Pool new scores with those already known of the same programs."""
        if self.problem.rescored:
            for k, digest in enumerate(self._asked):
                if digest in self._cache:
                    known = self._cache.look_up([digest])
                    self.problem.add(known[0], told[k])
                    told[k] = known[0]
        return told

    def _reproduce(self) -> Offspring[P]:
        generation, known = len(self.history), self._cache.__contains__
        stagnant = self._patience.at_its_end
        if stagnant and self.settings.restart == "grown" and self._patience.restarts > 0:
            return self._grow(generation, known)
        if stagnant or not self.history:
            return self._reproduction.begin(generation, known)
        return self._reproduction.next(self.genomes, self.scores, generation, known)

    def _grow(self, generation: int, known: Callable[[bytes], bool]) -> Offspring[P]:
        """Make a population from the contenders by duplicating subtrees.

        The lineage knows parents in the generation before only: contenders of earlier ones count as none, -1.
        """
        contenders = self.contenders
        genomes = np.array([one.genome for one in contenders])
        scores = np.concatenate([one.score for one in contenders])
        offspring = self._reproduction.next(genomes, scores, generation, known, grown=True)
        before = {genome.tobytes(): i for i, genome in enumerate(self.genomes)}
        places = np.array([before.get(genome.tobytes(), -1) for genome in genomes], np.int32)
        return replace(offspring, parents=places[offspring.parents])

    def _score(self, offspring: Offspring[P], told: Scores) -> Scores:
        """Put together the population's scores: invalid, known before, or told now."""
        scores = self.problem.failed(len(offspring.genomes))
        digests = {i: p.digest for i, p in enumerate(offspring.phenotypes) if p is not None}
        known = [i for i, digest in digests.items() if digest not in self._asked]
        scores[known] = self._cache.look_up([digests[i] for i in known])
        members = list(self._asked.values())
        asked = np.repeat(np.arange(len(told)), np.array([len(each) for each in members], int))
        scores[[i for each in members for i in each]] = told[asked]
        return scores

    def _record(self, offspring: Offspring[P], told: Scores, evaluations: int) -> None:
        totals = Totals(
            self.totals.evaluations + evaluations,
            self.totals.simulated + len(told),
            self.totals.steps + int(told["steps"].sum()),
        )
        programs = [phenotype.digest for phenotype in offspring.phenotypes if phenotype is not None]
        mapped = offspring.mapped or self.mapper.map(offspring.genomes)
        record = summary(
            len(self.history), self.scores, programs, mapped, totals, self._wall_s(), self.problem.failure
        )
        self.history.append(record)
        self._patience.see(self.history[-1].best)
        fittest = int(np.lexsort((-self.scores["share"], self.scores["merit"]))[0])
        if self._best is None or _rank(self.scores[fittest]) < _rank(self._best.score[0]):
            phenotype = offspring.phenotypes[fittest]
            program = None if phenotype is None else phenotype.program
            score = self.scores[fittest : fittest + 1].copy()
            self._best = Best(offspring.genomes[fittest].copy(), score, self.generation, program)

    def _keep_contenders(self, offspring: Offspring[P], scores: Scores) -> None:
        """Keep the best programs so far, with what is known of them now."""
        for i, phenotype in enumerate(offspring.phenotypes):
            if phenotype is not None and scores["merit"][i] < self.problem.failure:
                score, known = scores[i : i + 1].copy(), self._contenders.get(phenotype.digest)
                found = known or Best(
                    offspring.genomes[i].copy(), score, len(self.history), phenotype.program
                )
                self._contenders[phenotype.digest] = replace(found, score=score)
            elif phenotype is not None:
                self._contenders.pop(phenotype.digest, None)
        ranked = sorted(self._contenders, key=lambda digest: _rank(self._contenders[digest].score[0]))
        self._contenders = {digest: self._contenders[digest] for digest in ranked[:CONTENDERS]}

    def _dump_contenders(self) -> tuple[Genomes, Scores, npt.NDArray[np.int64]]:
        kept = list(self._contenders.values())
        genomes = np.array([one.genome for one in kept], self.genomes.dtype).reshape(
            -1, self.genomes.shape[1]
        )
        scores = np.concatenate([self.scores[:0], *(one.score for one in kept)])
        return genomes, scores, np.array([one.generation for one in kept], np.int64)

    def _wall_s(self) -> float:
        return self._earlier_s + (0.0 if self._began is None else time.perf_counter() - self._began)

    def _refuse_while_asked(self, where: str) -> None:
        if self._offspring is not None:
            found = f"generation {len(self.history)} asked for and not told"
            raise expected(where, found, f"tell with the {len(self._asked)} scores first")


def run(
    evolution: Evolution[P],
    score: Callable[[list[Candidate[P]]], Any],
    after: Callable[[Generation], None] = lambda generation: None,  # noqa: ARG005
) -> None:
    """Ask and tell until an evolution is finished.

    Parameters
    ----------
    evolution
        New or resumed.
    score
        Scores candidates.
    after
        Called with each generation's record.
    """
    while not evolution.finished:
        after(evolution.tell(score(evolution.ask())))


def rehearse(settings: EvolutionSettings, mapper: Mapper, problem: Problem[P]) -> None:
    """Run two small generations without scores, so that everything is compiled before time is measured."""
    elites = min(settings.elites, 1)
    sizes = {"population": elites + 4, "elites": elites, "generations": 1, "offspring": 0, "islands": 1}
    small = settings.model_copy(update=sizes | {"replacement": "generational"})
    run(Evolution(mapper, problem, small, 0), lambda asked: problem.failed(len(asked)))


def _rank(score: Any) -> tuple[float, float]:
    return float(score["merit"]), -float(score["share"])
