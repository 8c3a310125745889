"""Grammatical Evolution beside what else finds a controller, at an equal number of evaluations.

    python -m benchmarks.controllers --out runs/controllers

Everything is scored alike: 16 drives of which 15 are under conditions drawn anew (`gecar.search.evaluation`), the best
forty chosen from on fresh draws, the winner driven 200 times under others. CMA-ES (Hansen, arXiv:1604.00772; library
`cma`, restarted from a random point when it stops) tunes the numbers of a fixed program. The programs written by hand
are evaluated once each. Runs are kept in the folder; what is there is not run again.
"""

from __future__ import annotations

import json
import math
import re
from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from gecar.evolution.scores import UNSOLVED, merits
from gecar.files import json_lines, write_whole
from gecar.language.program import Program, parse_program
from gecar.report.table import piped
from gecar.results.arrival import arrives, percent
from gecar.results.config import configure
from gecar.results.quantile import quantile
from gecar.results.run import Task, choose, load_task, search
from gecar.results.statistics import holm
from gecar.search.chance import add_drives, chosen
from gecar.search.programs import noise_seed

BY_HAND = tuple(
    f"if(SensorValue > 50):\n    motor({left},{right},10)\nelse:\n    motor({right},{left},10)"
    for fast, slow in ((40, 0), (60, 0), (60, 20), (80, 0))
    for left, right in ((fast, slow), (slow, fast))
)
"""A first lesson's follower of the line's edge: the speeds one would try, on either edge."""
THRESHOLD, DUTY, TIME_MS, GAIN = (10.0, 90.0), (-100.0, 100.0), (0.0, 200.0), (-4.0, 4.0)
"""Ranges of the numbers, those of grammar `proportional`."""
IF_ELSE = (THRESHOLD, DUTY, DUTY, TIME_MS, DUTY, DUTY, TIME_MS)
LINEAR = (DUTY, GAIN, DUTY, GAIN, THRESHOLD, TIME_MS)
COURSES = ("paper", "hairpin", "figure_eight")
CONTENDERS = 40

Floats = npt.NDArray[np.float64]
Result = dict[str, Any]
Write = Callable[[Sequence[float]], str]


def if_else(numbers: Sequence[float]) -> str:
    """Return an if/else with these numbers."""
    threshold, a, b, c, d, e, f = (round(number) for number in numbers)
    return f"if(SensorValue > {threshold}):\n    motor({a},{b},{c})\nelse:\n    motor({d},{e},{f})"


def linear(numbers: Sequence[float]) -> str:
    """Return a program whose duties are linear in the sensor's reading."""
    left, left_gain, right, right_gain, middle, time_ms = numbers
    error = f"(SensorValue - {middle:.0f})"
    duties = (f"{duty:.0f} + {gain:.2f} * {error}" for duty, gain in ((left, left_gain), (right, right_gain)))
    return f"motor({','.join(duties)},{time_ms:.0f})"


class Contest:
    """Scores programs as a search does, each again when it is met again, and keeps those that lead."""

    def __init__(self, task: Task) -> None:
        self.task, self.evaluate = task, task.evaluator
        self.known: dict[str, tuple[Program, Any]] = {}
        self.round = 0

    def __call__(self, texts: Sequence[str]) -> Floats:
        """Return what programs are ranked by, lower is better (programs,)."""
        share, seed = self.task.config.search.arrival_share, self.task.config.seed
        programs = [parse_program(text) for text in texts]
        to_beat = min((float(score["merit"]) for _, score in self.known.values()), default=math.inf)
        seeds = [noise_seed(seed, program) for program in programs]
        scores = self.evaluate([each.opcodes for each in programs], seeds, to_beat, self.round)
        self.round += 1
        for k, (text, program) in enumerate(zip(texts, programs, strict=True)):
            if text in self.known:
                known = self.known[text][1]
                add_drives(known, scores[k], share)
                scores[k] = known
            self.known[text] = program, scores[k].copy()
        return merits(scores, True)

    def winner(self) -> Program:
        """Return the best of the best on fresh draws."""
        ranked = sorted(self.known.values(), key=lambda known: (known[1]["merit"], -known[1]["share"]))
        programs = [program for program, _ in ranked[:CONTENDERS]]
        share, seed = self.task.config.search.arrival_share, self.task.config.seed
        return programs[chosen(self.task.world, [each.opcodes for each in programs], share, seed)]


def tuned(write: Write, ranges: Sequence[tuple[float, float]], task: Task, evaluations: int) -> Program:
    """Tune a program's numbers by CMA-ES."""
    import cma  # noqa: PLC0415  an extra, for this benchmark alone

    low, high = np.array(ranges).T
    rng, contest, spent = np.random.default_rng(task.config.seed), Contest(task), 0
    while spent < evaluations:
        options = {
            "bounds": [0, 1],
            "seed": int(rng.integers(1, 2**31)),
            "verbose": -9,
            "maxfevals": evaluations - spent,
        }
        strategy = cma.CMAEvolutionStrategy(rng.uniform(0.2, 0.8, len(low)), 0.3, options)
        while not strategy.stop() and spent < evaluations:
            asked = strategy.ask()[: evaluations - spent]
            told = contest([write(low + np.asarray(place) * (high - low)) for place in asked])
            spent += len(asked)
            if len(asked) < strategy.popsize:
                break
            strategy.tell(asked, told.tolist())
    return contest.winner()


