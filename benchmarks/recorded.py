"""What `gecar discover` makes of recordings others made: ``python -m benchmarks.recorded [--recordings FOLDER]``.

With ``--laws`` what laws gain on the real motors: the catalogue alone, laws beside it, and laws alone.

Real motors, and practice cases of a 3D engine with their answers. All of them were looked at while gecar was made, so
these figures are not blind; `benchmarks/concealed` is.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gecar.reality.discovery import discover
from gecar.reality.invent.sentences import physics_grammar
from gecar.reality.recordings.recording import read_case
from gecar.reality.replay.replayer import replayer_of
from gecar.reality.verdict import Found, Verdict
from gecar.world.effects import CATALOGUE, Effect

BESIDE = Path(__file__).parents[2] / "shared" / "recordings"
# Beyond the levels that are fitted, and between them; of the only record of EMPS the last part is set aside.
REAL: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("ev3_motor_a", ("step_+040", "step_-020", "step_-100")),
    ("ev3_motor_a", ("step_+040", "step_-060")),
    ("ev3_motor_b", ("step_+020", "step_+060", "step_+100")),
    ("ev3_motor_b", ("step_+030", "step_+060")),
    ("emps", ()),
)
OF_LOG = ("clock_skew", "start_latency")  # effects of the log, not of the motor
ARMS: tuple[tuple[str, tuple[Effect, ...], bool], ...] = (
    ("catalogue", CATALOGUE, False),
    ("catalogue and laws", CATALOGUE, True),
    ("laws", tuple(effect for effect in CATALOGUE if effect.id in OF_LOG), True),
)
HEAD = "| case | concealed | found (95 %) | fitted on | judged on | NRMSE before | after | noise |\n"
LAWS_HEAD = "| case | judged on | with | found | laws | NRMSE before | after | noise |\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a Markdown table, a row as soon as it is known.

    Parameters
    ----------
    arguments
        Words after the program's name; those of the process if not given.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recorded", description=__doc__)
    parser.add_argument("--recordings", type=Path, default=BESIDE, help="holds real/ and practice/")
    parser.add_argument("--laws", action="store_true", help="what laws gain on the real motors")
    parser.add_argument("--only", default="", help="with --laws: of one motor, by the name of its folder")
    given = parser.parse_args(arguments)
    folder: Path = given.recordings
    if not folder.is_dir():
        print(
            f"--recordings: found no folder {folder}, expected one with real/ and practice/", file=sys.stderr
        )
        return 2
    print((LAWS_HEAD if given.laws else HEAD) + "|---" * 8 + "|")
    for row in law_rows(folder, given.only) if given.laws else rows(folder):
        print(row, flush=True)
    return 0


def rows(folder: Path) -> Iterator[str]:
    """Return the table's rows, one a case."""
    for name, held in REAL:
        verdict = discover(read_case(folder / "real" / name), held)
        yield _row(name, "?", verdict)
    yield f"| | | position where it was not fitted: {windows_mm(verdict)} | | | | | |"
    answers = tomllib.loads((folder / "practice" / "answers.toml").read_text(encoding="utf-8"))
    for name, answer in answers.items():
        case = read_case(folder / "practice" / name)
        yield _row(name, _concealed(answer), discover(case, [r.name for r in case.recordings[-2:]]))


def law_rows(folder: Path, only: str = "") -> Iterator[str]:
    """Return the rows of the table of laws: of each real motor, or of one, the catalogue, both, and laws alone."""
    for name, held in REAL:
        if only in ("", name):
            case = read_case(folder / "real" / name)
            for words, catalogue, invents in ARMS:
                language = physics_grammar() if invents else None
                verdict = discover(case, held, catalogue=catalogue, language=language, invents=invents)
                yield _law_row(name, words, verdict)


def windows_mm(verdict: Verdict) -> str:
    """Return the error of EMPS' position on what was not fitted [mm], whole and over stretches of a second."""
    replayer = replayer_of(verdict.evidence.held.recordings[0].recording)
    errors = replayer.measured[:, 0] - replayer.play(verdict.robot.physics).rows[:, 0]
    seen = ~np.isnan(errors)
    errors, second = errors[seen], replayer.t[seen].astype(int)
    begun = errors[np.unique(second, return_index=True)[1]]
    short = errors - begun[second - second[0]]
    return f"{1e3 * np.sqrt(np.mean(errors**2)):.1f} mm, over 1 s {1e3 * np.sqrt(np.mean(short**2)):.1f} mm"


def _concealed(answer: dict[str, Any]) -> str:
    numbers = [f"{key} {value}" for key, value in answer.items() if key not in ("effects", "outside")]
    words = [", ".join(f"`{effect}`" for effect in answer["effects"]), answer.get("outside", ""), *numbers]
    return "; ".join(filter(None, words)) or "nothing"


def _law_row(name: str, words: str, verdict: Verdict) -> str:
    judged = verdict.judgement
    held = "its last 30 %" if judged.by_time else ", ".join(judged.recordings)
    found = "; ".join(f"`{found.id}`" for found in verdict.effects) or "-"
    laws = "; ".join(f"`{law.term.typeset}`" for law in verdict.invented).replace("|", "\\|") or "-"
    sizes = " | ".join(f"{size:.4f}" for size in (judged.before, judged.after, judged.floor))
    return f"| {name} | {held} | {words} | {found} | {laws} | {sizes} |"


def _row(name: str, concealed: str, verdict: Verdict) -> str:
    judged = verdict.judgement
    fitted = f"{len(verdict.fitted_on)} recordings"
    held = "its last 30 %" if judged.by_time else ", ".join(judged.recordings)
    found = "; ".join(map(_found, verdict.effects)) or verdict.verdict
    if verdict.effects and "unexplained" in verdict.verdict:
        found += "; more is unexplained"
    sizes = " | ".join(f"{size:.4f}" for size in (judged.before, judged.after, judged.floor))
    return f"| {name} | {concealed} | {found} | {fitted} | {held} | {sizes} |"


def _found(found: Found) -> str:
    names = " or ".join(f"`{name}`" for name in (found.id, *found.alternatives))
    sizes = (f"{k} {p.value:.4g} ({p.low:.3g} to {p.high:.3g})" for k, p in found.parameters.items())
    return f"{names} {', '.join(sizes)}"


if __name__ == "__main__":
    sys.exit(main())
