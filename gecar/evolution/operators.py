"""Operators as objects: any object with the same protocol can replace one.

evolution = Evolution(mapper, fitness=error, operators=Operators.of(settings, select=Tournament(2), mutation=mine))
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gecar.errors import expected
from gecar.evolution.crossover import Genomes, OnePoint, Subtree, VariableOnePoint
from gecar.evolution.goals import MapElites, Nsga2
from gecar.evolution.initialisation import Initialisation, Ptc2, Sensible, Uniform
from gecar.evolution.lineage import MUTATION
from gecar.evolution.mutation import Creep, Duplicate, Flip, Renew
from gecar.evolution.replacement import Replacement, ReplaceWorst
from gecar.evolution.selection import Lexicase, Selection, Tournament
from gecar.evolution.settings import EvolutionSettings
from gecar.language.mapping import Mapper
from gecar.random_streams import Streams

GROWN = 0.7
"""Probability that a child of a stagnant population has one of its subtrees duplicated."""
LONGEST = 54
"""Most codons of such a child: six conditions of Table 3, 24 lines. Without a limit winners had up to 18 conditions."""


class Variation(Protocol):
    """Changes children: crossover, mutation, or anything else.

    These attributes are optional.

    ``change``: `gecar.evolution.lineage.CROSSOVER`, `MUTATION` (the default), `CREEP` or `DUPLICATION`.
    ``linear``: whether it needs a mapper that reads codons from the first on (default: no).
    ``fresh``: whether children are independent of their parents (default: no).
    """

    def __call__(self, genomes: Any, mapper: Any, streams: Streams) -> Genomes:
        """Return the children.

        Parameters
        ----------
        genomes
            Codons, may be changed in place (children, codons); 0 and 1 are a pair, 2 and 3, and so on.
        mapper
            What they derive.
        streams
            One for each (children,); `gecar.random_streams.generators` makes NumPy generators of them.
        """


@dataclass(frozen=True)
class Operators:
    """The operators of an evolution.

    Attributes
    ----------
    initialise
        Makes initial populations.
    select
        Selects parents.
    vary
        Change children, one after the other: crossover, mutation and so on.
    grow
        Replace them after a restart with duplication; see `restart` of `EvolutionSettings`.
    replace
        Chooses who lives on among parents and children. None: the children, and as many elites as the settings say.
    """

    initialise: Initialisation
    select: Selection
    vary: tuple[Variation, ...]
    grow: tuple[Variation, ...] = (Duplicate(GROWN, LONGEST),)
    replace: Replacement | None = None

    @classmethod
    def of(
        cls,
        settings: EvolutionSettings,
        *,
        initialise: Initialisation | None = None,
        select: Selection | None = None,
        crossover: Variation | None = None,
        mutation: Variation | None = None,
        replace: Replacement | None = None,
    ) -> Operators:
        """Return the operators that settings name, some of them replaced by those given."""
        initialise = initialise or INITIALISATIONS[settings.initialisation](settings)
        goals = GOALS[settings.replacement](settings)
        select = select or (goals.select if goals else SELECTIONS[settings.selection](settings))
        replace = replace or (goals.replace if goals else REPLACEMENTS[settings.replacement])
        creep = (
            (Creep(settings.creep_rate, settings.creep_most, settings.creep_reach),)
            if settings.creep_rate
            else ()
        )
        grow = (Duplicate(GROWN, LONGEST), *creep)
        duplicate = (Duplicate(settings.duplication_rate, LONGEST),) if settings.duplication_rate else ()
        if settings.mutation == "renew" and mutation is None:
            return cls(initialise, select, (Renew(initialise),), grow, replace)
        crossover = crossover or CROSSOVERS[settings.crossover](settings.crossover_rate)
        rate = None if settings.mutation == "one_used_codon" else settings.mutation_rate
        mutation = mutation or Flip(rate, within_used=settings.mutation != "codon")
        return cls(initialise, select, (crossover, mutation, *duplicate, *creep), grow, replace)

    @property
    def archive(self) -> MapElites | None:
        """The MAP-Elites that chooses who lives on; None if something else does."""
        algorithm = _algorithm(self.replace)
        return algorithm if isinstance(algorithm, MapElites) else None

    def check(self, mapper: Mapper, n_cases: int, grows: bool = False) -> None:
        """Check that the operators suit a mapper and scores; those of `grow` if they are used.

        Raises
        ------
        InputError
            If one needs cases and there are none, or codons read from the first on and the mapper has genes.
        """
        for chooser in (self.select, self.replace):
            algorithm = _algorithm(chooser)
            if getattr(algorithm, "needs_cases", False) and n_cases == 0:
                found = f"{type(algorithm).__name__.lower()} without cases"
                raise expected("selection", found, "scores with cases, or tournament")
            if isinstance(algorithm, MapElites) and len(algorithm.ranges) != n_cases - 1:
                found = f"{len(algorithm.ranges)} ranges for {n_cases} cases"
                raise expected("map_elites", found, "a range for each case but the first")
        for operator in (*self.vary, *(self.grow if grows else ())):
            if getattr(operator, "linear", False) and not mapper.linear:
                found = f"{type(operator).__name__} for a {type(mapper).__name__}"
                raise expected(
                    "operators",
                    found,
                    "operators on genes, such as GeneCrossover and GeneFlip; restart = random",
                )


def _algorithm(operator: Any) -> Any:
    """Return the object that a method belongs to; any other operator as it is."""
    return getattr(operator, "__self__", operator)


def change_of(operator: Variation) -> np.uint8:
    """Return the bit for an operator in a lineage."""
    return np.uint8(getattr(operator, "change", MUTATION))


def any_fresh(operators: Sequence[Variation]) -> bool:
    """Whether children are independent of their parents."""
    return any(getattr(operator, "fresh", False) for operator in operators)


INITIALISATIONS: dict[str, Callable[[EvolutionSettings], Initialisation]] = {
    "uniform": lambda settings: Uniform(settings.codons),
    "sensible": lambda settings: Sensible(settings.codons, settings.initial_depth),
    "ptc2": lambda settings: Ptc2(settings.codons, settings.initial_expansions),
}
SELECTIONS: dict[str, Callable[[EvolutionSettings], Selection]] = {
    "tournament": lambda settings: Tournament(settings.tournament),
    "lexicase": lambda settings: Lexicase(),  # noqa: ARG005
}
REPLACEMENTS: dict[str, Replacement | None] = {"generational": None, "worst": ReplaceWorst()}
GOALS: dict[str, Callable[[EvolutionSettings], Nsga2 | MapElites | None]] = {
    **dict.fromkeys(REPLACEMENTS, lambda settings: None),  # noqa: ARG005
    "nsga2": lambda settings: Nsga2(settings.tournament),
    "map_elites": lambda settings: MapElites(settings.ranges, settings.population),
}
CROSSOVERS: dict[str, Callable[[float], Variation]] = {
    "one_point": OnePoint,
    "one_point_used": lambda rate: OnePoint(rate, within_used=True),
    "variable_one_point": VariableOnePoint,
    "subtree": Subtree,
}
"""Operators by the names settings know."""
