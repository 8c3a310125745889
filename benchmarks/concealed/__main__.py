"""The command line: ``python -m benchmarks.concealed COMMAND``; ``--help`` lists the commands."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.concealed.kinds import MET, SETS
from benchmarks.concealed.runner import DISCOVER, run_all
from benchmarks.concealed.worlds import WORLDS

if TYPE_CHECKING:
    from benchmarks.concealed.plan import Counts

# By kind of case: how many things it conceals, and how many of them are outside the catalogue.
_SIZES = {
    "none": (0, 0),
    "single": (1, 0),
    "double": (2, 0),
    "triple": (3, 0),
    "mixed": (2, 1),
    "outside": (1, 1),
}
STOPPED = "stopped; the same command goes on from here"


def main(arguments: list[str] | None = None) -> int:
    """Parse the command line and run one command.

    Parameters
    ----------
    arguments
        Words after the program's name; those of the process if not given.

    Returns
    -------
    int
        Exit code.
    """
    chosen = _parser().parse_args(arguments)
    try:
        code: int = chosen.command(chosen)
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"\n{STOPPED}", file=sys.stderr)
        return 130
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.concealed", description=__doc__)
    commands = parser.add_subparsers(required=True)

    draw = commands.add_parser("draw", help="draw and seal one case")
    draw.add_argument("--seed", type=int, required=True)
    draw.add_argument("--kind", choices=_SIZES, required=True)
    draw.add_argument(
        "--effect", action="append", default=[], help="identifier; as often as --kind has things"
    )
    draw.add_argument("--name", default="case", help="of the case's folder")
    draw.add_argument("--world", choices=WORLDS, default="mujoco")
    draw.set_defaults(command=_draw)

    plan = commands.add_parser("plan", help="draw and seal a whole examination; resumes")
    plan.add_argument("--seed", type=int, required=True)
    _ask_counts(plan)
    plan.add_argument(
        "--kinds",
        choices=SETS,
        default=MET,
        help="from which set physics outside the catalogue is drawn: that met so far (default); last: also what was "
        "kept for a last examination; final, unmet, fresh, sixth, seventh: of these sets alone",
    )
    plan.add_argument(
        "--pace",
        type=float,
        default=1.0,
        help="share of the usual duties; below 1, faster recordings are sealed beside each case",
    )
    plan.add_argument(
        "--without", choices=("light", "camera", "encoders"), default="", help="a sensor that no case has"
    )
    plan.add_argument(
        "--material", action="store_true", help="with a background: everything concealed is material"
    )
    plan.set_defaults(command=_plan)

    exam = commands.add_parser("exam", help="all of it: draw, seal, run, score, write the tables; resumes")
    exam.add_argument("--seed", type=int, help="default: the folder's, or a fresh one")
    _ask_counts(exam)
    exam.add_argument("--compare", type=int, default=100, metavar="N", help="comparators see N cases (100)")
    exam.add_argument("--tools", help="with commas between; default: gecar and all comparators")
    exam.add_argument(
        "--minutes", type=float, default=math.inf, help="begin no case after so long, and report"
    )
    exam.add_argument("--timeout", type=float, default=900.0, help="seconds a case may take")
    exam.add_argument("--report", type=Path, help="Markdown file; default: RESULTS.md in --out")
    exam.set_defaults(command=_exam)

    run = commands.add_parser("run", help="run a tool on every open case; resumes")
    run.add_argument("--verdicts", type=Path, required=True)
    run.add_argument(
        "--tool", default=DISCOVER, help="command with {case}, {out} and, if wanted, {python}, {holdout}"
    )
    run.add_argument("--timeout", type=float, default=900.0, help="seconds a case may take")
    run.set_defaults(command=_run)

    score = commands.add_parser("score", help="open the labels and score a folder of verdicts")
    score.add_argument("--verdicts", type=Path, required=True)
    score.add_argument("--title", default="Concealed cases")
    score.add_argument("--report", type=Path, help="Markdown file; a PNG of the same stem goes beside it")
    score.set_defaults(command=_score)

    best, limits = _best_parser(commands), _limits_parser(commands)

    for command in (draw, plan, exam):
        command.add_argument(
            "--background",
            choices=("on", "off"),
            default="on",
            help="off: nothing small in every robot, and strengths and robots as in the first examinations",
        )
    for command in (plan, exam):
        command.add_argument(
            "--world",
            action="append",
            metavar="NAME[:KIND=N,...]",
            help=f"of {', '.join(WORLDS)}; repeat for several; one with counts of its own has no other kinds (mujoco)",
        )

    for command in (exam, run):
        command.add_argument(
            "--executor",
            choices=("thread", "dask"),
            help="where tools run: on this machine (default), or a cluster",
        )
        command.add_argument("--scheduler", default="", metavar="ADDRESS", help="Dask's scheduler")

    for command in (draw, plan, exam, run, score, best, limits):
        command.add_argument(
            "--out", type=Path, default=Path("runs/concealed"), help="holds cases/ and sealed/"
        )
    for command in (draw, plan, exam, run, score, limits):
        command.add_argument("--workers", type=int, default=os.cpu_count() or 1)

    _add_others(commands)
    return parser


def _add_others(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Ask for what has nothing to do with an examination's folder."""
    drive = commands.add_parser("drive", help="drive a program round the course on a concealed robot")
    drive.add_argument("program", type=Path, help="JSON: opcode rows")
    drive.add_argument("--recording", type=Path, help="CSV file to write")
    drive.add_argument(
        "--robot", default="paper_like", help="nominal, paper_like, or JSON of concealed numbers"
    )
    drive.add_argument("--seed", type=int, default=0)
    drive.set_defaults(command=_drive)

    practice = commands.add_parser("practice", help="replay the practice cases with their answers (minutes)")
    practice.add_argument("folder", type=Path)
    practice.set_defaults(command=_practice)


