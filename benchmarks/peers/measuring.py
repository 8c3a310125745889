"""Measure gecar and its peers, side by side, in processor time on one core."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.peers.control import Eye, Pose, drive
from benchmarks.peers.engines import ENGINES
from benchmarks.peers.mappers import LIBRARIES, agree, genomes
from gecar.evolution.ask_tell import rehearse
from gecar.language.grammar import load_grammar
from gecar.language.mapping import Mapper, MappingOptions
from gecar.language.program import parse_program
from gecar.results.config import configure
from gecar.results.run import load_task
from gecar.search.batches import Batches
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World, simulate

FOLLOWER = "if(SensorValue > 85):\n    motor(80,80,20)\nelse:\n    motor(50,-60,10)"
"""A good program of the paper's setting; it goes round the paper's course in 14.28 s."""
ARC = "motor(60,40,100)"
SECONDS, ARC_SECONDS = 10.0, 1.0
GOAL_RATIO = 500


@dataclass(frozen=True)
class Run:
    """A whole run of Table 4 on one core.

    Attributes
    ----------
    cpu_s
        Processor time [s].
    simulated_s
        Time that was driven: programs that differ [s].
    each_s
        Time that would be driven if every individual were [s].
    """

    cpu_s: float
    simulated_s: float
    each_s: float


@dataclass(frozen=True)
class Measured:
    """What came out.

    Attributes
    ----------
    run
        gecar's.
    per_second
        Processor time for a simulated second by engine, gecar's own first [s].
    apart_m
        How far from gecar's each engine's robot is after a second's arc [m].
    mapped
        Genomes a second by library, gecar's own first.
    agreed
        Share of genomes that each library maps to gecar's text.
    missing
        Peers that are not installed.
    """

    run: Run
    per_second: Mapping[str, float]
    apart_m: Mapping[str, float]
    mapped: Mapping[str, float]
    agreed: Mapping[str, float]
    missing: tuple[str, ...]

    def whole_run_s(self, engine: str) -> float:
        """Return a whole run's time in an engine that drives every individual, as the paper's did [s]."""
        return self.run.cpu_s if engine == "gecar" else self.per_second[engine] * self.run.each_s

    def ratio(self, engine: str) -> float:
        """Return how many times longer a whole run takes in an engine."""
        return self.whole_run_s(engine) / self.run.cpu_s

    def rows(self) -> list[tuple[str, str, str]]:
        """Return figure, value and goal."""
        table = [
            ("gecar, 200 x 50 run of Table 4, one core", f"{self.run.cpu_s:.1f} s", ""),
            ("  driven (different programs)", f"{self.run.simulated_s:,.0f} s", ""),
            ("  if every individual were driven", f"{self.run.each_s:,.0f} s", ""),
        ]
        for engine, second in self.per_second.items():
            table.append((f"{engine}, a simulated second", f"{1e3 * second:.3f} ms", ""))
        for engine in self.apart_m:
            goal = f">= {GOAL_RATIO} x" if engine == "PyBullet" else ""
            table.append(
                (f"{engine}, robot after 1 s from gecar's", f"{1e3 * self.apart_m[engine]:.1f} mm", "")
            )
            same = self.per_second[engine] * self.run.simulated_s / self.run.cpu_s
            table.append((f"{engine}, the same simulated seconds", f"{same:,.0f} x gecar's run", ""))
            words = f"{self.ratio(engine):,.0f} x ({self.whole_run_s(engine) / 60:,.0f} min)"
            table.append((f"{engine}, whole run, every individual", words, goal))
        for name, rate in self.mapped.items():
            same_text = f", {100 * self.agreed[name]:.0f} % the same text" if name in self.agreed else ""
            table.append((f"{name}, genomes/s mapped{same_text}", f"{rate:,.0f}", ""))
        return table + [
            (f"SKIPPED {name}: not installed", "-", "pip install -e '.[bench]'") for name in self.missing
        ]


def measure() -> Measured:
    """Measure everything that is installed; say what is not."""
    missing: list[str] = []
    run = min((whole_run() for _ in range(2)), key=lambda run: run.cpu_s)
    per_second, apart = engine_times(missing)
    mapped, agreed = mapping_rates(missing)
    return Measured(run, per_second, apart, mapped, agreed, tuple(missing))


def whole_run() -> Run:
    """Run Table 4 once, everything included but the start of Python and its compiler."""
    task = load_task(configure({"workers": 1}))
    evolution = task.evolution()
    each = 0.0
    with Batches(task.evaluator) as batches:
        rehearse(task.config.search, task.mapper, task.problem)
        batches.warm()
        began = time.process_time()
        while not evolution.finished:
            evolution.tell(batches(evolution.ask()))
            each += float(evolution.scores["time_s"].sum())
        spent = time.process_time() - began
    return Run(spent, evolution.totals.steps * task.config.step_s, each)


def engine_times(missing: list[str]) -> tuple[dict[str, float], dict[str, float]]:
    """Return processor time for a simulated second [s], and how far apart robots end on an arc [m]."""
    course, robot = load_course("paper"), load_robot("ev3")
    world, eye = World(robot, course), Eye(course, robot)
    follower, arc = parse_program(FOLLOWER).opcodes, parse_program(ARC).opcodes
    start = course.start.x_m, course.start.y_m, course.start.heading_rad
    own = simulate(world, follower)
    times = {"gecar": best_time(lambda: simulate(world, follower), 5) / own.time_s}
    trace = simulate(world, arc, trace=True).trace or {}
    here = round(ARC_SECONDS / 0.01)
    place = float(trace["x_m"][here]), float(trace["y_m"][here])
    apart: dict[str, float] = {}
    for name, engine in ENGINES.items():
        robot_there = _installed(name, lambda engine=engine: engine(robot), missing)
        if robot_there is not None:
            apart[name] = _distance(drive(robot_there, eye, arc, start, ARC_SECONDS), place)
            work = lambda there=robot_there: drive(there, eye, follower, start, SECONDS)  # noqa: E731
            times[name] = best_time(work, 3) / SECONDS
    return times, apart


def mapping_rates(missing: list[str]) -> tuple[dict[str, float], dict[str, float]]:
    """Return genomes mapped to text a second by library, and how many of the texts are gecar's."""
    drawn = genomes(2_000)
    codons = np.array(drawn, np.uint8)
    grammar = load_grammar("paper")
    # Whether a nonterminal with one production takes a codon is a matter of taste: some libraries say it does.
    mappers = [Mapper(grammar, MappingOptions(single_choice_consumes=consumes)) for consumes in (False, True)]

    def own() -> list[str]:
        mapped = mappers[0].map(codons)
        return [mapped.text(i) for i in range(len(drawn)) if mapped.valid[i]]

    rates = {"gecar": len(drawn) / best_time(own, 5)}
    rates["gecar, choices only"] = len(drawn) / best_time(lambda: mappers[0].map(codons), 5)
    agreed: dict[str, float] = {}
    for name, library in LIBRARIES.items():
        text = _installed(name, library, missing)
        if text is not None:
            few = drawn[:500]
            rates[name] = len(few) / best_time(lambda text=text, few=few: [text(genome) for genome in few], 3)
            texts = [text(genome) for genome in few]
            agreed[name] = max(agree(mapper.map(codons[:500]), texts) for mapper in mappers)
    return rates, agreed


def best_time(work: Callable[[], Any], repeats: int) -> float:
    """Return the least processor time [s] of several: other programs only ever make it longer."""
    work()
    times = []
    for _ in range(repeats):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def _installed(name: str, build: Callable[[], Any], missing: list[str]) -> Any:
    """Return what is built, or None, loudly, where its library is not there."""
    try:
        return build()
    except ImportError as error:
        print(f"SKIPPED {name}: {error} (pip install -e '.[bench]')", file=sys.stderr, flush=True)
        missing.append(name)
        return None


def _distance(pose: Pose, place: tuple[float, float]) -> float:
    return math.hypot(pose[0] - place[0], pose[1] - place[1])
