"""The whole examination: draw and seal, run `gecar` and its comparators, open the labels, write the tables."""

from __future__ import annotations

import json
import secrets
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.concealed.plan import Counts, draw_all, plan
from benchmarks.concealed.runner import DISCOVER, run_all

GECAR = "gecar"
COMPARATORS = ("bic", "everything", "sparse", "no_discrepancy", "no_whitening", "no_null", "no_refit")
_COMPARATOR = (
    "{{python}} -m benchmarks.concealed.comparators {name} {{case}} --out {{out}} --holdout {{holdout}}"
)


@dataclass(frozen=True)
class Terms:
    """What an examination was begun with, counts by world; kept in ``exam.json``, so that it goes on as it began."""

    seed: int
    counts: Mapping[str, Counts]
    background: bool = True


def agreed(out: Path, seed: int | None, counts: Mapping[str, Counts], *, background: bool = True) -> Terms:
    """Return the terms of the examination in a folder; a new one's are written down.

    Parameters
    ----------
    out
        The examination's folder.
    seed
        None: that of the folder, or a fresh one nobody can have tried before.
    counts
        By world, for a new examination.
    background
        Whether robots have a background, in a new examination.

    Raises
    ------
    ValueError
        If the folder holds an examination with another seed.
    """
    path = out / "exam.json"
    if path.exists():
        stored = json.loads(path.read_text(encoding="utf-8"))
        stored["counts"] = {world: Counts(**each) for world, each in stored["counts"].items()}
        known = Terms(**stored)
        if seed not in {None, known.seed}:
            message = f"{path}: found seed {known.seed}, expected {seed}; take another --out for another examination"
            raise ValueError(message)
        return known
    terms = Terms(secrets.randbelow(10**9) if seed is None else seed, counts, background)
    out.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(asdict(terms)) + "\n", encoding="utf-8", newline="\n")
    return terms


def command(name: str) -> str:
    """Return the command that makes one tool look at a case."""
    return DISCOVER if name == GECAR else _COMPARATOR.format(name=name)


def examine(
    out: Path,
    terms: Terms,
    tools: Sequence[str],
    compared: int,
    workers: int,
    timeout_s: float,
    minutes: float,
    executor: str = "thread",
    scheduler: str = "",
) -> None:
    """Draw and seal what is not there yet, and run every tool on what it has not seen; resumes.

    Parameters
    ----------
    out
        The examination's folder.
    terms
        As :func:`agreed` returns them.
    tools
        ``GECAR`` and any of ``COMPARATORS``, in the order they run.
    compared
        Comparators see this many cases, the first of a shuffled plan.
    workers
        Processes.
    timeout_s
        After which a case is given up [s].
    minutes
        After which no case is begun.
    executor, scheduler
        Where tools run, as `run_all`; cases are drawn here.
    """
    until = time.monotonic() + 60.0 * minutes
    cases = plan(terms.seed, terms.counts, background=terms.background)
    print(f"seed {terms.seed}, manifest {draw_all(cases, out, workers)}", file=sys.stderr)
    names = [case.name for case in cases]
    for tool in tools:
        print(f"{tool}:", file=sys.stderr)
        seen = names if tool == GECAR else names[:compared]
        verdicts, journal = out / "verdicts" / tool, out / "outcomes" / f"{tool}.jsonl"
        run_all(
            out / "cases",
            verdicts,
            command(tool),
            workers,
            timeout_s,
            seen,
            journal,
            until,
            executor,
            scheduler,
        )
