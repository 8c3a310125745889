"""From genomes to phenotypes, each read once however many individuals share it."""

from __future__ import annotations

import hashlib
from typing import Any, Generic, NamedTuple

import numpy.typing as npt

from gecar.evolution.problem import P, Problem
from gecar.language.mapping import Derivation, Mapped, Mapper

DIGEST_BYTES = 16


class Phenotype(NamedTuple, Generic[P]):
    """A program, the codons that derive it (as few and as small as do), and a hash of what it does."""

    program: P
    key: bytes
    digest: bytes


class Phenotypes(Generic[P]):
    """Reads populations' programs; what the last two generations derived is not read again.

    Parameters
    ----------
    mapper
        What genomes derive.
    problem
        What derivations mean.
    """

    def __init__(self, mapper: Mapper, problem: Problem[P]) -> None:
        self.mapper, self.problem = mapper, problem
        self._now: dict[bytes, Phenotype[P] | None] = {}
        self._before: dict[bytes, Phenotype[P] | None] = {}

    def read(self, genomes: npt.NDArray[Any]) -> list[Phenotype[P] | None]:
        """Return each genome's phenotype; None where it maps to no program."""
        return self.of(self.mapper.map(genomes))

    def of(self, mapped: Mapped) -> list[Phenotype[P] | None]:
        """Return the phenotype of each of some genomes that were mapped."""
        return [self._phenotype(mapped, i) if mapped.valid[i] else None for i in range(len(mapped))]

    def turn(self) -> None:
        """Begin a generation; without this, memory would grow with them."""
        self._before, self._now = self._now, {}

    def _phenotype(self, mapped: Mapped, i: int) -> Phenotype[P] | None:
        key = mapped.key(i)
        if key not in self._now:
            self._now[key] = self._before[key] if key in self._before else self._read(mapped, i, key)
        return self._now[key]

    def _read(self, mapped: Mapped, i: int, key: bytes) -> Phenotype[P] | None:
        derivation = Derivation(mapped, i)
        program = self.problem.read(derivation)
        if program is None:
            return None
        meaning = self.problem.meaning(program, derivation)
        digest = hashlib.blake2b(meaning, digest_size=DIGEST_BYTES).digest()
        return Phenotype(program, key, digest)
