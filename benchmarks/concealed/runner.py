"""Let a tool look at every open case: a process each, here or on a cluster; resumable, every outcome kept at once."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

# {python}: the Python of whoever runs it; {case}: folder of recordings; {out}: where the tool writes verdict.json;
# {holdout}: the two files to judge by.
DISCOVER = (
    "{python} -m gecar discover {case} --out {out} --holdout {holdout} --workers 1 --no-pictures --json"
)


@dataclass(frozen=True)
class Job:
    """All that a tool may know of a case, and how it is called; it travels to wherever the tool runs.

    Attributes
    ----------
    case
        Its name.
    files
        The open half: names and contents.
    template
        Command with ``{case}``, ``{out}`` and, if wanted, ``{python}`` and ``{holdout}``.
    timeout_s
        After which the case is given up [s].
    sender
        Who waits for it.
    """

    case: str
    files: dict[str, bytes]
    template: str
    timeout_s: float
    sender: str


class Outcome(NamedTuple):
    """What a tool left behind: verdict.json if there is one, what it printed, and the time it took [s]."""

    verdict: bytes | None
    log: bytes
    cpu_s: float
    wall_s: float


FEW = 3  # recordings of which a tool chooses itself what to judge by

_running: dict[subprocess.Popen[bytes], str] = {}
"""Tools this process has started, and for whom."""


def run_all(
    cases: Path,
    verdicts: Path,
    template: str,
    workers: int,
    timeout_s: float,
    names: Sequence[str] | None = None,
    journal: Path | None = None,
    until: float = float("inf"),
    executor: str = "thread",
    scheduler: str = "",
) -> list[str]:
    """Run a tool on every case that has no verdict yet.

    Parameters
    ----------
    cases
        The open half: a folder of cases. The tool sees a copy elsewhere, so the sealed half is not beside it.
    verdicts
        Receives ``NAME/verdict.json``, and ``NAME/log.txt`` with what the tool printed.
    template
        As `Job`.
    workers
        Processes at a time, on this machine.
    timeout_s
        After which a case is given up [s].
    names
        Cases to look at; all, if not given.
    journal
        Receives a JSON line for every case as it ends.
    until
        No case is begun after this time of ``time.monotonic`` [s].
    executor
        ``thread``: tools run on this machine; ``dask``: on the workers of a cluster.
    scheduler
        Address of Dask's scheduler; empty for a cluster on this machine.

    Returns
    -------
    list[str]
        Cases that still have no verdict.

    Raises
    ------
    ValueError
        If Dask is not installed, or does not answer.
    """
    # The one thing taken from gecar: where calls are run. It knows nothing of robots.
    from gecar.parallel.run_parallel import Workplace, as_they_end  # noqa: PLC0415

    wanted = sorted(path.name for path in cases.iterdir() if path.is_dir()) if names is None else names
    waiting = [name for name in wanted if not (verdicts / name / "verdict.json").exists()]
    sender = uuid4().hex
    jobs = (
        (name, Job(name, _contents(cases / name), template, timeout_s, sender))
        for name in waiting
        if time.monotonic() < until
    )
    place = Workplace.of(executor, workers, scheduler)
    pool, going = place.open(), dict[Future[Outcome], str]()
    began, failed = time.monotonic(), 0
    try:
        if executor == "dask":
            pool.must_have(__name__)
        for done, (name, future) in enumerate(as_they_end(pool, look, jobs, place.workers, going), start=1):
            failed += not _keep(cases / name, verdicts / name, journal, future)
            left = (time.monotonic() - began) / done * (len(waiting) - done) / 60.0
            words = f"\r{done} of {len(waiting)} cases, {failed} without verdict, {left:.0f} min to go   "
            print(words, end="", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        # Tools that this process started have heard of Ctrl-C, too, and are waited for; those of a cluster have not.
        if executor == "dask":
            pool.call_everywhere(end_tools, sender)
        pool.shutdown(cancel_futures=True)
        for future, name in going.items():
            if future.done() and not future.cancelled() and not future.exception():
                _keep(cases / name, verdicts / name, journal, future)
        raise
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    print(file=sys.stderr)
    return sorted(name for name in waiting if not (verdicts / name / "verdict.json").exists())


def holdout_names(case: Path) -> list[str]:
    """Name the two recordings of a case that are made to judge by; none where there are too few to spare any.

    Parameters
    ----------
    case
        The case's open folder.

    Returns
    -------
    list[str]
        File names.
    """
    names = [path.name for path in sorted(case.glob("run_*.csv"))]
    return names[-2:] if len(names) > FEW else []


def look(job: Job) -> Outcome:
    """Let a tool look at a case, here: in a temporary folder that holds the case and nothing else.

    Parameters
    ----------
    job
        The case, and the tool.

    Returns
    -------
    Outcome
        Without a verdict if the tool failed, or took too long.
    """
    with tempfile.TemporaryDirectory(prefix="case-") as elsewhere, tempfile.TemporaryFile() as log:
        case, out = Path(elsewhere, "open", job.case), Path(elsewhere, "verdict")
        for folder in (case, out):
            folder.mkdir(parents=True)
        for name, content in job.files.items():
            (case / name).write_bytes(content)
        began = time.monotonic()
        process = subprocess.Popen(
            _words(job.template, case, out), stdout=log, stderr=log, env=_environment()
        )
        _running[process] = job.sender
        cpu_s = _waited(process, job.timeout_s)
        del _running[process]
        wall_s = time.monotonic() - began
        if wall_s >= job.timeout_s:
            log.write(f"given up after {job.timeout_s:g} s\n".encode())
        log.seek(0)
        verdict = out / "verdict.json"
        return Outcome(verdict.read_bytes() if verdict.exists() else None, log.read(), cpu_s, wall_s)


def end_tools(sender: str) -> None:
    """End the tools that this process has started for somebody who no longer waits for them."""
    for process, waiting in list(_running.items()):
        if waiting == sender:
            process.kill()


def _contents(case: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(case.iterdir())}


def _words(template: str, case: Path, out: Path) -> list[str]:
    """Fill in a command, word by word: a blank in a place's name parts no words."""
    places = {"python": sys.executable, "case": case, "out": out, "holdout": ",".join(holdout_names(case))}
    return [word.format(**places) for word in shlex.split(template)]


