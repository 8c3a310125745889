"""Dask: the same calls on many machines, through its own concurrent-futures executor.

A worker that dies is Dask's to replace, and what it had is run again by Dask; only when a batch has killed several
workers it counts as lost. Everything about Dask is imported when it is wanted, and not before.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from gecar.compiled import CACHE
from gecar.errors import InputError, expected
from gecar.parallel.pickled import Pickled
from gecar.parallel.signals import sigint_ignored

ANSWER_WITHIN_S = 10.0
"""How long a scheduler may take to answer [s]."""
SHARED_FROM = 50_000
"""From this size [bytes] a pickled object is sent once to each worker, and not with each batch."""


class DaskExecutor(Executor):
    """Dask's executor, whose failures are those of other executors.

    Parameters
    ----------
    scheduler
        Its address; an empty one starts a cluster on this machine.
    workers
        Processes of that one.

    Raises
    ------
    InputError
        If Dask is not installed, nobody answers at the address, or no worker is there.
    """

    def __init__(self, scheduler: str, workers: int) -> None:
        self._dask = check_installed()
        self._where = scheduler or "a cluster on this machine"
        self._cluster: Any = None
        self._client = self._connect(scheduler, workers)
        self._executor = self._client.get_executor(pure=False)
        self._shared: dict[str, Any] = {}
        self.cores = sum(self._client.ncores().values())
        if self.cores == 0:
            self.shutdown()
            wanted = f"at least one; start them with: dask worker {scheduler}"
            raise expected("--scheduler", f"{scheduler}, which has no worker", wanted)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Send a call; its future raises InputError if the scheduler goes away, BrokenExecutor if workers die."""
        if self._client.status != "running":
            raise self._gone()
        sent = self._executor.submit(run_as_here, CACHE.name, fn, *map(self._share, args), **kwargs)
        answer: Future[Any] = Future()
        sent.add_done_callback(lambda done: self._pass_on(done, answer))
        return answer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002
        """Leave the scheduler, and end the cluster on this machine if there is one; nothing is waited for."""
        with suppress(Exception):  # whoever does not answer needs no goodbye
            self._executor.shutdown(wait=False)
        for each in (self._client, self._cluster):
            with suppress(Exception):
                if each is not None:
                    each.close(timeout=5)

    def call_everywhere(self, fn: Callable[..., Any], *args: Any) -> None:
        """Call a function in every worker at once, beside what it is doing; a worker that does not answer is let be."""
        with suppress(Exception):
            self._client.run(fn, *args, on_error="ignore")

    def must_have(self, module: str) -> None:
        """Make sure that workers can import a module: sent a function of one that is not there, Dask waits for ever.

        Raises
        ------
        InputError
            If one of them cannot.
        """
        lacking = [worker for worker, has in self._client.run(importable, module).items() if not has]
        if lacking:
            found = f"{self._where}, whose worker {lacking[0]} has no {module}"
            raise expected("--scheduler", found, "workers with it on their PYTHONPATH")

    def why_waiting(self) -> str:
        """Return a sentence if no worker is left; Dask waits until one comes."""
        with suppress(OSError):  # a scheduler that goes away meanwhile is reported by the batches
            if self._client.status != "running" or sum(self._client.ncores().values()):
                return ""
        return f"{self._where} has no worker left; waiting for one (dask worker ADDRESS), Ctrl-C ends the run"

    def _connect(self, scheduler: str, workers: int) -> Any:
        try:
            if not scheduler:
                with sigint_ignored():
                    self._cluster = self._dask.LocalCluster(
                        n_workers=workers, threads_per_worker=1, dashboard_address="127.0.0.1:0",
                        silence_logs=logging.CRITICAL,
                    )  # fmt: skip
            return self._dask.Client(
                self._cluster or scheduler, timeout=ANSWER_WITHIN_S, set_as_default=False
            )
        except (OSError, ValueError, TypeError) as error:
            if self._cluster is not None:
                self._cluster.close(timeout=5)
            said = str(error).partition("\n")[0] or "no answer"
            raise expected("--scheduler", f"{self._where}: {said}", "a Dask scheduler that answers") from None

    def _share(self, argument: Any) -> Any:
        """Replace a large pickled object by Dask's name for it."""
        if not isinstance(argument, Pickled) or len(argument.content) < SHARED_FROM:
            return argument
        if argument.name not in self._shared:
            self._shared[argument.name] = self._client.submit(itself, argument, pure=False)
        return self._shared[argument.name]

    def _pass_on(self, done: Future[Any], answer: Future[Any]) -> None:
        if not answer.set_running_or_notify_cancel():
            return
        try:
            answer.set_result(done.result())
        except CancelledError:  # what Dask does to all futures when it loses the scheduler
            answer.set_exception(self._gone())
        except self._dask.KilledWorker as error:
            answer.set_exception(BrokenExecutor(str(error)))
        except Exception as error:  # noqa: BLE001  it is raised again where the result is asked for
            answer.set_exception(self._unlike(error) or error)

    def _unlike(self, error: Exception) -> InputError | None:
        """Return an error in one line if the scheduler could not import what was sent."""
        if not isinstance(error, ImportError) and "deserializ" not in str(error):
            return None
        found = f"{self._where}, where what was sent cannot be imported"
        return expected(
            "--scheduler", found, "scheduler and workers with all that is installed here, or on PYTHONPATH"
        )

    def _gone(self) -> InputError:
        return expected("--scheduler", f"{self._where} no longer answers", "a Dask scheduler that stays")


def run_as_here(kernels: str, fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Run a call on a worker that would give the same result as the sender's machine.

    Raises
    ------
    InputError
        If the worker has another gecar or Numba.
    """
    if kernels != CACHE.name:
        raise expected("workers", f"another gecar or Numba ({CACHE.name})", f"the same as here ({kernels})")
    return fn(*args, **kwargs)


def importable(module: str) -> bool:
    """Say whether a module is there."""
    try:
        return find_spec(module) is not None
    except ImportError:  # of the package it would be in
        return False


def itself(packed: Pickled) -> Pickled:
    """Return a pickled object, from then on known to Dask."""
    return packed


def check_installed() -> Any:
    """Return Dask's module, which from then on keeps still.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        dask, distributed = import_module("dask"), import_module("distributed")
    except ImportError:
        wanted = "it installed: pip install 'gecar[cluster]'"
        raise expected("--executor", "dask, which is not installed", wanted) from None
    dask.config.set({"distributed.comm.timeouts.connect": f"{ANSWER_WITHIN_S:g}s"})
    for name in ("distributed", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what they report ends in a sentence of ours
    for name in list(logging.root.manager.loggerDict):
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    return distributed
