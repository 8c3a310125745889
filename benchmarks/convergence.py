"""Step size: what halving it moves, on 50 solving programs; `python -m benchmarks.convergence [--redraw]`.

A line follower on the edge of the line is a chaotic system: whatever moves its path by a tenth of a millimetre can
make one reading differ, and with it all that follows. To see the integrator and not the edge, the fixed set holds the
programs that other starts (1 mm, 0.3 degrees) move least; step sizes played no part in choosing it. The last rows show
the same for all solving programs, beside what a start 0.1 mm away does to them.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gecar.language.program import parse_program
from gecar.world.course.course import Pose, load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import STEP_S, Outcome, World, simulate_many

FIXED_SET = Path(__file__).parent / "solving_programs.json"
N_STEADY, N_ANY = 50, 200
WORLD = World(load_robot("ev3"), load_course("paper"))

Times = npt.NDArray[np.float64]


def arrival_times(world: World, programs: list[str]) -> Times:
    """Return times to GOAL [s], nan where a program does not get there."""
    summary = simulate_many(world, [parse_program(text).opcodes for text in programs])
    return np.where(summary["outcome"] == Outcome.GOAL, summary["time_s"], np.nan)


def moved(programs: list[str], world: World, reference: Times) -> Times:
    """Return the relative change of arrival times; 1 where GOAL is no longer reached."""
    return np.nan_to_num(np.abs(arrival_times(world, programs) / reference - 1.0), nan=1.0)


def start_moved(x: float, y: float, heading: float) -> World:
    """Return the world with another start [m, m, rad]."""
    start = WORLD.course.start
    pose = Pose(start.x_m + x, start.y_m + y, start.heading_rad + heading)
    return replace(WORLD, course=WORLD.course.starting(pose))


def with_step(step_s: float) -> World:
    """Return the world with another step [s]."""
    return replace(WORLD, step_s=step_s)


def draw(count: int = 8_000, starts: int = 48, seed: int = 11) -> dict[str, list[str]]:
    """Draw the fixed set: random if/else programs that solve, the steadiest of them and the first of them."""
    rng = np.random.default_rng(seed)
    programs = [_random_program(rng) for _ in range(count)]
    times = arrival_times(WORLD, programs)
    solving = [program for program, time in zip(programs, times, strict=True) if np.isfinite(time)]
    reference = times[np.isfinite(times)]
    left, worst = np.arange(len(solving)), np.zeros(len(solving))
    for _ in range(starts):
        x, y, heading = rng.normal(size=3) * (0.001, 0.001, np.radians(0.3))
        change = moved([solving[i] for i in left], start_moved(x, y, heading), reference[left])
        worst[left] = np.maximum(worst[left], change)
        left = left[worst[left] < 0.01]
    steady = [solving[i] for i in left[np.argsort(worst[left], kind="stable")][:N_STEADY]]
    return {"steady": steady, "any": solving[:N_ANY]}


def _random_program(rng: np.random.Generator) -> str:
    threshold, white_ms, black_ms = rng.integers(1, 20) * 5, rng.integers(1, 6) * 10, rng.integers(1, 12) * 10
    white, black = rng.integers(2, 11, 2) * 10, (rng.integers(0, 11) * 10, rng.integers(-10, 4) * 10)
    return (
        f"if(SensorValue > {threshold}):\n    motor({white[0]},{white[1]},{white_ms})\n"
        f"else:\n    motor({black[0]},{black[1]},{black_ms})"
    )


def rows() -> list[tuple[str, str, str]]:
    """Return the study's rows: figure, value, goal."""
    programs = json.loads(FIXED_SET.read_text())
    table = []
    for step in (4.0, STEP_S * 1000.0, 1.0):
        reference = arrival_times(with_step(step / 1000.0), programs["steady"])
        change = moved(programs["steady"], with_step(step / 2000.0), reference)
        goal = "at most 0.5 %" if step == STEP_S * 1000.0 else ""
        table.append((f"{N_STEADY} steady programs, step {step:g} to {step / 2:g} ms", _spread(change), goal))
    reference = arrival_times(WORLD, programs["any"])
    halved = moved(programs["any"], with_step(STEP_S / 2.0), reference)
    table.append((f"{N_ANY} solving programs, step halved", _spread(halved), ""))
    nudged = moved(programs["any"], start_moved(0.0001, 0.0, 0.0), reference)
    table.append((f"{N_ANY} solving programs, start 0.1 mm away", _spread(nudged), ""))
    return table


def _spread(change: Times) -> str:
    median, most, worst = 100.0 * np.quantile(change, [0.5, 0.9, 1.0])
    lost = int((change == 1.0).sum())
    return f"median {median:.3f} %, 90 % within {most:.2f} %, " + (
        f"{lost} no longer arrive" if lost else f"all within {worst:.2f} %"
    )


if __name__ == "__main__":
    if "--redraw" in sys.argv:
        FIXED_SET.write_text(json.dumps(draw(), indent=1) + "\n")
    for figure, value, goal in rows():
        print(f"{figure:48} {value}   {goal}")
