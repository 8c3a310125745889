"""Settings of an evolution: sizes, rates and operators; the defaults are the paper's Table 4."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

MAX_CODONS_IN_ALL = 200_000_000
"""Most codons of a whole population: 200 MB."""

Rate = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]


class EvolutionSettings(BaseModel):
    """Settings of any evolution; the defaults are the paper's Table 4.

    Attributes
    ----------
    population, generations
        Individuals, and number of generations after the first population.
    codons
        Genome length: number of codons, each 0..255.
    elites
        Number of best individuals that are copied unchanged.
    initialisation
        ``uniform``: random codons. ``sensible``: derivation trees grown or full, up to `initial_depth`
        (Ryan and Azad 2003). ``ptc2``: trees of 1 to `initial_expansions` expansions, expanded at random
        places (Luke 2000, Nicolau 2017).
    initial_depth
        Greatest depth of a ``sensible`` tree.
    initial_expansions
        Largest number of expansions of a ``ptc2`` tree.
    selection
        ``tournament``; or ``lexicase``: by the problem's cases, in random order, each as good as the best within
        the median absolute deviation (Spector 2012, La Cava 2016).
    tournament
        Individuals in a tournament.
    crossover
        ``one_point``: anywhere in the genome, the same point in both. ``one_point_used``: within the codons
        both parents use. ``variable_one_point``: within the codons each parent uses, at a different point in each
        (PonyGE2's default). ``subtree``: subtrees of the same nonterminal are swapped.
    crossover_rate
        Share of pairs that are crossed.
    mutation
        ``codon``: any codon of the genome. ``used_codon``: only codons the child uses. ``one_used_codon``: the
        same, one codon per child on average, independent of `mutation_rate` (PonyGE2's default). ``renew``: every
        child is a new random individual, which makes a random search.
    mutation_rate
        Probability that a codon is replaced by a random one.
    creep_rate
        Probability that a used codon that chooses a number changes to a number near it.
    creep_most
        Largest mean number of such changes per child; inf: no limit.
    creep_reach
        No such change is as large as this share of the numbers there are; 0: always to a neighbouring number.
    duplication_rate
        Probability that one of a child's subtrees is duplicated, in a child of at most
        `gecar.evolution.operators.LONGEST` codons.
    duplicates
        ``kept``; or replaced, up to `attempts` times, if the same program is already in the ``generation``, or was
        scored before in the ``run``.
    attempts
        How often a duplicate is replaced.
    restart_after
        Generations without a better program after which the population is replaced; four times as many while none has
        succeeded. The best program so far is kept as the run's result. 0: never.
    restart
        The new population. ``random``: random individuals. ``grown``: random individuals at the first restart, later
        the best programs so far with one of their subtrees duplicated.
    replacement
        Who lives on. ``generational``: the children, and the elites. ``worst``: the best of parents and children; with
        one or two `offspring` a steady state (Whitley 1989). ``nsga2``, ``map_elites``: by several goals, the
        problem's cases, which then also select parents; see `gecar.evolution.goals`.
    offspring
        Children per generation, where parents may live on. 0: as many as the population has individuals.
    ranges
        Of ``map_elites``: range of each case but the first; as many cells as the population has individuals.
    islands
        Number of parts of the population that evolve on their own, but for migrants.
    migration_every
        Generations after which the best of each island also joins the next island, the last one's the first (a ring).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    population: int = Field(200, ge=2, le=1_000_000)
    generations: int = Field(50, ge=0, le=1_000_000)
    codons: int = Field(1_000, ge=1, le=1_000_000)
    elites: int = Field(1, ge=0)
    initialisation: Literal["uniform", "sensible", "ptc2"] = "uniform"
    initial_depth: int = Field(8, ge=1, le=1_000)
    initial_expansions: int = Field(40, ge=1, le=10_000)
    selection: Literal["tournament", "lexicase"] = "tournament"
    tournament: int = Field(5, ge=1, le=1_000_000)
    crossover: Literal["one_point", "one_point_used", "variable_one_point", "subtree"] = "one_point"
    crossover_rate: Rate = 0.5
    mutation: Literal["codon", "used_codon", "one_used_codon", "renew"] = "codon"
    mutation_rate: Rate = 0.05
    creep_rate: Rate = 0.0
    creep_most: float = Field(math.inf, gt=0.0)
    creep_reach: float = Field(0.0, ge=0.0, le=0.5)
    duplication_rate: Rate = 0.0
    duplicates: Literal["kept", "generation", "run"] = "kept"
    attempts: int = Field(10, ge=1, le=1_000)
    restart_after: int = Field(0, ge=0, le=1_000_000)
    restart: Literal["random", "grown"] = "random"
    replacement: Literal["generational", "worst", "nsga2", "map_elites"] = "generational"
    offspring: int = Field(0, ge=0, le=1_000_000)
    ranges: tuple[tuple[float, float], ...] = ()
    islands: int = Field(1, ge=1, le=1_000)
    migration_every: int = Field(10, ge=1, le=1_000_000)

    @model_validator(mode="after")
    def _fits(self) -> EvolutionSettings:
        if self.elites >= self.population:
            raise ValueError(
                f"found elites = {self.elites}, expected fewer than population = {self.population}"
            )
        if self.population * self.codons > MAX_CODONS_IN_ALL:
            size = f"{self.population} x {self.codons} codons"
            raise ValueError(f"found population x codons = {size}, expected at most {MAX_CODONS_IN_ALL}")
        return self

    @model_validator(mode="after")
    def _parts_are_whole(self) -> EvolutionSettings:
        children = self.offspring or self.population
        if self.offspring and self.replacement == "generational":
            raise ValueError(
                "found offspring with replacement = generational, expected worst, nsga2 or map_elites"
            )
        if self.islands == 1:
            return self
        if self.replacement == "map_elites":
            raise ValueError("found islands with replacement = map_elites, expected another replacement")
        if self.population % self.islands or children % self.islands:
            found = f"{self.islands} islands for {self.population} individuals and {children} children"
            raise ValueError(f"found {found}, expected numbers that the islands share evenly")
        if self.population // self.islands < max(self.elites, 1) + 2:
            raise ValueError(
                f"found {self.islands} islands, expected room for elites, a migrant and a child on each"
            )
        return self

    @property
    def evaluations(self) -> int:
        """Evaluations of a whole run, the first population included."""
        return self.population + self.generations * (self.offspring or self.population)
