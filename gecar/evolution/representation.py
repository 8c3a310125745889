"""How genotypes relate to phenotypes: locality and redundancy, measured on a sample of genomes.

Locality is how far a phenotype moves when one codon changes (Rothlauf and Oetzel, "On the locality of grammatical
evolution", EuroGP 2006); the distance is Levenshtein's, in words of the grammar. Redundancy is how many genotypes share
a phenotype (Rothlauf, Representations for Genetic and Evolutionary Algorithms, 2006).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from gecar.compiled import compiled
from gecar.errors import expected
from gecar.language.mapping import Mapped, Mapper

MUTANTS = 5_000
"""Mutants that are made, and random genomes that are drawn."""
MOST_WORDS = 1_000
"""Longest phenotype whose distances are measured: the work grows with the square."""
INVALID, TOO_LONG = -1, -2
"""What stands for the distance of a mutant without a phenotype, and of one that is not measured."""

Genomes = npt.NDArray[Any]
Int32s = npt.NDArray[np.int32]
Int64s = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Representation:
    """Locality and redundancy of some genomes.

    Attributes
    ----------
    genomes
        Their number.
    counts
        How many genomes have each phenotype, the most frequent first (phenotypes,).
    texts
        The phenotypes.
    used
        Codons that each valid genome uses (valid,).
    length
        Codons of the longest genome.
    distances
        How many words each mutant's phenotype is from its genome's: 0 if neutral, `INVALID` if it has none,
        `TOO_LONG` if it was not measured (mutants,).
    places
        Where the changed codon is among those used, 0 (first) to 1 (mutants,).
    """

    genomes: int
    counts: Int64s
    texts: tuple[str, ...]
    used: Int32s
    length: int
    distances: Int32s
    places: npt.NDArray[np.float64]

    @cached_property
    def measured(self) -> npt.NDArray[np.bool_]:
        """Whether a mutant has a phenotype and its distance is known (mutants,)."""
        return self.distances >= 0

    def figures(self) -> dict[str, Any]:
        """Sum up, for JSON; nan where there is nothing to sum up."""
        known = self.distances[self.measured]
        changed = known[known > 0]
        mutants = max(len(self.distances), 1)
        shares = self.counts / max(self.counts.sum(), 1)
        return {
            "genomes": self.genomes,
            "valid": float(self.counts.sum() / self.genomes),
            "codons_used_median": _median(self.used),
            "phenotypes": len(self.counts),
            "entropy_bits": float(-(shares * np.log2(shares)).sum()) + 0.0 if len(shares) else float("nan"),
            "most_frequent": float(shares[0]) if len(shares) else float("nan"),
            "mutants": len(self.distances),
            "neutral": float((known == 0).sum() / mutants),
            "invalid": float((self.distances == INVALID).sum() / mutants),
            "one_word": float((known == 1).sum() / mutants),
            "too_long": float((self.distances == TOO_LONG).sum() / mutants),
            "changed_distance_median": _median(changed),
            "changed_distance_mean": float(changed.mean()) if changed.size else float("nan"),
        }


def random_genomes(mapper: Mapper, codons: int, n: int = MUTANTS, seed: int = 1) -> Genomes:
    """Draw genomes at random (n, codons)."""
    drawn = np.random.default_rng(seed).integers(0, mapper.options.codon_size, (n, codons))
    return drawn.astype(mapper.options.codon_type)


def measure(mapper: Mapper, genomes: Genomes, mutants: int = MUTANTS, seed: int = 1) -> Representation:
    """Measure locality and redundancy of genomes.

    Parameters
    ----------
    mapper
        Maps them; one that reads codons from the first on.
    genomes
        A random sample, or a population (genomes, codons).
    mutants
        How many are made, of valid genomes in turn: one of the codons that the genome uses gets another value.
    seed
        Random seed.

    Raises
    ------
    InputError
        If there is no genome, or the mapper reads codons in another order.
    """
    if not mapper.linear:
        raise expected("mapper", f"a {type(mapper).__name__}", "one that reads codons from the first on")
    if not len(genomes):
        raise expected("genomes", "none", "at least one")
    mapped = mapper.map(genomes)
    valid = np.flatnonzero(mapped.valid)
    counted = Counter(mapped.text(i) for i in valid.tolist()).most_common()
    parents = _spread(valid[mapped.used[valid] > 0], mutants)
    changed, places = _mutated(mapper, genomes[parents], mapped.used[parents], np.random.default_rng(seed))
    return Representation(
        len(genomes),
        np.array([count for _, count in counted], np.int64),
        tuple(text for text, _ in counted),
        mapped.used[valid],
        genomes.shape[1],
        _distances(mapped, parents, mapper.map(changed)),
        places,
    )


def _spread(places: npt.NDArray[Any], n: int) -> npt.NDArray[Any]:
    """Return n of the places, each about as often; none of none."""
    return np.resize(places, n) if places.size else places


def _mutated(
    mapper: Mapper, genomes: Genomes, used: Int32s, rng: np.random.Generator
) -> tuple[Genomes, npt.NDArray[np.float64]]:
    """Give one used codon of each genome another value; return the genomes, and where that is (genomes,)."""
    n, size = len(genomes), mapper.options.codon_size
    read = rng.integers(0, np.maximum(used, 1))
    lengths = (genomes >= 0).sum(axis=1)
    at = read % np.maximum(lengths, 1)  # wrapping reads the first again
    changed = genomes.copy()
    old = genomes[np.arange(n), at].astype(np.int64)
    changed[np.arange(n), at] = (old + rng.integers(1, size, n)) % size
    return changed, read / np.maximum(used - 1, 1)


def _distances(before: Mapped, parents: npt.NDArray[Any], after: Mapped) -> Int32s:
    begins, words = before.words
    distances = _levenshtein(begins, words, parents.astype(np.int64), *after.words, MOST_WORDS)
    distances[~after.valid] = INVALID
    return distances


@compiled
def _levenshtein(
    begins: Int64s, words: Int32s, parents: Int64s, new_begins: Int64s, new_words: Int32s, most: int
) -> Int32s:
    """Return the least number of words to insert, delete or replace, of each pair (pairs,); -2 beyond ``most``."""
    found = np.empty(parents.size, np.int32)
    row = np.empty(most + 1, np.int32)
    for k in range(parents.size):
        a, a_end = begins[parents[k]], begins[parents[k] + 1]
        b, b_end = new_begins[k], new_begins[k + 1]
        while a < a_end and b < b_end and words[a] == new_words[b]:
            a += 1
            b += 1
        while a < a_end and b < b_end and words[a_end - 1] == new_words[b_end - 1]:
            a_end -= 1
            b_end -= 1
        if max(a_end - a, b_end - b) > most:
            found[k] = -2
            continue
        for j in range(b_end - b + 1):
            row[j] = j
        for i in range(a, a_end):
            corner = row[0]
            row[0] = i - a + 1
            for j in range(b, b_end):
                cost = corner + (words[i] != new_words[j])
                corner = row[j - b + 1]
                row[j - b + 1] = min(cost, corner + 1, row[j - b] + 1)
        found[k] = row[b_end - b]
    return found


def _median(values: npt.NDArray[Any]) -> float:
    return float(np.median(values)) if values.size else float("nan")
