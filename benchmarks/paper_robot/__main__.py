"""Infer the paper's robot, and write tables and a picture: python -m benchmarks.paper_robot --out runs/paper-robot.

Some minutes for the simulated robot's posterior, kept in ``simulated.npz``; a second call only writes again.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

import numpy as np

from benchmarks.paper_robot.drives import PAPER_COURSE, PAPER_S, TOLERANCE_S, Fleet, moved
from benchmarks.paper_robot.picture import marginals
from benchmarks.paper_robot.prior import NOMINAL
from benchmarks.paper_robot.simulated import STEPS_S, infer, table
from benchmarks.paper_robot.twin import LONG_SIDE, MEAN_S, stretched
from gecar.files import write_whole
from gecar.plots.style import save
from gecar.report.table import piped
from gecar.world.course.course import Course, parse_course
from gecar.world.robot import load_robot
from gecar.world.rollout import Outcome

MOVES = ((3e-4, 0.0), (1e-3, 0.0), (0.0, 0.1), (0.0, 0.3))  # m, degrees
SHARES = 100


def shipped() -> dict[str, float]:
    """Return the shipped robot's values of the unknowns."""
    robot, start = load_robot("paper"), PAPER_COURSE.start
    return {
        "track_width": robot.body.track_width,
        "sensor_ahead": robot.colour_sensor.ahead,
        "sensor_left": robot.colour_sensor.left,
        "spot_diameter": robot.colour_sensor.spot_diameter,
        "speed": float(np.radians(1000.0 * robot.drive.duty_cap)),
        "time_constant": _time_constant(),
        "mass": robot.body.mass,
        "grip": robot.tyre.friction,
        "start_right": start.x_m - 0.15,
        "start_ahead": start.y_m - 0.75,
    }


def _time_constant() -> float:
    motor = NOMINAL.motor
    return motor.inertia * motor.resistance / motor.torque_constant / motor.back_emf_constant


def steadiness(name: str) -> str:
    """Write how a shipped robot's arrival depends on the step and the start, as Markdown."""
    lines = [["", "on time", "at GOAL"]]
    for course in (PAPER_COURSE, LONG_SIDE):
        fleet = Fleet(name, course)
        for metres, degrees in MOVES:
            drives = [fleet.drive({}, near) for near in moved(fleet.start, SHARES, metres, degrees)]
            there = np.array([drive.outcome == Outcome.GOAL for drive in drives])
            timely = there & (np.abs([drive.time_s - PAPER_S for drive in drives]) <= TOLERANCE_S)
            what = f"{course.name}, start {1e3 * metres:g} mm and {degrees:g} degrees away"
            lines.append([what, f"{100 * timely.mean():.0f} %", f"{100 * there.mean():.0f} %"])
    times = []
    for step in STEPS_S:
        fleet = Fleet(name, step_s=step)
        drive = fleet.drive({}, fleet.start)
        times.append(
            f"{1e3 * step:g} ms: {drive.time_s:.3f} s"
            + ("" if drive.outcome == Outcome.GOAL else ", not at GOAL")
        )
    return f"{piped(lines)}\n\nBy step: {'; '.join(times)}.\n"


def starts() -> str:
    """Write Table 7 as a robot slower by the paper's own factor would have it, for each START tile, as Markdown."""
    lines = [["START", "x", "y"]]
    for name, course in [("left side (courses/paper.toml)", PAPER_COURSE), *_upper_side()]:
        for ahead in (0.02, 0.0, -0.02, 0.05, -0.05, 0.1, -0.1):  # the first that gets there
            fleet = Fleet("paper", course)
            pose = fleet.start + ahead * np.array([np.cos(fleet.start[2]), np.sin(fleet.start[2]), 0.0])
            drive = fleet.drive({}, pose, trace=True)
            if drive.outcome == Outcome.GOAL and drive.trace is not None:
                lines.append(
                    [name, *(f"{value:.3f}" for value in stretched(dict(drive.trace), MEAN_S / PAPER_S))]
                )
                break
    return piped([*lines, ["the paper's Table 7", "0.955", "0.774"]]) + "\n"


def _upper_side() -> list[tuple[str, Course]]:
    """Return courses whose START is a tile of the upper long side; the lower one's are these, turned round."""
    text = (Path(__file__).parent / "long_side.toml").read_text(encoding="utf-8")
    text = text.replace("ahead_m = 0.02", "ahead_m = 0.0")
    named = ((f"long side, tile {k}", f"goal = [{k - 1}, 3]", f"tile = [{k}, 3]") for k in range(2, 7))
    return [
        (name, parse_course(text.replace("goal = [2, 3]", goal).replace("tile = [3, 3]", tile)))
        for name, goal, tile in named
    ]


def main() -> None:
    """Write everything."""
    parser = ArgumentParser(prog="python -m benchmarks.paper_robot", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument(
        "--possible", type=int, default=300, help="draws that reach GOAL to begin with (%(default)s)"
    )
    parser.add_argument("--seed", type=int, default=5)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    found = infer(asked.out, asked.possible, asked.seed)
    shares = f"{len(found.possible)} of {found.tried:,} draws of the prior reach GOAL in four turns"
    detail = f"Fig. 6 on the paper's course · {shares}"
    figure = marginals(
        found.possible,
        found.posterior,
        shipped(),
        "Which robots drive the paper's program in the paper's time",
        detail,
    )
    save(figure, asked.out / "posterior.png")
    parts = {
        "Posterior": table(found),
        "How steady `paper` is": steadiness("paper"),
        "How steady `paper_ev3` is": steadiness("paper_ev3"),
        "Table 7 by START": starts(),
    }
    text = "\n".join(f"## {title}\n\n{part}" for title, part in parts.items())
    write_whole(asked.out / "paper_robot.md", text)
    print(text)


if __name__ == "__main__":
    main()
