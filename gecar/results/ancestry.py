"""The lineage of a run that has been made: who its best program descends from, and what they looked like."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gecar.errors import InputError, expected
from gecar.evolution.lineage import Lineage, Member
from gecar.evolution.state import State
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.program import Program
from gecar.results.config import configure, read_config
from gecar.results.folder import RunFolder
from gecar.results.run import load_task


@dataclass(frozen=True)
class Ancestry:
    """A run's lineage, and its winner.

    Attributes
    ----------
    lineage
        Of all individuals.
    winner
        Whose program is the run's best.
    mapper
        What codons derive.
    """

    lineage: Lineage
    winner: Member
    mapper: Mapper

    def program(self, member: Member) -> Program | None:
        """Return an individual's program; None if it had none."""
        codons = self.lineage.codons_of(member)
        return self.mapper.map(codons[None]).program(0) if codons.size else None


def read_ancestry(folder: Path) -> Ancestry:
    """Read a run's lineage.

    Raises
    ------
    InputError
        If it is no run's folder, its checkpoint is missing or damaged, or the run was too long to keep it.
    """
    task = load_task(configure(read_config(folder / "config.toml"), folder / "config.toml"))
    place = folder / "checkpoint"
    state = RunFolder(folder).load(task.configuration)
    if state is None:
        raise expected(place, "no such file", "a run's checkpoint, which says who came from whom")
    if not state.lineage.size:
        raise expected(place, "a run too long to keep who came from whom", "a shorter or smaller one")
    try:
        lineage = Lineage.read(state.lineage, task.config.search.population)
        options = MappingOptions(max_symbols=task.mapper.options.max_symbols)  # kept codons never wrap
        return Ancestry(lineage, _winner(lineage, state, task.mapper), Mapper(task.mapper.grammar, options))
    except (ValueError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise expected(place, f"a lineage that does not fit ({error})", "a whole checkpoint") from None


def _winner(lineage: Lineage, state: State, mapper: Mapper) -> Member:
    """Find the best individual again, the first of those with its program."""
    key, generation = mapper.map(state.best_genome[None]).key(0), state.best_generation
    merits = lineage.generations[generation]["merit"]
    for place in merits.argsort(kind="stable").tolist():
        if lineage.codons_of((generation, place)).tobytes() == key:
            return generation, place
    raise ValueError(f"generation {generation} lacks the best program")
