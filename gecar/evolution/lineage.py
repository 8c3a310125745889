"""Who came from whom: every individual's parents, how good it was, and what changed its program.

A generation is kept as `INDIVIDUAL` records, and after them the codons of the programs that are new, one after the
other. That is 17 bytes an individual and a byte a codon: 0.3 MB for a run of Table 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gecar.language.mapping import Mapped

Bools = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]
Int32s = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]
Individuals = npt.NDArray[np.void]

CROSSOVER, MUTATION, CREEP, DUPLICATION = 1, 2, 4, 8
"""What can change a program, as bits."""

INDIVIDUAL = np.dtype(
    [("parent", "<i4"), ("mate", "<i4"), ("merit", "<f4"), ("changed", "u1"), ("codons", "<i4")]
)
"""``parent``, ``mate``: places in the generation before, as in `gecar.evolution.reproduction.Offspring`. ``merit``:
time to GOAL [s], or 10^4 to 10^4 + 2, see `gecar.evolution.scores.merits`. ``changed``: the operators that changed its
program, `CROSSOVER` | `MUTATION` | `CREEP` | `DUPLICATION`. ``codons``: bytes kept of its codons, one each unless they
are larger; none if nothing changed it."""

MAX_BYTES = 32_000_000
"""What is kept of a run at most, 5,000 generations of 200 and more; beyond it nothing is, so that memory stays flat."""


def differs(before: Mapped, after: Mapped) -> Bools:
    """Return which genomes derive another program than before (genomes,)."""
    one, other = before.choices.tobytes(), after.choices.tobytes()
    size = before.choices.itemsize
    ends, other_ends = (size * before.offsets).tolist(), (size * after.offsets).tolist()
    pieces = zip(ends[:-1], ends[1:], other_ends[:-1], other_ends[1:], strict=True)
    return np.array([one[a:b] != other[c:d] for a, b, c, d in pieces])


class Ledger:
    """Keeps a run's lineage while it goes on.

    Parameters
    ----------
    raw
        What an earlier part of the run kept (bytes,).
    going_on
        Whether there was an earlier part; if it kept nothing, it was too long, and nothing more is kept.
    """

    def __init__(self, raw: Bytes | None = None, *, going_on: bool = False) -> None:
        self._raw = np.zeros(0, np.uint8) if raw is None else raw
        self._used = self._raw.size
        self._kept = not going_on or self._used > 0

    def add(self, parents: Int32s, changed: Bytes, merits: Floats, keys: Sequence[bytes]) -> None:
        """Keep a generation.

        Parameters
        ----------
        parents
            Of each individual (population, 2).
        changed, merits
            As in `INDIVIDUAL` (population,).
        keys
            The codons each program needs, as few as derive it; empty if it is none.
        """
        new = (changed > 0) | (parents[:, 0] < 0)
        written = [key if is_new else b"" for key, is_new in zip(keys, new.tolist(), strict=True)]
        rows = np.zeros(len(keys), INDIVIDUAL)
        rows["parent"], rows["mate"] = parents.T
        rows["changed"] = changed
        with np.errstate(over="ignore"):  # beyond float32 a merit is as bad as inf
            rows["merit"] = merits
        rows["codons"] = [len(key) for key in written]
        self._append(rows.tobytes() + b"".join(written))

    def dump(self) -> Bytes:
        """Return all that is kept (bytes,); what is added later leaves it as it is."""
        return self._raw[: self._used]

    def _append(self, block: bytes) -> None:
        end = self._used + len(block)
        if not self._kept or end > MAX_BYTES:
            self._raw, self._used, self._kept = np.zeros(0, np.uint8), 0, False
            return
        if end > self._raw.size:
            self._raw = np.concatenate([self._raw, np.zeros(max(end, 1 << 16), np.uint8)])
        self._raw[self._used : end] = np.frombuffer(block, np.uint8)
        self._used = end


Member = tuple[int, int]
"""An individual: its generation, and its place in it."""


@dataclass(frozen=True)
class Lineage:
    """What a ledger kept.

    Attributes
    ----------
    generations
        Records of `INDIVIDUAL` (population,), one array a generation.
    codons
        Of each generation those of its new programs, one after the other.
    """

    generations: list[Individuals]
    codons: list[Bytes]

    @classmethod
    def read(cls, raw: Bytes, population: int) -> Lineage:
        """Read what `Ledger.dump` returned.

        Raises
        ------
        ValueError
            If it is something else.
        """
        generations, codons, at = [], [], 0
        while at < raw.size:
            rows = np.frombuffer(raw[at : at + population * INDIVIDUAL.itemsize].tobytes(), INDIVIDUAL)
            at += rows.nbytes
            codons.append(raw[at : at + rows["codons"].sum()])
            at += codons[-1].size
            generations.append(rows)
        _check(generations, codons, population)
        return cls(generations, codons)

    def merit(self, member: Member) -> float:
        """Return how good an individual was; see `INDIVIDUAL`."""
        return float(self.generations[member[0]]["merit"][member[1]])

    def changed(self, member: Member) -> int:
        """Return what changed its program; see `INDIVIDUAL`."""
        return int(self.generations[member[0]]["changed"][member[1]])

    def parents(self, member: Member) -> list[Member]:
        """Return its parent, and its mate if that had a part in its program; none if it has no parents."""
        generation, place = member
        row = self.generations[generation][place]
        if row["parent"] < 0:
            return []
        mate = [(generation - 1, int(row["mate"]))] if row["changed"] & CROSSOVER else []
        return [(generation - 1, int(row["parent"])), *mate]

    def line(self, member: Member) -> list[Member]:
        """Return an individual's line, from the first whose genome became its own to itself."""
        line = [member]
        while parents := self.parents(line[-1]):
            line.append(parents[0])
        return line[::-1]

    def family(self, member: Member) -> list[set[int]]:
        """Return all an individual descends from, as places in each generation up to its own."""
        members = [{member[1]}]
        for generation in range(member[0], 0, -1):
            found = [parent for place in members[-1] for parent in self.parents((generation, place))]
            members.append({place for _, place in found})
        return members[::-1]

    def codons_of(self, member: Member) -> Bytes:
        """Return the codons of an individual's program, as few as derive it; none if it has no program."""
        generation, place = member
        row = self.generations[generation][place]
        while row["parent"] >= 0 and not row["changed"]:
            generation, place = generation - 1, int(row["parent"])
            row = self.generations[generation][place]
        ends = np.cumsum(self.generations[generation]["codons"])
        return self.codons[generation][ends[place] - row["codons"] : ends[place]]

    def champions(self) -> list[Member]:
        """Return the best of each generation that brought a better one than all before."""
        found: list[Member] = []
        for generation, rows in enumerate(self.generations):
            best = (generation, int(rows["merit"].argmin()))
            if not found or self.merit(best) < self.merit(found[-1]):
                found.append(best)
        return found


def _check(generations: list[Individuals], codons: list[Bytes], population: int) -> None:
    """Check that every individual is there and has parents that are."""
    for number, (rows, new) in enumerate(zip(generations, codons, strict=True)):
        if len(rows) != population or (rows["codons"] < 0).any() or rows["codons"].sum() != new.size:
            raise ValueError(f"generation {number} of the lineage is not whole")
        kin = np.array([rows["parent"], rows["mate"]])
        if kin.min() < -1 or kin.max() >= (population if number else 0):
            raise ValueError(f"generation {number} of the lineage has parents that are nobody")
