"""Inputs and outputs of an evolution: candidates, the best so far, and the state for resuming."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.displayed import Displayed
from gecar.evolution.problem import P
from gecar.evolution.scores import Floats, Scores

Bytes = npt.NDArray[np.uint8]
Genomes = npt.NDArray[np.integer[Any]]


class Candidate(NamedTuple, Generic[P]):
    """A program to be scored, the seed of its noise, the best merit so far, the generation."""

    program: P
    seed: int
    to_beat: float = math.inf
    generation: int = 0


@dataclass(frozen=True)
class Best(Displayed, Generic[P]):
    """The best individual of a run so far.

    Attributes
    ----------
    genome
        Its codons (codons,).
    score
        The problem's dtype, shape (1,).
    generation
        When it was found.
    program
        None if no genome so far maps to a program.
    """

    genome: Genomes
    score: Scores
    generation: int
    program: P | None

    @property
    def merit(self) -> float:
        """The number that ranks individuals in selection; lower is better."""
        return float(self.score["merit"][0])

    @property
    def fitness(self) -> float | Floats:
        """The fitness function's value, (scores,) if there are several; the mean of several draws."""
        values = self.score["values"][0] if "values" in (self.score.dtype.names or ()) else [self.merit]
        return float(values[0]) if len(values) == 1 else np.asarray(values, float)


@dataclass(frozen=True)
class State:
    """All an evolution needs to go on, between two generations.

    Attributes
    ----------
    seed
        The run's.
    genomes, scores
        The population (population, codons), (population,).
    best_genome, best_score, best_generation
        The best so far (codons,), (1,).
    contenders, contender_scores, contender_generations
        The best programs so far, and when each was found (n, codons), (n,), (n,).
    history
        Dtype `gecar.evolution.history.HISTORY`, shape (generations so far,).
    digests, cached
        The score cache, oldest first (n, 16), (n,).
    lineage
        What a `gecar.evolution.lineage.Ledger` kept (bytes,).
    """

    seed: int
    genomes: Genomes
    scores: Scores
    best_genome: Genomes
    best_score: Scores
    best_generation: int
    contenders: Genomes
    contender_scores: Scores
    contender_generations: npt.NDArray[np.int64]
    history: npt.NDArray[np.void]
    digests: Bytes
    cached: Scores
    lineage: Bytes
