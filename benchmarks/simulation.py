"""Simulation and evolution: time per step, a whole `paper` run warm and cold, and memory."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.side_by_side import times_longer
from gecar.language.program import parse_program
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Driver, Fleet, World

CORES = 2
SOLVING = Path(__file__).parent / "solving_programs.json"


def rows() -> list[tuple[str, str, str]]:
    """Return this benchmark's rows: figure, value, goal."""
    inline, pymunk = step_us("inline"), step_us("pymunk")
    with tempfile.TemporaryDirectory() as folder:
        cold_s, _ = evolve(Path(folder) / "cold", Path(folder) / "cache")
        runs = [evolve(Path(folder) / f"warm{k}", Path(folder) / "cache") for k in range(3)]
    warm_s, result = min(runs, key=lambda run: float(run[1]["wall_s"]))
    ideal = result["simulated_steps"] * inline * 1e-6 / CORES
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
    return [
        ("time per step, inline, with program and sensor", f"{inline:.3f} us", "<= 0.1 us"),
        ("time per step, stepped by pymunk", f"{pymunk:.3f} us", "<= 0.35 us"),
        ("  drives one by one : in lanes", f"{gain_of_lanes():.1f}", ">= 2"),
        ("200 x 50 evolution, 2 workers, warm", f"{result['wall_s']:.2f} s", "<= 3 s"),
        ("  against steps x time per step / cores", f"{result['wall_s'] / ideal:.2f}", "<= 1.5"),
        ("  distinct programs simulated", f"{result['distinct_evaluations']:,}", ""),
        ("whole command, warm", f"{warm_s:.1f} s", ""),
        ("whole command, cold (all kernels compiled)", f"{cold_s:.1f} s", "< 40 s"),
        ("peak memory of the largest process", f"{memory:.0f} MB", "< 500 MB"),
    ]


def step_us(engine: str, repeats: int = 15) -> float:
    """Return the median over solving programs of each one's shortest time per step [us]."""
    driver = Driver(World(load_robot("ev3"), load_course("paper"), engine=engine))
    programs = [parse_program(text).opcodes for text in json.loads(SOLVING.read_text())["any"][:30]]
    return float(np.median([_shortest(driver, opcodes, repeats) for opcodes in programs]))


def gain_of_lanes(repeats: int = 15) -> float:
    """Return how many times longer drives take one by one than in lanes."""
    world = World(load_robot("ev3"), load_course("paper"))
    texts = [text for some in json.loads(SOLVING.read_text()).values() for text in some]
    programs = [parse_program(text).opcodes for text in texts]
    driver, fleet = Driver(world), Fleet(world)
    pairs, streams = [(k, 0) for k in range(len(programs))], np.zeros(len(programs))
    return times_longer(
        lambda: [driver.simulate(opcodes) for opcodes in programs],
        lambda: fleet.drive(programs, world.nominal, pairs, streams),
        repeats,
    )


def _shortest(driver: Driver, opcodes: Any, repeats: int) -> float:
    """Return the shortest time per step of several drives [us]: other programs only ever make it longer."""
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        steps = driver.simulate(opcodes).steps
        best = min(best, (time.perf_counter() - start) / steps)
    return best * 1e6


def evolve(out: Path, cache: Path) -> tuple[float, dict[str, Any]]:
    """Run `gecar evolve` with the paper's preset; return its wall time [s] and its result."""
    command = [
        sys.executable,
        "-m",
        "gecar",
        "evolve",
        "--preset",
        "paper",
        "--workers",
        str(CORES),
        "--out",
        str(out),
    ]
    start = time.perf_counter()
    subprocess.run(
        command, check=True, capture_output=True, env={**os.environ, "GECAR_CACHE_DIR": str(cache)}
    )
    return time.perf_counter() - start, json.loads((out / "result.json").read_text())


if __name__ == "__main__":
    for figure, value, goal in rows():
        print(f"{figure:50} {value:>12}   {goal}")
