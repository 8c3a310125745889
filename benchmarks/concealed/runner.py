"""Let a tool look at every open case: a process each, all cores, resumable."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

# {case}: folder of recordings; {out}: where the tool writes verdict.json; {holdout}: the two files to judge by.
DISCOVER = f"{shlex.quote(sys.executable)} -m gecar discover {{case}} --out {{out}} --json"


def run_all(cases: Path, verdicts: Path, template: str, workers: int, timeout_s: float) -> list[str]:
    """Run a tool on every case that has no verdict yet.

    Parameters
    ----------
    cases
        The open half: a folder of cases. The sealed half is nothing the tool is told about.
    verdicts
        Receives ``NAME/verdict.json``, and ``NAME/log.txt`` with what the tool printed.
    template
        Command with ``{case}``, ``{out}`` and, if wanted, ``{holdout}``.
    workers
        Processes at a time.
    timeout_s
        After which a case is given up [s].

    Returns
    -------
    list[str]
        Cases that still have no verdict.
    """
    names = sorted(path.name for path in cases.iterdir() if path.is_dir())
    waiting = [name for name in names if not (verdicts / name / "verdict.json").exists()]
    began, failed = time.monotonic(), []
    with ThreadPoolExecutor(workers) as pool:
        jobs = {
            pool.submit(_run, cases / name, verdicts / name, template, timeout_s): name for name in waiting
        }
        for done, job in enumerate(as_completed(jobs), start=1):
            if not job.result():
                failed.append(jobs[job])
            left = (time.monotonic() - began) / done * (len(jobs) - done) / 60.0
            words = f"\r{done} of {len(jobs)} cases, {len(failed)} without verdict, {left:.0f} min to go   "
            print(words, end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return sorted(failed)


def holdout_names(case: Path) -> list[str]:
    """Name the two recordings of a case that are made to judge by.

    Parameters
    ----------
    case
        The case's open folder.

    Returns
    -------
    list[str]
        File names.
    """
    return [path.name for path in sorted(case.glob("run_*.csv"))][-2:]


def _run(case: Path, out: Path, template: str, timeout_s: float) -> bool:
    out.mkdir(parents=True, exist_ok=True)
    holdout = ",".join(holdout_names(case))
    words = [part.format(case=case, out=out, holdout=holdout) for part in shlex.split(template)]
    with (out / "log.txt").open("w", encoding="utf-8") as log:
        try:
            subprocess.run(words, stdout=log, stderr=log, timeout=timeout_s, check=False, env=_environment())
        except subprocess.TimeoutExpired:
            log.write(f"given up after {timeout_s:g} s\n")
    return (out / "verdict.json").exists()


def _environment() -> dict[str, str]:
    """One case is one core's work: numerical libraries must not start threads of their own."""
    return {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
