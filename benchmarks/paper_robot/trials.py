"""Five synthetic trials of `paper_ev3`, as recordings, for `gecar compare`: Figs 9 and 10, Tables 6 and 7.

python -m benchmarks.paper_robot.trials --out runs/paper-trials
gecar compare runs/paper-trials/long_side --robot paper --course benchmarks/paper_robot/long_side.toml

They are drives of an inferred robot, not measurements: put down by a hand (1 mm and 0.2 degrees, standard deviations),
its sensor noisy by 0.5 %.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from benchmarks.paper_robot.drives import FIG_6, PAPER_COURSE, moved
from benchmarks.paper_robot.twin import LONG_SIDE, NOISE_PCT, PLACED_DEG, PLACED_M, TRIALS
from gecar.language.program import parse_program
from gecar.reality.recordings.recording import Recording, write_recording
from gecar.reality.recordings.synthetic import rehearsal
from gecar.world.course.course import Course, Pose
from gecar.world.robot import load_robot
from gecar.world.rollout import Noise, World, simulate

COURSES: dict[str, tuple[Course, str]] = {
    "paper": (PAPER_COURSE, ""),
    "long_side": (LONG_SIDE, str(Path(__file__).parent.resolve() / "long_side.toml")),
}


def trials(name: str) -> list[Recording]:
    """Return five trials on one of `COURSES`."""
    course, file = COURSES[name]
    program, found = parse_program(FIG_6), []
    start = World(load_robot("paper_ev3"), course).start
    for k, pose in enumerate(moved(start, TRIALS, PLACED_M, PLACED_DEG), 1):
        place = course.starting(Pose(*map(float, pose)))
        world = World(load_robot("paper_ev3"), place, noise=Noise(sensor_pct=NOISE_PCT))
        drive = simulate(world, program.opcodes, seed=k, trace=True)
        found.append(rehearsal(world, program, drive, f"trial_{k}", file))
    return found


def main() -> None:
    """Write the trials on both courses."""
    parser = ArgumentParser(prog="python -m benchmarks.paper_robot.trials", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args().out
    for name in COURSES:
        (out / name).mkdir(parents=True, exist_ok=True)
        for recording in trials(name):
            write_recording(recording, out / name / f"{recording.name}.csv")
        print(f"{out / name}: {TRIALS} recordings")


if __name__ == "__main__":
    main()
