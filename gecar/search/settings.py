"""Settings of an evolution of robot programs, and presets: the paper's Table 4, random search, and what does better."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, ValidationError, model_validator

from gecar.errors import expected, first_fault
from gecar.evolution.settings import EvolutionSettings, Rate
from gecar.search.goals import LEAST_SHARE, GoalName

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
    goals
        What ``nsga2`` and ``map_elites`` compare programs by; see `gecar.search.goals`. If ``arrival`` is one,
        half of the drives is enough.
    """

    checkpoint_credit: bool = False
    draws: int = Field(1, ge=1, le=1_000)
    arrival_share: Rate = 0.96
    goals: tuple[GoalName, ...] = ()

    @model_validator(mode="after")
    def _goals_fit(self) -> Settings:
        by_goals = self.replacement in ("nsga2", "map_elites")
        if by_goals != bool(self.goals):
            wanted = "two or more goals" if by_goals else "replacement = nsga2 or map_elites with goals"
            raise ValueError(
                f"found goals = {list(self.goals)}, replacement = {self.replacement}, expected {wanted}"
            )
        if self.goals and (len(set(self.goals)) < len(self.goals) or len(self.goals) < 2):
            raise ValueError(f"found goals = {list(self.goals)}, expected two or more different ones")
        if "arrival" in self.goals and self.draws == 1:
            raise ValueError("found goal arrival with draws = 1, expected 2 draws or more")
        if self.goals and self.selection == "lexicase":
            raise ValueError("found selection = lexicase with goals, expected tournament")
        return self

    @property
    def needs_arrivals(self) -> bool:
        """Whether selection looks at when each checkpoint was passed."""
        return self.selection == "lexicase"

    @property
    def required_share(self) -> float:
        """Share of its drives below which a program fails."""
        return min(self.arrival_share, LEAST_SHARE) if "arrival" in self.goals else self.arrival_share


_BETTER = Settings(
    population=40,
    generations=254,
    checkpoint_credit=True,
    crossover="subtree",
    crossover_rate=0.7,
    mutation="used_codon",
    mutation_rate=0.05,
    creep_rate=0.3,
    creep_most=2.0,
    creep_reach=0.09,
    restart_after=10,
    restart="grown",
    draws=16,
)
_GOALS = {
    "population": 100, "generations": 101, "tournament": 2, "restart_after": 0, "duplication_rate": 0.1,
    "duplicates": "generation", "goals": ("time", "length"),
}  # fmt: skip
PRESETS = {
    "paper": Settings(),
    "random": Settings(mutation="renew", crossover_rate=0.0),
    "better": _BETTER,
    "nsga2": _BETTER.model_copy(update=_GOALS | {"replacement": "nsga2"}),
    "map_elites": _BETTER.model_copy(update=_GOALS | {"replacement": "map_elites"}),
}
"""Settings by name: the paper's; random search; what finds faster programs (`benchmarks/better_search.py`); the same
for several goals. All spend 10,200 evaluations."""
DEFAULT_PRESET = "better"
"""What ``gecar evolve`` uses; tables and configurations made in code begin with the paper's."""


def default_preset(search: Mapping[str, Any]) -> str:
    """Return the preset that settings begin with where none is named."""
    return "nsga2" if search.get("goals") else DEFAULT_PRESET


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
