"""Judge other methods beside laws that were written: python -m benchmarks.rivals runs/cases runs/invention."""

from __future__ import annotations

import json
from argparse import ArgumentParser
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.cases import FASTER
from benchmarks.rivals.acting import NAMES, correction
from gecar.files import write_whole
from gecar.reality.discovery import MEMORY_S
from gecar.reality.fitting.clock_offsets import with_fitted_clocks
from gecar.reality.noise.sensor_noise import estimate_noise
from gecar.reality.prove.holdout import Contender, Correction, judge
from gecar.reality.recordings.recording import read_case
from gecar.reality.recordings.split import hold_out
from gecar.reality.residuals.of_case import Residuals, motion_residuals
from gecar.reality.residuals.threads import Threads
from gecar.reality.verdict import Judgement
from gecar.report.table import piped
from gecar.world.robot import Robot, load_robot, read_robot

LAW = "law"
NO_MOTION = ("battery_v", "reflection_pct")


@dataclass(frozen=True)
class Trial:
    """A case's recordings beside the robot as it is known: to learn from, set aside, and faster ones if there are."""

    known: Robot
    fitted: Residuals
    held: Residuals
    faster: Residuals


def trial(folder: Path, sealed: Path) -> Trial:
    """Read a case, and the faster recordings sealed beside it."""
    case = read_case(folder)
    parts = hold_out(case, ())
    known = load_robot(parts.fitted[0].setup.robot)
    noise, threads = estimate_noise(parts.fitted, known.physics, MEMORY_S), Threads(1)
    faster = read_case(sealed / FASTER).recordings if (sealed / FASTER).is_dir() else ()
    three = (motion_residuals(some, noise, MEMORY_S, threads) for some in (parts.fitted, parts.held, faster))
    return Trial(known, *three)


def gaps(at: Trial, found: Robot, clocks: bool) -> Iterator[tuple[str, dict[str, float | None]]]:
    """Yield each method's gaps closed, on the recordings set aside and on faster ones; of the law that was found first.

    Parameters
    ----------
    at
        The case.
    found
        The robot with its laws.
    clocks
        Whether the camera's clocks are each recording's own.
    """
    for name in (LAW, *NAMES):
        learned = None if name == LAW else correction(name, at.fitted.recordings, at.known)
        robot = found if name == LAW else at.known
        yield (
            name,
            {
                kind: gap_closed(at.known, robot, learned, held, clocks)
                for kind, held in (("holdout", at.held), ("faster", at.faster))
            },
        )


def gap_closed(
    known: Robot, found: Robot, learned: Correction | None, held: Residuals, clocks: bool
) -> float | None:
    """Return the share of the gap of motion that is closed; None where there is none, or nothing to judge by."""
    if not held.recordings:
        return None
    bare = replace(held, recordings=tuple(replace(run, course=None) for run in held.recordings))
    before, after = (
        Contender(robot, with_fitted_clocks(bare, robot.physics)[0] if clocks else bare)
        for robot in (known, found)
    )
    misfits = judge(before, replace(after, correction=learned))
    return Judgement((), False, {c: m for c, m in misfits.items() if c not in NO_MOTION}).gap_closed


def table(cases: dict[str, dict[str, Any]]) -> str:
    """Write medians and spread of each method, then a case a row."""
    names, kinds = (LAW, *NAMES), ("holdout", "faster")
    heads = {"holdout": "set aside", "faster": "twice as fast"}
    rows = [["method", *(f"{heads[k]}: median (quartiles), made worse" for k in kinds)]]
    for name in names:
        of_kind = []
        for kind in kinds:
            closed = [gap for case in cases.values() if (gap := case["gaps"][name][kind]) is not None]
            low, middle, high = np.quantile(closed, (0.25, 0.5, 0.75)) if closed else (np.nan,) * 3
            worse = sum(gap < 0.0 for gap in closed)
            of_kind.append(
                f"{middle:.2f} ({low:.2f} to {high:.2f}), {worse} of {len(closed)}" if closed else "-"
            )
        rows.append([name, *of_kind])
    single = [
        ["case", "concealed", *(f"{n}{' faster' if k == 'faster' else ''}" for k in kinds for n in names)]
    ]
    for number, case in sorted(cases.items()):
        told = [case["gaps"][name][kind] for kind in kinds for name in names]
        single.append([number, case["concealed"], *("-" if gap is None else f"{gap:.2f}" for gap in told)])
    return piped(rows) + "\n" + piped(single)


def main() -> None:
    """Judge the rivals in every case in which a law was written, beside the law; goes on where it was stopped."""
    parser = ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", type=Path, help="as benchmarks.concealed draws them: cases/ and sealed/")
    parser.add_argument("out", type=Path, help="what benchmarks.invention wrote")
    parser.add_argument("--all", action="store_true", help="also where no law was written")
    given = parser.parse_args()
    found = {}
    for file in sorted(given.out.glob("c*.json")):
        case = json.loads(file.read_text())
        if "gaps" not in case and (given.all or case["invented"]):
            robot = read_robot(file.with_suffix(".toml"))
            at = trial(given.cases / "cases" / file.stem, given.cases / "sealed" / file.stem)
            case["gaps"] = dict(gaps(at, robot, case["clocks_fitted"]))
            write_whole(file, json.dumps(case, indent=1) + "\n")
            print(file.stem, case["concealed"], case["gaps"], flush=True)
        if "gaps" in case:
            found[file.stem] = case
    write_whole(given.out / "rivals.md", table(found))
    print(table(found))


if __name__ == "__main__":
    main()
