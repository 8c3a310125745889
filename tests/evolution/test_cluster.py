"""Dask: the same end as on this machine, whichever of its processes dies; skipped where it is not installed."""

from __future__ import annotations

import json
import math
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.searching import MAPPER, SMALL, Toy, fingerprint, new_evolution, toy_scores

from benchmarks.concealed.runner import run_all
from gecar.errors import InputError
from gecar.evolution.ask_tell import run
from gecar.evolution.scores import Scores
from gecar.parallel import dask_executor as cluster_module
from gecar.parallel.dask_executor import run_as_here
from gecar.parallel.executors import open_executor, side_by_side
from gecar.results.folder import read_history, read_result
from gecar.search.batches import Batches
from gecar.search.evaluation import DriveEvaluator, Opcodes
from gecar.world.course.course import load_course
from gecar.world.robot import load_robot
from gecar.world.rollout import World

distributed = pytest.importorskip("distributed", reason="pip install 'gecar[cluster]'")
WORLD = World(load_robot("ev3"), load_course("paper"), time_limit_s=4.0)
SILENT_TOOL = Path(__file__).parents[1] / "support" / "silent_tool.py"
TOOL = f"{{python}} {shlex.quote(str(SILENT_TOOL))} {{case}} {{out}}"
TINY = ("--population", 20, "--generations", 2, "--time-limit", 4, "--no-pictures")


