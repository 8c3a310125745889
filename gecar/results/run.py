"""A run from configuration to results: new or resumed, saved after every generation."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gecar.errors import InputError, expected
from gecar.evolution.ask_tell import Evolution, rehearse, run
from gecar.evolution.history import Generation
from gecar.evolution.initialisation import Seeded
from gecar.evolution.operators import Operators
from gecar.evolution.state import State
from gecar.language.grammar import load_grammar
from gecar.language.inversion import genome_of
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.opcodes import MAX_DUTY_PCT
from gecar.language.program import Program, parse_program
from gecar.language.robot_language import check_robot_language
from gecar.parallel.executors import open_executor, side_by_side
from gecar.parallel.signals import interrupts_told, raise_if_interrupted
from gecar.results.arrival import arrives
from gecar.results.autosave import Saver
from gecar.results.config import Config, as_toml, configure, difference, identify, merged, read_config
from gecar.results.folder import UNSEEN_FILE, RunFolder, check_new
from gecar.results.front import Front, measure_front, write_front
from gecar.results.generalisation import drives_csv, drives_on, summed_up, unseen_courses
from gecar.results.provenance import fingerprints, versions
from gecar.search.batches import Batches
from gecar.search.chance import chosen
from gecar.search.evaluation import DriveEvaluator
from gecar.search.goals import ranges_of
from gecar.search.programs import RobotPrograms, noise_seed
from gecar.world.course.course import load_courses
from gecar.world.robot import load_robot
from gecar.world.rollout import Noise, World, simulate


@dataclass(frozen=True)
class Task:
    """A configuration, and what its names stand for.

    ``others`` are the worlds of further courses; ``own`` are operators in the place of those the settings name.
    """

    config: Config
    mapper: Mapper
    world: World
    fingerprints: Mapping[str, str]
    others: tuple[World, ...] = ()
    own: Operators | None = None

    @property
    def configuration(self) -> str:
        """What identifies the run: `gecar.results.config.identify`."""
        return identify(self.config, self.fingerprints)

    @property
    def place(self) -> tuple[str, int, str]:
        """Where programs are simulated, for `gecar.parallel.executors.open_executor`."""
        return self.config.executor, self.config.workers, self.config.scheduler

    @property
    def evaluator(self) -> DriveEvaluator:
        """What scores programs."""
        search = self.config.search
        return DriveEvaluator(
            self.world,
            search.needs_arrivals,
            search.draws,
            search.required_share,
            self.config.seed,
            self.others,
            search.goals,
        )

    @property
    def duty_cap_pct(self) -> int:
        """Duty beyond which commands do the same [%]; with noise on it a command beyond the cap is another."""
        cap = MAX_DUTY_PCT if self.world.noise != Noise() else 100.0 * self.world.robot.drive.duty_cap
        return math.ceil(cap - 1e-9)

    @property
    def problem(self) -> RobotPrograms:
        """What is evolved."""
        return RobotPrograms.of(self.config.search, self.evaluator.n_arrivals, self.duty_cap_pct)

    def evolution(self, state: State | None = None) -> Evolution[Program]:
        """Return an evolution, new or from a state on."""
        search = self.config.search
        if state is None:
            return Evolution(self.mapper, self.problem, search, self.config.seed, operators=self.operators)
        return Evolution.resume(state, self.mapper, self.problem, search, self.operators)

    def rehearse(self) -> None:
        """Compile everything before time is measured; operators from elsewhere are not called before the run is."""
        if self.own is None:
            rehearse(self.config.search, self.mapper, self.problem)

    def front(self, evolution: Evolution[Program]) -> Front:
        """Return the programs that a finished evolution with several goals ends with."""
        return measure_front(evolution, self.world, self.config.search, self.others)

    @property
    def operators(self) -> Operators:
        """The operators that the settings name; the first genomes are those of the programs to start from.

        Raises
        ------
        InputError
            If the grammar has no derivation for one of them.
        """
        if self.own is not None:
            return self.own
        search = self.config.search
        if search.replacement == "map_elites" and not search.ranges:
            search = search.model_copy(update={"ranges": ranges_of(self.world, search.goals[1:])})
        plain = Operators.of(search)
        programs = [parse_program(text, "start_from") for text in self.config.start_from]
        if not programs:
            return plain
        given = [genome_of(self.mapper, each, search.codons) for each in programs]
        return Operators.of(search, initialise=Seeded(plain.initialise, np.array(given)))


def load_task(config: Config) -> Task:
    """Load what a configuration names.

    Raises
    ------
    InputError
        If there is no such grammar, course or robot, one of them is wrong, or the grammar's words are no programs.
    """
    grammar = load_grammar(config.grammar)
    check_robot_language(grammar)
    options = MappingOptions(config.wraps, config.single_choice_consumes, config.max_symbols)
    robot, courses = load_robot(config.robot), load_courses(config.course)
    if len(courses) > 1 and config.search.draws == 1:
        raise expected(
            "draws", f"1 with {len(courses)} courses", "2 or more: the nominal drive is on the first"
        )
    noise = Noise(config.noise, 0.01 * config.motor_noise)
    world, *others = (
        World(robot, course, config.step_s, config.time_limit_s, noise, config.engine) for course in courses
    )
    made = fingerprints(grammar, courses, robot)
    return Task(config, Mapper(grammar, options), world, made, tuple(others))


@dataclass(frozen=True)
class Started:
    """A run that can go on: its task, its folder, and its evolution as far as it came."""

    task: Task
    folder: RunFolder
    evolution: Evolution[Program]


def start(config: Config, out: Path) -> Started:
    """Begin a run in a new folder.

    Raises
    ------
    InputError
        If the folder exists, or as `load_task`.
    """
    check_new(out)
    task = load_task(config)
    evolution = task.evolution()
    side_by_side(*task.place)  # whoever has no cluster shall hear of it before there is a folder
    about = {"provenance": versions(), "fingerprints": task.fingerprints}
    return Started(task, RunFolder.create(out, as_toml(config, about)), evolution)


def resume(out: Path, changes: Mapping[str, Any] | None = None) -> Started:
    """Go on with a run where it was stopped.

    Parameters
    ----------
    out
        Its folder.
    changes
        Options given again, as for `gecar.results.config.merged`; only those that leave the result alone may differ.

    Raises
    ------
    InputError
        If it is no run's folder, the checkpoint is damaged, or options or files have changed since.
    """
    folder, place = RunFolder(out), out / "config.toml"
    table = read_config(place)
    config = configure(table, place)
    wanted = configure(merged(table, changes or {}), "options")
    found = difference(wanted, config)
    if found:
        raise expected("--resume", f"{found[0]} = {found[1]!r}", f"{found[2]!r} as in {place}")
    task = load_task(wanted)
    _check_unchanged(table, task, place)
    folder.sweep()
    state = folder.load(task.configuration)
    return Started(task, folder, task.evolution(state))


def _check_unchanged(table: Mapping[str, Any], task: Task, place: Path) -> None:
    """Refuse where a grammar, course or robot reads otherwise now; say so where gecar or a library is another."""
    before = table.get("fingerprints", {})
    for kind, now in task.fingerprints.items():
        if before.get(kind) != now:
            name = getattr(task.config, kind)
            raise expected(
                "--resume", f"{kind} {name!r} changed since the run began", f"the one that {place} knows"
            )
    was, here = table.get("provenance", {}), versions()
    for name in ("gecar", "numba", "numpy", "pymunk"):
        if was.get(name) != here[name]:
            words = (
                f"{place}: begun with {name} {was.get(name)}, going on with {here[name]}; the end may differ"
            )
            print(words, file=sys.stderr)


def finish(started: Started, after: Callable[[Generation], None] = lambda generation: None) -> dict[str, Any]:  # noqa: ARG005
    """Run to the last generation, saving each, and write the results.

    Parameters
    ----------
    started
        New or resumed.
    after
        Called with each generation's record, once it is saved.

    Returns
    -------
    dict
        What result.json says.

    Raises
    ------
    InputError
        If a file cannot be written, or workers die again and again.
    KeyboardInterrupt
        On Ctrl-C, after the reports are written and the way to go on is printed.
    """
    task, folder, evolution = started.task, started.folder, started.evolution
    saver = Saver(folder, evolution, task.configuration)

    def saved(generation: Generation) -> None:
        saver()
        after(generation)
        raise_if_interrupted()

    try:
        with interrupts_told():
            if not evolution.finished:
                search(task, evolution, saved)
            saver.save()
            choose(task, evolution)
            # Who came from whom is asked of the program chosen.
            folder.save(evolution.state(), task.configuration)
            folder.write_reports(evolution)
            more = (
                measured(task, evolution)
                | _generalisation(task, evolution, folder)
                | _front(task, evolution, folder)
            )
            return folder.write_result(evolution, more)
    except KeyboardInterrupt:
        saver.leave()
        raise
    except InputError:
        with suppress(InputError):  # the first error is the one to tell
            saver.save()
        raise


def search(task: Task, evolution: Evolution[Program], after: Callable[[Generation], None]) -> None:
    """Run an evolution to its last generation on the task's executor; nothing is written."""
    with Batches(task.evaluator, partial(open_executor, *task.place), side_by_side(*task.place)) as batches:
        task.rehearse()
        batches.warm()
        run(evolution, batches, after)


