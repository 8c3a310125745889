"""Replays of a recording of 12 s, commands through the simulated robot, on one core: one by one, and in lock step."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.side_by_side import times_longer
from gecar.compiled import LANES
from gecar.language.program import parse_program
from gecar.reality.recordings.recording import Recording, make_recording
from gecar.reality.replay.replayer import replayer_of
from gecar.world.course.course import load_course
from gecar.world.robot import Robot, load_robot
from gecar.world.rollout import World, simulate
from gecar.world.terms import Term

SECONDS = 12.0
PROGRAM = "motor(60,40,200)\nmotor(-50,50,180)\nmotor(30,80,150)\nmotor(-40,-70,120)\nmotor(-60,-50,190)\n"


def rows() -> list[tuple[str, str, str]]:
    """Return this benchmark's rows: figure, value, goal."""
    recording = recorded()
    slippery = {"slippery_patch": {"radius_m": 0.3, "x_m": 0.3, "y_m": 0.9, "coefficient": 0.1}}
    ev3 = load_robot("ev3")
    kinds = {
        "plain robots": ev3,
        "with a dead band": ev3.with_effects({"dead_band": {"duty_pct": 3.0}}),
        "with a slippery patch": ev3.with_effects(slippery),
        "with a law": ev3.with_terms([Term(port="motor_torque", law="-a * speed * abs(speed)", a=1e-5)]),
    }
    return [
        ("12 s replayed whole", f"{replay_ms(recording, np.inf):.2f} ms", "<= 1.5 ms"),
        ("12 s replayed, re-based over 1 s", f"{replay_ms(recording, 1.0):.2f} ms", "<= 1.5 ms"),
        *(
            (f"{LANES} robots one by one : in lock step, {name}", f"{gain(recording, robot):.1f}", ">= 1.5")
            for name, robot in kinds.items()
        ),
    ]


def recorded() -> Recording:
    """Return what a brick at 100 Hz and a camera at 33 Hz log of 12 s of driving."""
    robot = load_robot("ev3")
    world = World(robot, load_course("paper"), time_limit_s=SECONDS)
    trace = simulate(world, parse_program(PROGRAM).opcodes, trace=True).trace
    assert trace is not None
    assert trace["t_s"][-1] > SECONDS - 0.1, "the program left the course"
    unseen = np.arange(len(trace["t_s"])) % 3 != 0
    columns = {
        "t_s": trace["t_s"],
        "left_duty_pct": 100 * trace["left_duty"],
        "right_duty_pct": 100 * trace["right_duty"],
        "left_angle_deg": np.round(np.degrees(trace["left_angle_rad"])),
        "right_angle_deg": np.round(np.degrees(trace["right_angle_rad"])),
        "x_m": np.where(unseen, np.nan, trace["x_m"]),
        "y_m": np.where(unseen, np.nan, trace["y_m"]),
        "heading_deg": np.where(unseen, np.nan, np.degrees(trace["heading_rad"])),
    }
    return make_recording("bench", columns)


def replay_ms(recording: Recording, memory_s: float, repeats: int = 200) -> float:
    """Return the shortest time of many replays [ms]: other programs only ever make it longer."""
    replayer, physics = replayer_of(recording, memory_s=memory_s), load_robot("ev3").physics
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        replayer.play(physics)
        best = min(best, time.perf_counter() - start)
    return 1e3 * best


def gain(recording: Recording, robot: Robot, repeats: int = 100) -> float:
    """Return how many times longer robots take one by one than in lock step."""
    replayer, physics = replayer_of(recording, memory_s=1.0), np.repeat(robot.physics, LANES)
    physics["mass"] *= np.linspace(0.9, 1.1, LANES)
    singles = [physics[k : k + 1] for k in range(LANES)]
    return times_longer(
        lambda: [replayer.errors(single) for single in singles], lambda: replayer.errors(physics), repeats
    )


if __name__ == "__main__":
    for figure, value, goal in rows():
        print(f"{figure:50} {value:>12}   {goal}")
