"""Executors: where batches of programs are run. Whatever has `concurrent.futures.Executor`'s submit will do.

This module imports nothing slow, so that a command can call `prepare_workers` first of all.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing.context import BaseContext
from typing import Any

from gecar.errors import expected
from gecar.parallel.signals import sigint_ignored, start_worker

MAX_WORKERS = 1_024
MAX_DEATHS = 3
"""How often in a row workers may die without finishing anything."""
QUIET_S = 30.0
"""How long nothing may come back before an executor is asked whether anybody is there to work [s]."""
_PRELOADED = "gecar.parallel.warm_up"


class SerialExecutor(Executor):
    """Runs everything at once, in the calling thread."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run the call and return its finished future."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001  it is raised again where the result is asked for
            future.set_exception(error)
        return future


def usable_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_workers(workers: int) -> int:
    """Return the number of workers.

    Raises
    ------
    InputError
        If it is none, or too many.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise expected("workers", workers, f"a whole number from 1 to {MAX_WORKERS}")
    return workers


def open_executor(kind: str, workers: int, scheduler: str = "") -> Executor:
    """Return an executor.

    Parameters
    ----------
    kind
        ``process``: a pool of processes; ``thread``: of threads; ``serial``: no pool; ``dask``: Dask's. One process
        is no pool.
    workers
        How many, on this machine.
    scheduler
        Address of Dask's scheduler; empty for a cluster on this machine.

    Raises
    ------
    InputError
        If there is no such kind, no worker, or Dask does not answer.
    """
    check_workers(workers)
    if kind == "serial" or (kind == "process" and workers == 1):
        return SerialExecutor()
    if kind == "process":
        prepare_workers()
        return ProcessPoolExecutor(workers, mp_context=_context(), initializer=start_worker)
    if kind == "thread":
        return ThreadPoolExecutor(workers)
    if kind == "dask":
        from gecar.parallel.dask_executor import DaskExecutor  # noqa: PLC0415  slow, and rarely wanted

        return DaskExecutor(scheduler, workers)
    raise expected("executor", repr(kind), "process, thread, serial or dask")


def side_by_side(kind: str, workers: int, scheduler: str = "") -> int:
    """Return how many calls an executor runs at a time; a cluster elsewhere is asked.

    Raises
    ------
    InputError
        As `open_executor`.
    """
    if kind == "serial":
        return 1
    if kind != "dask":
        return check_workers(workers)
    from gecar.parallel.dask_executor import DaskExecutor, check_installed  # noqa: PLC0415

    if not scheduler:
        check_installed()
        return check_workers(workers)
    executor = DaskExecutor(scheduler, workers)
    executor.shutdown()
    return executor.cores


def prepare_workers() -> None:
    """Begin to load what workers need, beside everything else a command does at its start; returns at once.

    On Linux a fork server imports the simulation and loads its compiled code once, and workers are forked from it
    in milliseconds. Elsewhere each worker loads for itself, and this does nothing.
    """
    if _context().get_start_method() == "forkserver":
        from multiprocessing import forkserver  # noqa: PLC0415  not there on every system

        with sigint_ignored():
            forkserver.ensure_running()


def _context() -> BaseContext:
    """Return how processes are started: never by forking this one, which may have threads."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    return context
