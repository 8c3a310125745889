"""The evolution, as ask and tell: it says which programs it wants scored, and is told their scores.

evolution = Evolution(Settings(), Mapper(load_grammar("paper")), seed=1)
while not evolution.finished:
    evolution.tell([my_fitness(candidate.program) for candidate in evolution.ask()])
print(evolution.best.program, evolution.best.fitness_s)
"""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.breeding import Bred, Breeder
from gecar.evolution.history import HISTORY, Generation, Patience, Totals, summary
from gecar.evolution.lineage import Ledger
from gecar.evolution.score_cache import ScoreCache
from gecar.evolution.state import Best, Candidate, State
from gecar.language.mapping import Mapper
from gecar.language.opcodes import MAX_DUTY_PCT
from gecar.language.program import Program
from gecar.search.chance import add_drives, wants_more
from gecar.search.evaluation import n_times
from gecar.search.fitness import UNSOLVED, Scores, as_scores, invalid_scores, merit
from gecar.search.settings import Settings

Bytes = npt.NDArray[np.uint8]
CONTENDERS = 40
"""Best programs kept, to choose from at the end."""


class Evolution:
    """An evolution of programs.

    Parameters
    ----------
    settings
        Sizes, rates and operators.
    mapper
        What genomes derive.
    seed
        Where all randomness comes from; equal seeds, equal runs.
    n_arrivals
        How many arrival times scores hold, for ``lexicase``.
    duty_cap_pct
        Duty beyond which commands do the same [%]: programs that differ only there are one program.

    Raises
    ------
    InputError
        If the seed is no whole number from 0 up, or lexicase has no arrival times.
    """

    def __init__(
        self,
        settings: Settings,
        mapper: Mapper,
        seed: int = 1,
        n_arrivals: int = 0,
        duty_cap_pct: int = MAX_DUTY_PCT,
    ) -> None:
        if not 0 <= seed < 2**64:
            raise expected("seed", seed, "a whole number from 0 to 2^64 - 1")
        if settings.needs_arrivals and n_arrivals == 0:
            raise expected("n_arrivals", 0, "the number of checkpoints and GOAL, for lexicase selection")
        self.settings, self.mapper, self.seed, self.n_arrivals = settings, mapper, seed, n_arrivals
        self.n_times = n_times(settings.draws)
        self.history: list[Generation] = []
        self.genomes: Bytes = np.zeros((0, settings.codons), np.uint8)
        self.scores: Scores = invalid_scores(0, n_arrivals, self.n_times)
        self._best: Best | None = None
        self._contenders: dict[bytes, Best] = {}
        self._cache = ScoreCache(n_arrivals, self.n_times)
        self._breeder = Breeder(settings, mapper, seed, duty_cap_pct)
        self._bred: Bred | None = None
        self._parents = np.zeros((0, 2), np.int32)
        self._ledger = Ledger()
        self._patience = Patience(settings.restart_after)
        self._asked: dict[bytes, list[int]] = {}
        self._began: float | None = None
        self._earlier_s = 0.0

    @classmethod
    def resume(
        cls,
        settings: Settings,
        mapper: Mapper,
        state: State,
        n_arrivals: int = 0,
        duty_cap_pct: int = MAX_DUTY_PCT,
    ) -> Evolution:
        """Go on from a state, to the same end as if there had been no break."""
        evolution = cls(settings, mapper, state.seed, n_arrivals, duty_cap_pct)
        evolution.history = [Generation(*row.tolist()) for row in state.history]
        for generation in evolution.history:
            evolution._patience.see(generation.best)
        evolution.genomes, evolution.scores = state.genomes, state.scores
        evolution._ledger = Ledger(state.lineage, going_on=True)
        evolution._earlier_s = evolution.history[-1].wall_s
        evolution._cache.add([row.tobytes() for row in state.digests], state.cached)
        program = mapper.map(state.best_genome[None]).program(0)
        evolution._best = Best(state.best_genome, state.best_score, state.best_generation, program)
        found = zip(
            state.contenders, state.contender_scores, state.contender_generations.tolist(), strict=True
        )
        for phenotype, (genome, score, generation) in zip(
            evolution._breeder.read(state.contenders), found, strict=True
        ):
            if phenotype is not None:
                best = Best(
                    genome.copy(), np.array([score], state.scores.dtype), generation, phenotype.program
                )
                evolution._contenders[phenotype.digest] = best
        return evolution

    def state(self) -> State:
        """Return what `resume` needs.

        Raises
        ------
        InputError
            If there is no finished generation, or one is asked for and not told.
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
        """Whether the last generation has its scores."""
        return self.generation == self.settings.generations

    @property
    def totals(self) -> Totals:
        """What has been spent so far."""
        last = self.history[-1] if self.history else None
        return Totals(last.evaluations, last.simulated, last.steps) if last else Totals()

    @property
    def best(self) -> Best:
        """The best individual so far; among those that miss GOAL the one that came farthest.

        Raises
        ------
        InputError
            If no generation has its scores yet.
        """
        if self._best is None:
            raise expected("best", "no generation with scores", "ask and tell first")
        return self._best

    @property
    def contenders(self) -> list[Best]:
        """The best programs so far by merit, the best first; without drawn conditions that is the best alone."""
        ranked = sorted(self._contenders.values(), key=lambda contender: _rank(contender.score[0]))
        return ranked or [self.best]

    def choose(self, contender: Best) -> None:
        """Make a contender the best: what looked best may have been lucky, as fresh draws show."""
        self._best = contender

    @property
    def parents(self) -> npt.NDArray[np.int32]:
        """Whom the individuals asked for, or told of last, come from; see `gecar.evolution.breeding.Bred`."""
        return self._parents

    def ask(self) -> list[Candidate]:
        """Breed the next generation and return the programs in it that have no score yet, each once.

        With drawn conditions, also those that have arrived often enough so far, to be driven under fresh ones. There
        may be none; `tell` them all the same.

        Raises
        ------
        InputError
            If the last generation asked for has not been told, or the run is finished.
        """
        self._refuse_while_asked("ask")
        if self.finished:
            raise expected("ask", f"all {self.settings.generations} generations done", "an unfinished run")
        if self._began is None:
            self._began = time.perf_counter()
        self._bred = self._breed()
        self._parents = self._bred.parents
        programs: dict[bytes, Program] = {}
        self._asked = {}
        for i, phenotype in enumerate(self._bred.phenotypes):
            if phenotype is not None and self._wants_drives(phenotype.digest):
                programs[phenotype.digest] = phenotype.program
                self._asked.setdefault(phenotype.digest, []).append(i)
        to_beat_s = math.inf if self._best is None else self._best.merit_s
        generation = len(self.history)
        return [Candidate(p, noise_seed(self.seed, p), to_beat_s, generation) for p in programs.values()]

    def tell(self, results: Any) -> Generation:
        """Take the scores of the programs asked for.

        Parameters
        ----------
        results
            In the order of `ask`: scores of dtype `gecar.search.fitness.score_type`, or fitness [s] as plain
            numbers, lower is better and 10000 for failure.

        Returns
        -------
        Generation
            The generation's record.

        Raises
        ------
        InputError
            If nothing is asked for, or the results do not fit.
        """
        if self._bred is None:
            raise expected("tell", "no generation that waits for scores", "ask first")
        told = self._pooled(as_scores(results, len(self._asked), self.n_arrivals, self.n_times))
        bred, scores = self._bred, self._score(self._bred, told)
        self._cache.add(list(self._asked), told)
        self.genomes, self.scores, self._bred = bred.genomes, scores, None
        self._record(bred, told)
        keys = [b"" if phenotype is None else phenotype.key for phenotype in bred.phenotypes]
        self._ledger.add(bred.parents, bred.changed, merit(scores, checkpoint_credit=True), keys)
        return self.history[-1]

    def _wants_drives(self, digest: bytes) -> bool:
        if digest not in self._cache:
            return True
        return self.n_times > 0 and wants_more(self._cache.look_up([digest])[0])

    def _pooled(self, told: Scores) -> Scores:
        """Add to what is known of programs what was driven now."""
        if self.n_times > 0:
            for k, digest in enumerate(self._asked):
                if digest in self._cache:
                    known = self._cache.look_up([digest])
                    add_drives(known[0], told[k], self.settings.arrival_share)
                    told[k] = known[0]
        return told

    def _breed(self) -> Bred:
        generation, known = len(self.history), self._cache.__contains__
        if not self.history or self._patience.at_its_end:
            return self._breeder.begin(generation, known)
        return self._breeder.next(self.genomes, self.scores, generation, known)

    def _score(self, bred: Bred, told: Scores) -> Scores:
        """Put together the population's scores: invalid, known before, or told now."""
        scores = invalid_scores(len(bred.genomes), self.n_arrivals, self.n_times)
        digests = {i: p.digest for i, p in enumerate(bred.phenotypes) if p is not None}
        known = [i for i, digest in digests.items() if digest not in self._asked]
        scores[known] = self._cache.look_up([digests[i] for i in known])
        for members, score in zip(self._asked.values(), told, strict=True):
            scores[members] = score
        return scores

    def _record(self, bred: Bred, told: Scores) -> None:
        totals = Totals(
            self.totals.evaluations + len(bred.genomes),
            self.totals.simulated + len(told),
            self.totals.steps + int(told["steps"].sum()),
        )
        programs = len({phenotype.digest for phenotype in bred.phenotypes if phenotype is not None})
        self.history.append(summary(len(self.history), self.scores, programs, totals, self._wall_s()))
        self._patience.see(self.history[-1].best)
        if self.n_times > 0:
            self._keep_contenders(bred)
        fittest = int(np.lexsort((-self.scores["share"], self.scores["merit_s"]))[0])
        if self._best is None or _rank(self.scores[fittest]) < _rank(self._best.score[0]):
            phenotype = bred.phenotypes[fittest]
            program = None if phenotype is None else phenotype.program
            score = self.scores[fittest : fittest + 1].copy()
            self._best = Best(bred.genomes[fittest].copy(), score, self.generation, program)

    def _keep_contenders(self, bred: Bred) -> None:
        """Keep the best programs so far, with what is known of them now."""
        for i, phenotype in enumerate(bred.phenotypes):
            if phenotype is not None and self.scores["merit_s"][i] < UNSOLVED:
                known = self._contenders.get(phenotype.digest)
                generation = known.generation if known else self.generation
                score = self.scores[i : i + 1].copy()
                genome = bred.genomes[i].copy()
                self._contenders[phenotype.digest] = Best(genome, score, generation, phenotype.program)
            elif phenotype is not None:
                self._contenders.pop(phenotype.digest, None)
        ranked = sorted(self._contenders, key=lambda digest: _rank(self._contenders[digest].score[0]))
        self._contenders = {digest: self._contenders[digest] for digest in ranked[:CONTENDERS]}

    def _dump_contenders(self) -> tuple[Bytes, Scores, npt.NDArray[np.int64]]:
        kept = list(self._contenders.values())
        genomes = np.array([one.genome for one in kept], np.uint8).reshape(-1, self.settings.codons)
        scores = np.concatenate([self.scores[:0], *(one.score for one in kept)])
        return genomes, scores, np.array([one.generation for one in kept], np.int64)

    def _wall_s(self) -> float:
        return self._earlier_s + (0.0 if self._began is None else time.perf_counter() - self._began)

    def _refuse_while_asked(self, where: str) -> None:
        if self._bred is not None:
            found = f"generation {len(self.history)} asked for and not told"
            raise expected(where, found, f"tell with the {len(self._asked)} scores first")


