"""Whether the concealed robot arrives when a simulation with the law that was written says so.

python -m benchmarks.arrivals runs/cases runs/invention       # after benchmarks.invention

For each case in which a law was written, a program is evolved on the robot with the law (preset ``better``,
`GENERATIONS` generations, `DRAWS` drives each) and drives the concealed robot in its own world, `SEEDS` times with
other noise of the sensor. Its median time of arrival is compared with the one predicted with the law, and without it.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.program import drive
from benchmarks.concealed.robot import Concealed
from gecar.api import evolve, simulate
from gecar.files import write_whole
from gecar.language.program import Program
from gecar.report.table import piped
from gecar.world.robot import Robot, load_robot, read_robot
from gecar.world.rollout import Outcome

GENERATIONS, DRAWS, SEEDS = 60, 4, 5
WITHIN = 0.02


def arrival(found: Robot, concealed: Concealed, world: str) -> dict[str, Any]:
    """Return when a program evolved on the robot that was found arrives: predicted, and in the concealed world."""
    settings = {"generations": GENERATIONS, "draws": DRAWS}
    program = evolve(robot=found, settings=settings, workers=1, seed=1).program
    rounds = [drive(program.opcodes.tolist(), concealed, seed=seed, world=world) for seed in range(SEEDS)]
    times = [each.time_s for each in rounds if each.outcome == "goal"]
    return {
        "program": str(program),
        "predicted_s": predicted(found, program),
        "without_law_s": predicted(load_robot("ev3"), program),
        "driven_s": float(np.median(times)) if times else None,
        "arrived": len(times),
        "outcomes": [each.outcome for each in rounds],
    }


def predicted(robot: Robot, program: Program) -> float | None:
    """Return the time of arrival in the simulation [s]; None where it does not arrive."""
    found = simulate(program, robot=robot)
    return found.time_s if found.outcome is Outcome.GOAL else None


def concealed_robot(label: dict[str, Any]) -> Concealed:
    """Return the robot of a label; it says what is not neutral."""
    fields = {name: tuple(v) if isinstance(v, list) else v for name, v in label["robot"].items()}
    return Concealed(**fields)


def table(cases: dict[str, dict[str, Any]]) -> str:
    """Write a case a row, and how many arrive when they should."""
    rows = [["case", "concealed", "predicted with the law", "without", "driven", "off by", "arrived"]]
    near = 0
    for name, case in sorted(cases.items()):
        found = case["arrival"]
        told = [found[key] for key in ("predicted_s", "without_law_s", "driven_s")]
        off = None if told[0] is None or told[2] is None else told[0] / told[2] - 1.0
        near += off is not None and abs(off) < WITHIN
        times = ["-" if seconds is None else f"{seconds:.2f} s" for seconds in told]
        words = "-" if off is None else f"{100.0 * off:+.1f} %"
        rows.append([name, case["concealed"], *times, words, f"{found['arrived']} of {SEEDS}"])
    return piped(rows) + f"\n- arrival predicted within 2 %: {near} of {len(cases)}\n"


def main() -> None:
    """Evolve and drive for every case with a law; goes on where it was stopped."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=Path, help="as benchmarks.concealed draws them: cases/ and sealed/")
    parser.add_argument("out", type=Path, help="what benchmarks.invention wrote")
    given = parser.parse_args()
    done = {}
    for file in sorted(given.out.glob("c*.json")):
        case = json.loads(file.read_text())
        if "arrival" not in case and case["invented"]:
            label = json.loads((given.cases / "sealed" / file.stem / "label.json").read_text())
            found = read_robot(file.with_suffix(".toml"))
            case["arrival"] = arrival(found, concealed_robot(label), label.get("world", "mujoco"))
            write_whole(file, json.dumps(case, indent=1) + "\n")
            print(file.stem, case["concealed"], case["arrival"], flush=True)
        if "arrival" in case:
            done[file.stem] = case
    write_whole(given.out / "arrivals.md", table(done))
    print(table(done))


if __name__ == "__main__":
    main()
