"""A run's pictures, drawn from its folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gecar.cli.inputs import build_world, drive_seed, find_program, read_run_config
from gecar.cli.output import Output
from gecar.errors import expected
from gecar.evolution.lineage import Member
from gecar.evolution.representation import measure, random_genomes
from gecar.language.program import Program, read_program
from gecar.plots.courses.many import courses_figure
from gecar.plots.drives.classroom import write_classroom_page
from gecar.plots.drives.trajectory import trajectory
from gecar.plots.runs.compare_runs import compare_runs
from gecar.plots.runs.convergence import Reference, convergence
from gecar.plots.runs.derivation_tree import tree_of
from gecar.plots.runs.evolution_film import Champion, choose_shown, film_evolution
from gecar.plots.runs.front import archive_figure, front_figure
from gecar.plots.runs.genealogy import genealogy
from gecar.plots.runs.population import population_figure
from gecar.plots.runs.representation import representation_figure, representation_title
from gecar.plots.style import save
from gecar.report.drive import PAPER_BEST_S, detail_of, title_of
from gecar.report.runs import came_to, group_names, run_detail, run_title, summaries, summary_table
from gecar.results.ancestry import Ancestry, read_ancestry
from gecar.results.arrival import arriving, percent, share_of, shares
from gecar.results.config import Config
from gecar.results.folder import FRONT_FILE, UNSEEN_FILE, RunFolder, read_history, read_result
from gecar.results.front import read_front
from gecar.results.generalisation import CourseDrive, read_drives, summed_up
from gecar.results.run import Task, load_task
from gecar.search.goals import GOALS
from gecar.world.course.course import course_names, load_course, load_courses
from gecar.world.perturbation import under_drawn_conditions
from gecar.world.robot import load_robot
from gecar.world.rollout import Drive, World, simulate

SHOWN = 20
"""Drives under drawn conditions that a picture shows."""


def draw_run(folder: Path, out: Path | None = None) -> list[Path]:
    """Draw a run's convergence, its best program's drive, unseen courses that it was tested on, and its front.

    Parameters
    ----------
    folder
        The run's.
    out
        Where the pictures go; by default into the run's folder.

    Returns
    -------
    list
        What was drawn; no drive where no genome mapped to a program.

    Raises
    ------
    InputError
        If the folder is no finished run's, or what it names cannot be loaded.
    """
    target = out or folder
    target.mkdir(parents=True, exist_ok=True)
    drawn = [draw_convergence(folder, target / "convergence.png")]
    if read_result(folder)["program"]:
        drawn.append(draw_trajectory(folder, target / "trajectory.png"))
    if (folder / UNSEEN_FILE).is_file():
        drawn.append(draw_drives(read_drives(folder / UNSEEN_FILE), target / "unseen.png"))
    if (folder / FRONT_FILE).is_file() and read_front(folder):
        drawn.append(draw_front(folder, target / "front.png"))
    return drawn


def draw_front(folder: Path, target: Path) -> Path:
    """Draw the programs that a run with several goals ended with."""
    points, config = read_front(folder), read_run_config(folder)
    goals = [GOALS[name] for name in config.search.goals]
    values = np.array([[getattr(point, goal.field) * goal.scale for goal in goals] for point in points])
    labels, best = [goal.label for goal in goals], [point.on_front == 1 for point in points]
    spent = read_result(folder)["evaluations"]
    detail = f"preset {config.preset}, seed {config.seed} · {spent:,} evaluations"
    archive = load_task(config).operators.archive
    if archive is not None and len(goals) == 3:
        title = f"The best program in each of {len(points)} cells"
        ends = [
            (low * goal.scale, high * goal.scale)
            for goal, (low, high) in zip(goals[1:], archive.ranges, strict=True)
        ]
        return save(archive_figure(values, ends, archive.along, labels, title, detail), target)
    names = ", ".join(goal.name for goal in goals)
    title = f"Pareto front of {names}: {sum(best)} of {len(points)} programs"
    return save(
        front_figure(values, best, labels, title, f"{detail} · grey: dominated, or arrives too rarely"),
        target,
    )


def draw_drives(drives: Sequence[CourseDrive], target: Path, kind: str = "unseen courses") -> Path:
    """Draw which of several courses a program drives."""
    told = summed_up(drives)
    title = f"{told['driven']} of {told['of']} {kind} driven"
    arriving = f"{percent(told['arrive'])} of drives under random conditions arrive"
    detail = f"blue: driven · orange: not, with a cross where the robot failed · {arriving}"
    failures = {each.course: each.checkpoints for each in drives if not each.driven}
    return save(
        courses_figure([load_course(each.course) for each in drives], failures, title, detail), target
    )


def study_run(folder: Path, out: Path | None = None) -> list[Path]:
    """Draw all of a run's pictures: of `draw_run`, its populations, locality, its best's derivation and ancestors."""
    target = out or folder
    drawn = [*draw_run(folder, target), draw_locality(folder, target / "locality.png")]
    if "size" in read_history(folder):
        drawn.append(draw_population(folder, target / "population.png"))
    if read_result(folder)["program"]:
        drawn += [
            draw_tree(folder, target / "tree.png"),
            draw_genealogy(folder, target / "genealogy.png"),
        ]
    return drawn


def draw_convergence(folder: Path, target: Path) -> Path:
    """Draw a run's convergence."""
    config, history, result = read_run_config(folder), read_history(folder), read_result(folder)
    title, detail = run_title(config, result), run_detail(config, result)
    winner = Reference(arriving(share_of(result)), result["fitness_s"]) if result["solved"] else None
    return save(convergence(history, references(config), title, detail, winner), target)


