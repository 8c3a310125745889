"""A run's configuration: a preset, a file, options, and what all of them come to."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gecar.errors import expected, first_fault
from gecar.files import is_file, read_toml
from gecar.language.mapping import MappingOptions
from gecar.parallel.executors import MAX_WORKERS, usable_cores
from gecar.search.settings import Settings, preset
from gecar.world.course.course import course_parts
from gecar.world.rollout import STEP_S

Share = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
NOT_PART_OF_THE_RESULT = {"preset", "executor", "workers", "scheduler"}
"""Fields that may differ when a run is resumed: the result does not depend on them, or other fields say it."""
ADDED = {
    "start_from",
    "replacement",
    "offspring",
    "ranges",
    "islands",
    "migration_every",
    "duplication_rate",
    "goals",
}
"""Fields that came later, and change nothing by default."""
_ABOUT_THE_RUN = ("provenance", "fingerprints")


class Config(BaseModel):
    """All that a run depends on; the defaults are the paper's.

    Attributes
    ----------
    preset
        Name of the search settings it started from.
    course, grammar, robot
        Names, or files. Several courses are named as for `gecar.world.course.course.course_names`: drawn conditions are
        then spread over all of them, and the first is that of eq. 1.
    seed
        Random seed.
    executor, workers, scheduler
        Where programs are simulated; the address is that of Dask's scheduler, empty for a cluster on this machine.
    time_limit_s, step_s, engine
        As in `gecar.world.rollout.World`.
    noise, motor_noise
        Noise of each sensor reading [%], and of each command's strength [% of it].
    wraps, single_choice_consumes, max_symbols
        As in `gecar.language.mapping.MappingOptions`.
    start_from
        Programs that every new population of the evolution holds, as text.
    search
        The evolution's settings.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    preset: str = "paper"
    course: str = "paper"
    grammar: str = "paper"
    robot: str = "ev3"
    seed: int = Field(1, ge=0, lt=2**63)
    executor: Literal["process", "thread", "serial", "dask"] = "process"
    workers: int = Field(default_factory=usable_cores, ge=1, le=MAX_WORKERS)
    scheduler: str = ""
    time_limit_s: float = Field(60.0, gt=0.0, le=3_600.0)
    step_s: float = Field(STEP_S, ge=0.0001, le=0.01)
    engine: Literal["auto", "inline", "pymunk"] = "auto"
    noise: Share = 0.0
    motor_noise: Share = 0.0
    wraps: int = Field(MappingOptions.wraps, ge=0, le=1_000_000)
    single_choice_consumes: bool = MappingOptions.single_choice_consumes
    max_symbols: int = Field(MappingOptions.max_symbols, ge=1, le=10_000_000)
    start_from: tuple[str, ...] = ()
    search: Settings = Settings()

    @property
    def course_name(self) -> str:
        """The courses' names in short, fit for the name of a folder."""
        stems = (Path(part).stem for part in course_parts(self.course))
        return re.sub(r"[^\w.+-]", "-", "+".join(stems))[:60]

    @property
    def identity(self) -> dict[str, Any]:
        """What the result depends on, files' contents apart."""
        return self.model_dump(exclude=NOT_PART_OF_THE_RESULT)


def configure(table: Mapping[str, Any], where: str | Path = "configuration") -> Config:
    """Make a configuration from a table that says what differs from the paper's.

    Parameters
    ----------
    table
        Fields of `Config` by name; ``search`` is a table of what differs from the preset. What a run wrote about
        itself (provenance, fingerprints) is passed over, so that its config.toml serves for a new run.
    where
        The file, or what else it comes from, for errors.

    Raises
    ------
    InputError
        If a field is unknown or out of bounds; names it.
    """
    given = {name: value for name, value in table.items() if name not in _ABOUT_THE_RUN}
    search = given.get("search", {})
    if not isinstance(search, Mapping):
        raise expected(f"{where}, search", repr(search)[:40], "a table of settings")
    given["search"] = preset(given.get("preset", "paper"), search, f"{where}, search")
    for field in ("grammar", "robot"):
        if field in given:
            given[field] = _place(str(given[field]))
    if "course" in given:
        given["course"] = "+".join(map(_place, course_parts(str(given["course"]))))
    try:
        return Config.model_validate(given)
    except ValidationError as error:
        raise first_fault(error, where, f"one of {', '.join(Config.model_fields)}") from None


def read_config(path: Path) -> dict[str, Any]:
    """Read a configuration file, for `configure`.

    Raises
    ------
    InputError
        If it is missing or not TOML.
    """
    return read_toml(path, "a configuration file (.toml)")


def merged(table: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table with changes laid over it, in ``search`` one by one. Another preset drops the old search."""
    other = changes.get("preset", table.get("preset", "paper")) != table.get("preset", "paper")
    search = {**({} if other else table.get("search", {})), **changes.get("search", {})}
    return {**table, **changes, "search": search}


def identify(config: Config, fingerprints: Mapping[str, str]) -> str:
    """Return a hash of all that the result depends on; a checkpoint belongs to one."""
    told = _as_before(config.identity, Config)
    told["search"] = _as_before(told["search"], Settings)
    text = json.dumps([told, dict(fingerprints)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _as_before(table: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """Return a table as before there were `ADDED` fields, unless they say something: old checkpoints stay valid."""
    plain = {name: model.model_fields[name].default for name in ADDED & model.model_fields.keys()}
    return {name: value for name, value in table.items() if name not in plain or value != plain[name]}


def as_toml(config: Config, tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Write a configuration, and tables about the run after it, as TOML."""
    return tomli_w.dumps({**config.model_dump(), **tables})


def difference(ours: Config, theirs: Config) -> tuple[str, Any, Any] | None:
    """Return the first field in which two configurations' results may differ, and both values."""
    for name, mine, other in _pairs(ours.identity, theirs.identity):
        if mine != other:
            return name, mine, other
    return None


def _pairs(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> list[tuple[str, Any, Any]]:
    flat = [(name, value, theirs[name]) for name, value in ours.items() if name != "search"]
    return flat + [
        (f"search.{name}", value, theirs["search"][name]) for name, value in ours["search"].items()
    ]


def _place(name: str) -> str:
    """Make a file's name hold wherever it is read again; other names stay."""
    path = Path(name)
    return str(path.resolve()) if is_file(path) else name
