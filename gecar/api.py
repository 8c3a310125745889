"""gecar from Python: evolve, simulate and discover as one call each, with names, files or objects.

They are exported as ``gecar.evolve``, ``gecar.simulate``, ``gecar.discover``. Notebooks display what they return.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from gecar.displayed import Displayed
from gecar.errors import InputError, expected
from gecar.evolution.ask_tell import Evolution, run
from gecar.evolution.history import Generation
from gecar.evolution.operators import Operators
from gecar.evolution.state import Best, Candidate
from gecar.language.grammar import Grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.program import Program, parse_program, read_program
from gecar.language.robot_language import check_robot_language
from gecar.reality.discovery import discover as find_missing
from gecar.reality.invent.sentences import physics_grammar
from gecar.reality.materiality import DEFAULT, Material
from gecar.reality.recordings.recording import Case, Recording, read_case
from gecar.reality.verdict import Verdict
from gecar.results.arrival import arrives
from gecar.results.config import Config, configure
from gecar.results.front import Front, load_front
from gecar.results.run import Task, choose, finish, load_task, search, start
from gecar.search.own_fitness import Fitness, FitnessEvaluator
from gecar.search.programs import noise_seed
from gecar.search.settings import DEFAULT_PRESET, PRESETS, Settings, default_preset
from gecar.world.course.course import Course, load_course
from gecar.world.robot import Robot, load_robot
from gecar.world.rollout import Drive, Noise, Outcome, World
from gecar.world.rollout import simulate as drive_program

Tell = Callable[[Generation], None]


@dataclass(frozen=True)
class Simulation(Displayed):
    """A program's drive in the simulation.

    Attributes
    ----------
    world
        Robot, course, and settings.
    program
        The program.
    drive
        The drive, with its trace.
    """

    world: World
    program: Program
    drive: Drive

    @property
    def outcome(self) -> Outcome:
        """How the drive ended."""
        return self.drive.outcome

    @property
    def time_s(self) -> float:
        """When it ended [s]; with `Outcome.GOAL` the time to GOAL."""
        return self.drive.time_s

    @cached_property
    def arrives(self) -> Mapping[str, Any]:
        """How the program arrives in 200 drives under random conditions; see `gecar.results.arrival.arrives`."""
        return arrives(self.world, self.program, 1)


@dataclass(frozen=True)
class Run(Displayed):
    """A finished evolution.

    Attributes
    ----------
    best
        The best individual: genome, score, generation, program.
    history
        A record for each generation.
    world
        Robot, course, and settings of the simulation.
    seed
        Random seed of the run.
    folder
        Folder of its files, or None.
    front
        With several goals, the programs of the last population, measured; else None.
    """

    best: Best[Program]
    history: Sequence[Generation]
    world: World
    seed: int
    folder: Path | None = None
    front: Front | None = None

    @property
    def program(self) -> Program:
        """The best program.

        Raises
        ------
        InputError
            If no genome mapped to a program.
        """
        if self.best.program is None:
            raise InputError(
                "run: found no genome that maps to a program, expected one; raise codons or wraps"
            )
        return self.best.program

    @cached_property
    def simulation(self) -> Simulation:
        """The drive of the best program, as it was scored in the run."""
        seed = noise_seed(self.seed, self.program)
        return Simulation(
            self.world, self.program, drive_program(self.world, self.program.opcodes, seed, trace=True)
        )


def evolve(
    course: str | Path | Course = "paper",
    grammar: str | Path | Grammar = "paper",
    fitness: Fitness | None = None,
    settings: str | Mapping[str, Any] | Settings = DEFAULT_PRESET,
    *,
    robot: str | Path | Robot = "ev3",
    seed: int = 1,
    workers: int | None = None,
    noise_pct: float = 0.0,
    motor_noise_pct: float = 0.0,
    time_limit_s: float = 60.0,
    start_from: Sequence[str | Path | Program | Run] = (),
    operators: Operators | None = None,
    mapping: MappingOptions | Mapper | None = None,
    out: str | Path | None = None,
    tell: Tell = lambda generation: None,  # noqa: ARG005
) -> Run:
    """Evolve a program that drives a robot around a course.

    Parameters
    ----------
    course, grammar, robot
        Names, files, or objects; several courses are named as ``"paper+hairpin"`` or ``"random:1-20"``.
    fitness
        Fitness of a drive, by default its time to GOAL (eq. 1): a function of a `gecar.world.rollout.Drive` with its
        trace that returns 0 or more. Lower is better; 10,000 or more, or nan, is a failed drive. Drives are then
        simulated one at a time in this thread, about 2 ms each.
    settings
        A preset's name; or the settings that differ from preset ``better``, by name, as in config.toml; or `Settings`.
    seed
        Random seed.
    workers
        Number of threads; default: one per core. It does not change the result.
    noise_pct, motor_noise_pct
        Noise of each sensor reading [%], and of each command's strength [% of it].
    time_limit_s
        Time after which a drive without GOAL ends [s].
    start_from
        Programs that every new population holds: programs, texts, files, or runs.
    operators
        Operators in the place of those that the settings name; ``Operators.of(settings, mutation=mine)`` adds the rest.
    mapping
        How codons are read: options, such as wraps, codon size or genomes of any length; or a mapper, such as
        `gecar.language.structured.StructuredMapper`, whose grammar is then the one evolved.
    out
        A new folder for the files of ``gecar evolve``; by default nothing is written. Then course, grammar and robot
        must be names or files, the fitness eq. 1, and operators and mapping those of the settings, because a run is
        resumed from its folder.
    tell
        Called with each generation's record.

    Raises
    ------
    InputError
        If there is no such course, grammar, robot, preset or setting, a value is out of bounds, the folder exists, or
        operators and mapping do not go together.
    """
    preset, changes = _preset(settings)
    options: dict[str, Any] = {
        "preset": preset, "search": changes, "seed": seed, "executor": "thread", "noise": noise_pct,
        "motor_noise": motor_noise_pct, "time_limit_s": time_limit_s,
        "start_from": [_program(each).source for each in start_from],
    }  # fmt: skip
    if workers is not None:
        options["workers"] = workers
    if isinstance(mapping, Mapper):
        grammar = mapping.grammar
    if start_from and (operators is not None or isinstance(mapping, Mapper)):
        found = "programs beside operators or a mapper"
        raise expected("start_from", found, "one of the two; Seeded initialises from given genomes")
    made = {"course": course, "grammar": grammar, "robot": robot, "operators": operators, "mapping": mapping}
    given = {kind: thing for kind, thing in made.items() if thing is not None}
    objects: dict[str, Any] = {
        kind: thing for kind, thing in given.items() if not isinstance(thing, str | Path)
    }
    names = {kind: str(thing) for kind, thing in given.items() if kind not in objects}
    config = configure({**options, **names}, "evolve")
    if out is not None:
        return _evolve_into(Path(out), config, objects, fitness, tell)
    task = _task(config, **objects)
    if fitness is not None and task.others:
        raise expected("course", f"{config.course}", "one course, with a fitness of your own")
    if fitness is not None and config.search.goals:
        raise expected("goals", ", ".join(config.search.goals), "none, with a fitness of your own")
    evolution = task.evolution()
    if fitness is None:
        search(task, evolution, tell)
        choose(task, evolution)
    else:
        _search_by(fitness, task, evolution, tell)
    front = task.front(evolution) if config.search.goals else None
    return Run(evolution.best, evolution.history, task.world, seed, front=front)


def simulate(
    program: str | Path | Program | Run,
    course: str | Path | Course = "paper",
    *,
    robot: str | Path | Robot = "ev3",
    noise_pct: float = 0.0,
    motor_noise_pct: float = 0.0,
    seed: int = 1,
    time_limit_s: float = 60.0,
) -> Simulation:
    """Simulate a drive of a program.

    Parameters
    ----------
    program
        A program, its text, its file, or a run, which stands for its best program.
    course, robot
        Names, files, or objects.
    noise_pct, motor_noise_pct, seed
        Noise of each sensor reading [%], of each command's strength [% of it], and its seed.
    time_limit_s
        Time after which a drive without GOAL ends [s].

    Raises
    ------
    InputError
        If there is no such program, course or robot, or a value is out of bounds.
    """
    chosen = _program(program)
    noise = Noise(noise_pct, 0.01 * motor_noise_pct)
    world = World(_robot(robot), _course(course), time_limit_s=time_limit_s, noise=noise)
    return Simulation(world, chosen, drive_program(world, chosen.opcodes, seed, trace=True))


def discover(
    recordings: str | Path | Case | Sequence[Recording],
    holdout: Sequence[str] = (),
    *,
    robot: str | Path | Robot | None = None,
    program: str | Path | Program | Run | None = None,
    material: Material = DEFAULT,
    invent: bool | None = None,
    seed: int = 0,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
) -> Verdict:
    """Find the physics that a simulation lacks, fit it, and judge it on held-out recordings.

    Parameters
    ----------
    recordings
        A folder of recordings of one robot, a recording's file, or recordings that were read.
    holdout
        Names of the held-out recordings; default: every fourth, or the last part of a single one.
    robot
        The robot as it is known: a name, a file or an object; default: what the recordings name.
    program
        Program whose arrival time is used to report sizes, too.
    material
        Smallest size that is material.
    invent
        Whether a law is written for an error that no effect explains; default: if that error is material.
    seed
        Random seed.
    workers
        Number of threads; default: one per core.
    tell
        Called with a line of progress.

    Raises
    ------
    InputError
        If a recording, a name, or a robot or course file is wrong.
    """
    if isinstance(recordings, str | Path):
        case = read_case(recordings)
    else:
        case = recordings if isinstance(recordings, Case) else Case("recordings", tuple(recordings))
    if not case.recordings:
        raise expected("recordings", "none", "recordings of one robot")
    known = None if robot is None else _robot(robot)
    driven = None if program is None else _program(program)
    return find_missing(
        case, holdout, known, seed, workers, tell, material=material, program=driven,
        language=None if invent is False else physics_grammar(), invents=bool(invent),
    )  # fmt: skip


def _preset(settings: str | Mapping[str, Any] | Settings) -> tuple[str, Mapping[str, Any]]:
    """Return a preset's name, and what differs from it."""
    if isinstance(settings, str):
        return settings, {}
    table = settings.model_dump() if isinstance(settings, Settings) else settings
    name = default_preset(table)
    return name, {k: v for k, v in table.items() if v != getattr(PRESETS[name], k, None)}


