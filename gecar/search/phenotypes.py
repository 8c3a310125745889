"""From genomes to programs, each read once however many individuals share it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gecar.language.mapping import Mapped, Mapper
from gecar.language.program import Program

DIGEST_BYTES = 16


@dataclass(frozen=True)
class Phenotype:
    """A program, known by what it does, and the codons that derive it, as few and as small as do."""

    program: Program
    key: bytes

    @cached_property
    def digest(self) -> bytes:
        """Hash of the opcodes without their line numbers: what programs that do the same have in common."""
        return hashlib.blake2b(self.program.canonical, digest_size=DIGEST_BYTES).digest()


class Phenotypes:
    """Reads populations' programs; what the last two generations derived is not read again.

    Parameters
    ----------
    mapper
        What genomes derive.
    """

    def __init__(self, mapper: Mapper) -> None:
        self.mapper = mapper
        self._now: dict[bytes, Phenotype | None] = {}
        self._before: dict[bytes, Phenotype | None] = {}

    def read(self, genomes: npt.NDArray[np.uint8]) -> list[Phenotype | None]:
        """Return each genome's phenotype; None where it maps to no program."""
        mapped = self.mapper.map(genomes)
        return [self._phenotype(mapped, i) if mapped.valid[i] else None for i in range(len(mapped))]

    def turn(self) -> None:
        """Begin a generation; without this, memory would grow with them."""
        self._before, self._now = self._now, {}

    def _phenotype(self, mapped: Mapped, i: int) -> Phenotype | None:
        key = mapped.key(i)
        if key not in self._now:
            self._now[key] = self._before[key] if key in self._before else _read(mapped, i)
        return self._now[key]


def _read(mapped: Mapped, i: int) -> Phenotype | None:
    program = mapped.program(i)
    return None if program is None else Phenotype(program, mapped.key(i))
