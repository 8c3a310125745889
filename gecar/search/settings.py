"""Settings of an evolution of robot programs, and presets: the paper's Table 4, random search, and what does better."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, ValidationError

from gecar.errors import expected, first_fault
from gecar.evolution.settings import EvolutionSettings, Rate

TABLE_4_CROSSOVER_RATES = (0.4, 0.5, 0.7)
TABLE_4_MUTATION_RATES = (0.03, 0.05, 0.07)


class Settings(EvolutionSettings):
    """Settings of an evolution of robot programs; the defaults are the paper's Table 4.

    Attributes
    ----------
    checkpoint_credit
        Whether selection, and only it, prefers among programs that miss GOAL those that pass more
        checkpoints, and pass them sooner.
    draws
        Drives a program is judged by: the nominal one, and the others under conditions drawn anew every generation
        (`gecar.search.chance`). 1: eq. 1 alone.
    arrival_share
        Share of its drives in which a program has to arrive, where there are several.
    """

    checkpoint_credit: bool = False
    draws: int = Field(1, ge=1, le=1_000)
    arrival_share: Rate = 0.96

    @property
    def needs_arrivals(self) -> bool:
        """Whether selection looks at when each checkpoint was passed."""
        return self.selection == "lexicase"


PRESETS = {
    "paper": Settings(),
    "random": Settings(mutation="renew", crossover_rate=0.0),
    "better": Settings(
        population=40,
        generations=254,
        checkpoint_credit=True,
        crossover="subtree",
        crossover_rate=0.7,
        mutation="used_codon",
        mutation_rate=0.05,
        creep_rate=0.3,
        creep_most=2.0,
        restart_after=10,
        restart="grown",
        draws=16,
    ),
}
"""Settings by name: the paper's; random search; and what finds faster programs (`benchmarks/better_search.py`).
All three spend 10,200 evaluations."""
DEFAULT_PRESET = "better"
"""What ``gecar evolve`` uses; tables and configurations made in code begin with the paper's."""


def preset(name: str, changes: Mapping[str, Any] | None = None, where: str = "search") -> Settings:
    """Return a preset's settings, some of them changed.

    Parameters
    ----------
    name
        One of `PRESETS`.
    changes
        Settings by name that differ from the preset's.
    where
        Where the changes stand, for errors.

    Raises
    ------
    InputError
        If there is no such preset or setting, or a value is out of bounds; names it.
    """
    if name not in PRESETS:
        raise expected("preset", repr(name), f"one of {', '.join(PRESETS)}")
    try:
        return Settings.model_validate({**PRESETS[name].model_dump(), **(changes or {})})
    except ValidationError as error:
        fields = f"one of {', '.join(Settings.model_fields)}"
        raise first_fault(error, where, fields, between=".") from None
