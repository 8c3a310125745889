"""Close the loop on a concealed robot: see the gap, name its causes, correct the simulation, evolve on it again.

python -m benchmarks.demonstration --out runs/demonstration

The robot is `benchmarks.concealed.program.PAPER_LIKE`, a MuJoCo robot with lag, drag and a late sensor, slower than its
simulation by about as much as the paper's (16.74 s simulated, 19.32 s driven). Every step of gecar's is a command, as a
user would type it; the recordings are all it is told of the robot. Prints a table, and writes it to table.md.
"""

from __future__ import annotations

import json
import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.cases import RUNS, Hidden, record
from benchmarks.concealed.program import PAPER_LIKE, START, Round, drive
from benchmarks.concealed.recording import Conditions
from gecar.files import write_whole
from gecar.language.program import read_program
from gecar.report.table import piped
from gecar.results.arrival import percent, share_of

TRIALS = 5
SEEDS = 5
SEARCH = ("--preset", "paper", "--noise", "2", "--motor-noise", "3", "--no-pictures", "--quiet")
HELD = ("trial_4", "trial_5", "run_07_reversals", "run_08_line_smooth")


def gecar(*words: str | Path) -> dict[str, Any]:
    """Run a command and return what it answers."""
    command = [sys.executable, "-m", "gecar", *map(str, words), "--json"]
    told = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    answer: dict[str, Any] = json.loads(told)
    return answer


def drives(run: Path, into: Path) -> list[Round]:
    """Drive a run's best program on the concealed robot, and keep the recordings."""
    rows = read_program(run / "best.txt").opcodes.tolist()
    return [drive(rows, PAPER_LIKE, START, k, into / f"trial_{k + 1}.csv") for k in range(TRIALS)]


def fastest_that_arrives(out: Path, name: str, *more: str | Path) -> tuple[Path, Path, int]:
    """Evolve with several seeds, and let their programs drive, the fastest in simulation first, until one arrives.

    Returns
    -------
    tuple
        The run, its trials' folder, and how many before it did not arrive in all trials.
    """
    runs = [out / f"{name}_{seed}" for seed in range(1, SEEDS + 1)]
    for seed, run in enumerate(runs, 1):
        if not (run / "result.json").exists():
            gecar("evolve", *SEARCH, *more, "--seed", str(seed), "--out", run)
    fitness = {run: json.loads((run / "result.json").read_text())["fitness_s"] for run in runs}
    for failed, run in enumerate(sorted(runs, key=fitness.__getitem__)):
        trials = out / f"{run.name}_trials"
        if all(r.outcome == "goal" for r in drives(run, trials)):
            return run, trials, failed
    raise SystemExit(f"none of {SEEDS} programs arrived on the concealed robot")


def scripts(into: Path) -> None:
    """Record the eight open-loop drives every concealed case has, beside the trials."""
    hidden = Hidden((PAPER_LIKE,) * len(RUNS), {}, (), {})
    for k, kind in enumerate(RUNS):
        record(into / f"run_{k + 1:02d}_{kind}.csv", k, hidden, Conditions(), np.random.default_rng((5, k)))


def row(what: str, compared: dict[str, Any]) -> list[str]:
    """Write a line of the table from what ``gecar compare`` answers."""
    trials = compared["trials"]
    x, y = (np.mean([trial[name] for trial in trials]) for name in ("correlation_x", "correlation_y"))
    arrival = np.mean([trial["arrival_s"] for trial in trials])
    simulated = compared["simulation"]["time_s"]
    return [
        what,
        f"{simulated:.2f}",
        percent(share_of(compared["simulation"])),
        f"{arrival:.2f}",
        f"{100 * (arrival / simulated - 1):+.1f} %",
        f"{x:.3f}",
        f"{y:.3f}",
    ]


def main() -> None:
    """Do all of it, and print what came of it."""
    parser = ArgumentParser(prog="python -m benchmarks.demonstration", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out: Path = parser.parse_args().out
    run, trials, failed = fastest_that_arrives(out, "nominal")
    before = gecar("compare", trials, "--program", run, "--out", out / "before")
    scripts(trials)
    verdict = gecar("discover", trials, "--holdout", ",".join(HELD), "--out", out / "verdict")
    corrected = out / "verdict/robot.toml"
    only = [trials / f"trial_{k + 1}.csv" for k in range(TRIALS)]
    after = gecar("compare", *only, "--program", run, "--robot", corrected, "--out", out / "after")
    again, its_trials, failed_again = fastest_that_arrives(out, "corrected", "--robot", corrected)
    new = gecar("compare", its_trials, "--program", again, "--robot", corrected, "--out", out / "again")
    heads = [
        "program, simulated robot",
        "simulated [s]",
        "arrive",
        "driven [s]",
        "late",
        "correlation x",
        "y",
    ]
    lines = [
        row("first, nominal", before),
        row("first, corrected", after),
        row("evolved again, corrected", new),
    ]
    found = ", ".join(effect["id"] for effect in verdict["effects"])
    words = (
        f"Found: {found}. Of {SEEDS} programs each, the fastest in simulation drove first, and the next where it did "
        f"not arrive in all trials: {failed} evolved on the nominal robot did not, {failed_again} on the corrected one."
    )
    text = f"{piped([heads, *lines])}\n\n{words}\n"
    write_whole(out / "table.md", text)
    print(text)


if __name__ == "__main__":
    main()
