"""The programs that a run with several goals ends with: each measured afresh, in front.csv and as a file of its own."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gecar.errors import expected
from gecar.evolution.ask_tell import Evolution
from gecar.evolution.goals import fronts
from gecar.evolution.phenotypes import Phenotypes
from gecar.files import read_rows
from gecar.language.program import Program, read_program
from gecar.results.folder import FRONT_FILE, FRONT_FOLDER, RunFolder
from gecar.search.chance import REPORT, REPORTED_DRAWS, Arrivals, arrivals
from gecar.search.goals import GOALS
from gecar.search.programs import noise_seed
from gecar.search.settings import Settings
from gecar.world.rollout import Driver, World

Floats = npt.NDArray[np.float64]


class Point(NamedTuple):
    """A program, and what it reaches of each goal; a row of front.csv.

    Attributes
    ----------
    program
        Its number: ``front/1.txt`` and so on.
    on_front
        1 if no other program of the run is as good in all of the run's goals and better in one, else 0; also 0 where
        a program arrives in too few drives.
    time_s
        Time to GOAL [s]: the median under random conditions; with one draw, that of the nominal robot.
    missed
        Share of drives under random conditions that miss GOAL.
    energy_j
        Electrical energy of the nominal drive [J].
    length
        Instructions.
    """

    program: int
    on_front: int
    time_s: float
    missed: float
    energy_j: float
    length: int


class Front(NamedTuple):
    """Points, and the program of each."""

    points: list[Point]
    programs: list[Program]


def measure_front(
    evolution: Evolution[Program], world: World, search: Settings, others: Sequence[World] = ()
) -> Front:
    """Measure the programs of the last population under conditions that the search did not meet.

    Parameters
    ----------
    evolution
        Finished.
    world, search, others
        Of the run; points are sorted by its first goal.

    Returns
    -------
    Front
        Of ``nsga2`` all programs that do not fail, each once; of ``map_elites`` the best of each cell.
    """
    phenotypes = Phenotypes(evolution.mapper, evolution.problem).read(evolution.genomes)
    alive = {
        phenotype.digest: phenotype.program
        for phenotype, merit in zip(phenotypes, evolution.scores["merit"], strict=True)
        if phenotype is not None and merit < evolution.problem.failure
    }
    programs = list(alive.values())
    measured = _measured(world, programs, evolution.seed, search.draws, others)
    kept = np.flatnonzero(np.isfinite(measured["time_s"]))
    values = np.column_stack([measured[GOALS[name].field] for name in search.goals])
    if search.draws > 1:
        values[1.0 - measured["missed"] < search.required_share] = np.inf
    archive = evolution.operators.archive
    if archive is not None:
        kept = archive.best(values)
    kept = kept[np.lexsort(values[kept].T[::-1])]
    whole = np.flatnonzero(np.isfinite(values[kept]).all(axis=1))
    best = set(whole[fronts(values[kept[whole]])[0]].tolist()) if len(whole) else set()
    columns = [measured[field][kept].tolist() for field in Point._fields[2:]]
    points = [
        Point(k + 1, int(k in best), time_s, missed, energy_j, int(length))
        for k, (time_s, missed, energy_j, length) in enumerate(zip(*columns, strict=True))
    ]
    return Front(points, [programs[k] for k in kept.tolist()])


def _measured(
    world: World, programs: Sequence[Program], seed: int, draws: int, others: Sequence[World]
) -> dict[str, Floats]:
    """Return what programs reach of all goals, by field of `Point` (programs,); a time of inf if they fail."""
    driver = Driver(world)
    drives = [driver.simulate(program.opcodes, noise_seed(seed, program)) for program in programs]
    found: Sequence[Arrivals] = []
    if programs:
        opcodes = [program.opcodes for program in programs]
        found = arrivals(world, opcodes, REPORTED_DRAWS, (seed, REPORT), others)
    nominal = [drive.time_s for drive in drives]
    times = nominal if draws == 1 else [each.quantile_s(0.5) or np.inf for each in found]
    return {
        "time_s": np.array(times, float),
        "missed": np.array([1.0 - each.share for each in found]),
        "energy_j": np.array([drive.energy_j for drive in drives]),
        "length": np.array([len(program.opcodes) for program in programs], float),
    }


def write_front(folder: RunFolder, front: Front) -> None:
    """Write front.csv, and each program into a folder ``front``."""
    place = folder.path / FRONT_FOLDER
    try:
        place.mkdir(exist_ok=True)
        for left in place.glob("*.txt"):
            left.unlink()
    except OSError as error:
        raise expected(place, error.strerror or "an error", "a folder to write to") from None
    for point, program in zip(front.points, front.programs, strict=True):
        folder.write(f"{FRONT_FOLDER}/{point.program}.txt", f"{program}\n", durable=False)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([Point._fields, *front.points])
    folder.write(FRONT_FILE, text.getvalue())


def read_front(folder: Path) -> list[Point]:
    """Read a run's front.csv.

    Raises
    ------
    InputError
        If it is missing, or a row is not as `Point`.
    """
    return read_rows(folder / FRONT_FILE, "the front of a run with several goals", Point)


def load_front(folder: Path) -> Front:
    """Read a run's front.csv, and its programs."""
    points = read_front(folder)
    return Front(points, [read_program(folder / FRONT_FOLDER / f"{point.program}.txt") for point in points])