def _best_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    best = commands.add_parser("best", help="how well the best possible test would tell what a case conceals")
    best.add_argument("case", nargs="+", help="names of cases that conceal one, two or three effects")
    best.add_argument("--others", type=int, default=10, help="cases whose backgrounds are taken (10)")
    best.set_defaults(command=_best)
    return best


def _limits_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> argparse.ArgumentParser:
    limits = commands.add_parser(
        "limits",
        help="conceal effects at the limits that verdicts on empty cases state, in those cases' robots",
    )
    limits.add_argument("--verdicts", type=Path, required=True)
    limits.add_argument("--to", type=Path, required=True, help="folder for the new cases")
    limits.add_argument("--count", type=int, default=60, help="of effects to conceal, at most (60)")
    limits.add_argument("--seed", type=int, default=0)
    limits.set_defaults(command=_limits)
    return limits


def _ask_counts(parser: argparse.ArgumentParser) -> None:
    """Ask how many cases of each kind; what is not said is the whole examination's."""
    words = {
        "none": "conceal nothing (100)",
        "single": "conceal one effect (5 of each)",
        "double": "conceal two effects (40)",
        "outside": "conceal what no effect of the catalogue is (3 of each kind)",
        "triple": "conceal three effects (0)",
        "mixed": "conceal one effect and one thing that none is (0)",
    }
    for kind, what in words.items():
        parser.add_argument(f"--{kind}", type=int, metavar="N", help=f"cases that {what}")


# What needs MuJoCo, or matplotlib, is imported by the command that needs it: `run` and `--help` do without.