@dataclass(frozen=True)
class Mortal:
    """A toy evaluator that kills its process at its first program."""

    mark: Path

    def __call__(
        self, programs: Sequence[Opcodes], _seeds: Sequence[int], _to_beat: float, _generation: int
    ) -> Scores:
        if programs and not self.mark.exists():
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return toy_scores(programs)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler with two workers, each of one thread."""
    cluster_module.check_installed()
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield cluster.scheduler_address


def evolved(score: Batches | Toy) -> tuple[object, ...]:
    evolution = new_evolution(SMALL, MAPPER)
    run(evolution, score)
    return fingerprint(evolution)


def test_a_cluster_evolves_what_this_process_does(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    alone = evolved(Batches(DriveEvaluator(WORLD)))
    assert side_by_side("dask", 7, address) == 2
    for shared_from in (
        cluster_module.SHARED_FROM,
        0,
    ):  # the evaluator with each batch, or once to each worker
        monkeypatch.setattr(cluster_module, "SHARED_FROM", shared_from)
        with Batches(DriveEvaluator(WORLD), partial(open_executor, "dask", 2, address), 2) as batches:
            assert evolved(batches) == alone


def test_commands_end_the_same_on_a_cluster(gecar: Any, address: str) -> None:
    for out, place in (("here", ("--workers", 1)), ("there", ("--scheduler", address))):
        assert gecar("evolve", *TINY, *place, "--out", out).code == 0
    here, there = (read_history(Path(name)) for name in ("here", "there"))
    assert all(np.array_equal(here[k], there[k], equal_nan=True) for k in set(here) - {"wall_s"})
    mine, other = (read_result(Path(name)) for name in ("here", "there"))
    assert {**mine, "wall_s": 0} == {**other, "wall_s": 0}
    assert gecar("evolve", "--resume", "--out", "there", "--executor", "serial", "--no-pictures").code == 0


def test_a_pool_and_a_cluster_evolve_the_same(address: str) -> None:
    ends = []
    for place in (("process", 2), ("dask", 2, address)):
        with Batches(DriveEvaluator(WORLD), partial(open_executor, *place), 2) as batches:
            ends.append(evolved(batches))
    assert ends[0] == ends[1]


def test_a_table_is_the_same_from_a_pool_and_from_a_cluster(gecar: Any, address: str) -> None:
    grid = ("--rows", "elites=0,1", "--columns", "mutation_rate=0.1", "--seeds", 2)
    tables = {}
    for out, place in (("pool", ("--workers", 2)), ("dask", ("--executor", "dask", "--scheduler", address))):
        assert gecar("table", *grid, *TINY, *place, "--out", out).code == 0
        runs = [json.loads(path.read_text()) for path in sorted(Path(out, "runs").iterdir())]
        for each in runs:
            each["wall_s"] = each["history"]["wall_s"] = 0
        rows = Path(out, "table.csv").read_text().splitlines()
        tables[out] = [row.rpartition(",")[0] for row in rows], runs  # its last column is the time they took
    assert len(tables["pool"][1]) == 4
    assert tables["pool"] == tables["dask"]


def test_a_killed_worker_of_a_cluster_loses_nothing(address: str, tmp_path: Path) -> None:
    with Batches(Mortal(tmp_path / "mark"), partial(open_executor, "dask", 2, address), 2) as batches:
        assert evolved(batches) == evolved(Toy())
    assert (tmp_path / "mark").exists()


def open_cases(folder: Path) -> Path:
    for name in "ab":
        (folder / "cases" / name).mkdir(parents=True)
        (folder / "cases" / name / "run_1.csv").write_text("t_s\n")
    return folder / "cases"


def test_an_examination_leaves_on_a_cluster_what_it_leaves_here(address: str, tmp_path: Path) -> None:
    cases, left = open_cases(tmp_path), {}
    for place in (("thread", ""), ("dask", address)):
        out = tmp_path / place[0]
        assert run_all(cases, out, TOOL, 2, 60.0, None, out / "journal", math.inf, *place) == []
        notes = [json.loads(line) for line in (out / "journal").read_text().splitlines()]
        told = sorted((note["case"], note["verdict"], note["verdict_sha256"]) for note in notes)
        left[place[0]] = told, [path.read_bytes() for path in sorted(out.glob("*/*"))]
    assert left["dask"] == left["thread"]
    assert left["dask"][1][0] == b"a\n"  # its log: beside the case lies nothing


def test_a_killed_worker_loses_no_case_of_an_examination(address: str, tmp_path: Path) -> None:
    mark, tool = tmp_path / "mark", tmp_path / "tool.py"
    tool.write_text(
        "import os, pathlib, runpy, shutil, sys\n"
        f"mark = pathlib.Path({str(mark)!r})\n"
        "if not mark.exists():\n"
        "    mark.touch()\n"
        "    shutil.rmtree(pathlib.Path(sys.argv[1]).parents[1])\n"  # the worker no longer can
        f"    os.kill(os.getppid(), {int(signal.SIGKILL)})\n"
        "    sys.exit()\n"
        f"runpy.run_path({str(SILENT_TOOL)!r}, run_name='__main__')\n"
    )
    words = f"{{python}} {shlex.quote(str(tool))} {{case}} {{out}}"
    cases, out = open_cases(tmp_path), tmp_path / "out"
    assert run_all(cases, out, words, 2, 60.0, executor="dask", scheduler=address) == []
    assert mark.exists()


def test_without_an_address_a_cluster_starts_here_and_ends(tmp_path: Path) -> None:
    executor = open_executor("dask", 1)
    process = executor.submit(os.getpid).result()
    executor.shutdown()
    assert process != os.getpid()
    until = time.monotonic() + 10
    while Path(f"/proc/{process}").exists() and time.monotonic() < until:
        time.sleep(0.05)
    assert not Path(f"/proc/{process}").exists()


def test_a_missing_dask_is_one_line(gecar: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert "pip install 'gecar[cluster]'" in gecar.error("evolve", "--executor", "dask", "--out", "new")
    assert not Path("new").exists()


@pytest.mark.parametrize("address", ["127.0.0.1:1", "nonsense://x", "not a place"])
def test_a_wrong_address_is_one_line(address: str, gecar: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "ANSWER_WITHIN_S", 0.5)
    words = gecar.error("evolve", "--scheduler", address, "--out", "new")
    assert words.startswith(f"error: --scheduler: found {address}")
    assert not Path("new").exists()


def test_a_worker_with_another_gecar_is_refused() -> None:
    assert run_as_here(cluster_module.CACHE.name, max, 3, 4) == 4
    with pytest.raises(InputError, match="workers: found another gecar or Numba"):
        run_as_here("kernels-of-old", max, 3, 4)


def test_workers_without_a_module_are_named(address: str) -> None:
    with open_executor("dask", 1, address) as executor:
        executor.must_have("json")
        with pytest.raises(
            InputError, match=r"whose worker tcp://\S+ has no nowhere.else, expected workers with"
        ):
            executor.must_have("nowhere.else")


def _start(*words: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", *words]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def test_a_scheduler_without_workers_or_that_goes_away_is_one_line(tmp_path: Path) -> None:
    place = tmp_path / "scheduler.json"
    words = ("--port", "0", "--no-dashboard", "--scheduler-file", str(place))
    scheduler = _start("distributed.cli.dask_scheduler", *words)
    worker = None
    try:
        while not place.exists():
            assert scheduler.poll() is None
            time.sleep(0.05)
        address = json.loads(place.read_text())["address"]
        with pytest.raises(InputError, match=r"which has no worker, expected at least one; start them with"):
            open_executor("dask", 1, address)
        where = ("--nthreads", "1", "--no-dashboard", "--no-nanny", "--local-directory", str(tmp_path))
        worker = _start("distributed.cli.dask_worker", address, *where, "--death-timeout", "2")
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=30)
        executor = open_executor("dask", 1, address)
        answer = executor.submit(time.sleep, 30)
        assert not executor.why_waiting()
        worker.kill()
        until = time.monotonic() + 20
        while not executor.why_waiting() and time.monotonic() < until:
            time.sleep(0.05)
        assert executor.why_waiting().startswith(f"{address} has no worker left; waiting for one")
        scheduler.kill()
        gone = rf"--scheduler: found {address} no longer answers, expected a Dask scheduler that stays"
        with pytest.raises(InputError, match=gone):
            answer.result(timeout=20)
        with pytest.raises(InputError, match=gone):
            executor.submit(max, 1, 2)
        executor.shutdown()
    finally:
        for process in filter(None, (scheduler, worker)):
            process.kill()
            process.wait()
