"""From genomes to programs, each read once however many individuals share it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gecar.language.mapping import Mapped, Mapper
from gecar.language.opcodes import LINE, MAX_DUTY_PCT, MOTOR, MOTOR_UNTIL, OP, A, B
from gecar.language.program import Program

DIGEST_BYTES = 16


@dataclass(frozen=True)
class Phenotype:
    """A program, known by what it does, and the codons that derive it, as few and as small as do."""

    program: Program
    key: bytes
    duty_cap_pct: int = MAX_DUTY_PCT

    @cached_property
    def digest(self) -> bytes:
        """Hash of what programs that do the same share: opcodes without line numbers, duties cut at the cap."""
        rows = self.program.opcodes[:, :LINE].copy()
        drives = (rows[:, OP] == MOTOR) | (rows[:, OP] == MOTOR_UNTIL)
        rows[drives, A : B + 1] = np.clip(rows[drives, A : B + 1], -self.duty_cap_pct, self.duty_cap_pct)
        return hashlib.blake2b(rows.tobytes(), digest_size=DIGEST_BYTES).digest()


class Phenotypes:
    """Reads populations' programs; what the last two generations derived is not read again.

    Parameters
    ----------
    mapper
        What genomes derive.
    duty_cap_pct
        As for `gecar.evolution.ask_tell.Evolution`.
    """

    def __init__(self, mapper: Mapper, duty_cap_pct: int = MAX_DUTY_PCT) -> None:
        self.mapper, self.duty_cap_pct = mapper, duty_cap_pct
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
            self._now[key] = self._before[key] if key in self._before else self._read(mapped, i)
        return self._now[key]

    def _read(self, mapped: Mapped, i: int) -> Phenotype | None:
        program = mapped.program(i)
        return None if program is None else Phenotype(program, mapped.key(i), self.duty_cap_pct)