def _draw(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.cases import Manner, draw_case, seal  # noqa: PLC0415

    _known(chosen.kind, chosen.effect)
    manner = Manner(chosen.world, chosen.background == "on")
    draw_case(chosen.name, chosen.kind, tuple(chosen.effect), (chosen.seed,), chosen.out, manner)
    print(seal(chosen.out))
    return 0


def _plan(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.plan import draw_all, plan  # noqa: PLC0415

    if not 0.1 <= chosen.pace <= 1.0:
        message = f"--pace: found {chosen.pace}, expected 0.1 to 1"
        raise ValueError(message)
    background = chosen.background == "on"
    cases = plan(
        chosen.seed,
        _by_world(chosen),
        background=background,
        kinds=chosen.kinds,
        pace=chosen.pace,
        without=chosen.without,
        material=chosen.material,
    )
    print(draw_all(cases, chosen.out, chosen.workers))
    return 0


def _by_world(chosen: argparse.Namespace) -> dict[str, Counts]:
    """Read how many cases of each kind each world has: of a world that names some itself, no others."""
    from benchmarks.concealed.plan import Counts  # noqa: PLC0415

    counts: dict[str, Counts] = {}
    for asked in chosen.world or ["mujoco"]:
        world, _, own = asked.partition(":")
        pairs = [pair.partition("=") for pair in own.split(",") if pair]
        kinds = [kind for kind, _, number in pairs if number.isdigit()]
        if world not in WORLDS or len(kinds) < len(pairs) or set(kinds) - set(asdict(Counts())):
            message = (
                f"--world: found {asked}, expected one of {', '.join(WORLDS)}, and, if wanted, :KIND=N,KIND=N"
            )
            raise ValueError(message)
        whole = Counts(**dict.fromkeys(asdict(Counts()), 0)) if pairs else Counts()
        counts[world] = replace(_counts(chosen, whole), **{kind: int(number) for kind, _, number in pairs})
    return counts


def _counts(chosen: argparse.Namespace, whole: Counts) -> Counts:
    """Take the numbers asked for, and the whole examination's for the rest."""
    asked = {kind: getattr(chosen, kind) for kind in asdict(whole)}
    return replace(whole, **{kind: count for kind, count in asked.items() if count is not None})


def _exam(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.exam import COMPARATORS, GECAR, agreed, examine  # noqa: PLC0415
    from benchmarks.concealed.results import write_results  # noqa: PLC0415

    tools = chosen.tools.split(",") if chosen.tools else [GECAR, *COMPARATORS]
    if strangers := set(tools) - {GECAR, *COMPARATORS}:
        message = (
            f"--tools: found {', '.join(strangers)}, expected some of: {', '.join((GECAR, *COMPARATORS))}"
        )
        raise ValueError(message)
    terms = agreed(chosen.out, chosen.seed, _by_world(chosen), background=chosen.background == "on")
    stopped = 0
    try:
        examine(
            chosen.out,
            terms,
            tools,
            chosen.compare,
            chosen.workers,
            chosen.timeout,
            chosen.minutes,
            *_place(chosen),
        )
    except KeyboardInterrupt:
        print(f"\n{STOPPED}", file=sys.stderr)
        stopped = 130
    if not (chosen.out / "manifest.sha256").exists():
        return stopped
    path = chosen.report or chosen.out / "RESULTS.md"
    write_results(chosen.out, terms, path, chosen.workers)
    print(f"written to {path}")
    return stopped


def _run(chosen: argparse.Namespace) -> int:
    if not (chosen.out / "manifest.sha256").exists():
        print(
            f"{chosen.out}: no manifest; seal the cases with `plan` before any tool sees them",
            file=sys.stderr,
        )
        return 2
    executor, scheduler = _place(chosen)
    failed = run_all(
        chosen.out / "cases", chosen.verdicts, chosen.tool, chosen.workers, chosen.timeout,
        executor=executor, scheduler=scheduler,
    )  # fmt: skip
    print("\n".join(failed))
    return 1 if failed else 0


def _place(chosen: argparse.Namespace) -> tuple[str, str]:
    """Return where tools run: an address alone asks for a cluster."""
    return chosen.executor or ("dask" if chosen.scheduler else "thread"), chosen.scheduler


def _score(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.score import manifest_hash, score  # noqa: PLC0415
    from benchmarks.concealed.tables import draw, report  # noqa: PLC0415

    judged = score(chosen.out, chosen.verdicts, chosen.workers)
    sealed = sum(1 for path in (chosen.out / "sealed").iterdir() if path.is_dir())
    text = report(judged, chosen.title, manifest_hash(chosen.out), sealed)
    if chosen.report is None:
        print(text)
        return 0
    chosen.report.parent.mkdir(parents=True, exist_ok=True)
    chosen.report.write_text(text, encoding="utf-8", newline="\n")
    draw(judged, chosen.report.with_suffix(".png"))
    return 0


def _best(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.best_test import d_prime_beside_backgrounds  # noqa: PLC0415

    print(f"{'case':<10} {'effect':<24} {'d_prime':>8} {'beside the rest':>16}")
    for name in chosen.case:
        for effect, (alone, beside) in d_prime_beside_backgrounds(chosen.out, name, chosen.others).items():
            print(f"{name:<10} {effect:<24} {alone:8.1f} {beside:16.1f}", flush=True)
    return 0


def _limits(chosen: argparse.Namespace) -> int:
    import numpy as np  # noqa: PLC0415

    from benchmarks.concealed.at_limits import draw_at_limits, stated  # noqa: PLC0415

    rng = np.random.default_rng(chosen.seed)
    limits = stated(chosen.out, chosen.verdicts, chosen.count, rng)
    print(draw_at_limits(chosen.out, limits, chosen.to, rng, chosen.workers))
    return 0


def _drive(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.program import PAPER_LIKE, drive  # noqa: PLC0415
    from benchmarks.concealed.robot import NEUTRAL, Concealed  # noqa: PLC0415

    known = {"nominal": NEUTRAL, "paper_like": PAPER_LIKE}
    robot = known[chosen.robot] if chosen.robot in known else Concealed(**json.loads(chosen.robot))
    rows = json.loads(chosen.program.read_text(encoding="utf-8"))
    result = drive(rows, robot, seed=chosen.seed, path=chosen.recording)
    arrivals = [None if arrival != arrival else round(float(arrival), 3) for arrival in result.arrivals_s]  # noqa: PLR0124
    print(json.dumps({"outcome": result.outcome, "time_s": round(result.time_s, 3), "arrivals_s": arrivals}))
    return 0


def _practice(chosen: argparse.Namespace) -> int:
    from benchmarks.concealed.practice import table  # noqa: PLC0415

    print(table(chosen.folder))
    return 0


def _known(kind: str, effects: list[str]) -> None:
    """Refuse what cannot be drawn, in one line."""
    from benchmarks.concealed.cases import ALL_OUTSIDE  # noqa: PLC0415
    from benchmarks.concealed.effects import EFFECTS  # noqa: PLC0415

    outside = [effect for effect in effects if effect in ALL_OUTSIDE]
    unknown = [effect for effect in effects if effect not in {**EFFECTS, **ALL_OUTSIDE}]
    count, foreign = _SIZES[kind]
    if unknown or len(set(effects)) != len(effects) or (len(effects), len(outside)) != (count, foreign):
        choices = {**(EFFECTS if count > foreign else {}), **(ALL_OUTSIDE if foreign else {})}
        found = ", ".join(effects) or "none"
        words = f"{count} different" + (", one of them outside the catalogue," if kind == "mixed" else "")
        message = f"--effect: found {found}, expected {words} of: {', '.join(choices)}"
        raise ValueError(message)


if __name__ == "__main__":
    sys.exit(main())