def draw_population(folder: Path, target: Path) -> Path:
    """Draw the size, depth and diversity of a run's populations."""
    config, result = read_run_config(folder), read_result(folder)
    title, detail = "Size, depth and diversity of the populations", run_detail(config, result)
    return save(population_figure(read_history(folder), config.search.population, title, detail), target)


def draw_locality(folder: Path, target: Path) -> Path:
    """Draw the locality and redundancy of random genomes, and of a run's last population if it was kept."""
    config = read_run_config(folder)
    task = load_task(config)
    state = RunFolder(folder).load(task.configuration)
    genomes = {"random genomes": random_genomes(task.mapper, config.search.codons, seed=config.seed)}
    if state is not None:
        genomes["last population"] = state.genomes
    found = {name: measure(task.mapper, each, seed=config.seed) for name, each in genomes.items()}
    detail = f"grammar {Path(config.grammar).stem}, preset {config.preset}, seed {config.seed}"
    return save(representation_figure(found, representation_title(found["random genomes"]), detail), target)


def draw_trajectory(folder: Path, target: Path) -> Path:
    """Draw the drive of a run's best program, as the run scored it."""
    world, program, drive, title = _best_drive(folder)
    others = under_drawn_conditions(world, program.opcodes, SHOWN)
    detail = f"{detail_of(world, drive)} · thin: {SHOWN} drives under other conditions"
    return save(trajectory(world, program, drive, title=title, detail=detail, others=others), target)


def _best_drive(folder: Path) -> tuple[World, Program, Drive, str]:
    """Drive a run's best program as the run scored it; return where, what, the drive and a title for it."""
    file, settings = find_program(folder)
    world, program = build_world(settings), read_program(file)
    drive = simulate(world, program.opcodes, drive_seed(None, settings, program), trace=True)
    several = len(course_names(read_run_config(folder).course)) > 1  # result.json then has the share on all
    share = shares(world, [program], settings["seed"])[0] if several else share_of(read_result(folder))
    return world, program, drive, title_of(drive, world.course, share)


def draw_tree(folder: Path, target: Path) -> Path:
    """Draw the derivation of a run's best program.

    Raises
    ------
    InputError
        If the folder is no run's, or its run found no program.
    """
    mapper = load_task(read_run_config(folder)).mapper
    return save(tree_of(mapper, read_result(folder)["genome"]), target)