def choose(task: Task, evolution: Evolution[Program]) -> None:
    """Choose the best of the best on fresh draws, where programs are judged by more than the nominal drive."""
    search, contenders = task.config.search, evolution.contenders
    programs = [contender.program.opcodes for contender in contenders if contender.program is not None]
    if search.draws > 1 and len(programs) > 1:
        share, seed = search.arrival_share, evolution.seed
        evolution.choose(contenders[chosen(task.world, programs, share, seed, task.others)])


def measured(task: Task, evolution: Evolution[Program]) -> dict[str, Any]:
    """Return what is measured of the best program at the end: whether pymunk agrees, and how it arrives elsewhere."""
    return {
        "verified_on_pymunk": verified_on_pymunk(task, evolution),
        "arrives": arrives(task.world, evolution.best.program, evolution.seed, task.others),
    }


def _generalisation(task: Task, evolution: Evolution[Program], folder: RunFolder) -> dict[str, Any]:
    """Test what was evolved on several courses on unseen ones; write the drives, and return what they come to."""
    program = evolution.best.program
    if not task.others or program is None:
        return {}
    names = unseen_courses([world.course for world in (task.world, *task.others)])
    drives = drives_on(task.world, program, names, evolution.seed)
    folder.write(UNSEEN_FILE, drives_csv(drives))
    return {"unseen": {"courses": names} | summed_up(drives)}


def _front(task: Task, evolution: Evolution[Program], folder: RunFolder) -> dict[str, Any]:
    """Measure the programs that several goals end with; write them, and return what they reach."""
    if not task.config.search.goals:
        return {}
    front = task.front(evolution)
    write_front(folder, front)
    return {"front": [point._asdict() for point in front.points]}


def verified_on_pymunk(task: Task, evolution: Evolution[Program]) -> bool:
    """Drive the best program once more with pymunk; return whether it ends the same within a step."""
    best = evolution.best
    if best.program is None:
        return False
    seed = noise_seed(evolution.seed, best.program)
    own = simulate(task.world, best.program.opcodes, seed)
    drive = simulate(replace(task.world, engine="pymunk"), best.program.opcodes, seed)
    return drive.outcome == own.outcome and abs(drive.time_s - own.time_s) <= 1.5 * task.config.step_s
