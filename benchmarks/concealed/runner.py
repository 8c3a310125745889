"""Let a tool look at every open case: a process each, all cores, resumable; every outcome is kept as it comes."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

# {case}: folder of recordings; {out}: where the tool writes verdict.json; {holdout}: the two files to judge by.
DISCOVER = (
    f"{shlex.quote(sys.executable)} -m gecar discover {{case}} --out {{out}} --holdout {{holdout}}"
    " --workers 1 --no-pictures --json"
)


def run_all(
    cases: Path,
    verdicts: Path,
    template: str,
    workers: int,
    timeout_s: float,
    names: Sequence[str] | None = None,
    journal: Path | None = None,
    until: float = float("inf"),
) -> list[str]:
    """Run a tool on every case that has no verdict yet.

    Parameters
    ----------
    cases
        The open half: a folder of cases. The tool sees a copy elsewhere, so the sealed half is not beside it.
    verdicts
        Receives ``NAME/verdict.json``, and ``NAME/log.txt`` with what the tool printed.
    template
        Command with ``{case}``, ``{out}`` and, if wanted, ``{holdout}``.
    workers
        Processes at a time.
    timeout_s
        After which a case is given up [s].
    names
        Cases to look at; all, if not given.
    journal
        Receives a JSON line for every case as it ends.
    until
        No case is begun after this time of ``time.monotonic`` [s].

    Returns
    -------
    list[str]
        Cases that still have no verdict.
    """
    wanted = sorted(path.name for path in cases.iterdir() if path.is_dir()) if names is None else names
    waiting = [name for name in wanted if not (verdicts / name / "verdict.json").exists()]
    began, failed = time.monotonic(), []

    def look(name: str) -> bool:
        return time.monotonic() < until and _run(cases / name, verdicts / name, template, timeout_s, journal)

    with ThreadPoolExecutor(workers) as pool:
        jobs = {pool.submit(look, name): name for name in waiting}
        try:
            for done, job in enumerate(as_completed(jobs), start=1):
                if not job.result():
                    failed.append(jobs[job])
                left = (time.monotonic() - began) / done * (len(jobs) - done) / 60.0
                words = (
                    f"\r{done} of {len(jobs)} cases, {len(failed)} without verdict, {left:.0f} min to go   "
                )
                print(words, end="", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            raise
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


def _run(case: Path, out: Path, template: str, timeout_s: float, journal: Path | None) -> bool:
    out.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with (
        tempfile.TemporaryDirectory(prefix="case-") as elsewhere,
        (out / "log.txt").open("w", encoding="utf-8") as log,
    ):
        copy = Path(shutil.copytree(case, Path(elsewhere) / case.name))
        holdout = ",".join(holdout_names(case))
        words = [part.format(case=copy, out=out.resolve(), holdout=holdout) for part in shlex.split(template)]
        cpu_s = _waited(subprocess.Popen(words, stdout=log, stderr=log, env=_environment()), timeout_s)
        wall_s = time.monotonic() - began
        if wall_s >= timeout_s:
            log.write(f"given up after {timeout_s:g} s\n")
    there = (out / "verdict.json").exists()
    if journal is not None:
        times = {"cpu_s": round(cpu_s, 2), "wall_s": round(wall_s, 2)}
        _note(journal, case, out / "verdict.json" if there else None, times)
    return there


def _waited(process: subprocess.Popen[bytes], timeout_s: float) -> float:
    """Wait for a process, or end it; return the processor time it took [s]."""
    timer = threading.Timer(timeout_s, process.kill)
    timer.start()
    _, status, used = os.wait4(process.pid, 0)
    timer.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def _note(journal: Path, case: Path, path: Path | None, times: dict[str, float]) -> None:
    """Append one line: which case, hashes of its sealed label and of the verdict, and what the verdict says."""
    label = case.parent.parent / "sealed" / case.name / "label.json"
    line: dict[str, Any] = {
        "case": case.name,
        "label_sha256": _digest(label) if label.exists() else None,
        "verdict": None,
        **times,
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    if path is not None:
        said = json.loads(path.read_text(encoding="utf-8"))
        named = [[effect.get("id"), *(effect.get("or") or [])] for effect in said.get("effects") or []]
        line |= {"verdict": said.get("verdict"), "named": named, "verdict_sha256": _digest(path)}
    journal.parent.mkdir(parents=True, exist_ok=True)
    # One write of one line: threads do not mix theirs.
    with journal.open("a", encoding="utf-8", newline="\n") as file:
        file.write(json.dumps(line) + "\n")


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _environment() -> dict[str, str]:
    """One case is one core's work: numerical libraries must not start threads of their own."""
    return {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