def drawn(task: Task, evaluations: int) -> Program:
    """Draw an if/else's numbers at random."""
    low, high = np.array(IF_ELSE).T
    rng, contest = np.random.default_rng(task.config.seed), Contest(task)
    for begin in range(0, evaluations, 40):
        places = rng.uniform(low, high, (min(40, evaluations - begin), len(low)))
        contest([if_else(place) for place in places])
    return contest.winner()


def evolved(task: Task, evaluations: int) -> Program:  # noqa: ARG001  the task's settings hold them
    """Evolve a program."""
    evolution = task.evolution()
    search(task, evolution, lambda _: None)
    choose(task, evolution)
    return evolution.best.program or parse_program("motor(0,0,100)")


def by_hand(task: Task, evaluations: int) -> Program:  # noqa: ARG001
    """Return the best of the programs written by hand."""
    contest = Contest(task)
    contest(BY_HAND)
    return contest.winner()


OURS = "GE, grammar `fine`"
"""What the others are compared with: it draws from the same whole numbers as they do."""
METHODS: dict[str, tuple[str, Callable[[Task, int], Program]]] = {
    "GE, Table 3's grammar": ("paper", evolved),
    OURS: ("fine", evolved),
    "GE, grammar `proportional`": ("proportional", evolved),
    "CMA-ES, an if/else's 7 numbers": ("paper", partial(tuned, if_else, IF_ELSE)),
    "CMA-ES, a linear policy's 6 numbers": ("paper", partial(tuned, linear, LINEAR)),
    "random search, an if/else's 7 numbers": ("paper", drawn),
    "written by hand, an if/else": ("paper", by_hand),
}


def outcome(name: str, course: str, seed: int, evaluations: int) -> Result:
    """Return what a method's run comes to."""
    grammar, find = METHODS[name]
    generations = evaluations // 40 - 1
    config = configure(
        {"preset": "better", "course": course, "grammar": grammar, "seed": seed, "executor": "serial",
         "workers": 1, "search": {"generations": generations}},
    )  # fmt: skip
    task = load_task(config)
    program = find(task, evaluations)
    return {"program": program.source, **arrives(task.world, program, seed)}


def kept(folder: Path, name: str, course: str, seed: int, evaluations: int) -> Result:
    """Return what a method's run came to, from its file if it has been run."""
    slug = re.sub(r"\W+", "-", name).strip("-").lower()
    place = folder / f"{course}-{slug}-{evaluations}-{seed}.json"
    if not place.is_file():
        write_whole(place, json_lines(outcome(name, course, seed, evaluations)))
        print(place, flush=True)
    return json.loads(place.read_text())


def times_s(results: Sequence[Result]) -> Floats:
    """Return each run's time under random conditions [s]; inf unless its winner arrives in 90 % of the drives."""
    return np.array([each["median_s"] if each["share"] >= 0.9 else np.inf for each in results])


def row(name: str, course: str, results: Sequence[Result]) -> list[str]:
    """Return a row of the table of all figures."""
    times = times_s(results)
    shares = [each["share"] for each in results]

    def said(time_s: float) -> str:
        return f"{time_s:.2f}" if math.isfinite(time_s) else "-"

    spread = f"{said(times.min())} to {said(times.max())}" if np.isfinite(times).any() else "-"
    middle = float(quantile(times, 0.5))
    solved = f"{np.isfinite(times).sum()}/{len(times)}"
    return [course, name, solved, said(middle), spread, percent(float(np.median(shares)))]


def paired(results: Mapping[tuple[str, str], Sequence[Result]], courses: Sequence[str]) -> list[list[str]]:
    """Return the table that compares each method with `OURS`, run by run of the same course and seed.

    p is that of Wilcoxon's signed ranks of the ratios of times, over all courses; a run that does not arrive is slower
    than any that does. It is corrected by Holm over the methods.
    """
    times = {name: np.concatenate([times_s(results[course, name]) for course in courses]) for name in METHODS}
    ours = times.pop(OURS)
    logs = {name: np.log(np.minimum(t, UNSOLVED) / np.minimum(ours, UNSOLVED)) for name, t in times.items()}
    tests = [stats.wilcoxon(log, zero_method="zsplit").pvalue if log.any() else 1.0 for log in logs.values()]
    lines = [["method", f"runs slower than with {OURS}", "of", "time, median ratio", "paired p, Holm"]]
    for (name, log), p in zip(logs.items(), holm(tests), strict=True):
        both = np.isfinite(times[name]) & np.isfinite(ours)
        ratio = f"{np.exp(np.median(log[both])):.2f}" if both.any() else "-"
        lines.append([name, f"{(log > 0).sum()}", f"{len(log)}", ratio, f"{p:.2g}"])
    return lines


def main() -> None:
    """Run what is not kept yet, seed after seed, and write the tables."""
    parser = ArgumentParser(description=__doc__, prog="python -m benchmarks.controllers")
    parser.add_argument("--out", type=Path, default=Path("runs/controllers"))
    parser.add_argument("--courses", nargs="+", default=COURSES)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--evaluations", type=int, default=2_000)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    results: dict[tuple[str, str], list[Result]] = {(c, name): [] for c in asked.courses for name in METHODS}
    for seed in range(asked.first_seed, asked.first_seed + asked.seeds):
        for (course, name), found in results.items():
            found.append(kept(asked.out, name, course, seed, asked.evaluations))
    heads = ["course", "method", "runs that arrive", "median [s]", "range [s]", "drives that arrive, median"]
    rows = [row(name, course, found) for (course, name), found in results.items()]
    text = f"{piped([heads, *rows])}\n\n{piped(paired(results, asked.courses))}"
    write_whole(asked.out / "table.md", text + "\n")
    print(text)


if __name__ == "__main__":
    main()