def draw_genealogy(folder: Path, target: Path) -> Path:
    """Draw who a run's best program descends from; see `gecar.results.ancestry.read_ancestry`."""
    ancestry, config, result = read_ancestry(folder), read_run_config(folder), read_result(folder)
    line, family = ancestry.lineage.line(ancestry.winner), ancestry.lineage.family(ancestry.winner)
    found, ancestors = ancestry.winner[0], sum(map(len, family)) - 1
    detail = (
        f"found in generation {found} · {ancestors:,} ancestors, {len(line) - 1:,} of them in its own line"
    )
    detail += f" · preset {config.preset}, seed {config.seed}"
    title = run_title(config, result)
    share = _shares_in(load_task(config), ancestry)
    figure = genealogy(ancestry.lineage, ancestry.winner, ancestry.program, share, title, detail)
    return save(figure, target)


def _shares_in(task: Task, ancestry: Ancestry) -> Callable[[Member], float | None]:
    """Return what measures the share of drives in which an individual's program arrives, each program once."""

    @cache
    def measured(program: Program) -> float:
        return shares(task.world, [program], task.config.seed, task.others)[0]

    def share(member: Member) -> float | None:
        program = ancestry.program(member)
        return None if program is None else measured(program)

    return share


def film_run(folder: Path, target: Path) -> Path:
    """Film how a run found its program, in half a minute at most: programs that were best so far, then the one chosen.

    Raises
    ------
    InputError
        If the target's ending is no film's, no program was found, or as `gecar.results.ancestry.read_ancestry`.
    """
    ancestry, (_, settings) = read_ancestry(folder), find_program(folder)
    world = build_world(settings)
    champions = _champions(ancestry, world, settings)
    if not champions:
        raise expected(folder, "a run that found no program", "one that did")
    return film_evolution(world, champions, read_history(folder), target)


def _champions(ancestry: Ancestry, world: World, settings: dict[str, Any]) -> list[Champion]:
    """Drive the programs that a film shows, as the run scored them: those best so far, then the one chosen."""
    winner = ancestry.winner  # later ones looked faster, and arrive less often
    ways = [member for member in ancestry.lineage.champions() if member[0] < winner[0]]
    members = [(member[0], ancestry.program(member)) for member in (*ways, winner)]
    found = choose_shown([(generation, program) for generation, program in members if program is not None])
    arriving = shares(world, [program for _, program in found], settings["seed"])
    champions = []
    for (generation, program), share in zip(found, arriving, strict=True):
        drive = simulate(world, program.opcodes, drive_seed(None, settings, program), trace=True)
        title = f"Generation {generation} · {title_of(drive, world.course, share)}"
        champions.append(Champion(generation, program, drive, title))
    return champions


def write_drive_page(folder: Path, target: Path) -> Path:
    """Write a page that plays the drive of a run's best program, as the run scored it.

    Raises
    ------
    InputError
        If the folder is no run's, or its run found no program.
    """
    world, program, drive, title = _best_drive(folder)
    return write_classroom_page(world, program, drive, target, title, detail_of(world, drive))


def references(config: Config) -> Sequence[Reference]:
    """Return the times a run's best is compared with."""
    bound = load_courses(config.course)[0].lower_bound_s(load_robot(config.robot))
    paper = [Reference("the paper's best", PAPER_BEST_S)] if config.course == "paper" else []
    return [*paper, Reference("lower bound", bound)]


def compare(output: Output, folders: Sequence[Path], out: Path) -> tuple[dict[str, Any], list[Path]]:
    """Draw runs beside each other, and print what each kind of run came to.

    Returns
    -------
    tuple
        (figures of each group, pictures drawn).

    Raises
    ------
    InputError
        If a folder is no finished run's.
    """
    configs = [read_run_config(folder) for folder in folders]
    results, names = [read_result(folder) for folder in folders], group_names(configs)
    histories = [read_history(folder) for folder in folders]
    groups = {
        name: [h for n, h in zip(names, histories, strict=True) if n == name] for name in dict.fromkeys(names)
    }
    table = summaries(names, results)
    came = {name: came_to(group) for name, group in table.items()}
    output.print(summary_table(table))
    same_course = len({(config.course, config.robot) for config in configs}) == 1
    title = f"{len(folders)} runs" + (f" on {configs[0].course}" if same_course else "")
    out.mkdir(parents=True, exist_ok=True)
    detail = (
        "median and middle half of runs; legend: the winners' median time and share of drives that arrive"
    )
    figure = compare_runs(groups, references(configs[0]) if same_course else (), title, detail, came)
    return table, [save(figure, out / "compare.png")]