def _task(
    config: Config,
    course: Course | None = None,
    grammar: Grammar | None = None,
    robot: Robot | None = None,
    operators: Operators | None = None,
    mapping: MappingOptions | Mapper | None = None,
) -> Task:
    """Load what a configuration names, and put objects in the place of the rest."""
    task = load_task(config)
    if grammar is not None:
        check_robot_language(grammar)
    if not isinstance(mapping, Mapper):
        mapping = Mapper(grammar or task.mapper.grammar, mapping or task.mapper.options)
    task = replace(task, mapper=mapping, own=operators)
    world = replace(task.world, course=course or task.world.course, robot=robot or task.world.robot)
    others = tuple(replace(other, robot=world.robot) for other in task.others)
    return replace(task, world=world, others=others)


def _evolve_into(
    out: Path, config: Config, objects: Mapping[str, Any], fitness: Fitness | None, tell: Tell
) -> Run:
    """Evolve into a folder, as ``gecar evolve`` does."""
    if objects:
        kind = next(iter(objects))
        wanted = "its name or its file" if kind in ("course", "grammar", "robot") else "those of the settings"
        found = kind if kind == "operators" else f"a {kind}"
        raise expected("out", f"{found} made in Python", wanted)
    if fitness is not None:
        raise expected(
            "out",
            "a fitness of your own",
            "none: a run is resumed from its folder, which cannot hold a function",
        )
    started = start(config, out)
    finish(started, tell)
    evolution = started.evolution
    front = load_front(out) if config.search.goals else None
    return Run(evolution.best, evolution.history, started.task.world, config.seed, out, front)


def _search_by(fitness: Fitness, task: Task, evolution: Evolution[Program], tell: Tell) -> None:
    """Run an evolution by a fitness of one's own."""
    settings = task.config.search
    score = FitnessEvaluator(
        task.world, fitness, settings.draws, settings.arrival_share, task.config.seed, settings.needs_arrivals
    )

    def scores(asked: list[Candidate[Program]]) -> Any:
        return score(
            [c.program.opcodes for c in asked], [c.seed for c in asked], generation=len(evolution.history)
        )

    task.rehearse()
    run(evolution, scores, tell)
    if settings.draws > 1:
        evolution.choose(evolution.contenders[0])


def _course(course: str | Path | Course) -> Course:
    return course if isinstance(course, Course) else load_course(course)


def _robot(robot: str | Path | Robot) -> Robot:
    return robot if isinstance(robot, Robot) else load_robot(robot)


def _program(program: str | Path | Program | Run) -> Program:
    """Return a program: itself, a run's best, one in a file or a run's folder, or one written out."""
    if isinstance(program, Program):
        return program
    if isinstance(program, Run):
        return program.program
    if isinstance(program, str) and "(" in program:
        return parse_program(program)
    place = Path(program)
    return read_program(place / "best.txt" if place.is_dir() else place)