def _keep(case: Path, out: Path, journal: Path | None, future: Future[Outcome]) -> bool:
    """Write down what came of a case; return whether there is a verdict."""
    try:
        outcome = future.result()
    except BrokenExecutor:
        print(f"\n{case.name}: its workers died; the same command tries it again", file=sys.stderr)
        return False
    out.mkdir(parents=True, exist_ok=True)
    (out / "log.txt").write_bytes(outcome.log)
    if outcome.verdict is not None:
        (out / "verdict.part").write_bytes(outcome.verdict)
        (out / "verdict.part").replace(out / "verdict.json")  # a case that has one is never looked at again
    if journal is not None:
        _note(journal, case, outcome)
    return outcome.verdict is not None


def _waited(process: subprocess.Popen[bytes], timeout_s: float) -> float:
    """Wait for a process, or end it; return the processor time it took [s]."""
    timer = threading.Timer(timeout_s, process.kill)
    timer.start()
    _, status, used = os.wait4(process.pid, 0)
    timer.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime


def _note(journal: Path, case: Path, outcome: Outcome) -> None:
    """Append one line: which case, hashes of its sealed label and of the verdict, and what the verdict says."""
    label = case.parent.parent / "sealed" / case.name / "label.json"
    line: dict[str, Any] = {
        "case": case.name,
        "label_sha256": _digest(label.read_bytes()) if label.exists() else None,
        "verdict": None,
        "cpu_s": round(outcome.cpu_s, 2),
        "wall_s": round(outcome.wall_s, 2),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    if outcome.verdict is not None:
        said = json.loads(outcome.verdict)
        named = [[effect.get("id"), *(effect.get("or") or [])] for effect in said.get("effects") or []]
        line |= {"verdict": said.get("verdict"), "named": named, "verdict_sha256": _digest(outcome.verdict)}
    journal.parent.mkdir(parents=True, exist_ok=True)
    with journal.open("a", encoding="utf-8", newline="\n") as file:
        file.write(json.dumps(line) + "\n")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _environment() -> dict[str, str]:
    """One case is one core's work, so libraries start no threads; comparators are found from any folder."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    paths = os.pathsep.join(filter(None, (os.environ.get("PYTHONPATH"), str(Path(__file__).parents[2]))))
    return {**os.environ, **threads, "PYTHONPATH": paths}