def run(
    evolution: Evolution,
    score: Callable[[list[Candidate]], Any],
    after: Callable[[Generation], None] = lambda generation: None,  # noqa: ARG005
) -> None:
    """Ask and tell until an evolution is finished.

    Parameters
    ----------
    evolution
        New or resumed.
    score
        Scores candidates: a `gecar.search.batches.Batches`, or any function.
    after
        Called with each generation's record.
    """
    while not evolution.finished:
        after(evolution.tell(score(evolution.ask())))


def rehearse(settings: Settings, mapper: Mapper) -> None:
    """Run two small generations that score nothing, so that all compiled code is there before the clock runs."""
    small = settings.model_copy(update={"population": settings.elites + 4, "generations": 1})
    sizes = 2 if settings.needs_arrivals else 0, n_times(settings.draws)
    run(Evolution(small, mapper, 0, sizes[0]), lambda asked: invalid_scores(len(asked), *sizes))


def _rank(score: Any) -> tuple[float, float]:
    return float(score["merit_s"]), -float(score["share"])


def noise_seed(seed: int, program: Program) -> int:
    """Return the seed of the noise a program is driven with: its own, and the same whenever the run meets it."""
    return int.from_bytes(hashlib.blake2b(program.canonical, digest_size=8, key=seed.to_bytes(8)).digest())
