"""Reproduction: selection and variation, in the order of the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic

import numpy as np
import numpy.typing as npt

from gecar.evolution.crossover import Genomes
from gecar.evolution.islands import Island, divide, lay_out
from gecar.evolution.lineage import differs
from gecar.evolution.operators import Operators, Variation, any_fresh, change_of
from gecar.evolution.phenotypes import Phenotype, Phenotypes
from gecar.evolution.problem import P, Problem
from gecar.evolution.scores import Scores, merits
from gecar.evolution.selection import Population
from gecar.evolution.settings import EvolutionSettings
from gecar.language.mapping import Mapped, Mapper
from gecar.random_streams import Streams, spawn

Bytes = npt.NDArray[np.uint8]
Int32s = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Offspring(Generic[P]):
    """New individuals, without scores yet.

    Attributes
    ----------
    genomes
        Of each island those that are copied first, such as elites (population, codons).
    phenotypes
        Their programs; None if a genome maps to none.
    parents
        Indices of parent and mate in the population before (population, 2). An elite is its own parent and mate;
        those of a random individual are -1.
    changed
        Which operators changed the derivation (population,), as bits; see `gecar.evolution.lineage`.
    copied, islands
        Whether each is a copy, and its island (population,).
    mapped
        What the genomes derive; None where it is not at hand.
    """

    genomes: Genomes
    phenotypes: list[Phenotype[P] | None]
    parents: Int32s
    changed: Bytes
    copied: npt.NDArray[np.bool_]
    islands: Int32s
    mapped: Mapped | None = None

    def part(self, places: Int32s) -> Offspring[P]:
        """Return the individuals at some places, each at most once and in order; itself where those are all."""
        if len(places) == len(self.genomes):
            return self
        phenotypes = [self.phenotypes[place] for place in places.tolist()]
        return Offspring(
            self.genomes[places],
            phenotypes,
            self.parents[places],
            self.changed[places],
            self.copied[places],
            self.islands[places],
        )


Drawn = tuple[Genomes, Int32s, Bytes]
"""Genomes, parents and changes, as in `Offspring`."""


class Reproduction(Generic[P]):
    """Makes populations; they depend only on the arguments.

    Parameters
    ----------
    settings
        Sizes, and how duplicates are treated.
    operators
        Initialisation, selection and variation.
    mapper
        Maps genomes to derivations.
    problem
        Reads programs from derivations and ranks scores.
    seed
        Random seed of the run.
    """

    def __init__(
        self,
        settings: EvolutionSettings,
        operators: Operators,
        mapper: Mapper,
        problem: Problem[P],
        seed: int,
    ) -> None:
        self.settings, self.operators = settings, operators
        self.mapper, self.problem, self.seed = mapper, problem, seed
        self._phenotypes = Phenotypes(mapper, problem)

    def read(self, genomes: Genomes) -> list[Phenotype[P] | None]:
        """Return the phenotypes of genomes."""
        return self._phenotypes.read(genomes)

    def begin(self, generation: int, known: Callable[[bytes], bool]) -> Offspring[P]:
        """Return an initial population, at generation 0 or at a restart."""
        settings = self.settings

        def draw(attempt: int) -> Drawn:
            n = settings.population
            genomes = self.operators.initialise(self.mapper, spawn(self.seed, generation, attempt, n))
            return genomes, np.full((n, 2), -1, np.int32), np.zeros(n, np.uint8)

        n, parts = settings.population, settings.islands
        islands = np.repeat(np.arange(parts, dtype=np.int32), n // parts)
        return self._without_duplicates(draw, np.zeros(n, bool), islands, known)

    def next(
        self,
        genomes: Genomes,
        scores: Scores,
        generation: int,
        known: Callable[[bytes], bool],
        grown: bool = False,
    ) -> Offspring[P]:
        """Return the population that follows one with scores; with a replacement, the parents and their children.

        Parameters
        ----------
        genomes, scores
            The population before.
        generation
            The number of the new one.
        known
            Whether a program, by its digest, was scored before.
        grown
            Whether children have a subtree duplicated instead of being crossed and mutated; they then replace all but
            the elites.
        """
        operators = self.operators.grow if grown else self.operators.vary
        fresh = any_fresh(self.operators.vary)
        population = self._population(genomes, scores)
        settings = self.settings.model_copy(update={"islands": 1}) if grown else self.settings
        all_live_on = self.operators.replace is not None and not grown
        islands = divide(population.merits, settings, generation, all_live_on)
        copied = np.concatenate([island.copied for island in islands])
        layout = lay_out(islands)

        def draw(attempt: int) -> Drawn:
            streams = spawn(self.seed, generation, attempt, sum(island.drawn for island in islands))
            chosen = self._select(population, islands, streams)
            children, changed = self._vary(operators, genomes[chosen], streams)
            pairs = np.column_stack([chosen, chosen.reshape(-1, 2)[:, ::-1].ravel()])
            if fresh:
                pairs[:] = -1
            return (
                np.concatenate([genomes[copied], children])[layout.order],
                np.concatenate([np.column_stack([copied, copied]), pairs])[layout.order],
                np.concatenate([np.zeros(len(copied), np.uint8), changed])[layout.order],
            )

        return self._without_duplicates(draw, layout.copied, layout.islands, known)

    def survivors(self, offspring: Offspring[P], scores: Scores) -> Int32s:
        """Return the places of those that live on in what `next` returned, by their scores (population,)."""
        n, parts = self.settings.population, self.settings.islands
        if self.operators.replace is None or len(scores) == n:
            return np.arange(len(scores), dtype=np.int32)
        population = self._population(offspring.genomes, scores)
        places = (np.flatnonzero(offspring.islands == island) for island in range(parts))
        living = [here[self.operators.replace(population.part(here), n // parts)] for here in places]
        return np.concatenate(living).astype(np.int32)

    def _population(self, genomes: Genomes, scores: Scores) -> Population:
        ranked = merits(scores, self.problem.partial_credit, self.problem.failure)
        return Population(genomes, scores, ranked, self.problem.cases(scores))

    def _select(self, population: Population, islands: Sequence[Island], streams: Streams) -> Int32s:
        """Return the places of all children's parents, each from its own island (children drawn,)."""
        if len(islands) == 1:
            return self.operators.select(population, streams)
        ends = np.cumsum([island.drawn for island in islands])
        chosen = [
            island.places[
                self.operators.select(population.part(island.places), streams[end - island.drawn : end])
            ]
            for island, end in zip(islands, ends.tolist(), strict=True)
        ]
        return np.concatenate(chosen)

    def _vary(
        self, operators: tuple[Variation, ...], children: Genomes, streams: Streams
    ) -> tuple[Genomes, Bytes]:
        """Return the children after all operators, and which operators changed their derivations."""
        changed, before = np.zeros(len(children), np.uint8), self.mapper.map(children)
        for operator in operators:
            children = operator(children, self.mapper, streams)
            after = self.mapper.map(children)
            changed |= change_of(operator) * differs(before, after)
            before = after
        return children, changed

    def _without_duplicates(
        self,
        draw: Callable[[int], Drawn],
        copied: npt.NDArray[np.bool_],
        islands: Int32s,
        known: Callable[[bytes], bool],
    ) -> Offspring[P]:
        """Draw individuals, and replace duplicates, as often as the settings allow."""
        self._phenotypes.turn()
        genomes, parents, changed = draw(0)
        derived = self.mapper.map(genomes)
        phenotypes = self._phenotypes.of(derived)
        attempts = 0 if self.settings.duplicates == "kept" else self.settings.attempts
        simulated = known if self.settings.duplicates == "run" else _never
        mapped: Mapped | None = derived
        for attempt in range(1, attempts + 1):
            again = _duplicates(phenotypes, copied, simulated)
            if not again:
                break
            mapped = None
            drawn = draw(attempt)
            genomes[again], parents[again], changed[again] = (each[again] for each in drawn)
            for i, phenotype in zip(again, self._phenotypes.read(genomes[again]), strict=True):
                phenotypes[i] = phenotype
        return Offspring(genomes, phenotypes, parents, changed, copied, islands, mapped)


def _duplicates(
    phenotypes: list[Phenotype[P] | None], copied: npt.NDArray[np.bool_], simulated: Callable[[bytes], bool]
) -> list[int]:
    """Return the individuals, except copies, without a program or with one seen before."""
    seen: set[bytes] = set()
    found = []
    for i, phenotype in enumerate(phenotypes):
        if not copied[i] and (phenotype is None or phenotype.digest in seen or simulated(phenotype.digest)):
            found.append(i)
        if phenotype is not None:
            seen.add(phenotype.digest)
    return found


def _never(digest: bytes) -> bool:  # noqa: ARG001
    return False
